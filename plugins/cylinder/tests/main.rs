//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod consistency;
mod measured;
#[path = "../../../tests/support/measured_data.rs"]
mod measured_data;
mod simulated;
mod simulator;
#[path = "../../../tests/support/trials.rs"]
mod trials;
