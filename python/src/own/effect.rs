//! An effect in Python: a linear change of one channel, order by order.

use std::sync::Arc;

use numpy::{Complex64, PyArray1};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyTuple};
use runout_core::{Error, ErrorKind, closed_loop::Parameter};
use runout_spindle::effects::{ChannelTransfer, differences};

use super::{Object, numbers};

/// The transfer of an effect that is a Python object.
pub(crate) struct OwnTransfer(pub Arc<Object>);

impl OwnTransfer {
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

    fn method(&self, name: &str) -> String {
        format!("{}.{name}", self.0.name)
    }
}

impl ChannelTransfer for OwnTransfer {
    fn transfer(&self, orders: usize, values: &[f64]) -> Option<Vec<Complex64>> {
        let method = self.method("transfer");
        self.0.ask(|_, plugin| {
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
        })
    }

    fn partials(&self, parameters: &[Parameter], orders: usize, values: &[f64]) -> Option<Vec<Vec<Complex64>>> {
        let method = self.method("partials");
        let given = self.0.ask(|_, plugin| {
            if !plugin.hasattr("partials")? {
                return Ok(None);
            }
            let returned = Self::call(plugin, "partials", orders, values)?;
            let found = numbers(&returned, &method, "[parameter, order]", &[values.len(), orders])?;
            let found = found.as_slice()?;
            if found.iter().any(|entry| !entry.is_finite()) {
                return Err(PyValueError::new_err(format!("{method}: expected finite numbers")));
            }
            Ok(Some(found.chunks(orders).map(<[Complex64]>::to_vec).collect()))
        })?;
        given.or_else(|| differences(self, parameters, orders, values))
    }

    fn failure(&self) -> Option<Error> {
        let problem = format!("the code of `{}` raised an exception", self.0.name);
        self.0.has_raised().then(|| Error::new("diagnose", "the effects", problem).of(ErrorKind::Interrupted))
    }
}
