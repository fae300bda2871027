//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod control;
mod files;
mod support;
mod tables;
