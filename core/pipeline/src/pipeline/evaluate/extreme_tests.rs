//! How often intervals of roundness hold the truth of forms whose extremes are unlike those of waves at random: a scratch, and lobes that are
//! alike. Profiles share no formula with the evaluation.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{
    collections::BTreeMap,
    f64::consts::{PI, TAU},
};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    likely_tests::{ANGLES, HIGHEST, Waves, harmonics, profile, truth},
    section_values,
    tests::{RADIUS_MM, evaluate, station},
};

/// Of a value: truths below the interval, above it, profiles, sum of half widths, and sum of squares of its error.
#[derive(Debug, Default, Clone, Copy)]
struct Held {
    below: u32,
    above: u32,
    profiles: u32,
    half_um: f64,
    squares: f64,
}

impl Held {
    fn inside(&self) -> u32 {
        self.profiles - self.below - self.above
    }
}

/// Of each value by "symbol reference", behind no filter, of so many profiles with white noise of this standard deviation at an angle, of which
/// the average keeps the orders to [`HIGHEST`]. Its variance is known from so many turns; exactly from 0.
fn held(
    form: impl Fn(&mut ChaCha8Rng) -> Waves,
    noise_um: f64,
    turns: usize,
    profiles: u64,
) -> BTreeMap<&'static str, Held> {
    let evaluate =
        evaluate("values = ['roundness']\nreferences = ['LSCI', 'MZCI', 'MICI', 'MCCI']\nfilter_upr = []").unwrap();
    let mut held = BTreeMap::new();
    for number in 0..profiles {
        let mut random = ChaCha8Rng::seed_from_u64(47_000 + number);
        let waves = form(&mut random);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let measured: Vec<f64> = profile(&waves, ANGLES).iter().map(|value| value + noise_um * normal()).collect();
        let variance = 4.0 * noise_um * noise_um / ANGLES as f64;
        let mut result = station(0.0, &harmonics(&measured), HIGHEST, variance, &[]);
        if turns > 0 {
            let squares = 2 * 5 * (turns - 1);
            result.separation.freedom = 2 * (turns - 1);
            for five in (2..=HIGHEST).collect::<Vec<_>>().chunks(5) {
                let chance = (0..squares).map(|_| normal().powi(2)).sum::<f64>() / squares as f64;
                five.iter().for_each(|order| result.separation.variance[*order] *= chance);
            }
        }
        result.station = format!("profile {number}");
        let found = section_values(&result, 0, &evaluate, RADIUS_MM);
        for (name, truth) in truth(&waves, &mut random) {
            let same = found.iter().find(|value| format!("{} {}", value.symbol, value.reference) == name).unwrap();
            let Some(known) = &same.uncertainty else { continue };
            let [low, high] = known.interval_95;
            let Held { below, above, profiles, half_um, squares } = held.entry(name).or_insert_with(Held::default);
            // Of a circle about another centre, form²/radius.
            let exact = 2e-4;
            *below += u32::from(truth < low - exact);
            *above += u32::from(truth > high + exact);
            *profiles += 1;
            *half_um += 0.5 * (high - low);
            *squares += (same.value - truth).powi(2);
        }
    }
    held
}

/// A scratch of 2 µm, and waves whose amplitudes fall as 1/n.
fn scratch(random: &mut ChaCha8Rng, width_deg: f64) -> Waves {
    let mut waves: Waves = (2..=30).map(|n| (n, 0.9 / n as f64, TAU * random.random::<f64>())).collect();
    let (width, place) = (width_deg.to_radians(), TAU * random.random::<f64>());
    for n in 2..=HIGHEST {
        // Of a Gaussian curve of this standard deviation.
        let amplitude = 2.0 * 2.0 * width / (2.0 * PI).sqrt() * (-0.5 * (n as f64 * width).powi(2)).exp();
        waves.push((n, -amplitude, -(n as f64) * place));
    }
    waves
}

fn lobes(random: &mut ChaCha8Rng, order: usize) -> Waves {
    vec![(order, random.random_range(0.8..2.0), TAU * random.random::<f64>())]
}

#[test]
#[ignore = "prints a table"]
fn extremes_table() {
    let print = |case: &str, all: BTreeMap<&'static str, Held>| {
        for (name, held) in all.into_iter().filter(|(name, _)| !name.contains("MICI") && !name.contains("RONq")) {
            let n = f64::from(held.profiles);
            println!(
                "{case:24} {name:14} {:5.1} % of {} (below {} above {}), half {:.4}, {:.2} of 1.96 rms",
                100.0 * f64::from(held.inside()) / n,
                held.profiles,
                held.below,
                held.above,
                held.half_um / n,
                held.half_um / n / (1.96 * (held.squares / n).sqrt())
            );
        }
    };
    const N: u64 = 100;
    for noise_um in [0.05, 0.008] {
        print(&format!("scratch {noise_um}"), held(|random| scratch(random, 2.0), noise_um, 40, N));
    }
    for noise_um in [0.2, 0.015] {
        print(&format!("lobes15 {noise_um}"), held(|random| lobes(random, 15), noise_um, 40, N));
    }
    for noise_um in [0.05, 0.004] {
        print(&format!("lobes2 {noise_um}"), held(|random| lobes(random, 2), noise_um, 40, N));
    }
    let falling = |random: &mut ChaCha8Rng| -> Waves {
        (2..=HIGHEST).map(|n| (n, 2.0 * (n as f64).powf(-1.2), TAU * random.random::<f64>())).collect()
    };
    for noise_um in [0.1, 0.02, 0.003] {
        print(&format!("falling {noise_um}"), held(falling, noise_um, 40, N));
    }
}
