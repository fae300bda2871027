//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod closed_forms;
mod coverage;
mod drift;
