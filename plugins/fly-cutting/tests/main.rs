//! Tests of this crate, in one program.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;
mod fly_config;
mod fly_loop;
mod fly_surface;
mod fly_texture;
#[path = "../../../tests/support/trials.rs"]
mod trials;
