//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;
mod consistency;
mod diagnose;
mod reversal;
#[path = "../../../tests/support/trials.rs"]
mod trials;
