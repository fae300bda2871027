//! What marks that turn single turns add to asynchronous motion.

use crate::Value;
use runout_turning::profile::Profile;

/// Asynchronous values, radial, with intervals that reach down to what is left without the [marks' share](Profile::jitter_um).
#[must_use]
pub fn with_jitter_of_marks(mut values: Vec<Value>, profiles: &[Profile]) -> Vec<Value> {
    let evaluated = profiles.iter().filter(|profile| profile.spread.is_some());
    let added_um = evaluated.map(Profile::jitter_um).fold(0.0, f64::max);
    if added_um <= 0.0 {
        return values;
    }
    let all: Vec<(String, f64)> = values.iter().map(|value| (value.symbol.clone(), value.value)).collect();
    for value in values.iter_mut().filter(|value| value.symbol.starts_with("asynchronous-radial")) {
        let rms = format!("{}-rms", value.symbol.trim_end_matches("-rms"));
        let Some((_, rms_um)) = all.iter().find(|(symbol, _)| *symbol == rms) else { continue };
        let left = value.value * (1.0 - (added_um / rms_um).powi(2)).max(0.0).sqrt();
        value.uncertainty = value.uncertainty.take().map(|known| known.with_equivalents(value.value, &[left]));
    }
    values
}
