//! Reference cylinders of walls of few points, against a random search that shares nothing with the solver.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::standards::{
    cylindricity::Points,
    reference::{Reference, Undetermined},
};

struct Wall {
    radius_mm: f64,
    /// Angle in rad, height in mm, deviation in µm.
    points: Vec<(f64, f64, f64)>,
}

impl Wall {
    /// 2 to 4 sections of 3 to 7 points.
    fn random(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (sections, count) = (rng.random_range(2..=4), rng.random_range(3..=7));
        let count = if sections == 2 { count.max(4) } else { count };
        let (radius_mm, length_mm) = (rng.random_range(5.0..40.0), rng.random_range(5.0..80.0));
        let size_um = 10_f64.powf(rng.random_range(-1.0..1.5));
        let mut points = Vec::new();
        for section in 0..sections {
            let start = rng.random_range(0.0..TAU);
            for point in 0..count {
                let angle = start + TAU * (f64::from(point) + rng.random_range(-0.2..0.2)) / f64::from(count);
                let z_mm = length_mm * f64::from(section) / f64::from(sections - 1);
                points.push((angle, z_mm, size_um * rng.random_range(-1.0..1.0)));
            }
        }
        Self { radius_mm, points }
    }

    /// Lowest and highest distance from the line through (x, y) at z = 0 with slopes dx/dz, dy/dz, in µm.
    fn extremes(&self, [x, y, a, b]: [f64; 4]) -> (f64, f64) {
        let distances = self.points.iter().map(|(angle, z_mm, form_um)| {
            let (radius, z) = (1e3 * self.radius_mm + form_um, 1e3 * z_mm);
            let [x, y] = [radius * angle.cos() - x, radius * angle.sin() - y];
            let cross = [y - z * b, z * a - x, x * b - y * a];
            (cross.iter().map(|c| c * c).sum::<f64>() / (1.0 + a * a + b * b)).sqrt()
        });
        distances.fold((f64::INFINITY, 0.0), |(low, high), d| (low.min(d), f64::max(high, d)))
    }

    fn merit(&self, reference: Reference, axis: [f64; 4]) -> f64 {
        let (low, high) = self.extremes(axis);
        match reference {
            Reference::MaximumInscribed => 1e-3 * (high - low) - low,
            Reference::MinimumCircumscribed => high + 1e-3 * (high - low),
            _ => high - low,
        }
    }

    /// The least merit that normal steps of all sizes find downhill from an axis, and whether it stays within a tenth of the
    /// radius.
    fn searched(&self, reference: Reference, start: [f64; 4], seed: u64) -> (f64, bool) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let length = 1e3 * self.points.iter().map(|point| point.1).fold(0.0, f64::max);
        let (mut axis, mut merit, mut size) = (start, self.merit(reference, start), 10.0);
        for _ in 0..20_000 {
            let scale: f64 = size * 10_f64.powf(rng.random_range(-3.0..0.5));
            let step: [f64; 4] =
                std::array::from_fn(|k| scale * rng.random_range(-1.0..1.0) / if k < 2 { 1.0 } else { length });
            let next = std::array::from_fn(|k| axis[k] + step[k]);
            let better = self.merit(reference, next);
            if better < merit {
                (axis, merit, size) = (next, better, (1.5 * size).min(1e3));
            } else {
                size = (0.995 * size).max(1e-7);
            }
        }
        (merit, axis[0].abs().max(axis[1].abs()) < 100.0 * self.radius_mm)
    }
}

#[test]
fn no_search_finds_a_better_cylinder() {
    let (mut wrong, mut found) = (Vec::new(), 0);
    for seed in 0..120 {
        let wall = Wall::random(seed);
        let points = Points::new(wall.radius_mm, wall.points.iter().copied());
        let line = |cylinder: &runout_core::standards::cylindricity::Cylinder| {
            let [a, b] = [1e-6 * cylinder.slope_x_urad, 1e-6 * cylinder.slope_y_urad];
            [cylinder.x_um - 1e3 * cylinder.z_mm * a, cylinder.y_um - 1e3 * cylinder.z_mm * b, a, b]
        };
        let lscy = line(&points.reference(Reference::LeastSquares).unwrap());
        for reference in &Reference::ALL[1..] {
            let name = format!("{seed} ({} points), {}", wall.points.len(), reference.cylinder_symbol());
            let (searched, stays) = wall.searched(*reference, lscy, seed);
            match points.determine(*reference) {
                Ok(cylinder) => {
                    found += 1;
                    let (merit, start) = (wall.merit(*reference, line(&cylinder)), wall.merit(*reference, lscy));
                    if merit > start + 1e-9 {
                        wrong.push(format!("{name}: worse than its start by {}", merit - start));
                    }
                    // 1 pm: along flat valleys the merit changes by less than rounding of coordinates a step.
                    if stays && merit > searched + 1e-6 {
                        wrong.push(format!("{name}: {} worse than searched", merit - searched));
                    }
                }
                Err(Undetermined::NotBounded) if !stays => {}
                Err(reason) => wrong.push(format!("{name}: {reason}")),
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} wrong, {found} found, such as\n{}",
        wrong.len(),
        wrong[..wrong.len().min(40)].join("\n")
    );
    assert!(found > 300, "{found} found");
}

/// A section of three lobes fixes MCCY at its own height, and a smaller, displaced section at another height has room to lean:
/// the axis with the least zone passes through its centre.
#[test]
fn a_free_axis_takes_the_least_zone() {
    for (aside, lobes, smaller) in [(1.0, 2.0, 6.0), (0.3, 1.0, 2.0), (0.0, 2.0, 3.0)] {
        let mut wall = Vec::new();
        for point in 0..360 {
            let angle = TAU * f64::from(point) / 360.0;
            wall.push((angle, 0.0, lobes * (3.0 * angle).cos()));
            wall.push((angle, 40.0, aside * angle.cos() - smaller));
        }
        let points = Points::new(30.0, wall);
        let found = points.reference(Reference::MinimumCircumscribed).unwrap();
        let cylt_um = points.values(&found).cylt_um;
        // Zone: the lobes' crests less the smaller section, or less the lobes' own dales. Leaning changes distances by
        // (slope · R)²/2R.
        let expected = (lobes + smaller).max(2.0 * lobes);
        assert!((found.deviation_um - lobes).abs() < 2e-4, "{found:?}");
        assert!((cylt_um - expected).abs() < 2e-4, "{cylt_um} instead of {expected}");
        // The same of MICY with the wall inside out.
        let inside_out = (0..720).map(|point| {
            let angle = TAU * f64::from(point % 360) / 360.0;
            let section = [-lobes * (3.0 * angle).cos(), aside * angle.cos() + smaller][point as usize / 360];
            (angle, [0.0, 40.0][point as usize / 360], section)
        });
        let points = Points::new(30.0, inside_out);
        let found = points.reference(Reference::MaximumInscribed).unwrap();
        let cylt_um = points.values(&found).cylt_um;
        assert!((found.deviation_um + lobes).abs() < 2e-4, "{found:?}");
        assert!((cylt_um - expected).abs() < 2e-4, "{cylt_um} instead of {expected}");
    }
}
