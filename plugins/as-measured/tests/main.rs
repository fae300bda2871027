//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod golden;
mod points_as_they_come;

// Modules that need nothing else of the crate: for their tests the library is not compiled a second time.
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/filling.rs"]
mod filling;
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/neighbours.rs"]
mod neighbours;
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/quadric.rs"]
mod quadric;
