//! The pipeline: configuration, what is registered, and the run.

pub mod batch;
pub mod compare;
pub mod config;
pub mod diagnose;
pub mod document;
pub mod evaluate;
mod observer;
mod ordered_collector;
mod outdated;
mod pinpoint;
mod point_run;
mod read_ahead;
mod record_reader;
pub mod registry;
mod result;
mod result_writer;
pub mod run;
mod station_summary;
mod steadiness;
pub mod tables;
mod turn_tables;
mod undeclared;

pub use crate::{effects, summary};
pub use config::Pipeline;
pub use registry::Registry;

/// Faults of a configuration.
pub use runout_error::fault as error;
