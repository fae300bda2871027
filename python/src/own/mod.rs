//! Plugins that are Python objects: registered by their names for one call, beside those that are compiled in.
//!
//! A formula is asked for arrays over all orders at once, once a run; an effect once for each of its values. What an external program may be,
//! an object is by the same requests and answers (`runout.external.Answering`). What their code raises stops the work, and the call raises it
//! with its traceback.

mod code;
mod effect;
mod separator;

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use numpy::{Complex64, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::{exceptions::PyValueError, prelude::*};
use runout_cli::Failure;
use runout_core::{
    closed_loop::Parameter,
    pipeline::{Plugin, Registry},
    stage::Separator,
};
use runout_external::{CodeKind, Gives, Symbol, lasting, register_code};
use runout_spindle::{
    effects::{self, ChannelEffect},
    separators::MethodConfig,
};

use crate::work::Stop;
use code::OwnCode;
use effect::OwnTransfer;
pub(crate) use separator::Layout;
use separator::OwnSeparator;

/// A Python object that is a plugin of one call.
#[derive(FromPyObject)]
pub(crate) struct Own {
    name: String,
    about: String,
    /// The method that says what it is: "operator", "transfer", "change", "preprocess", "separate", "values", "load", "captures", "evaluate" or "export".
    method: String,
    /// Name, unit and tolerance of each parameter of an effect.
    parameters: Vec<(String, String, f64)>,
    /// Columns of numbers that a separator of points takes.
    columns: Vec<String>,
    /// Columns of texts that it takes.
    labels: Vec<String>,
    /// Symbols and units of values.
    symbols: Vec<(String, String)>,
    plugin: Py<PyAny>,
}

/// Adds the plugins of a call to what is registered.
///
/// # Errors
/// When a name is taken.
pub(crate) fn register(registry: &mut Registry, plugins: Vec<Own>, stop: &Stop) -> Result<(), Failure> {
    for Own { name, about, method, parameters, columns, labels, symbols, plugin } in plugins {
        if is_taken(registry, &name, &method) {
            let message = format!("there is a plugin `{name}` already");
            return Err(Failure::Name { message, help: "give the object another `name`".into() });
        }
        let (name, about) = (lasting(&name), lasting(&about));
        let object = Arc::new(Object { name, plugin, stop: stop.clone(), raised: AtomicBool::new(false) });
        let symbols = symbols.into_iter().map(|(symbol, unit)| Symbol { symbol, unit }).collect();
        let parameter = |(name, unit, tolerance)| Parameter { name, unit, tolerance };
        let parameters = parameters.into_iter().map(parameter).collect();
        let kind = match &*method {
            "operator" => {
                registry.separators.add(formula(about, object));
                continue;
            }
            "transfer" => {
                let effect = ChannelEffect::new(name, about, parameters, OwnTransfer(object));
                registry.effects.add(effects::entry(Arc::new(effect)));
                continue;
            }
            "change" => CodeKind::Effect { parameters, columns, labels },
            "values" => CodeKind::Points { columns, labels, symbols },
            "preprocess" => CodeKind::Preprocessor,
            "load" => CodeKind::Loader(Gives::Points),
            "captures" => CodeKind::Loader(Gives::Samples),
            "evaluate" => CodeKind::Evaluator(symbols),
            "export" => CodeKind::Exporter,
            _ => CodeKind::Turns,
        };
        register_code(registry, (name, about), kind, Arc::new(OwnCode(object))).map_err(|fault| Failure::Name {
            message: format!("{name}: {}", fault.message),
            help: "an effect of points takes `columns`, names of columns of numbers".into(),
        })?;
    }
    Ok(())
}

/// Whether a plugin of the same stage has a name.
fn is_taken(registry: &Registry, name: &str, method: &str) -> bool {
    match method {
        "transfer" | "change" => registry.effects.iter().any(|known| known.name == name),
        "preprocess" => registry.preprocessors.iter().any(|known| known.name == name),
        "load" | "captures" => registry.loaders.iter().any(|known| known.name == name),
        "evaluate" => registry.evaluators.iter().any(|known| known.name == name),
        "export" => registry.exporters.iter().any(|known| known.name == name),
        _ => registry.separators.iter().any(|known| known.name == name),
    }
}

/// The plugin of a formula, with the keys that all formulas have.
fn formula(about: &'static str, object: Arc<Object>) -> Plugin<Separator> {
    Plugin::made(object.name, about, move |config: MethodConfig<Object>, context| {
        Ok(Separator::Stations(Box::new(OwnSeparator::new(&config, context, &object)?)))
    })
}

/// A Python object, and what to stop when its code raises.
struct Object {
    name: &'static str,
    plugin: Py<PyAny>,
    stop: Stop,
    raised: AtomicBool,
}

impl Object {
    /// Whether its code has raised.
    fn has_raised(&self) -> bool {
        self.raised.load(Ordering::Relaxed)
    }

    /// Asks it with the interpreter's lock held. `None` where its code raises: the work stops then, and the call raises that.
    fn ask<T>(&self, question: impl FnOnce(Python<'_>, &Bound<'_, PyAny>) -> PyResult<T>) -> Option<T> {
        let asked = Python::try_attach(|py| question(py, self.plugin.bind(py)));
        match asked? {
            Ok(answer) => Some(answer),
            Err(error) => {
                self.raised.store(true, Ordering::Relaxed);
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
