//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod abandon;
mod calypso;
mod cylindricity;
mod least_squares;
#[path = "../../../tests/support/measured_data.rs"]
mod measured_data;
mod parts_of_a_data_set;
mod roundness;
mod small_walls;
mod surfalize;
