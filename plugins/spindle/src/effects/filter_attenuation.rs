//! `filter-attenuation`: a first-order low-pass in one channel, 1/(1 − i n p) at order n for −3 dB at order 1/p (time runs
//! with e^{−inΦ}). ∂/∂p = i n u at p = 0.

use runout_core::{Complex64, model::diagnosis::Estimated};

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, parameter};

/// A sensor's bandwidth.
pub(crate) struct FilterAttenuation;

impl SpindleEffect for FilterAttenuation {
    fn about(&self) -> About {
        // −3 dB at order 1000.
        let parameters = vec![parameter("inverse-cut-off", "rev", 1e-3)];
        About {
            id: "filter-attenuation",
            does: "a first-order low-pass in one channel",
            acts_on: ActsOn::Sensor,
            parameters,
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        alterations.sensors[target].inverse_cutoff += values[0];
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let p = predicted.alterations.sensors[target].inverse_cutoff;
        let change = |order: usize| Complex64::I * order as f64 / Complex64::new(1.0, -(order as f64) * p);
        vec![predicted.each(|reading| reading.sensor == target, |order, at| change(order) * predicted.readings[at])]
    }

    fn is_possible(&self, values: &[f64]) -> bool {
        // A negative one amplifies.
        values.first().is_some_and(|inverse_cutoff| *inverse_cutoff > 0.0)
    }

    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        let cut_off = |inverse: Estimated| Estimated {
            name: "cut-off".into(),
            value: inverse.value.recip(),
            std: inverse.std.map(|std| std / (inverse.value * inverse.value)),
            unit: "1/rev".into(),
        };
        estimated.into_iter().map(cut_off).collect()
    }
}
