//! Random streams that do not know of one another: each purpose, setup, station and sensor has its own, so that no
//! result depends on the order of reading, on threads, or on what else a scenario contains.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::Complex64;

/// What a stream is drawn for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Purpose {
    Form = 1,
    Motion,
    Eccentricity,
    EvenMotion,
    Fractal,
    Line,
    Noise,
    Wobble,
    PickUp,
    Face,
    Pole,
}

/// Where a stream is used; what does not matter stays 0.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub setup: usize,
    pub station: usize,
    /// A sensor, or whatever else is counted there.
    pub item: usize,
}

pub(super) fn stream(seed: u64, purpose: Purpose, place: Place) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let Place { setup, station, item } = place;
    random.set_stream((purpose as u64) << 56 | (setup as u64) << 44 | (item as u64) << 32 | station as u64);
    random
}

/// A point of the unit circle, every angle as likely.
pub(super) fn phase(random: &mut ChaCha8Rng) -> Complex64 {
    Complex64::cis(random.random_range(0.0..TAU))
}
