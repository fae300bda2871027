//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod axial;
mod blind;
mod blind_points;
mod consistency;
mod coverage;
mod eccentricity;
mod minimum_zone_cylinder;
mod monte_carlo;
mod results;
mod rotor;
mod spatial;
mod straightness;
#[path = "../../tests/support/trials.rs"]
mod trials;
mod values;
