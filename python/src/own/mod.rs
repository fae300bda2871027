//! Separators and effects that are Python objects: registered by their names for one call, beside those that are compiled in.
//!
//! Both are asked for arrays over all orders at once, and seldom: a separator once a run, an effect once for each of its values. What their
//! code raises stops the work, and the call raises it with its traceback.

mod effect;
mod separator;

use std::{
    collections::HashSet,
    sync::{Arc, Mutex, PoisonError},
};

use numpy::{Complex64, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::{exceptions::PyValueError, prelude::*};
use runout_cli::Failure;
use runout_core::{
    model::Parameter,
    pipeline::{Plugin, Registry},
    stage::Separator,
};
use runout_spindle::{effects, separators::MethodConfig};

use crate::work::Stop;
use effect::OwnEffect;
pub(crate) use separator::Layout;
use separator::OwnSeparator;

/// A Python object that is a plugin of one call.
#[derive(FromPyObject)]
pub(crate) struct Own {
    name: String,
    about: String,
    /// Name, unit and tolerance of each parameter of an effect; `None` of a separator.
    parameters: Option<Vec<(String, String, f64)>>,
    plugin: Py<PyAny>,
}

/// Adds the plugins of a call to what is registered.
///
/// # Errors
/// When a name is taken.
pub(crate) fn register(registry: &mut Registry, plugins: Vec<Own>, stop: &Stop) -> Result<(), Failure> {
    for Own { name, about, parameters, plugin } in plugins {
        let taken = registry.separators.iter().any(|known| known.name == name)
            || registry.effects.iter().any(|known| known.name == name);
        if taken {
            let message = format!("there is a plugin `{name}` already");
            return Err(Failure::Name { message, help: "give the object another `name`".into() });
        }
        let (name, about) = (lasting(&name), lasting(&about));
        let object = Arc::new(Object { name, plugin, stop: stop.clone() });
        match parameters {
            None => registry.separators.add(separator(about, object)),
            Some(parameters) => {
                let parameter = |(name, unit, tolerance)| Parameter { name, unit, tolerance };
                let parameters = parameters.into_iter().map(parameter).collect();
                registry.effects.add(effects::entry(Arc::new(OwnEffect::new(about, parameters, object))));
            }
        }
    }
    Ok(())
}

/// The plugin of a separator, with the keys that all formulas have.
fn separator(about: &'static str, object: Arc<Object>) -> Plugin<Separator> {
    Plugin::made(object.name, about, move |config: MethodConfig<Object>, context| {
        Ok(Separator::Stations(Box::new(OwnSeparator::new(&config, context, &object)?)))
    })
}

/// A text that lasts as long as the process, as names of plugins do; kept once, however often it is asked for.
fn lasting(text: &str) -> &'static str {
    static KNOWN: Mutex<Option<HashSet<&'static str>>> = Mutex::new(None);
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let known = known.get_or_insert_default();
    if let Some(text) = known.get(text) {
        return text;
    }
    let text: &'static str = Box::leak(text.into());
    known.insert(text);
    text
}

/// A Python object, and what to stop when its code raises.
struct Object {
    name: &'static str,
    plugin: Py<PyAny>,
    stop: Stop,
}

impl Object {
    /// Asks it with the interpreter's lock held. `None` where its code raises: the work stops then, and the call raises that.
    fn ask<T>(&self, question: impl FnOnce(Python<'_>, &Bound<'_, PyAny>) -> PyResult<T>) -> Option<T> {
        let asked = Python::try_attach(|py| question(py, self.plugin.bind(py)));
        match asked? {
            Ok(answer) => Some(answer),
            Err(error) => {
                self.stop.raise(error);
                None
            }
        }
    }
}

/// What a method returned as an array of complex numbers; `axes` names its shape.
///
/// # Errors
/// When it is no such array, or of another shape.
fn numbers<'py>(
    returned: &Bound<'py, PyAny>,
    method: &str,
    axes: &str,
    shape: &[usize],
) -> PyResult<PyReadonlyArrayDyn<'py, Complex64>> {
    let numpy = returned.py().import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (returned, "complex128"))?;
    let array = array.cast_into::<PyArrayDyn<Complex64>>().map_err(PyErr::from)?;
    if array.shape() != shape {
        let problem =
            format!("{method}: expected an array {axes} of the shape {shape:?}, found the shape {:?}", array.shape());
        return Err(PyValueError::new_err(problem));
    }
    Ok(array.try_readonly()?)
}
