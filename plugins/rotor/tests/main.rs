//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bad_input;
mod beam;
mod closed_forms;
mod matrix_market;
mod support;
mod tables;
