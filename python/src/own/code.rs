//! What an external program may be, as a Python object: `runout.external` reads and writes the tables.

use std::sync::Arc;

use pyo3::{prelude::*, types::PyBytes};
use runout_external::{Answers, Code};

use super::Object;

/// A Python object that answers requests.
pub(crate) struct OwnCode(pub Arc<Object>);

impl Code for OwnCode {
    fn name(&self) -> &str {
        self.0.name
    }

    fn begin(&self) -> Result<Answers, String> {
        let object = Arc::clone(&self.0);
        let begin = |py: Python<'_>, plugin: &Bound<'_, PyAny>| {
            let external = py.import("runout.external")?;
            Ok(external.getattr("Answering")?.call1((plugin,))?.unbind())
        };
        let answering = object.ask(begin).ok_or_else(raised)?;
        Ok(Box::new(move |request| {
            let answer = |py: Python<'_>, _: &Bound<'_, PyAny>| {
                let found = answering.bind(py).call_method1("answer", (PyBytes::new(py, request),))?;
                Ok(found.cast::<PyBytes>()?.as_bytes().to_vec())
            };
            object.ask(answer).ok_or_else(raised)
        }))
    }
}

fn raised() -> String {
    "raised an exception".to_owned()
}
