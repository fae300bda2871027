//! How often stated intervals cover the true value on walls whose centres are known, as a measuring machine gives them: positions about a
//! datum, taper and lines, and texture along the axis. Whole pipelines, from points to values; the true value is that of the same wall
//! without noise.

use std::{f64::consts::TAU, fmt::Write, ops::Range, path::Path};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use runout_core::{
    Error, Result,
    pipeline::{
        INCLUDE_KEY, Pipeline, Registry,
        document::Sources,
        run::{Silent, run},
    },
    summary::Summary,
};

use crate::values::{Rows, count};

/// Circles, and points of each.
const CIRCLES: usize = 25;
const POINTS: usize = 180;
/// Distance of the circles, in mm.
const STEP_MM: f64 = 1.0;
/// Highest order of the form.
const HIGHEST: usize = 12;

/// What is done with the points.
const STAGES: &str = r#"
[load]
plugin = "points"
path = "wall.csv"
[separate]
plugin = "least-squares-cylinder"
radius_mm = 15.0
max_order = 15
[surface]
angles = 180
[evaluate]
values = ["roundness", "cylindricity", "texture"]
references = ["LSCI"]
filter_upr = [15]
lambda_c_mm = 4
datum = ["Z0", "Z24"]
[evaluate.texture]
profiles = ["P", "R"]
generatrices_deg = [0, 137]
"#;

/// A wall: level, centre and form of each circle, in µm.
struct Wall {
    circles: Vec<Circle>,
}

#[allow(clippy::struct_field_names, reason = "units")]
struct Circle {
    level_um: f64,
    centre_um: [f64; 2],
    /// Cosine and sine of each order from 2.
    form_um: Vec<[f64; 2]>,
}

impl Wall {
    /// A form of 1/n µm at order n that changes from circle to circle, centres and levels of 1 µm about a bent, tapered axis.
    fn simulated(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let (bend, taper) = ([2.0 * normal(), 2.0 * normal()], normal());
        let common: Vec<[f64; 2]> = (2..=HIGHEST).map(|_| [normal(), normal()]).collect();
        let circle = |index: usize| {
            let along = index as f64 / (CIRCLES - 1) as f64 - 0.5;
            let centre_um = bend.map(|bend| 4.0 * bend * along * along + 0.3 * normal());
            let form_um = common.iter().zip(2..).map(|(common, order): (&[f64; 2], u32)| {
                common.map(|common| (0.7 * common + 0.7 * normal()) / f64::from(order))
            });
            let form_um = form_um.collect();
            Circle { level_um: taper * along + 0.3 * normal(), centre_um, form_um }
        };
        Self { circles: (0..CIRCLES).map(circle).collect() }
    }

    /// Its points as a CSV file, with noise.
    fn csv(&self, noise_um: f64, seed: u64) -> String {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut text = String::from("trace,kind,z_mm,angle_deg,deviation_um\n");
        let phase: f64 = random.random_range(0.0..TAU / POINTS as f64);
        for (index, circle) in self.circles.iter().enumerate() {
            for point in 0..POINTS {
                let angle = phase + TAU * point as f64 / POINTS as f64;
                let (sine, cosine) = angle.sin_cos();
                let form = circle.form_um.iter().zip(2..).map(|([a, b], order): (_, u32)| {
                    let (sine, cosine) = (f64::from(order) * angle).sin_cos();
                    a * cosine + b * sine
                });
                let noise: f64 = StandardNormal.sample(&mut random);
                let deviation = circle.level_um
                    + circle.centre_um[0] * cosine
                    + circle.centre_um[1] * sine
                    + form.sum::<f64>()
                    + noise_um * noise;
                let z_mm = STEP_MM * index as f64;
                // Writing to a string cannot fail.
                let _ = writeln!(text, "Z{index},circle,{z_mm},{},{deviation}", angle.to_degrees());
            }
        }
        text
    }
}

/// Coverage over walls, by their seeds, of noise with this standard deviation; files go into a folder.
///
/// # Errors
/// When a stage fails.
pub fn rows(noise_um: f64, walls: Range<u64>, folder: &Path) -> Result<Rows> {
    let mut total = Rows::new();
    for seed in walls {
        let wall = Wall::simulated(seed);
        let found = evaluated(&wall.csv(noise_um, seed), folder)?;
        let truth = evaluated(&wall.csv(0.0, seed), folder)?;
        count(&found, &truth, &mut total);
    }
    Ok(total)
}

fn evaluated(csv: &str, folder: &Path) -> Result<Summary> {
    let path = folder.join("wall.csv");
    std::fs::write(&path, csv).map_err(|error| Error::new("write", path.display().to_string(), error))?;
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_cylinder::register(&mut registry);
    let sources = Sources::from_text("pipeline.toml", STAGES, folder.to_owned(), &[], INCLUDE_KEY)
        .map_err(|error| Error::new("read", "the pipeline", error))?;
    let pipeline =
        Pipeline::from_sources(&sources, &registry).map_err(|error| Error::new("check", "the pipeline", error))?;
    run(&pipeline, None, &Silent)
}
