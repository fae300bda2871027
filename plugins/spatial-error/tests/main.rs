//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod curves;
mod diagnose;
mod example;
mod measured;
mod peers;
mod searched;
mod separate;
mod support;
#[path = "../../../tests/support/trials.rs"]
mod trials;
mod wandering;
