//! What a mesh says of itself, in glTF's extras and in comments.

use runout_core::{height_grid::HeightGrid, numerics::fourier::max_order, stage::Completed, surface::Surface};
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
    /// Radius that the deviations are added to, in mm; none on a plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// Deviation of the strongest colours, ± µm.
    pub colour_range_um: f64,
    /// Lowest and highest order (undulations per revolution) that the form holds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band_upr: Option<[usize; 2]>,
    /// Orders in that band that the layout cannot separate; they are missing in the form.
    pub lost_orders: Vec<usize>,
    /// How the rings were filled between the sections; none on a plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<&'static str>,
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

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Drawn<'a> {
    /// Form over angle and z.
    Surface(&'a Surface),
    /// Heights on a plane.
    Heights(&'a HeightGrid),
}

impl<'a> Drawn<'a> {
    /// What a result holds.
    pub(crate) fn of(result: &Completed<'a>) -> Option<Self> {
        result.surface.map(Self::Surface).or(result.heights.map(Self::Heights))
    }

    pub(crate) fn checksum(self) -> String {
        match self {
            Self::Surface(surface) => surface.checksum(),
            Self::Heights(heights) => heights.checksum(),
        }
    }

    fn surface(self) -> Option<&'a Surface> {
        match self {
            Self::Surface(surface) => Some(surface),
            Self::Heights(_) => None,
        }
    }

    fn checksum_of(self) -> &'static str {
        match self {
            Self::Surface(_) => "radius_mm, z_mm of each ring, deviation_um [ring][angle], as little-endian f64",
            Self::Heights(_) => {
                "origin_x_mm, origin_y_mm, step_x_mm, step_y_mm, height_nm [row][column] with NaN where there is none, as \
                 little-endian f64"
            }
        }
    }
}

impl Notes {
    pub(crate) fn new(unit: &'static str, mesh: &Mesh, drawn: Drawn, checksum: &str, result: &Completed) -> Self {
        let Completed { summary, about, .. } = result;
        let surface = drawn.surface();
        let fitting = surface.map(|surface| max_order(surface.angles));
        let band_upr =
            about.form_band_upr.zip(fitting).map(|([lowest, highest], fitting)| [lowest, highest.min(fitting)]);
        let inputs = summary.provenance.inputs.iter();
        let within = |order: &&usize| band_upr.is_some_and(|[lowest, highest]| (lowest..=highest).contains(order));
        Self {
            title: summary.title.clone(),
            unit,
            scale: mesh.scale(),
            radius_mm: surface.map(|surface| surface.radius_mm),
            colour_range_um: mesh.range_um(),
            band_upr,
            lost_orders: summary.lost_orders.form.iter().filter(within).copied().collect(),
            interpolation: surface.map(|surface| surface.interpolation),
            effects: summary.effects.iter().map(ToString::to_string).collect(),
            caps: mesh.wall().is_some_and(|wall| !wall.caps().is_empty()).then_some("drawn, not measured: grey"),
            checksum: format!("blake3:{checksum}"),
            checksum_of: drawn.checksum_of(),
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
        ];
        lines.extend(self.radius_mm.map(|radius| format!("radius_mm: {radius}")));
        lines.push(format!("colour_range_um: -{0} (blue) to +{0} (red)", self.colour_range_um));
        if let Some([lowest, highest]) = self.band_upr {
            lines.push(format!("band_upr: {lowest} to {highest}"));
        }
        if !self.lost_orders.is_empty() {
            let orders: Vec<String> = self.lost_orders.iter().map(ToString::to_string).collect();
            lines.push(format!("lost_orders: {}", orders.join(" ")));
        }
        lines.extend(self.interpolation.map(|filled| format!("interpolation: {filled}")));
        lines.extend(self.effects.iter().map(|effect| format!("corrected_for: {effect}")));
        lines.extend(self.caps.map(|caps| format!("caps: {caps}")));
        lines.push(format!("checksum: {} ({})", self.checksum, self.checksum_of));
        lines.push(format!("program: {}", self.program));
        lines.extend(self.inputs.iter().map(|input| format!("input: {} blake3:{}", input.path, input.blake3)));
        // A title or a path may hold line breaks, and what follows one would be no comment.
        lines.iter().map(|line| line.replace(char::is_control, " ")).collect()
    }
}
