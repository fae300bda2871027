//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod measured;
#[path = "../../../tests/support/measured_data.rs"]
mod measured_data;
mod simulated;
#[path = "../../../tests/support/trials.rs"]
mod trials;
