//! Failures as exceptions of `runout.errors`, with kind, place and help.

use pyo3::{exceptions::PyRuntimeError, prelude::*};
use runout_cli::Failure;

/// The exception that the package raises for a failure.
pub(crate) fn exception(py: Python<'_>, failure: &Failure) -> PyErr {
    let document = failure.document().to_string();
    let made = py.import("runout.errors").and_then(|errors| errors.call_method1("from_document", (document,)));
    match made {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}

/// The exception for a fault of the program itself.
pub(crate) fn fault(message: &str) -> PyErr {
    PyRuntimeError::new_err(format!("{message}; please report this as a fault of runout"))
}
