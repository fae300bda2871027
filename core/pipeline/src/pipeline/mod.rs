//! The pipeline: configuration, what is registered, and the run.

pub mod batch;
pub mod compare;
mod config;
pub mod diagnose;
pub mod document;
mod evaluations;
mod hidden_readings;
mod observer;
mod ordered_collector;
mod outdated;
mod pinpoint;
mod point_run;
pub mod put_right;
mod read_ahead;
mod record_reader;
mod registry;
mod result_writer;
pub mod run;
mod station_summary;
mod steadiness;
mod tables;
mod true_error;
mod turn_tables;
mod undeclared;
mod warnings;

pub use config::{Candidate, INCLUDE_KEY, Pipeline, PlainTable, Route, choice, pipeline_schema, plain_tables};
pub use registry::{Catalogue, Context, Plugin, Registry, StageConfig};
