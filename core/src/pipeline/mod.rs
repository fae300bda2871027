//! The pipeline: configuration, what is registered, and the run.

pub mod config;
pub mod document;
pub mod error;
pub mod registry;
pub mod run;

pub use config::Pipeline;
pub use registry::Registry;
