//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod conformance;
mod corrector;
mod effect;
mod evaluator;
mod exporter;
mod hostile;
mod loader;
mod point_effect;
mod points;
mod recording;
mod support;
mod three_point;
