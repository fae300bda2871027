//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod closed_forms;
mod coverage;
mod diagonals;
mod drift;
mod probing;
mod rotary_path;
mod structural;
mod support;
#[path = "../../../tests/support/trials.rs"]
mod trials;

// Modules that need nothing else of the crate: for their tests the library is not compiled a second time.
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/runs.rs"]
mod runs;
