//! Reversal along an axis on simulated traces: the file of example 4, and its picture.

use std::{f64::consts::TAU, fmt::Write, path::Path};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use runout_core::{Error, Result, stage::PointSeparator, standards::straightness::about_lsli_um};
use runout_straightness::{AxialReversalConfig, Straightness};

use crate::plot::{self, Axes, Curve};

const SEED: u64 = 12;
const NOISE_UM: f64 = 0.05;
const LENGTH_MM: f64 = 300.0;

/// The simulated part: barrelled by 3 µm, with feed marks of a coarse lead.
#[must_use]
pub fn part_um(z_mm: f64) -> f64 {
    3.0 * (TAU * z_mm / (2.0 * LENGTH_MM)).sin() + 0.35 * (TAU * z_mm / 42.0).cos()
}

/// The simulated slide: an S of 2 µm, with the period of a recirculating bearing.
#[must_use]
pub fn slide_um(z_mm: f64) -> f64 {
    2.0 * (TAU * z_mm / LENGTH_MM).sin() + 0.2 * (TAU * z_mm / 25.0 + 1.0).sin()
}

/// Six traces in two setups as CSV: each with its own sampling, extent, offset and slope, all with the same noise.
///
/// # Errors
/// Never but for a spread that no distribution has.
pub fn traces() -> Result<String> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let noise = Normal::new(0.0, NOISE_UM).map_err(|error| Error::caused("simulate", "the traces", error))?;
    let mut text = String::from("trace,setup,z_mm,reading_um\n");
    for (setup, sign) in [("initial", 1.0), ("reversed", -1.0)] {
        for repeat in 1..=3 {
            let step = random.random_range(1.8..2.2);
            let offset = random.random_range(-40.0..40.0);
            let slope = random.random_range(-0.05..0.05);
            let last = LENGTH_MM - random.random_range(0.0..6.0);
            let mut z = random.random_range(0.0..6.0);
            while z <= last {
                let reading = part_um(z) + sign * slide_um(z) + offset + slope * z + noise.sample(&mut random);
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{setup}-{repeat},{setup},{z:.4},{reading:.4}");
                z += step + random.random_range(-0.1..0.1);
            }
        }
    }
    Ok(text)
}

/// What `axial-reversal` makes of a file of traces.
///
/// # Errors
/// When the file cannot be read or separated.
pub fn separate(file: &Path) -> Result<Straightness> {
    let configured = |fault| Error::caused("set up", "the separator", fault);
    let separator = AxialReversalConfig::default().separator().map_err(configured)?;
    separator.separated(&runout_points::read(file, &separator.columns())?)
}

/// True error and stated uncertainty of part and slide, in µm rms, as Markdown.
#[must_use]
pub fn table(result: &Straightness) -> String {
    let rms = |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
    let mut text =
        String::from("| | true error, µm rms | stated standard uncertainty, µm rms |\n| --- | --- | --- |\n");
    for (name, found, std, truth) in quantities(result) {
        let error: Vec<f64> = found.iter().zip(truth).map(|(found, truth)| found - truth).collect();
        let _ = writeln!(text, "| {name} | {:.4} | {:.4} |", rms(&error), rms(std));
    }
    text
}

/// Straightness of part and slide beside the truth, as PNG.
///
/// # Errors
/// When the picture cannot be drawn.
pub fn picture(result: &Straightness) -> Result<Vec<u8>> {
    let points = |values: &[f64]| result.z_mm.iter().copied().zip(values.iter().copied()).collect();
    let curves: Vec<Curve> = (quantities(result).into_iter().zip(["#1f6fb4", "#d1602b"]))
        .flat_map(|((name, found, _, truth), colour)| {
            let curve = |name, points, colour, dashed| Curve { name, points, colour, dashed, dots: false };
            [
                curve(format!("{name}, true"), points(&truth), "#888888", true),
                curve(name.to_owned(), points(found), colour, false),
            ]
        })
        .collect();
    let axes = Axes {
        title: "Straightness of part and slide (simulated)",
        x: "z / mm",
        y: "deviation from the least-squares line / µm",
    };
    plot::curves(&axes, &curves).map_err(|problem| Error::new("draw", "the straightness", problem))
}

/// Name, what was found, its uncertainty, truth.
type Compared<'a> = (&'static str, &'a [f64], &'a [f64], Vec<f64>);

/// What was found beside the truth about the least-squares line on the same positions.
fn quantities(result: &Straightness) -> [Compared<'_>; 2] {
    let truth = |of: fn(f64) -> f64| {
        let profile: Vec<f64> = result.z_mm.iter().map(|z| of(*z)).collect();
        about_lsli_um(&result.z_mm, &profile)
    };
    [
        ("part", &result.part_um, &result.part_std_um, truth(part_um)),
        ("slide", &result.slide_um, &result.slide_std_um, truth(slide_um)),
    ]
}
