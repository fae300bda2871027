//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod closed_forms;
mod coverage;
mod diagonals;
mod drift;
mod play;
mod probing;
mod rotary_path;
mod runs;
mod structural;
mod support;
#[path = "../../../tests/support/trials.rs"]
mod trials;
