//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod conformance;
mod effect;
mod evaluator;
mod exporter;
mod hostile;
mod loader;
mod points;
mod recording;
mod support;
mod three_point;

// Modules that need nothing else of the crate: for their tests the library is not compiled a second time.
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/frame.rs"]
mod frame;
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/said.rs"]
mod said;
