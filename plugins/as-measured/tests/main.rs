//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod golden;
mod points_as_they_come;
