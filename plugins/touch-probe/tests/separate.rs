//! Simulated campaigns: recovered within the stated uncertainty, and what the setups lose.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::items_after_statements, reason = "tests")]

use crate::support;
use crate::support::{column, config, lobing, scenario, setups, table, value};
use crate::trials::trials;
use runout_core::stage::PointSeparator;

/// Pre-travel, lobes, mean and ranges over many campaigns: three quarters of them with uneven directions.
#[test]
fn intervals_cover_the_true_value_as_often_as_they_say() {
    let mut inside = [0_usize; 3];
    let mut all = [0_usize; 3];
    let campaigns = trials(200);
    for seed in 0..campaigns as u64 {
        let mut scenario = scenario(seed, &setups(&[(0.0, 0.0), (100.0, 0.0), (217.0, 0.0)]));
        scenario.repeats = 2;
        scenario.directions = 40;
        scenario.gap_deg = (seed % 4 > 0).then_some([100.0, 100.0 + 4.0 * (seed % 5) as f64]);
        let outcome = config(&scenario, 12, None).separate(&scenario.touched().points()).unwrap();
        let truth = lobing(&scenario);
        let table = table(&outcome, "pretravel");
        let [directions, found, std] =
            ["direction_deg", "pretravel_um", "std_pretravel_um"].map(|name| column(&table, name));
        for ((direction, found), std) in directions.iter().zip(found).zip(std) {
            all[0] += 1;
            inside[0] += usize::from((found - truth.at(direction.to_radians())).abs() < 1.96 * std);
        }
        for order in [3, 6] {
            let found = value(&outcome, &format!("lobe_{order}_amplitude"));
            all[1] += 1;
            let off = found.value - truth.amplitude(order);
            inside[1] += usize::from(off.abs() < 1.96 * found.std().unwrap());
        }
        let mean = value(&outcome, "pretravel_mean");
        all[2] += 1;
        inside[2] += usize::from((mean.value - truth.mean_um).abs() < 1.96 * mean.std().unwrap());
    }
    for ((inside, all), what) in inside.iter().zip(all).zip(["pre-travel", "amplitudes", "mean"]) {
        let share = 100.0 * *inside as f64 / all as f64;
        println!("{what}: {share:.1} % of {all} intervals");
        // Shares scatter with the root of the number of campaigns.
        let off = 2.0 * f64::sqrt(200.0 / campaigns as f64);
        assert!((95.0 - off..95.0 + off).contains(&share), "{what}: {share}");
    }
}

/// The probe of the paper's size, against the paper's own table: the mean of one pass by direction.
#[test]
fn the_range_after_compensation_beats_a_table() {
    let (mut before, mut after, mut by_table, mut numbers) = (0.0, 0.0, 0.0, 0);
    const SEEDS: u64 = 12;
    for seed in 0..SEEDS {
        let mut scenario = scenario(seed, &setups(&[(0.0, 0.0), (100.0, 0.0), (217.0, 0.0)]));
        scenario.repeats = 4;
        let touched = scenario.touched();
        let outcome = config(&scenario, 15, None).separate(&touched.points()).unwrap();
        before += value(&outcome, "range_before").value / SEEDS as f64;
        after += value(&outcome, "range_after_without_form").value / SEEDS as f64;
        let lobing = table(&outcome, "lobing");
        numbers += 2 * runout_core::table::RecordBatch::column_by_name(&lobing, "evident")
            .map(|flags| support::flags(flags).into_iter().filter(|flag| *flag).count())
            .unwrap();
        // The paper's table: what the first pass read in each direction, taken from the second pass; another setup of the ring.
        let pass = |setup: usize, repeat: usize| {
            let first = (setup * scenario.repeats + repeat) * scenario.directions;
            support::about_circle(&touched.place_mm[first..first + scenario.directions])
        };
        let (table, other) = (pass(0, 0), pass(0, 1));
        let left: Vec<f64> = other.iter().zip(&table).map(|(other, table)| other - table).collect();
        by_table += support::range(&left) / SEEDS as f64;
        if seed == 0 {
            println!("lobing {:.1} µm peak to valley", support::lobing(&scenario).range());
        }
    }
    println!(
        "before {before:.2} µm; after {after:.2} µm with {} numbers; by a table of 60 {by_table:.2} µm",
        numbers as f64 / SEEDS as f64
    );
    assert!((14.0..20.0).contains(&before));
    assert!(after < 0.6 * 8.1, "{after}");
}

/// Noise of correlation 0.7 beside noise of the same size that is not correlated: the mean is within its stated uncertainty in both.
#[test]
fn correlated_touches_are_remarked_and_widen() {
    let layout = setups(&[(0.0, 0.0), (100.0, 0.0), (217.0, 0.0)]);
    let (mut squares, mut warned) = ([0.0; 2], [0; 2]);
    const CAMPAIGNS: u64 = 12;
    for seed in 0..CAMPAIGNS {
        let mut scenario = scenario(seed, &layout);
        scenario.std_um = 0.0;
        scenario.repeats = 4;
        let exact = scenario.touched().points();
        let truth = lobing(&scenario).mean_um;
        for (kind, rho) in [0.0_f64, 0.7].into_iter().enumerate() {
            let mut points = exact.clone();
            let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
            let mut uniform = || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                (state >> 11) as f64 / (1_u64 << 53) as f64
            };
            let mut noise_um = 0.0;
            for radius in &mut points.columns.iter_mut().find(|column| column.name == "radius_mm").unwrap().values {
                let normal: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                noise_um = rho * noise_um + (1.0 - rho * rho).sqrt() * 0.9 * normal;
                *radius += 1e-3 * noise_um;
            }
            let outcome = config(&scenario, 15, None).separate(&points).unwrap();
            warned[kind] += usize::from(
                outcome.checks.iter().any(|check| check.finding.contains("depend on each other along time")),
            );
            let mean = outcome.values.iter().find(|value| value.symbol == "pretravel_mean").unwrap();
            squares[kind] += ((mean.value - truth) / mean.std().unwrap()).powi(2);
        }
    }
    let chi2 = squares.map(|sum| sum / CAMPAIGNS as f64);
    println!("{chi2:.2?} {warned:?}");
    assert_eq!(warned, [0, CAMPAIGNS as usize]);
    assert!(chi2.iter().all(|chi2| *chi2 < 2.5), "{chi2:?}");
}

/// Angles of ring and probe that count the other way are named; right ones are not.
#[test]
fn angles_that_are_declared_wrongly_are_named() {
    let angles = [(0.0, 0.0), (100.0, 0.0), (217.0, 35.0), (40.0, 150.0)];
    let mut scenario = scenario(3, &setups(&angles));
    // The noise of repeats says what is too much.
    scenario.repeats = 3;
    let points = scenario.touched().points();
    let said = |angles: &[(f64, f64)]| {
        let mut declared = scenario.clone();
        for (setup, (ring_deg, probe_deg)) in declared.setups.iter_mut().zip(angles) {
            (setup.ring_deg, setup.probe_deg) = (*ring_deg, *probe_deg);
        }
        let remarks = config(&declared, 12, None).separate(&points).unwrap().remarks;
        remarks.into_iter().filter(|remark| remark.starts_with("it looks as if")).collect::<Vec<_>>()
    };
    assert_eq!(said(&angles), Vec::<String>::new());
    for (what, change) in [
        ("`ring_deg` counts", (|(ring, probe)| (-ring, probe)) as fn((f64, f64)) -> (f64, f64)),
        ("`probe_deg` counts", |(ring, probe)| (ring, -probe)),
    ] {
        let said = said(&angles.map(change));
        println!("{what}: {said:?}");
        assert!(said.first().is_some_and(|first| first.contains(what)), "{what}: {said:?}");
    }
}

/// With symmetric seats, the travel repeats after 120°, and is largest and smallest towards a seat and away from it.
#[test]
fn three_seats_make_three_lobes() {
    let mut scenario = scenario(1, &setups(&[(0.0, 0.0)]));
    (scenario.probe.seats_deg, scenario.probe.preload_at_mm) = ([90.0, 210.0, 330.0], [0.0; 2]);
    let travel = |degrees: f64| scenario.pretravel_um(degrees.to_radians());
    for degrees in [0.0, 17.0, 90.0] {
        assert!((travel(degrees) - travel(degrees + 120.0)).abs() < 1e-6);
    }
    assert!((travel(90.0) - travel(150.0)).abs() > 5.0, "{} {}", travel(90.0), travel(150.0));
}
