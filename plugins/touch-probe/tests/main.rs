//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bad_touch;
mod diagnose;
mod example;
mod lost;
mod separate;
mod support;
#[path = "../../../tests/support/trials.rs"]
mod trials;
