//! How often stated intervals of roundness, texture and areal values cover the true value.
//!
//! Long because all of them simulate the same spectra.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; some print tables for the documentation")]

use std::f64::consts::{PI, SQRT_2, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    PartSummary, add_areal, add_generatrices, section_values,
    tests::{RADIUS_MM, evaluate, find, lobes, station},
};
use crate::{
    Value,
    trials::{fewest, trials},
};
use runout_numerics::Complex64;
use runout_turning::surface::{SurfaceBuilder, SurfaceConfig};

/// Highest order of the simulated averages.
const HIGHEST: usize = 250;

/// A form's spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Spectrum {
    /// Six waves of 0.05 to 2 µm between orders 2 and 100, nothing else.
    Lines,
    /// All orders, amplitudes 2 µm · n^−1.2, phases by chance.
    Power,
}

impl Spectrum {
    fn waves(self, seed: u64) -> Vec<(usize, Complex64)> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut wave =
            |order: usize, amplitude: f64| (order, Complex64::from_polar(amplitude, TAU * random.random::<f64>()));
        match self {
            Self::Lines => [(2, 1.0), (3, 2.0), (5, 0.7), (12, 0.3), (40, 0.1), (100, 0.05)]
                .map(|(order, amplitude)| wave(order, amplitude))
                .to_vec(),
            Self::Power => (2..=HIGHEST).map(|order| wave(order, 2.0 * (order as f64).powf(-1.2))).collect(),
        }
    }
}

/// Of each value: symbol, filter, trials that state an interval, and those of which it covers the true value.
struct Coverage(Vec<(String, String, usize, usize)>);

impl Coverage {
    fn of(truth: &[Value]) -> Self {
        Self(truth.iter().map(|value| (value.symbol.clone(), value.filter.clone().unwrap(), 0, 0)).collect())
    }

    fn add(&mut self, truth: &[Value], found: &[Value]) {
        for (symbol, filter, stated, inside) in &mut self.0 {
            let Some(truth) =
                truth.iter().find(|value| value.symbol == *symbol && value.filter.as_ref() == Some(&*filter))
            else {
                continue;
            };
            // Where the autocorrelation does not fall within the map, there is no Str.
            let same = |found: &&Value| found.symbol == *symbol && found.filter.as_ref() == Some(&*filter);
            let Some(found) = found.iter().find(same) else { continue };
            // A value either states an interval or says why not.
            assert_eq!(found.uncertainty.is_some(), found.no_uncertainty.is_none(), "{symbol}");
            if let Some(known) = &found.uncertainty {
                *stated += 1;
                *inside += usize::from(known.interval_95[0] <= truth.value && truth.value <= known.interval_95[1]);
            }
        }
    }

    fn share(&self, symbol: &str, filter: &str) -> (usize, f64) {
        let (_, _, stated, inside) = self.0.iter().find(|row| row.0 == symbol && row.1 == filter).unwrap();
        (*stated, *inside as f64 / *stated as f64)
    }
}

fn texture_intervals(spectrum: Spectrum, std_um: f64, trials: u64) -> Coverage {
    intervals("values = ['texture']\nlambda_c_mm = 8.0", spectrum, std_um, trials)
}

/// Of sections with errors of this standard deviation at an angle, evenly over the orders from 2.
fn intervals(text: &str, spectrum: Spectrum, std_um: f64, trials: u64) -> Coverage {
    let evaluate = evaluate(text).unwrap();
    let variance = 2.0 * std_um * std_um / (HIGHEST - 1) as f64;
    let mut coverage = None;
    for trial in 0..trials {
        // Another form each time: what holds on average over forms is what a user meets.
        let truth = spectrum.waves(trial);
        let exact = section_values(&station(0.0, &truth, HIGHEST, f64::NAN, &[]), 0, &evaluate, RADIUS_MM);
        let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + trial);
        let share = (0.5 * variance).sqrt();
        let mut normal = || -> f64 { share * Distribution::<f64>::sample(&StandardNormal, &mut random) };
        let mut waves: Vec<(usize, Complex64)> =
            (2..=HIGHEST).map(|order| (order, Complex64::new(normal(), normal()))).collect();
        for (order, value) in &truth {
            waves[order - 2].1 += value;
        }
        // The station's name seeds the draws: another one for each trial.
        let mut measured = station(0.0, &waves, HIGHEST, variance, &[]);
        measured.station = format!("s{trial}");
        let found = section_values(&measured, 0, &evaluate, RADIUS_MM);
        coverage.get_or_insert_with(|| Coverage::of(&exact)).add(&exact, &found);
    }
    coverage.unwrap()
}

#[test]
fn texture_intervals_cover_the_true_value() {
    let found = texture_intervals(Spectrum::Lines, 0.003, 60);
    for (symbol, filter) in [("Ra", "none"), ("Ra", "Gaussian λc 8 mm"), ("Rq", "Gaussian λc 8 mm")] {
        let (stated, share) = found.share(symbol, filter);
        // 95 % of 60 are 57 ± 1.7; four of those below it.
        assert!(stated >= 55 && share >= 0.83, "{symbol} {filter}: {share} of {stated}");
    }
    assert_eq!(found.share("Rsm", "Gaussian λc 8 mm").0, 0);
}

#[test]
#[ignore = "prints a table of docs/appendix/intervals.md, which takes minutes"]
fn roundness_intervals_of_two_spectra() {
    let text = "values = ['roundness']\nreferences = ['LSCI', 'MZCI', 'MICI', 'MCCI']";
    for (spectrum, std_um) in
        [Spectrum::Lines, Spectrum::Power].into_iter().flat_map(|s| [0.003, 0.02, 0.1].map(|std| (s, std)))
    {
        println!("{spectrum:?}, {std_um} µm");
        for (symbol, filter, stated, inside) in intervals(text, spectrum, std_um, 400).0 {
            println!("| {symbol} | {filter} | {:.1} % |", 100.0 * inside as f64 / stated as f64);
        }
    }
}

#[test]
#[ignore = "prints the table of docs/appendix/intervals.md, which takes minutes"]
fn texture_intervals_of_two_spectra() {
    for spectrum in [Spectrum::Lines, Spectrum::Power] {
        for std_um in [0.003, 0.02, 0.1] {
            println!("{spectrum:?}, {std_um} µm");
            for (symbol, filter, stated, inside) in texture_intervals(spectrum, std_um, 400).0 {
                println!("| {symbol} | {filter} | {stated} | {:.1} % |", 100.0 * inside as f64 / stated as f64);
            }
        }
    }
}

/// Orders up to 359 on 720 angles: 2.1 points of a wave of order 340 have neither its height nor its slope.
#[test]
fn texture_near_nyquist_has_its_closed_forms() {
    let evaluate = evaluate("values = ['texture']\nlambda_c_mm = 0.8").unwrap();
    let found = section_values(&station(0.0, &[lobes(340, 1.0)], 359, f64::NAN, &[]), 0, &evaluate, RADIUS_MM);
    let passed = 1.0 - (-(340.0 * 0.8 / (60.0 * PI)).powi(2)).exp2();
    let slope = passed * 340.0 / (1e3 * RADIUS_MM) / SQRT_2;
    // 16 angles a wave miss a crest by at most 2 %; the mean of |z| by less; differences over seven points lose 2e-5.
    for (symbol, expected, tolerance) in [
        ("Rz", 2.0 * passed, 0.02),
        ("Rt", 2.0 * passed, 0.02),
        ("Ra", 2.0 / PI * passed, 0.01),
        ("Rq", passed / SQRT_2, 1e-9),
        ("Rdq", slope, 1e-4),
        ("Rsm", 60.0 * PI / 340.0, 1e-3),
        ("Rc", 2.0 * passed, 0.02),
        ("RPc", 10.0 * 340.0 / (60.0 * PI), 1e-3),
    ] {
        let value = find(&found, symbol, "mean line", "Gaussian λc 0.8 mm").value;
        assert!((value / expected - 1.0).abs() < tolerance, "{symbol} {value} instead of {expected}");
    }
}

#[test]
fn primary_and_waviness_profiles_have_their_bands() {
    // A circumference of 188.5 mm: 3 waves of 63 mm, 40 of 4.7 mm, 300 of 0.63 mm, each of 1 µm.
    let waves = [lobes(3, 1.0), lobes(40, 1.0), lobes(300, 1.0)];
    let text = "values = ['texture']\nlambda_c_mm = 0.8\n\
                texture = { profiles = ['P', 'W', 'R'], lambda_f_mm = 8.0, heights_um = [0.0] }";
    let found = section_values(&station(0.0, &waves, 340, f64::NAN, &[]), 0, &evaluate(text).unwrap(), RADIUS_MM);
    let low = |order: f64, cutoff_mm: f64| (-(order * cutoff_mm / (60.0 * PI)).powi(2)).exp2();
    let of = |share: &dyn Fn(f64) -> f64| {
        (0.5 * [3.0, 40.0, 300.0].map(|order| share(order).powi(2)).iter().sum::<f64>()).sqrt()
    };
    let waviness = |order: f64| low(order, 0.8) * (1.0 - low(order, 8.0));
    for (symbol, filter, expected) in [
        ("Pq", "none", of(&|_| 1.0)),
        ("Wq", "Gaussian λc 0.8 mm, λf 8 mm", of(&waviness)),
        ("Rq", "Gaussian λc 0.8 mm", of(&|order| 1.0 - low(order, 0.8))),
    ] {
        let value = find(&found, symbol, "mean line", filter).value;
        assert!((value / expected - 1.0).abs() < 1e-9, "{symbol} {value} instead of {expected}");
    }
    // Of a wave that is as high as deep, half lies above the mean line; the other two move that by a little.
    let ratio = find(&found, "Wmr(c)", "0 µm above the mean line", "Gaussian λc 0.8 mm, λf 8 mm").value;
    assert!((ratio - 50.0).abs() < 1.0, "{ratio}");
}

/// Values of the surface through rings 5 mm apart (or `step_mm`), each with these waves and one variance.
fn of_surface(
    text: &str,
    rings: &[Vec<(usize, Complex64)>],
    angles: usize,
    step_mm: f64,
    variance: f64,
) -> PartSummary {
    let evaluate = evaluate(text).unwrap();
    let mut builder = SurfaceBuilder::new(&SurfaceConfig { angles, step_mm: None });
    let highest = rings.iter().flatten().map(|(order, _)| *order).max().unwrap();
    for (ring, waves) in rings.iter().enumerate() {
        builder.add(&station(step_mm * ring as f64, waves, highest, variance, &[]));
    }
    let (surface, uncertain) = builder.build(RADIUS_MM).unwrap();
    let mut part = PartSummary::default();
    add_generatrices(&mut part, &uncertain, RADIUS_MM, true, &evaluate);
    add_areal(&mut part, &surface, &uncertain, 2, &evaluate).unwrap();
    part
}

/// Orders of a surface's rings.
const RING_ORDERS: usize = 40;

/// Waves of a ring: three that turn and grow along the axis, or all orders by chance with amplitudes n^−1.2.
fn ring_waves(spectrum: Spectrum, ring: usize, rings: usize, seed: u64) -> Vec<(usize, Complex64)> {
    let grown = Complex64::from_polar(1.0 + ring as f64 / rings as f64, 0.6 * ring as f64 + seed as f64);
    let mut waves: Vec<(usize, Complex64)> = (2..=RING_ORDERS).map(|order| (order, Complex64::ZERO)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(1000 * seed + ring as u64);
    for (order, value) in &mut waves {
        *value = match spectrum {
            Spectrum::Lines => match order {
                4 => 0.4 * grown,
                7 => 0.5 * grown,
                11 => 0.3 * grown,
                _ => Complex64::ZERO,
            },
            Spectrum::Power => Complex64::from_polar((*order as f64).powf(-1.2), TAU * random.random::<f64>()),
        };
    }
    waves
}

/// Surfaces with errors of this standard deviation at every point.
fn areal_intervals(spectrum: Spectrum, std_um: f64, rings: usize, angles: usize, trials: u64) -> Coverage {
    let variance = 2.0 * std_um * std_um / (RING_ORDERS - 1) as f64;
    let mut coverage = None;
    for trial in 0..trials {
        let truth: Vec<_> = (0..rings).map(|ring| ring_waves(spectrum, ring, rings, trial)).collect();
        let exact = of_surface("values = ['areal']", &truth, angles, 5.0, f64::NAN).values;
        let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + trial);
        let share = (0.5 * variance).sqrt();
        let mut measured = truth;
        for (_, value) in measured.iter_mut().flatten() {
            let mut normal = || -> f64 { share * Distribution::<f64>::sample(&StandardNormal, &mut random) };
            *value += Complex64::new(normal(), normal());
        }
        let found = of_surface("values = ['areal']", &measured, angles, 5.0, variance).values;
        coverage.get_or_insert_with(|| Coverage::of(&exact)).add(&exact, &found);
    }
    coverage.unwrap()
}

#[test]
fn areal_intervals_cover_the_true_value() {
    let count = trials(60);
    let found = areal_intervals(Spectrum::Lines, 0.03, 8, 128, count as u64);
    for symbol in ["Sq", "Sa", "Sdq", "Sal"] {
        let (stated, share) = found.share(symbol, "none");
        // 95 % of 60 are 57 ± 1.7; four of those below it.
        let least = fewest(count, [50, 60], 0.95) as f64 / count as f64;
        assert!(60 * stated >= 55 * count && share >= least, "{symbol}: {share} of {stated}");
    }
    assert_eq!(found.share("Spd", "none").0, 0);
}

#[test]
#[ignore = "prints the table of docs/appendix/intervals.md, which takes minutes"]
fn areal_intervals_of_two_spectra() {
    for spectrum in [Spectrum::Lines, Spectrum::Power] {
        for std_um in [0.003, 0.03] {
            println!("{spectrum:?}, {std_um} µm");
            for (symbol, _, stated, inside) in areal_intervals(spectrum, std_um, 24, 180, 300).0 {
                println!("| {symbol} | {stated} | {:.1} % |", 100.0 * inside as f64 / stated as f64);
            }
        }
    }
}

#[test]
fn forms_and_filters_of_areal_values_are_by_choice() {
    // A barrel: 3 µm of curvature along the axis, 0.5 µm of order 3, no noise.
    let rings: Vec<Vec<(usize, Complex64)>> = (0..41)
        .map(|ring| {
            let z = f64::from(ring) / 20.0 - 1.0;
            vec![lobes(0, 3.0 * z * z + 2.0 * z), lobes(1, 4.0 * z), lobes(3, 0.5)]
        })
        .collect();
    let sq = |options: &str| {
        let text = format!("values = ['areal']\nareal = {{ {options} }}");
        let part = of_surface(&text, &rings, 64, 0.5, f64::NAN);
        let found = part.values.iter().find(|value| value.symbol == "Sq").unwrap();
        (found.value, found.reference.clone())
    };
    // Mean squares over 41 equal steps from −1 to 1: z² has S2, and 1.5 z² − 0.5 …; here the sums themselves.
    let mean = |of: &dyn Fn(f64) -> f64| (0..41).map(|ring| of(f64::from(ring) / 20.0 - 1.0)).sum::<f64>() / 41.0;
    let s2 = mean(&|z| z * z);
    let bulge = mean(&|z| (3.0 * (z * z - s2)).powi(2));
    let (taper, tilt, lobe) = (4.0 * s2, 8.0 * s2, 0.125);
    for (options, squares, reference) in [
        ("form = 'none'", bulge + taper + tilt + lobe, "mean"),
        ("form = 'plane'", bulge + tilt + lobe, "taper removed, mean"),
        ("form = 'cylinder'", bulge + taper + lobe, "LSCY removed, mean"),
        ("form = 'cone'", bulge + lobe, "least-squares cone removed, mean"),
        ("form = 'polynomial', degree = 2", lobe, "turned body of degree 2 removed, mean"),
    ] {
        let (found, referred) = sq(options);
        assert!((found - squares.sqrt()).abs() < 1e-9, "{options}: {found} instead of {}", squares.sqrt());
        assert_eq!(referred.as_deref(), Some(reference));
    }
    assert!(evaluate("areal = { degree = 2 }").is_err() && evaluate("areal = { ratios_percent = [101] }").is_err());
    // Heights of cos 3θ: a third of the surface is above half of the amplitude.
    let text = "values = ['areal']\n\
                areal = { form = 'polynomial', heights_um = [0.25], ratios_percent = [50] }";
    let part = of_surface(text, &rings, 720, 0.5, f64::NAN);
    let value = |symbol: &str| part.values.iter().find(|value| value.symbol == symbol).unwrap().value;
    assert!((value("Smr(c)") - 100.0 / 3.0).abs() < 0.5 && value("Smc(p)").abs() < 0.01);
    // The robust filter takes the wave that the plain one takes.
    let text = |filter: &str| format!("values = ['areal']\nlambda_c_mm = 4.0\nareal = {{ filter = '{filter}' }}");
    let robust = of_surface(&text("robust-gaussian"), &rings, 64, 0.5, 1e-6);
    let found = robust.values.iter().find(|value| value.symbol == "Sq").unwrap();
    assert_eq!(found.filter.as_deref(), Some("robust Gaussian λc 4 mm"));
    assert!(found.uncertainty.is_none() && found.no_uncertainty.as_ref().unwrap().contains("robust"));
}

/// With half of a cut-off left out at the ends, values are those of the middle of a long surface.
#[test]
fn ends_of_a_filtered_surface_are_left_out() {
    let ring = |z: f64| vec![lobes(0, (TAU * z / 11.0).sin()), lobes(1, 0.0), lobes(2, 0.1 * (TAU * z / 1.3).sin())];
    let text = "values = ['areal']\nlambda_c_mm = 4.0\nareal = { form = 'none' }";
    let rings = |from: usize, to: usize| (from..to).map(|ring_at| ring(0.1 * ring_at as f64)).collect::<Vec<_>>();
    let short = of_surface(text, &rings(300, 401), 32, 0.1, f64::NAN);
    assert!(short.remarks[0].contains("leave out 20 rings"), "{:?}", short.remarks);
    let sq = |part: &PartSummary| part.values.iter().find(|value| value.symbol == "Sq").unwrap().value;
    // By the closed form, over the rings that are left.
    let passed = |wavelength: f64| 1.0 - (-(4.0 / wavelength).powi(2)).exp2();
    let (mut sum, mut squares) = (0.0, 0.0);
    for ring in 320..381 {
        let z = 0.1 * f64::from(ring);
        let level = passed(11.0) * (TAU * z / 11.0).sin();
        sum += level / 61.0;
        // An order 2 of this size: its wavelength around is 94 mm.
        let lobe = 0.1 * passed(1.3) * (TAU * z / 1.3).sin();
        squares += (level * level + 0.5 * lobe * lobe) / 61.0;
    }
    let expected = (squares - sum * sum).sqrt();
    assert!((sq(&short) - expected).abs() < 0.01, "{} instead of {expected}", sq(&short));
    let shortest = of_surface(text, &rings(300, 361), 32, 0.1, f64::NAN);
    assert!(shortest.remarks[0].contains("keep the ends"), "{:?}", shortest.remarks);
}

/// A wave of 2.5 mm along the axis, the same all around; at 90° one of 1 µm more.
#[test]
fn generatrices_have_their_texture() {
    let rings: Vec<Vec<(usize, Complex64)>> = (0..401)
        .map(|ring| {
            let wave = (TAU * 0.1 * f64::from(ring) / 2.5).sin();
            vec![lobes(0, 2.0 * wave), lobes(1, 0.0), (2, Complex64::new(-wave, 0.0))]
        })
        .collect();
    let text = "values = ['texture']\nlambda_c_mm = 8.0\ntexture = { generatrices_deg = [45, 90] }";
    let part = of_surface(text, &rings, 64, 0.1, 1e-6);
    let passed = 1.0 - (-(8.0_f64 / 2.5).powi(2)).exp2();
    for (reference, amplitude) in [("generatrix at 45°", 2.0), ("generatrix at 90°", 3.0)] {
        let of = |symbol: &str| find(&part.values, symbol, reference, "Gaussian λc 8 mm");
        // Ends of half a cut-off are left out: 32 mm are 12.8 waves.
        for (symbol, expected) in [("Rq", amplitude * passed / SQRT_2), ("Rsm", 2.5), ("Rt", 2.0 * amplitude * passed)]
        {
            let value = of(symbol).value;
            assert!((value / expected - 1.0).abs() < 0.02, "{reference} {symbol}: {value} instead of {expected}");
        }
        let known = of("Rq").uncertainty.as_ref().unwrap();
        // One order's error of √½ · 1e-3 µm … over three orders, at 321 points: √(1e-6·1.5)/√321 · √2 ≈ 1e-4 µm.
        assert!(known.std > 2e-5 && known.std < 5e-4, "{known:?}");
        assert!(of("Rsm").no_uncertainty.is_some());
    }
}
