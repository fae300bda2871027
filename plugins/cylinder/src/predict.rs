//! How well a surface predicts points that were not used to make it.

use std::fmt;

use crate::{
    robust::{Fence, rms},
    scan::Scan,
};

/// How far the points of traces that were not used lie from what cylinder and surface say of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Kind of the traces.
    pub kind: String,
    /// Their ids.
    pub traces: Vec<String>,
    /// Points within the surface's range along z.
    pub points: usize,
    /// Points beyond it, of which it says nothing.
    pub beyond: usize,
    /// Points that lie further off than so many median absolute deviations.
    pub outliers: usize,
    /// Root mean square of measured minus predicted without the outliers, in µm; NaN without points.
    pub rms_um: f64,
    /// Root mean square of measured minus predicted with every point, in µm; NaN without points.
    pub rms_all_um: f64,
    /// What the cylinder alone, a surface without form, leaves of the points behind [`rms_um`](Self::rms_um), in µm.
    pub cylinder_rms_um: f64,
}

impl Prediction {
    /// Compares points about the cylinder's axis with `surface` (angle in rad, z in mm; `None` beyond its range).
    pub(crate) fn of(scans: &[Scan], surface: impl Fn(f64, f64) -> Option<f64>, deviations: f64) -> Self {
        let points = scans.iter().flat_map(Scan::iter);
        let (mut from_cylinder, mut from_surface) = (Vec::new(), Vec::new());
        for (angle, z, distance) in points.clone() {
            if let Some(form) = surface(angle, z) {
                from_cylinder.push(distance);
                from_surface.push(distance - form);
            }
        }
        let fence = Fence::around(&from_surface, deviations);
        let near = |values: &[f64]| {
            rms(values.iter().zip(&from_surface).filter(|(_, off)| fence.holds(**off)).map(|(value, _)| *value))
        };
        Self {
            kind: String::new(),
            traces: Vec::new(),
            points: from_surface.len(),
            beyond: points.count() - from_surface.len(),
            outliers: from_surface.iter().filter(|off| !fence.holds(**off)).count(),
            rms_um: near(&from_surface),
            rms_all_um: rms(from_surface.iter().copied()),
            cylinder_rms_um: near(&from_cylinder),
        }
    }
}

impl fmt::Display for Prediction {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, points, beyond, outliers, rms_um, rms_all_um, cylinder_rms_um, .. } = self;
        let traces = self.traces.join(", ");
        if *points == 0 {
            return write!(formatter, "{kind} {traces}, not used, lies beyond the surface and cannot test it");
        }
        let used = points - outliers;
        write!(formatter, "{kind} {traces}, not used, is predicted to {rms_um:.3} µm rms ({used} of {points} points")?;
        if *outliers > 0 {
            write!(formatter, "; {rms_all_um:.3} µm with the {outliers} outliers")?;
        }
        write!(formatter, "); by the cylinder without form to {cylinder_rms_um:.3} µm")?;
        match beyond {
            0 => Ok(()),
            _ => write!(formatter, "; {beyond} more points lie beyond the surface"),
        }
    }
}
