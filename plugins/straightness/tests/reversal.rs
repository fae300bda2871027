//! Part and slide distinguished on made-up traces.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use runout_core::{
    points::{Column, Points, Trace},
    stage::{Evaluable, PointSeparator},
    standards::straightness::Straightness as Values,
};
use runout_straightness::{AxialReversal, AxialReversalConfig, Straightness};

use crate::trials::{fewest, trials};

fn config(step_mm: Option<f64>) -> AxialReversalConfig {
    AxialReversalConfig { step_mm, ..AxialReversalConfig::default() }
}

fn separator(step_mm: Option<f64>) -> AxialReversal {
    config(step_mm).separator().unwrap()
}

/// A file of traces: name, setup, (z, reading).
#[derive(Clone)]
struct File(Vec<Measured>);

/// Name, setup, position and reading.
type Measured = (String, &'static str, Vec<(f64, f64)>);

impl File {
    fn points(&self) -> Points {
        let rows = || self.0.iter().flat_map(|(_, _, rows)| rows);
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        let mut start = 0;
        let traces = self.0.iter().map(|(id, setup, rows)| {
            let points = start..start + rows.len();
            start = points.end;
            Trace { id: id.clone(), kind: (*setup).into(), points }
        });
        Points {
            input: "made.csv".into(),
            traces: traces.collect(),
            columns: vec![
                column("z_mm", rows().map(|row| row.0).collect()),
                column("reading_um", rows().map(|row| row.1).collect()),
            ],
            ..Points::default()
        }
    }

    fn separate(&self, step_mm: Option<f64>) -> Straightness {
        separator(step_mm).separated(&self.points()).unwrap()
    }

    fn refused(&self, step_mm: Option<f64>) -> (String, String) {
        let error = separator(step_mm).separated(&self.points()).unwrap_err();
        (error.to_string(), error.advice().unwrap_or_default().to_owned())
    }
}

fn part(z: f64) -> f64 {
    1.5 * (TAU * z / 90.0).cos() + 0.3 * (TAU * z / 20.0).sin()
}

fn slide(z: f64) -> f64 {
    0.8 * (TAU * z / 70.0).sin() + 0.2 * (TAU * z / 25.0).cos()
}

/// A trace without noise, with an offset in µm and a slope in µm/mm.
fn trace(
    id: &str,
    setup: &'static str,
    z: &[f64],
    [offset, slope]: [f64; 2],
) -> (String, &'static str, Vec<(f64, f64)>) {
    let sign = if setup == "initial" { 1.0 } else { -1.0 };
    (id.into(), setup, z.iter().map(|z| (*z, part(*z) + sign * slide(*z) + offset + slope * z)).collect())
}

fn even(first: f64, step: f64, count: usize) -> Vec<f64> {
    (0..count).map(|index| first + step * index as f64).collect()
}

/// The residual of a profile about its least-squares line, by the normal equations in z itself.
fn without_line(z: &[f64], profile: impl Fn(f64) -> f64) -> Vec<f64> {
    let sum = |of: &dyn Fn(f64) -> f64| z.iter().map(|z| of(*z)).sum::<f64>();
    let (n, sz, szz) = (z.len() as f64, sum(&|z| z), sum(&|z| z * z));
    let (sy, szy) = (sum(&profile), sum(&|z| z * profile(z)));
    let determinant = n * szz - sz * sz;
    let (offset, slope) = ((szz * sy - sz * szy) / determinant, (n * szy - sz * sy) / determinant);
    z.iter().map(|z| profile(*z) - offset - slope * z).collect()
}

/// Largest errors of part and slide.
fn errors(found: &Straightness) -> [f64; 2] {
    let largest = |found: &[f64], truth: Vec<f64>| {
        found.iter().zip(truth).map(|(found, truth)| (found - truth).abs()).fold(0.0, f64::max)
    };
    let z = &found.z_mm;
    [largest(&found.part_um, without_line(z, part)), largest(&found.slide_um, without_line(z, slide))]
}

#[test]
fn exact_on_common_positions_whatever_the_offsets_and_slopes() {
    let uneven: Vec<f64> = (0..120).map(|index| f64::from(index) + 0.4 * f64::from(index * index % 7) / 7.0).collect();
    for z in [even(-30.0, 0.5, 241), uneven] {
        for (number, lines) in [[[0.0, 0.0], [0.0, 0.0]], [[1000.0, -2.0], [-300.0, 5.0]], [[3.0, 0.01], [1e4, 10.0]]]
            .into_iter()
            .enumerate()
        {
            let file = File(vec![trace("1", "initial", &z, lines[0]), trace("2", "reversed", &z, lines[1])]);
            let found = file.separate(None);
            assert_eq!(found.z_mm, z, "the traces' own positions");
            // 1e-10 µm: readings of up to 1e4 µm are rounded to 2e-12.
            assert!(errors(&found).iter().all(|error| *error < 1e-10), "{number}: {:?}", errors(&found));
            assert!(found.part_std_um.iter().chain(&found.slide_std_um).all(|std| std.is_nan()));
            assert!(found.repeatability_um.is_nan() && found.degrees_of_freedom == 0);
            assert!(found.warnings.iter().any(|warning| warning.starts_with("one trace in each setup")));
        }
    }
}

#[test]
fn other_samplings_cost_what_the_interpolation_does() {
    let first = even(0.3, 1.9, 60);
    let second: Vec<f64> = (0..70).map(|index| 1.6 * f64::from(index) + 0.1 * f64::from(index % 3)).collect();
    let file = File(vec![trace("1", "initial", &first, [40.0, 0.3]), trace("2", "reversed", &second, [-7.0, -0.2])]);
    // At the ends, where the cubic stands aside, (1/24)·(2πh/λ)⁴ of a wave's amplitude; 1.9 mm is the widest spacing.
    // Each quantity has half of the sum of the four waves' losses in both traces.
    let waves: [(f64, f64); 4] = [(1.5, 90.0), (0.3, 20.0), (0.8, 70.0), (0.2, 25.0)];
    let bound: f64 = waves.iter().map(|(amplitude, length)| amplitude * (TAU * 1.9 / length).powi(4) / 24.0).sum();
    for step in [None, Some(1.0), Some(3.7)] {
        let found = file.separate(step);
        println!("step {step:?}: errors {:?} µm, bound {bound} µm", errors(&found));
        assert!(errors(&found).iter().all(|error| *error < bound), "{:?}, bound {bound}", errors(&found));
        assert!(found.warnings.iter().any(|warning| warning.contains("interpolated")), "{:?}", found.warnings);
    }
    let ends = file.separate(None).z_mm;
    // 1e-9 mm: rounding. Both traces end beyond 0.3 + 59·1.9 mm or before it: 69·1.6 = 110.4 mm.
    assert!((ends[0] - 0.3).abs() < 1e-9 && (ends[ends.len() - 1] - 110.4).abs() < 1e-9, "{ends:?}");
    let stepped = file.separate(Some(2.0));
    assert!(stepped.warnings.iter().any(|warning| warning.contains("2 mm apart; the last 0.1 mm")));
    assert!(file.separate(Some(0.5)).warnings.iter().any(|warning| warning.contains("closer than the traces' own")));
}

/// Two-sided 95 % quantiles of Student's t (tables) by the repeats of both setups.
#[test]
fn the_stated_uncertainty_covers_the_truth() {
    let z = even(0.0, 5.0, 25);
    let noise = Normal::new(0.0, 0.1).unwrap();
    for (repeats, quantile) in [([3, 3], 2.776), ([5, 2], 2.571), ([2, 1], 12.706)] {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let (mut held, mut positions, mut variance) = ([0, 0], 0, 0.0);
        let campaigns = trials(600);
        // Of a third of the campaigns the root of three.
        let wider = f64::sqrt(600.0 / campaigns as f64);
        for _ in 0..campaigns {
            let mut traces = Vec::new();
            for (setup, count) in ["initial", "reversed"].into_iter().zip(repeats) {
                for repeat in 0..count {
                    let line = [f64::from(repeat) * 10.0, 0.1 * f64::from(repeat)];
                    let mut one = trace(&format!("{setup}{repeat}"), setup, &z, line);
                    one.2.iter_mut().for_each(|row| row.1 += noise.sample(&mut random));
                    traces.push(one);
                }
            }
            let found = File(traces).separate(None);
            let (part, slide) = (without_line(&z, part), without_line(&z, slide));
            for at in 0..z.len() {
                held[0] += usize::from((found.part_um[at] - part[at]).abs() <= quantile * found.part_std_um[at]);
                held[1] += usize::from((found.slide_um[at] - slide[at]).abs() <= quantile * found.slide_std_um[at]);
            }
            positions += z.len();
            variance += found.repeatability_um.powi(2) / campaigns as f64;
        }
        let shares = held.map(|held| held as f64 / positions as f64);
        println!(
            "{repeats:?}: 95 % intervals hold {shares:.4?} of {positions}; one trace repeats to {:.4} µm",
            variance.sqrt()
        );
        // 15 000 positions, little correlated: 0.0018 standard deviation of the share; 0.0075 is four of them.
        assert!(shares.iter().all(|share| (share - 0.95).abs() < 0.0075 * wider), "{repeats:?}: {shares:?}");
        // The line of each trace takes 2 of 25 degrees of freedom: 0.1·√(23/25); 2.5 % is four standard deviations where
        // there are fewest degrees of freedom, 600·23.
        assert!(
            (variance.sqrt() / (0.1 * (23.0_f64 / 25.0).sqrt()) - 1.0).abs() < 0.025 * wider,
            "{}",
            variance.sqrt()
        );
    }
}

/// The errors that the domain offers with both profiles are those that the profiles have: of straightness values, at little and at much
/// noise, from four degrees of freedom a position.
#[test]
fn intervals_of_the_standards_values_cover_the_true_value() {
    let z = even(0.0, 1.0, 121);
    let look = |deviation_um: &[f64], values: &mut Vec<f64>| {
        let found = Values::of(&z, deviation_um);
        values.extend([found.strt_lsli_um, found.strt_mzli_um, found.strq_um]);
    };
    for noise_um in [0.004, 0.04] {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let noise = Normal::new(0.0, noise_um).unwrap();
        let (mut held, campaigns) = ([[0; 3]; 2], trials(100));
        for campaign in 0..campaigns as u64 {
            let mut traces = Vec::new();
            for (setup, repeat) in
                ["initial", "reversed"].into_iter().flat_map(|setup| (0..3).map(move |one| (setup, one)))
            {
                let line = [f64::from(repeat) * 10.0, 0.1 * f64::from(repeat)];
                let mut one = trace(&format!("{setup}{repeat}"), setup, &z, line);
                one.2.iter_mut().for_each(|row| row.1 += noise.sample(&mut random));
                traces.push(one);
            }
            let outcome = separator(None).separate(&File(traces).points()).unwrap();
            for (evaluable, (held, truth)) in outcome.evaluables.iter().zip(held.iter_mut().zip([part, slide])) {
                let Evaluable::OpenProfile(profile) = evaluable else { panic!("{evaluable:?}") };
                let errors = profile.errors.as_ref().unwrap();
                let known = errors.values(&profile.deviation_um, campaign, look).unwrap();
                let mut truths = Vec::new();
                look(&without_line(&z, truth), &mut truths);
                for ((held, known), truth) in held.iter_mut().zip(known).zip(truths) {
                    let [low, high] = known.uncertainty.unwrap().interval_95;
                    *held += usize::from(low <= truth && truth <= high);
                }
            }
        }
        println!(
            "{noise_um} µm: STRt LSLI, STRt MZLI, STRq of part and slide hold the truth in {held:?} of {campaigns}"
        );
        // 95 % of 100 are 95 ± 2.2; four of those below it.
        let least = fewest(campaigns, [86, 100], 0.95);
        assert!(held.iter().flatten().all(|held| *held >= least), "{noise_um}: {held:?}");
    }
}

/// Readings in mm, of a probe that repeats to 0.05 µm, look like those of one that repeats to 0.05 nm.
#[test]
fn readings_in_millimetres_are_named() {
    let z = even(0.0, 1.0, 121);
    let noise = Normal::new(0.0, 0.05).unwrap();
    for (unit, is_named) in [(1.0, false), (1e-3, true)] {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let traces = ["initial", "initial", "reversed", "reversed"].iter().enumerate().map(|(number, setup)| {
            let mut one = trace(&number.to_string(), setup, &z, [0.0, 0.0]);
            one.2.iter_mut().for_each(|row| row.1 = unit * (row.1 + noise.sample(&mut random)));
            one
        });
        let warnings = File(traces.collect()).separate(None).warnings;
        assert_eq!(warnings.iter().any(|warning| warning.contains("may be in mm")), is_named, "{warnings:?}");
    }
}

#[test]
fn without_repeats_the_profiles_say_why_they_have_no_errors() {
    let z = even(0.0, 1.0, 60);
    let file = File(vec![trace("1", "initial", &z, [0.0, 0.0]), trace("2", "reversed", &z, [0.0, 0.0])]);
    let outcome = separator(None).separate(&file.points()).unwrap();
    let names: Vec<&str> = outcome
        .evaluables
        .iter()
        .map(|one| match one {
            Evaluable::OpenProfile(profile) => {
                assert!(profile.errors.as_ref().unwrap_err().contains("one trace in each setup"));
                profile.of.as_str()
            }
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(names, ["part", "slide"]);
}

#[test]
fn a_single_trace_is_taken_to_scatter_like_the_others() {
    let z = even(0.0, 1.0, 51);
    let mut ones = vec![trace("a", "initial", &z, [0.0, 0.0]), trace("b", "initial", &z, [5.0, 1.0])];
    for (at, row) in ones[1].2.iter_mut().enumerate() {
        row.1 += if at % 2 == 0 { 0.2 } else { 0.0 };
    }
    ones.push(trace("c", "reversed", &z, [0.0, 0.0]));
    let found = File(ones).separate(None);
    // Without its mean, ±0.1 µm in one of two traces: s² = 2·0.05², and s²(1/2 + 1)/4. An odd number of positions has
    // no slope of an alternating sign, and a mean of 1/51 of it.
    let expected = (0.005_f64 * 1.5 / 4.0).sqrt();
    assert!(found.part_std_um.iter().all(|std| (std / expected - 1.0).abs() < 1.01 / 51.0), "{:?}", found.part_std_um);
    assert_eq!(found.degrees_of_freedom, 1);
    let said = "the one trace of reversed is taken to scatter like those of initial";
    assert!(found.warnings.iter().any(|warning| warning.contains(said)), "{:?}", found.warnings);
}

#[test]
fn only_what_all_traces_cover_is_separated_and_the_rest_is_said() {
    let long = even(0.0, 0.5, 201);
    let late = even(12.0, 0.5, 201);
    let mut back = trace("back", "initial", &long, [9.0, 0.1]);
    back.2.reverse();
    let file = File(vec![
        trace("there", "initial", &long, [3.0, -0.2]),
        back,
        trace("late", "reversed", &late, [1.0, 0.4]),
        trace("odd", "tilted", &long, [0.0, 0.0]),
    ]);
    let found = file.separate(None);
    assert_eq!((found.z_mm[0], found.z_mm[found.z_mm.len() - 1], found.z_mm.len()), (12.0, 100.0, 177));
    // 1e-10: rounding; every position is one of each trace's own.
    assert!(errors(&found).iter().all(|error| *error < 1e-10), "{:?}", errors(&found));
    assert!(found.part_std_um.iter().all(|std| *std < 1e-10), "a trace measured backwards is the same trace");
    let said = |words: &str| found.warnings.iter().any(|warning| warning.contains(words));
    assert!(said("z = 12 to 100 mm; points beyond it left out: there 24 of 201, back 24 of 201, late 24 of 201"));
    assert!(said("traces of other setups are left out: odd (tilted)"));
    assert!(!said("interpolated"), "{:?}", found.warnings);
}

#[test]
fn a_gap_is_said() {
    let z = even(0.0, 1.0, 80);
    let holed: Vec<f64> = z.iter().copied().filter(|z| !(30.0..40.0).contains(z)).collect();
    let file = File(vec![trace("1", "initial", &z, [0.0, 0.0]), trace("2", "reversed", &holed, [0.0, 0.0])]);
    let warnings = file.separate(None).warnings;
    let said = "trace 2 has no points from 29 to 40 mm";
    assert!(warnings.iter().any(|warning| warning.contains(said)), "{warnings:?}");
}

/// A taper of the part, or a slide at an angle to it, is a slope like any other.
#[test]
fn taper_and_parallelism_are_not_observable() {
    let z = even(0.0, 1.0, 101);
    let straight = File(vec![trace("1", "initial", &z, [0.0, 0.0]), trace("2", "reversed", &z, [0.0, 0.0])]);
    let mut tapered = straight.clone();
    for (_, setup, rows) in &mut tapered.0 {
        let angle = if *setup == "initial" { 0.02 } else { -0.02 };
        for row in rows.iter_mut() {
            row.1 += (0.05 + angle) * row.0;
        }
    }
    let (straight, tapered) = (straight.separate(None), tapered.separate(None));
    let differ = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // 1e-13: rounding of readings near 7 µm.
    assert!(differ(&straight.part_um, &tapered.part_um) < 1e-13);
    assert!(differ(&straight.slide_um, &tapered.slide_um) < 1e-13);
}

#[test]
fn traces_that_cannot_be_separated_are_refused() {
    let z = even(0.0, 1.0, 50);
    let initial = || trace("1", "initial", &z, [0.0, 0.0]);
    let beside = |other: Vec<f64>| File(vec![initial(), trace("2", "reversed", &other, [0.0, 0.0])]);
    let cases = [
        (File(vec![initial()]), "made.csv has no trace of setup `reversed`", "known: `initial`"),
        (
            File(vec![initial(), trace("2", "reversd", &z, [0.0, 0.0])]),
            "no trace of setup `reversed`",
            "did you mean `reversd`",
        ),
        (beside(vec![0.0, 1.0, 3.0, 2.0, 4.0]), "trace 2 of made.csv: z goes back between 2 and 3 mm", "sort its rows"),
        (beside(vec![0.0, 1.0, 1.0, 2.0, 4.0]), "trace 2 of made.csv: z = 1 mm is there twice", "rise or fall"),
        (beside(vec![0.0, 1.0, f64::NAN, 2.0, 4.0]), "trace 2 of made.csv: z goes back", "rise or fall"),
        (beside(vec![0.0, 1.0, 2.0]), "it has 3 points; 4 are needed", "more points"),
        (beside(even(60.0, 1.0, 9)), "trace 2 begins at 60 mm, where 1 has ended (49 mm)", "share a range"),
        (
            beside(even(48.0, 1.0, 9)),
            "all traces share z = 48 to 49 mm: 2 positions, and 3 are needed",
            "longer common range",
        ),
    ];
    for (file, expected, help) in cases {
        let (message, advice) = file.refused(None);
        assert!(message.contains(expected) && advice.contains(help), "{message}\n{advice}");
    }
    let (message, advice) = beside(even(0.5, 1.0, 40)).refused(Some(1e-9));
    assert!(message.contains("a step of 0.000000001 mm makes") && advice.contains("larger `step_mm`"), "{message}");
    assert!(beside(even(0.5, 1.0, 40)).refused(Some(30.0)).1.contains("smaller `step_mm`"));
    let mut points = beside(z.clone()).points();
    points.columns[1].name = "deviation_um".into();
    assert!(separator(None).separated(&points).unwrap_err().to_string().contains("reading_um"));
}

#[test]
fn a_configuration_that_cannot_be_is_refused() {
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(config(Some(step)).separator().unwrap_err().to_string().contains("must be above 0 mm"));
    }
    let same = AxialReversalConfig { reversed: "initial".into(), ..config(None) };
    assert!(same.separator().unwrap_err().to_string().contains("both setups are named `initial`"));
}
