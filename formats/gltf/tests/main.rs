//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod foreign;
mod reader;
#[path = "../../mesh/tests/support/mod.rs"]
mod support;
