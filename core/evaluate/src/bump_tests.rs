//! How often intervals of a mean deviation cover the true value of a bump that noise hides order by order, by a profile that shares no formula with
//! the evaluation: heights at angles, white noise at each, harmonics by sums over all angles.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::f64::consts::{PI, TAU};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    likely_tests::{ANGLES, DENSE, HIGHEST, harmonics},
    section_values,
    tests::{RADIUS_MM, evaluate, station},
};
use runout_numerics::Complex64;

/// Three lobes and a bump of 1 µm, of which the width is a share of the turn.
fn profile(lobes_um: f64, width: f64) -> impl Fn(usize) -> f64 {
    move |angle| {
        let turns = angle as f64 / ANGLES as f64;
        let aside = (turns - 0.31) / width;
        let bump = if aside.abs() < 0.5 { (PI * aside).cos().powi(2) } else { 0.0 };
        bump + lobes_um * (3.0 * TAU * turns).cos()
    }
}

/// The mean of |z| of the sum of waves.
fn mean_deviation(waves: &[(usize, Complex64)]) -> f64 {
    let height = |turn: usize| -> f64 {
        let turns = |order: usize| ((order * turn) % DENSE) as f64 / DENSE as f64;
        waves.iter().map(|(order, wave)| (wave * Complex64::cis(TAU * turns(*order))).re).sum()
    };
    (0..DENSE).map(|turn| height(turn).abs()).sum::<f64>() / DENSE as f64
}

#[test]
fn intervals_of_ra_cover_the_true_value_beside_a_bump_that_noise_hides() {
    let evaluate = evaluate("values = ['texture']").unwrap();
    for (lobes_um, width, noise_um) in
        [(0.0, 0.02, 0.02), (0.1, 0.05, 0.02), (0.2, 0.01, 0.05), (0.5, 0.05, 0.1), (2.0, 0.02, 0.05)]
    {
        let at = profile(lobes_um, width);
        let truth = mean_deviation(&harmonics(&(0..ANGLES).map(&at).collect::<Vec<f64>>()));
        let mut random = ChaCha8Rng::seed_from_u64(61);
        let (mut held, mut stated, mut reach) = (0, 0_u32, 0.0);
        for number in 0..60 {
            let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
            let found = harmonics(&(0..ANGLES).map(|angle| at(angle) + noise_um * noise()).collect::<Vec<f64>>());
            let mut result = station(0.0, &found, HIGHEST, 4.0 * noise_um * noise_um / ANGLES as f64, &[]);
            result.station = format!("bump {number}");
            let values = section_values(&result, 0, &evaluate, RADIUS_MM);
            let ra = values.iter().find(|value| value.symbol == "Ra").unwrap();
            let Some(known) = &ra.uncertainty else { continue };
            stated += 1;
            let [low, high] = known.interval_95;
            held += u32::from(low <= truth && truth <= high);
            reach += (high - low) / truth;
        }
        let width_percent = 100.0 * reach / f64::from(stated.max(1));
        println!(
            "lobes {lobes_um} µm, width {width}, noise {noise_um} µm: {held} of {stated}, {width_percent:.0} % wide"
        );
        // 95 % of 60 are 57 ± 1.7, three of those below it. Where noise decides, nothing is stated.
        assert!(
            60 * held >= 52 * stated && (stated > 50 || lobes_um < 0.1),
            "{lobes_um} {width} {noise_um}: {held} of {stated}"
        );
    }
}
