//! Klipper: a profile of `[skew_correction]` and one of `[bed_mesh]`.
//!
//! Its source (`klippy/extras/skew_correction.py`, `bed_mesh.py`): x −= y·xy + z·(xz − xy·yz), y −= z·yz; z += mesh(x, y), bilinear between
//! points with `mesh_x_pps` and `mesh_y_pps` 0. `axis_twist_compensation` is not written: it changes what a probe reads, not where the
//! nozzle goes, and the mesh holds what a twist does on the bed.

use super::{Comments, Dialect, Written, fixed};
use crate::{
    chain::{AxisCurves, Chain, SQUARENESS},
    config::ControllerConfig,
};

/// Errors of which the mesh holds what they do to z on the bed.
const ON_BED: [&str; 6] = ["EZX", "EZY", "EAX", "EBX", "EAY", "EBY"];

pub(super) struct Klipper(pub ControllerConfig);

impl Klipper {
    /// Error in z on the bed, in µm.
    fn bed_um(&self, chain: &Chain, x: f64, y: f64) -> f64 {
        chain.error_um([x, y, self.0.bed_z_mm.unwrap_or(0.0)])[2]
    }
}

fn axes(chain: &Chain) -> Result<[&AxisCurves; 2], String> {
    let of = |letter: &str| chain.axis(letter).ok_or_else(|| format!("there is no curve of the axis {letter}"));
    Ok([of("X")?, of("Y")?])
}

impl Dialect for Klipper {
    fn comments(&self) -> Comments {
        Comments::First("#")
    }

    fn holds(&self, symbol: &str) -> bool {
        SQUARENESS.iter().any(|(known, ..)| *known == symbol) || ON_BED.contains(&symbol)
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let skew: Vec<(&str, f64)> = ["xy", "xz", "yz"]
            .into_iter()
            .zip(SQUARENESS)
            .map(|(name, (symbol, _, _, sign))| (name, 1e-6 * sign * chain.location(symbol)))
            .collect();
        let [x, y] = axes(chain)?;
        let mut lines = vec!["[skew_correction]".to_owned(), String::new(), "[skew_correction runout]".to_owned()];
        lines.extend(skew.iter().map(|(name, factor)| format!("{name}_skew = {}", fixed(*factor, 9))));
        let ([min_x, max_x], [min_y, max_y]) = (x.ends(), y.ends());
        lines.extend([String::new(), "[bed_mesh runout]".into(), "version = 1".into(), "points =".into()]);
        for along_y in &y.nodes {
            let z = |along_x: &runout_core::component_curves::Node| {
                fixed(-1e-3 * self.bed_um(chain, along_x.position, along_y.position), 6)
            };
            lines.push(format!("    {}", x.nodes.iter().map(z).collect::<Vec<_>>().join(", ")));
        }
        lines.extend([
            format!("x_count = {}", x.nodes.len()),
            format!("y_count = {}", y.nodes.len()),
            "mesh_x_pps = 0".into(),
            "mesh_y_pps = 0".into(),
            "algo = direct".into(),
            "tension = 0.2".into(),
            format!("min_x = {min_x:.6}"),
            format!("max_x = {max_x:.6}"),
            format!("min_y = {min_y:.6}"),
            format!("max_y = {max_y:.6}"),
        ]);
        let notes = vec![
            "unit mm and rad; load with SKEW_PROFILE LOAD=runout and BED_MESH_PROFILE LOAD=runout; no fade: `fade_end` 0".to_owned(),
            format!(
                "the mesh is minus the error in z at Z = {} mm: of rotations only what they do there; the form of the bed is not in it, and a mesh that was probed replaces it",
                self.0.bed_z_mm.unwrap_or(0.0)
            ),
        ];
        Ok(Written::one(lines, notes))
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        let mut adds = [0.0, 0.0, -self.bed_um(chain, place_mm[0], place_mm[1])];
        for (symbol, moved, with, sign) in SQUARENESS {
            adds[moved] -= sign * 1e-3 * chain.location(symbol) * place_mm[with];
        }
        adds
    }
}
