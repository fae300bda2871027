//! An effect in Python: a linear change of one channel, order by order.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use numpy::{Complex64, PyArray1};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyTuple};
use runout_core::model::Parameter;
use runout_spindle::effects::{About, ActsOn, Alterations, Predicted, SpindleEffect, Transfer};

use super::{Object, numbers};

/// Orders of an average on 1024 angles.
const USUAL_ORDERS: usize = 512;
/// Step of a difference in place of a partial, relative to the parameter's tolerance.
const STEP: f64 = 1e-3;

/// An effect whose transfer is a Python object's.
pub(crate) struct OwnEffect(Arc<Described>);

struct Described {
    about: &'static str,
    parameters: Vec<Parameter>,
    object: Arc<Object>,
    /// How many orders, from 0, were asked for so far.
    orders: AtomicUsize,
}

impl OwnEffect {
    /// With what its parameters are.
    pub(crate) fn new(about: &'static str, parameters: Vec<Parameter>, object: Arc<Object>) -> Self {
        Self(Arc::new(Described { about, parameters, object, orders: AtomicUsize::new(USUAL_ORDERS) }))
    }
}

impl Described {
    /// Calls a method with the orders and the values.
    fn call<'py>(
        plugin: &Bound<'py, PyAny>,
        method: &str,
        orders: usize,
        values: &[f64],
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = plugin.py();
        let orders = PyArray1::from_iter(py, 0..orders.cast_signed() as i64).into_any();
        let words: Vec<Bound<PyAny>> = std::iter::once(Ok(orders))
            .chain(values.iter().map(|value| Ok(value.into_pyobject(py)?.into_any())))
            .collect::<PyResult<_>>()?;
        plugin.call_method1(method, PyTuple::new(py, words)?)
    }

    fn transfer_of(&self, plugin: &Bound<'_, PyAny>, orders: usize, values: &[f64]) -> PyResult<Vec<Complex64>> {
        let method = format!("{}.transfer", self.object.name);
        let array = numbers(&Self::call(plugin, "transfer", orders, values)?, &method, "[order]", &[orders])?;
        let found = array.as_slice()?.to_vec();
        match found.iter().position(|entry| !entry.is_finite() || *entry == Complex64::ZERO) {
            None => Ok(found),
            Some(order) => {
                let problem =
                    format!("{method}: expected finite numbers but 0, found {} at order {order}", found[order]);
                Err(PyValueError::new_err(problem))
            }
        }
    }

    /// Reading over displacement at each order from 0; none changed where the code raises, which stops the work.
    fn transfer(&self, orders: usize, values: &[f64]) -> Vec<Complex64> {
        let found = self.object.ask(|_, plugin| self.transfer_of(plugin, orders, values));
        found.unwrap_or_else(|| vec![Complex64::ONE; orders])
    }

    /// ∂(transfer)/∂(parameter) over the transfer, `[parameter][order]`.
    fn relative_partials(
        &self,
        plugin: &Bound<'_, PyAny>,
        orders: usize,
        values: &[f64],
    ) -> PyResult<Vec<Vec<Complex64>>> {
        let transfer = self.transfer_of(plugin, orders, values)?;
        let relative =
            |partial: &[Complex64]| partial.iter().zip(&transfer).map(|(partial, of)| partial / of).collect();
        if plugin.hasattr("partials")? {
            let method = format!("{}.partials", self.object.name);
            let returned = Self::call(plugin, "partials", orders, values)?;
            let found = numbers(&returned, &method, "[parameter, order]", &[values.len(), orders])?;
            let found = found.as_slice()?;
            if found.iter().any(|entry| !entry.is_finite()) {
                return Err(PyValueError::new_err(format!("{method}: expected finite numbers")));
            }
            return Ok(found.chunks(orders).map(relative).collect());
        }
        let mut partials = Vec::with_capacity(values.len());
        for (index, parameter) in self.parameters.iter().enumerate() {
            let step = STEP * parameter.tolerance;
            let at = |sign: f64| {
                let mut values = values.to_vec();
                values[index] += sign * step;
                self.transfer_of(plugin, orders, &values)
            };
            let (above, below) = (at(1.0)?, at(-1.0)?);
            let difference: Vec<Complex64> =
                above.iter().zip(&below).map(|(above, below)| (above - below) / (2.0 * step)).collect();
            partials.push(relative(&difference));
        }
        Ok(partials)
    }
}

impl SpindleEffect for OwnEffect {
    fn about(&self) -> About {
        let Described { about, parameters, object, .. } = &*self.0;
        About { id: object.name, does: about, acts_on: ActsOn::Sensor, parameters: parameters.clone() }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let (effect, of) = (Arc::clone(&self.0), values.to_vec());
        let known = Mutex::new(effect.transfer(effect.orders.load(Ordering::Relaxed), values));
        let at = move |order: usize| {
            let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
            if order >= known.len() {
                let orders = 2 * (order + 1);
                effect.orders.fetch_max(orders, Ordering::Relaxed);
                *known = effect.transfer(orders, &of);
            }
            known[order]
        };
        alterations.sensors[target].transfers.push(Transfer::new(at).of(self.0.object.name, values));
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let none = vec![0.0; self.0.parameters.len()];
        let values = predicted.alterations.sensors[target].applied(self.0.object.name).unwrap_or(&none);
        let orders = predicted.readings.len() / predicted.layout.readings.len().max(1);
        let found = self.0.object.ask(|_, plugin| self.0.relative_partials(plugin, orders, values));
        let Some(relative) = found else { return vec![predicted.nothing(); none.len()] };
        let partial = |relative: &Vec<Complex64>| {
            predicted.each(|reading| reading.sensor == target, |order, at| relative[order] * predicted.readings[at])
        };
        relative.iter().map(partial).collect()
    }
}
