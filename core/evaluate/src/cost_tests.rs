//! What each group of values costs.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "prints times")]

use std::{f64::consts::TAU, time::Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    PartSummary, add_areal, part_summary, section_values,
    tests::{RADIUS_MM, evaluate, station},
};
use runout_numerics::Complex64;
use runout_turning::{
    station::StationResult,
    surface::{Surface, SurfaceBuilder, SurfaceConfig, Uncertain},
};

const SECTIONS: usize = 400;
const ANGLES: usize = 2560;

/// 400 sections of 2560 angles: amplitudes n^−1.2 µm of orders n to `highest`, errors of 3 nm.
fn stations(highest: usize) -> Vec<StationResult> {
    let variance = 2.0 * 0.003_f64.powi(2) / highest as f64;
    let of_section = |section: usize| {
        let mut random = ChaCha8Rng::seed_from_u64(section as u64);
        let waves: Vec<_> = (2..=highest)
            .map(|order| (order, Complex64::from_polar((order as f64).powf(-1.2), TAU * random.random::<f64>())))
            .collect();
        let mut station = station(0.5 * section as f64, &waves, highest, variance, &[]);
        station.angles = ANGLES;
        station
    };
    (0..SECTIONS).map(of_section).collect()
}

fn builder(stations: &[StationResult]) -> SurfaceBuilder {
    let mut builder = SurfaceBuilder::new(&SurfaceConfig { angles: ANGLES, step_mm: None });
    for station in stations {
        builder.add(station);
    }
    builder
}

/// Times some work that gives so many values.
fn timed(name: &str, work: &mut dyn FnMut() -> usize) {
    let (start, before) = (Instant::now(), processor_s());
    let values = work();
    let (took, processor) = (start.elapsed().as_secs_f64(), processor_s() - before);
    println!("{name:44} {values:6} values {took:7.3} s, {processor:6.2} s of processors");
}

/// Time of all threads on a processor in s, to 0.01 s; NaN where the system does not report it.
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = text.rsplit(')').next().unwrap_or_default();
    let ticks: Vec<f64> =
        after_name.split_whitespace().skip(11).take(2).filter_map(|field| field.parse().ok()).collect();
    if ticks.len() == 2 { 0.01 * ticks.iter().sum::<f64>() } else { f64::NAN }
}

/// Values of 400 sections of 2560 angles, group by group; then all of a run, sections on as many threads as a run has them.
#[test]
#[ignore = "prints times, which are meaningful in a release build only"]
fn cost_of_all_values() {
    let stations = stations(1279);
    println!("of one thread:");
    let groups = [
        "values = ['roundness']",
        "values = ['roundness']\nreferences = ['LSCI']",
        "values = ['roundness']\nreferences = ['MZCI']",
        "values = ['roundness']\nreferences = ['MICI']",
        "values = ['roundness']\nreferences = ['MCCI']",
        "values = ['harmonics']",
        "values = ['texture']",
        "values = ['texture']\nlambda_c_mm = 0.8",
    ];
    for text in groups {
        let evaluate = evaluate(text).unwrap();
        timed(&text.replace('\n', ", "), &mut || {
            stations.iter().map(|station| section_values(station, 0, &evaluate, RADIUS_MM).len()).sum()
        });
    }
    println!("of the threads that they take:");
    for text in ["values = ['cylindricity']", "values = ['cylindricity']\nreferences = ['LSCI']"] {
        let (builder, evaluate) = (builder(&stations), evaluate(text).unwrap());
        timed(&text.replace('\n', ", "), &mut || of_part(&builder, &evaluate).values.len());
    }
    let (surface, uncertain) = builder(&stations).build(RADIUS_MM).unwrap();
    for text in ["values = ['areal']", "values = ['areal']\nlambda_c_mm = 8.0", "values = ['twist']"] {
        let evaluate = evaluate(text).unwrap();
        timed(&text.replace('\n', ", "), &mut || {
            let mut part = PartSummary::default();
            add_areal(&mut part, &surface, &uncertain, 2, &evaluate).unwrap();
            part.values.len()
        });
    }
    for text in ["values = 'all'", "values = 'all'\nlambda_c_mm = 0.8"] {
        let evaluate = evaluate(text).unwrap();
        timed(&text.replace('\n', ", "), &mut || {
            let threads = std::thread::available_parallelism().map_or(1, usize::from);
            let count = std::thread::scope(|scope| {
                let of_sections = |stations: &[StationResult]| -> usize {
                    stations.iter().map(|station| section_values(station, 0, &evaluate, RADIUS_MM).len()).sum()
                };
                let shares = stations.chunks(SECTIONS.div_ceil(threads));
                let shares: Vec<_> = shares.map(|share| scope.spawn(move || of_sections(share))).collect();
                shares.into_iter().map(|share| share.join().unwrap()).sum::<usize>()
            });
            let builder = builder(&stations);
            let mut part = of_part(&builder, &evaluate);
            let (surface, uncertain): (Surface, Uncertain) = builder.build(RADIUS_MM).unwrap();
            add_areal(&mut part, &surface, &uncertain, 2, &evaluate).unwrap();
            count + part.values.len()
        });
    }
}

fn of_part(builder: &SurfaceBuilder, evaluate: &super::Evaluate) -> PartSummary {
    part_summary(builder.sections(), ANGLES, evaluate, RADIUS_MM, false).unwrap()
}

/// RONt of one section with 500 orders, about each reference.
#[test]
#[ignore = "prints times, which are meaningful in a release build only"]
fn cost_of_one_value() {
    let stations = stations(500);
    for reference in ["LSCI", "MZCI", "MICI", "MCCI"] {
        for known in [true, false] {
            let evaluate =
                evaluate(&format!("values = ['roundness']\nreferences = ['{reference}']\nfilter_upr = []")).unwrap();
            let name = format!("RONt about {reference}{}", if known { " with its ±" } else { "" });
            let mut stations = stations.clone();
            if !known {
                for station in &mut stations {
                    station.separation.variance.fill(f64::NAN);
                }
            }
            timed(&name, &mut || {
                stations.iter().map(|station| section_values(station, 0, &evaluate, RADIUS_MM).len()).sum()
            });
        }
    }
}
