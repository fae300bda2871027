//! One station separated, with a look for mistakes in the rig where far more than noise is left.

use runout_core::{Result, separation::Separation, stage::Station};

use crate::{
    sizes,
    solve::{Operators, Readings, Solver, whitening},
    wiring,
};

/// Separates a station with the operators that `method` makes for its readings.
///
/// # Errors
/// When the station's profiles do not fit the rig, or exact geometry does not settle.
pub(super) fn separate(
    solver: &Solver,
    station: &Station,
    method: impl FnOnce(&Readings) -> Operators,
) -> Result<Separation> {
    let (mut separation, readings) = solver.separate(station, method)?;
    let rig = &solver.selection.rig;
    separation.residual.checks.extend(wiring::copies(rig, &readings));
    let mut warnings = Vec::new();
    let units = sizes::mistaken_units(rig, &readings);
    if units.is_empty() && separation.residual.chi2_per_dof > wiring::SUSPICIOUS_CHI2 {
        let weights = whitening(&readings);
        warnings.extend(wiring::warning(solver.selection, solver.layout, &readings, weights.as_deref()));
    }
    separation.residual.checks.extend(units);
    warnings.extend(sizes::unusual_sizes(rig, &readings));
    separation.warnings.splice(..0, warnings);
    Ok(separation)
}
