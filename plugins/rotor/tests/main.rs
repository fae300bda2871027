//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bad_input;
mod closed_forms;
mod matrix_market;
mod support;
mod tables;

// Modules that need nothing else of the crate: for their tests the library is not compiled a second time.
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/beam.rs"]
mod beam;
