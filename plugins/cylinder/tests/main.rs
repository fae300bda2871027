//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod consistency;
mod measured;
#[path = "../../../tests/support/measured_data.rs"]
mod measured_data;
mod simulated;
mod simulator;
#[path = "../../../tests/support/trials.rs"]
mod trials;

// Modules that need nothing else of the crate: for their tests the library is not compiled a second time.
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/circle.rs"]
mod circle;
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/robust.rs"]
mod robust;
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/scan.rs"]
mod scan;
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/shape.rs"]
mod shape;
