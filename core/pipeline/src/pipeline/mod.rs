//! The pipeline: configuration, what is registered, and the run.

pub mod batch;
pub mod compare;
pub mod config;
pub mod diagnose;
pub mod document;
pub mod effects;
pub mod evaluate;
mod exports;
mod ordered_collector;
mod outdated;
mod pinpoint;
mod point_run;
mod read_ahead;
mod record_reader;
pub mod registry;
pub mod result;
mod result_writer;
pub mod run;
mod schema;
mod steadiness;
pub mod summary;
pub mod tables;
mod turn_tables;
mod undeclared;

pub use config::Pipeline;
pub use registry::Registry;

/// Faults of a configuration.
pub use runout_error::fault as error;
