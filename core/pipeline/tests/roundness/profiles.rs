//! Random profiles of many kinds.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::standards::roundness::{Angles, Points};

pub(crate) struct Profile {
    pub kind: &'static str,
    pub angles: Vec<f64>,
    pub form_um: Vec<f64>,
    pub radius_mm: f64,
}

impl Profile {
    /// Coordinates and index of the points that are there, in µm.
    pub(crate) fn places(&self) -> Vec<(usize, [f64; 2])> {
        let points = self.form_um.iter().zip(&self.angles).enumerate().filter(|(_, (form, _))| form.is_finite());
        let radius = 1e3 * self.radius_mm;
        points
            .map(|(index, (form, angle))| (index, [(radius + form) * angle.cos(), (radius + form) * angle.sin()]))
            .collect()
    }

    pub(crate) fn points(&self) -> Points {
        let mut points = Points::default();
        points.set_profile(&self.angles.iter().copied().collect::<Angles>(), &self.form_um, self.radius_mm);
        points
    }
}

/// Profile `seed` with a number of points from `sizes`.
pub(crate) fn profile(seed: u64, sizes: std::ops::RangeInclusive<usize>) -> Profile {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let count = rng.random_range(sizes);
    let radius_mm = 10_f64.powf(rng.random_range(-0.5..2.5));
    let angles: Vec<f64> = (0..count).map(|index| TAU * index as f64 / count as f64).collect();
    let size = 10_f64.powf(rng.random_range(-2.0..1.5));
    let mut unit = || rng.random_range(-1.0..1.0);
    let smooth: Vec<[f64; 2]> = (0..8).map(|_| [unit(), 3.2 * unit()]).collect();
    let noise: Vec<f64> = (0..count).map(|_| unit()).collect();
    let [x, y, lobes] = [unit(), unit(), unit()];
    let harmonics = |angle: f64| {
        let terms = smooth.iter().zip(2..);
        terms.map(|([a, phase], order)| a / f64::from(order) * (f64::from(order) * angle + phase).cos()).sum::<f64>()
    };
    let (kind, shape): (_, Box<dyn Fn(usize) -> f64>) = match seed % 8 {
        0 => ("smooth", Box::new(|i| harmonics(angles[i]))),
        1 => ("noise", Box::new(|i| noise[i])),
        2 => ("smooth and noise, off centre", {
            Box::new(|i| harmonics(angles[i]) + 0.05 * noise[i] + 5.0 * (x * angles[i].cos() + y * angles[i].sin()))
        }),
        3 => ("equal lobes", {
            let order = (3.0 + (lobes + 1.0) * 5.0).floor();
            Box::new(move |i| (order * TAU * i as f64 / count as f64).cos())
        }),
        4 => ("spikes", Box::new(|i| if noise[i] > 0.95 { 10.0 * noise[i] } else { 0.01 * noise[i] })),
        5 => ("steps of a digital gauge", Box::new(|i| (4.0 * harmonics(angles[i])).round() / 4.0)),
        6 => ("keyway", {
            let last = (0.15 * (lobes + 1.0) * count as f64) as usize;
            let (noise, angles, harmonics) = (&noise, &angles, &harmonics);
            Box::new(move |i| if i < last { f64::NAN } else { noise[i] * 0.1 + harmonics(angles[i]) })
        }),
        _ => ("two lobes", Box::new(|i| (2.0 * angles[i]).cos() + 0.02 * x * noise[i])),
    };
    let form_um = (0..count).map(|i| size * shape(i)).collect();
    drop(shape);
    Profile { kind, angles, form_um, radius_mm }
}
