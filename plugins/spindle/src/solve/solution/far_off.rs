//! What is said of a part that turns far off the axis.

use runout_core::{Error, ErrorKind, numerics::number::significant, stage::Station};

use super::{Estimate, Readings, Solver};

/// From this eccentricity on, as a share of the radius, stated uncertainties lack what badly determined orders carry into others.
const LARGE: f64 = 0.015;
/// No part is clamped so far off centre, as a share of its radius.
pub(super) const FAR_OFF: f64 = 0.1;

impl Solver<'_> {
    /// Where exact geometry does not settle.
    pub(super) fn unsettled(&self, station: &Station, readings: &Readings, estimate: &Estimate) -> Error {
        let (eccentricity_um, radius_mm) = (self.eccentricity_um(readings), self.selection.rig.part_radius_mm);
        let ratio = format!("an eccentricity of {eccentricity_um:.0} µm on a radius of {radius_mm} mm");
        let check = "check part_radius_mm and the unit of the readings";
        let (problem, help) = if eccentricity_um > FAR_OFF * 1e3 * radius_mm {
            (format!("{ratio} is more than exact geometry is solved for"), check)
        } else if estimate.moved_um.is_finite() {
            let moved_um = estimate.moved_um;
            let problem = format!(
                "{ratio} couples the orders so strongly that no solution settles: the last pass still moves the readings \
                 by {} µm rms",
                significant(moved_um, 2)
            );
            let help = "centre the part better, or average on fewer angles (samples_per_rev): the coupling grows with the order";
            (problem, help)
        } else {
            let problem = format!("{ratio}: sensors' lines do not meet the part, and the result is no number");
            (problem, check)
        };
        Error::new("separate", format!("station {}", station.name), problem).of(ErrorKind::Numerical).help(help)
    }

    /// What the stated uncertainty of order by order lacks where the eccentricity is large.
    pub(super) fn far_off_centre(&self, readings: &Readings) -> Option<String> {
        let (eccentricity_um, radius_mm) = (self.eccentricity_um(readings), self.selection.rig.part_radius_mm);
        let is_large = self.second_order && eccentricity_um > LARGE * 1e3 * radius_mm;
        is_large.then(|| {
            // Stations that are alike are to say the same.
            let share = 100.0 * LARGE;
            format!(
                "the eccentricity is above {share} % of the radius of {radius_mm} mm and couples neighbouring orders: an order that the layout \
                 determines badly carries its error into those beside it, and their stated uncertainties do not include that; centre \
                 the part better"
            )
        })
    }
}
