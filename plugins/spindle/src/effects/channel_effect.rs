//! An effect that only its transfer describes: reading over displacement of one channel, order by order, by code that is asked for all orders
//! at once. Its partials are central differences, where the code gives none.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use runout_core::{Complex64, Error, closed_loop::Parameter};

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, Transfer};

/// Orders of an average on 1024 angles.
const USUAL_ORDERS: usize = 512;
/// Step of a difference in place of a partial, relative to the parameter's tolerance.
const STEP: f64 = 1e-3;
/// Transfers that are kept: of the values that a loop tries at a time.
const KEPT: usize = 256;

/// Reading over displacement of a channel at each order.
pub trait ChannelTransfer: Send + Sync {
    /// H at the orders 0 to `orders` − 1 for values of the parameters, in their units: finite, never 0, and 1 where all values are 0. `None`
    /// where it fails; [`failure`](Self::failure) then says why.
    fn transfer(&self, orders: usize, values: &[f64]) -> Option<Vec<Complex64>>;

    /// ∂H/∂(parameter), `[parameter][order]`: [`differences`] where the code has no derivatives. `None` where it fails.
    fn partials(&self, parameters: &[Parameter], orders: usize, values: &[f64]) -> Option<Vec<Vec<Complex64>>> {
        differences(self, parameters, orders, values)
    }

    /// Why it failed, once it has: the work that uses the effect then fails with this error.
    fn failure(&self) -> Option<Error> {
        None
    }
}

/// Central differences of a transfer by each parameter, a thousandth of its tolerance to either side: `[parameter][order]`. `None` where the
/// code fails.
pub fn differences<T: ChannelTransfer + ?Sized>(
    code: &T,
    parameters: &[Parameter],
    orders: usize,
    values: &[f64],
) -> Option<Vec<Vec<Complex64>>> {
    let of_parameter = |(index, parameter): (usize, &Parameter)| {
        let step = STEP * parameter.tolerance;
        let at = |sign: f64| {
            let mut values = values.to_vec();
            values[index] += sign * step;
            code.transfer(orders, &values)
        };
        let (above, below) = (at(1.0)?, at(-1.0)?);
        Some(above.iter().zip(&below).map(|(above, below)| (above - below) / (2.0 * step)).collect())
    };
    parameters.iter().enumerate().map(of_parameter).collect()
}

/// An effect of a transfer. A channel reads Re Σ H u e^{−inΦ} instead of Re Σ u e^{−inΦ}, and ∂/∂v = (∂H/∂v / H) of the reading for a value v.
pub struct ChannelEffect(Arc<Described>);

struct Described {
    id: &'static str,
    does: &'static str,
    parameters: Vec<Parameter>,
    code: Box<dyn ChannelTransfer>,
    kept: Mutex<Kept>,
}

/// What was asked for so far, by the bits of the values.
struct Kept {
    /// How many orders, from 0.
    orders: usize,
    transfers: HashMap<Vec<u64>, Arc<[Complex64]>>,
    relative: HashMap<Vec<u64>, Arc<[Vec<Complex64>]>>,
}

impl ChannelEffect {
    /// With its id, one line about it, its parameters and their transfer.
    #[must_use]
    pub fn new(
        id: &'static str,
        does: &'static str,
        parameters: Vec<Parameter>,
        code: impl ChannelTransfer + 'static,
    ) -> Self {
        let kept = Kept { orders: USUAL_ORDERS, transfers: HashMap::new(), relative: HashMap::new() };
        Self(Arc::new(Described { id, does, parameters, code: Box::new(code), kept: Mutex::new(kept) }))
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

impl Described {
    fn kept<T>(&self, use_of_it: impl FnOnce(&mut Kept) -> T) -> T {
        use_of_it(&mut self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// How many orders are asked for, at least so many.
    fn orders(&self, wanted: usize) -> usize {
        self.kept(|kept| {
            if kept.orders < wanted {
                (kept.orders, kept.transfers, kept.relative) = (2 * wanted, HashMap::new(), HashMap::new());
            }
            kept.orders
        })
    }

    /// H at so many orders or more; `None` where the code fails.
    fn transfer(&self, wanted: usize, values: &[f64]) -> Option<Arc<[Complex64]>> {
        let (orders, key) = (self.orders(wanted), bits(values));
        if let Some(known) = self.kept(|kept| kept.transfers.get(&key).filter(|known| known.len() >= wanted).cloned()) {
            return Some(known);
        }
        let found: Arc<[Complex64]> = self.code.transfer(orders, values)?.into();
        self.kept(|kept| {
            if kept.transfers.len() >= KEPT {
                kept.transfers.clear();
            }
            kept.transfers.insert(key, Arc::clone(&found));
        });
        Some(found)
    }

    /// (∂H/∂v) / H, `[parameter][order]`; `None` where the code fails.
    fn relative_partials(&self, wanted: usize, values: &[f64]) -> Option<Arc<[Vec<Complex64>]>> {
        let (orders, key) = (self.orders(wanted), bits(values));
        let fits = |known: &Arc<[Vec<Complex64>]>| known.iter().all(|partial| partial.len() >= wanted);
        if let Some(known) = self.kept(|kept| kept.relative.get(&key).filter(|known| fits(known)).cloned()) {
            return Some(known);
        }
        let transfer = self.transfer(orders, values)?;
        let partials = self.code.partials(&self.parameters, orders, values)?;
        let over =
            |partial: &Vec<Complex64>| partial.iter().zip(&*transfer).map(|(partial, of)| partial / of).collect();
        let found: Arc<[Vec<Complex64>]> = partials.iter().map(over).collect();
        self.kept(|kept| {
            if kept.relative.len() >= KEPT {
                kept.relative.clear();
            }
            kept.relative.insert(key, Arc::clone(&found));
        });
        Some(found)
    }
}

impl SpindleEffect for ChannelEffect {
    fn about(&self) -> About {
        let Described { id, does, parameters, .. } = &*self.0;
        About { id, does, acts_on: ActsOn::Sensor, parameters: parameters.clone() }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let (effect, of, known) = (Arc::clone(&self.0), values.to_vec(), Mutex::new(None::<Arc<[Complex64]>>));
        let at = move |order: usize| {
            let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
            if known.as_ref().is_none_or(|known| known.len() <= order) {
                *known = effect.transfer(order + 1, &of);
            }
            // The failure of the code is that of the work, which does not use what is here in its place.
            known.as_ref().and_then(|known| known.get(order).copied()).unwrap_or(Complex64::ONE)
        };
        alterations.sensors[target].transfers.push(Transfer::new(at).of(self.0.id, values));
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let none = vec![0.0; self.0.parameters.len()];
        let values = predicted.alterations.sensors[target].applied(self.0.id).unwrap_or(&none);
        let orders = predicted.readings.len() / predicted.layout.readings.len().max(1);
        let Some(relative) = self.0.relative_partials(orders, values) else {
            return vec![predicted.nothing(); none.len()];
        };
        let partial = |relative: &Vec<Complex64>| {
            predicted.each(|reading| reading.sensor == target, |order, at| relative[order] * predicted.readings[at])
        };
        relative.iter().map(partial).collect()
    }

    fn failure(&self) -> Option<Error> {
        self.0.code.failure()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    /// 1/(1 − i n p) and how often it was asked for.
    struct LowPass(Arc<AtomicUsize>);

    impl ChannelTransfer for LowPass {
        fn transfer(&self, orders: usize, values: &[f64]) -> Option<Vec<Complex64>> {
            self.0.fetch_add(1, Ordering::Relaxed);
            Some((0..orders).map(|order| Complex64::new(1.0, -(order as f64) * values[0]).inv()).collect())
        }
    }

    fn low_pass() -> (Described, Arc<AtomicUsize>) {
        let asked = Arc::new(AtomicUsize::new(0));
        let parameters = vec![Parameter { name: "inverse-cut-off".into(), unit: "rev".into(), tolerance: 1e-3 }];
        let effect = ChannelEffect::new("low-pass", "a low-pass", parameters, LowPass(Arc::clone(&asked)));
        (Arc::into_inner(effect.0).unwrap(), asked)
    }

    #[test]
    fn differences_are_the_partials_and_nothing_is_asked_twice() {
        let (effect, asked) = low_pass();
        for value in [0.0, 2e-3] {
            let relative = effect.relative_partials(100, &[value]).unwrap();
            for order in [1, 7, 99] {
                let exact = Complex64::new(0.0, order as f64) / Complex64::new(1.0, -(order as f64) * value);
                // Third derivative times step squared over six.
                assert!((relative[0][order] - exact).norm() < 1e-5 * exact.norm(), "order {order} at {value}");
            }
            for _ in 0..5 {
                effect.relative_partials(100, &[value]).unwrap();
                effect.transfer(50, &[value]).unwrap();
            }
        }
        assert_eq!(asked.load(Ordering::Relaxed), 2 * 3, "one transfer and two of the difference for each value");
    }

    #[test]
    fn more_orders_than_usual_are_asked_for() {
        let (effect, _) = low_pass();
        assert!(effect.transfer(USUAL_ORDERS + 1, &[1e-3]).unwrap().len() > USUAL_ORDERS);
        let partials = effect.relative_partials(3000, &[1e-3]).unwrap();
        assert!(partials[0].len() >= 3000 && partials[0].iter().all(|entry| entry.is_finite()));
    }
}
