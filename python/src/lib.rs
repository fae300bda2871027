//! `runout._native`: the pipeline for the Python package, which gives it names and types.
//!
//! Documents cross the border as JSON, which both sides read and print to the last bit; samples, tables and surfaces cross it as
//! memory. Every piece of work runs beside the interpreter (`work`), so that other threads of Python go on.

mod arrays;
mod calls;
mod collect;
mod failure;
mod interruptible;
mod own;
mod table;
mod work;

use pyo3::prelude::*;

/// The compiled part of the package.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::arrays::Capture;
    #[pymodule_export]
    use super::calls::{check, compare, diagnose, document, main, run};
    #[pymodule_export]
    use super::own::Layout;
    #[pymodule_export]
    use super::table::{Surface, Table, figures};

    use pyo3::{
        Bound, PyResult,
        types::{PyModule, PyModuleMethods},
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", runout_core::provenance::VERSION)
    }
}
