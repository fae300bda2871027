//! Values of a test with their uncertainties.

use runout_core::{
    draws::{Draw, MeasuredAgain, Truth, Uncertainty, measured_again},
    summary::Value,
};

/// A value: its symbol, the number and what it is.
pub(crate) struct Computed {
    pub symbol: String,
    pub value: f64,
    pub about: &'static str,
    pub is_key: bool,
    /// The least that it can be.
    pub least: f64,
}

/// Values with their uncertainties. `measure` measures a machine again.
pub(crate) fn with_uncertainty(
    computed: &[Computed],
    unit: &str,
    seed: u64,
    measure: impl Fn(Truth, &mut Draw) -> MeasuredAgain,
) -> Vec<Value> {
    let numbers: Vec<f64> = computed.iter().map(|computed| computed.value).collect();
    let with = |(computed, known): (&Computed, Uncertainty)| {
        let mut value = Value::new(&computed.symbol, computed.value, known.std, unit, computed.about);
        if let Some(of) = &mut value.uncertainty {
            of.interval_95 = known.interval_95.map(|end| end.max(computed.least));
        }
        if computed.is_key { value.key() } else { value }
    };
    computed.iter().zip(measured_again(&numbers, seed, measure)).map(with).collect()
}
