//! The formats of named channels: against their reference libraries, and all by one suite.
#![allow(clippy::unwrap_used, reason = "tests")]

mod conformance;
mod mutations;
mod real_files;
mod references;
mod resampling;
mod support;
#[path = "../../../tests/support/trials.rs"]
mod trials;
mod turns;
