//! The pipeline: configuration, what is registered, and the run.

pub mod compare;
pub mod config;
pub mod diagnose;
pub mod document;
pub mod effects;
pub mod error;
pub mod evaluate;
mod line;
mod outdated;
mod overlap;
mod pinpoint;
pub mod registry;
pub mod result;
pub mod run;
mod steadiness;
pub mod summary;
mod traces;
mod turnstile;

pub use config::Pipeline;
pub use registry::Registry;
