//! The pipeline: configuration, what is registered, and the run.

pub mod config;
pub mod document;
pub mod error;
pub mod registry;
pub mod result;
pub mod run;
pub mod summary;
mod traces;

pub use config::Pipeline;
pub use registry::Registry;
