//! Traces along the axis as open profiles, from which the values of straightness follow.

use runout_core::{Result, points::Points, stage::OpenProfile};

use crate::{scan::Scan, shape::Cylinder};

/// The kind of such a trace.
const KIND: &str = "generatrix";

/// Each generatrix: distances from the cylinder over the height along its axis. Traces of no more than one height are left out.
///
/// # Errors
/// When the points lack a column.
pub(crate) fn open_profiles(points: &Points, cylinder: &Cylinder) -> Result<Vec<OpenProfile>> {
    let traces = points.traces.iter().filter(|trace| trace.kind == KIND);
    let profiles = traces.map(|trace| {
        let (z_mm, deviation_um) = along(&cylinder.place(&Scan::of(points, trace)?));
        let errors = Err("each point of a generatrix is measured once: its errors are not known".to_owned());
        Ok(OpenProfile { of: trace.id.clone(), z_mm, deviation_um, errors })
    });
    let profiles: Vec<OpenProfile> = profiles.collect::<Result<_>>()?;
    Ok(profiles.into_iter().filter(|profile| profile.z_mm.len() > 1).collect())
}

/// Ascending heights, and the mean deviation at each.
fn along(scan: &Scan) -> (Vec<f64>, Vec<f64>) {
    let mut places: Vec<(f64, f64)> = scan.iter().map(|(_, z, deviation)| (z, deviation)).collect();
    places.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    let (mut z_mm, mut deviation_um) = (Vec::new(), Vec::new());
    for together in places.chunk_by(|(one, _), (next, _)| one.total_cmp(next).is_eq()) {
        z_mm.push(together[0].0);
        deviation_um.push(together.iter().map(|(_, deviation)| deviation).sum::<f64>() / together.len() as f64);
    }
    (z_mm, deviation_um)
}
