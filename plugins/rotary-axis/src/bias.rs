//! What effects that are not observable do to the results all the same.

use nalgebra::Vector3;
use runout_core::closed_loop::diagnosis::{BiasPerUnit, Blind};

use crate::{
    campaign::Campaign,
    config::RotaryAxis,
    effects::{CANDIDATES, Shapes},
    solve::fit,
};

/// Smallest change of a result per usual size of an effect that is worth reporting, mm or rad times lever arm.
const NO_BIAS: f64 = 1e-9;

impl RotaryAxis {
    /// What an effect that is not visible does to the results all the same.
    pub(crate) fn bias(
        &self,
        campaign: &Campaign,
        blind: &Blind,
        names: &[String],
        shapes: &Shapes,
    ) -> Option<BiasPerUnit> {
        let own = blind.targets.iter().fold(blind.effect.clone(), |name, target| format!("{name} {target}"));
        let candidate = CANDIDATES.get(names.iter().position(|name| *name == own)?)?;
        let effect = candidate.effect();
        let parameter = effect.parameters.first()?;
        let column = candidate.columns(self.0.axis, campaign, shapes).into_iter().next()?;
        let mut readings = campaign.readings.clone();
        let plain = fit(&campaign.layout, &readings, &[]).ok()?;
        readings.iter_mut().zip(&column).for_each(|(reading, column)| reading.value += column * parameter.tolerance);
        let moved = fit(&campaign.layout, &readings, &[]).ok()?;
        let symbols = self.0.axis.location_symbols();
        let lever = campaign.layout.balls.iter().map(Vector3::norm).fold(1.0, f64::max);
        let mut changes: Vec<(f64, f64, &str, String)> = Vec::new();
        for (index, (one, other)) in plain.location().into_iter().zip(moved.location()).enumerate() {
            let change = (other.value - one.value).abs() / parameter.tolerance;
            let (reach, scale, unit) = if index < 2 { (1.0, 1e3, "um") } else { (lever, 1e6, "urad") };
            changes.push((change * reach, scale * change, unit, symbols[index].clone()));
        }
        for (ball, id) in campaign.balls.iter().enumerate() {
            for (one, other) in plain.placement(ball).into_iter().zip(moved.placement(ball)) {
                let change = (other.value - one.value).abs() / parameter.tolerance;
                changes.push((change, 1e3 * change, "um", format!("placement of {id}")));
            }
        }
        let known =
            |change: &&(f64, f64, &str, String)| change.0.is_finite() && change.0 > NO_BIAS / parameter.tolerance;
        let (location, placement) = changes.split_at(4);
        let largest = |changes: &[(f64, f64, &'static str, String)]| {
            changes.iter().filter(|change| known(change)).max_by(|a, b| a.0.total_cmp(&b.0)).cloned()
        };
        let (_, value, unit, on) = largest(location).or_else(|| largest(placement))?;
        Some(BiasPerUnit { value, unit: format!("{unit}/{}", per(&parameter.unit)), on })
    }
}

/// A unit in a denominator.
fn per(unit: &str) -> String {
    if unit.contains('/') { format!("({unit})") } else { unit.to_owned() }
}
