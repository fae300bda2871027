//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod measured;
#[path = "../../../tests/support/measured_data.rs"]
mod measured_data;
mod simulated;
#[path = "../../../tests/support/trials.rs"]
mod trials;

// Modules that need nothing else of the crate: for their tests the library is not compiled a second time.
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/components.rs"]
mod components;
#[allow(dead_code, unreachable_pub, reason = "a part of the library")]
#[path = "../src/signal.rs"]
mod signal;
