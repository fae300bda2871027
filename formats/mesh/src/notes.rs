//! What a mesh says of itself, in glTF's extras and in comments.

use runout_core::{numerics::fourier::max_order, stage::Completed, surface::Surface};
use serde::Serialize;

use crate::mesh::Mesh;

/// What a mesh says of itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Notes {
    /// The pipeline's title.
    pub title: String,
    /// Unit of the positions.
    pub unit: &'static str,
    /// How many times larger than they are the deviations are drawn.
    pub scale: f64,
    /// Radius that the deviations are added to, in mm.
    pub radius_mm: f64,
    /// What the strongest colours stand for, ± µm.
    pub colour_range_um: f64,
    /// Lowest and highest order (undulations per revolution) that the form holds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band_upr: Option<[usize; 2]>,
    /// Orders in that band that the layout cannot separate; they are missing in the form.
    pub lost_orders: Vec<usize>,
    /// How the rings were filled between the sections.
    pub interpolation: &'static str,
    /// Effects that the form is corrected for, with their values; none after a run.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<String>,
    /// What the ends are, where they are drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub caps: Option<&'static str>,
    /// Checksum of the surface, `blake3:…`.
    pub checksum: String,
    /// What was summed: enough to do it again.
    pub checksum_of: &'static str,
    /// Program and version.
    pub program: String,
    /// The measurement's files.
    pub inputs: Vec<InputNote>,
}

/// A file of the measurement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputNote {
    /// Its path as configured.
    pub path: String,
    /// BLAKE3 of its contents.
    pub blake3: String,
}

impl Notes {
    pub(crate) fn new(unit: &'static str, mesh: &Mesh, surface: &Surface, checksum: &str, result: &Completed) -> Self {
        let Completed { summary, about, .. } = result;
        let fitting = max_order(surface.angles);
        let band_upr = about.form_band_upr.map(|[lowest, highest]| [lowest, highest.min(fitting)]);
        let inputs = summary.provenance.inputs.iter();
        let within = |order: &&usize| band_upr.is_some_and(|[lowest, highest]| (lowest..=highest).contains(order));
        Self {
            title: summary.title.clone(),
            unit,
            scale: mesh.scale(),
            radius_mm: surface.radius_mm,
            colour_range_um: mesh.range_um(),
            band_upr,
            lost_orders: summary.lost_orders.form.iter().filter(within).copied().collect(),
            interpolation: surface.interpolation,
            effects: summary.effects.iter().map(ToString::to_string).collect(),
            caps: (!mesh.caps().is_empty()).then_some("drawn, not measured: grey"),
            checksum: format!("blake3:{checksum}"),
            checksum_of: "radius_mm, z_mm of each ring, deviation_um [ring][angle], as little-endian f64",
            program: summary.provenance.program.clone(),
            inputs: inputs.map(|input| InputNote { path: input.path.clone(), blake3: input.blake3.clone() }).collect(),
        }
    }

    /// One line each, for formats with comments.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![
            format!("title: {}", self.title),
            format!("unit: {}", self.unit),
            format!("scale: deviations drawn x{}", self.scale),
            format!("radius_mm: {}", self.radius_mm),
            format!("colour_range_um: -{0} (blue) to +{0} (red)", self.colour_range_um),
        ];
        if let Some([lowest, highest]) = self.band_upr {
            lines.push(format!("band_upr: {lowest} to {highest}"));
        }
        if !self.lost_orders.is_empty() {
            let orders: Vec<String> = self.lost_orders.iter().map(ToString::to_string).collect();
            lines.push(format!("lost_orders: {}", orders.join(" ")));
        }
        lines.push(format!("interpolation: {}", self.interpolation));
        lines.extend(self.effects.iter().map(|effect| format!("corrected_for: {effect}")));
        lines.extend(self.caps.map(|caps| format!("caps: {caps}")));
        lines.push(format!("checksum: {} ({})", self.checksum, self.checksum_of));
        lines.push(format!("program: {}", self.program));
        lines.extend(self.inputs.iter().map(|input| format!("input: {} blake3:{}", input.path, input.blake3)));
        // A title or a path may hold line breaks, and what follows one would be no comment.
        lines.iter().map(|line| line.replace(char::is_control, " ")).collect()
    }
}
