//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod axial;
mod campaigns;
mod common;
mod confounded;
mod diagnose;
mod eccentricity;
mod error_motion;
mod foresee;
mod methods;
mod plan;
mod separation;
mod stated;
#[path = "../../../tests/support/trials.rs"]
mod trials;
mod unusual;
