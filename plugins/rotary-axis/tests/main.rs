//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod blind;
mod common;
mod consistency;
mod curves;
mod diagnose;
mod error_motion;
mod fit;
#[path = "../../../tests/support/measured_data.rs"]
mod measured_data;
mod nest;
mod paper;
mod passes;
mod published;
#[path = "../../../tests/support/trials.rs"]
mod trials;
