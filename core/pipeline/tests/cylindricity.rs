//! Reference cylinders: proof of the optimum on random walls, with a distance formula of the test's own.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::standards::{
    cylindricity::{Cylinder, Generatrices, MedianLine, Points, Section},
    reference::Reference,
    roundness::{self, Angles},
};

const RADIUS_MM: f64 = 15.0;

struct Wall {
    angles: Angles,
    /// Height and deviations of each section.
    sections: Vec<(f64, Vec<f64>)>,
}

impl Wall {
    fn random(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (count, rings) = (4 * rng.random_range(3..=30), rng.random_range(3..=9));
        let size = 10_f64.powf(rng.random_range(-1.0..1.3));
        let mut unit = || rng.random_range(-1.0..1.0);
        let [x, y, u, v, taper, bow] = std::array::from_fn(|_| unit());
        let lobes: [[f64; 3]; 5] = std::array::from_fn(|_| [unit(), 3.2 * unit(), unit()]);
        let mut sections = Vec::new();
        for ring in 0..rings {
            let height = 2.0 * f64::from(ring) / f64::from(rings - 1) - 1.0;
            let form = (0..count).map(|i| {
                let angle = TAU * f64::from(i) / f64::from(count);
                let lobed: f64 = (2..)
                    .zip(&lobes)
                    .map(|(order, [a, phase, twist])| {
                        a / f64::from(order) * (f64::from(order) * angle + phase + twist * height).cos()
                    })
                    .sum();
                let centre = (x + u * height + bow * height * height) * angle.cos() + (y + v * height) * angle.sin();
                let noise = if seed.is_multiple_of(3) { 0.0 } else { 0.1 * unit() };
                let missing = seed % 5 == 4 && i < count / 8;
                if missing { f64::NAN } else { size * (lobed + 3.0 * centre + taper * height + noise) }
            });
            sections.push((30.0 + 20.0 * height, form.collect()));
        }
        Self { angles: Angles::equal(count as usize), sections }
    }

    fn sections(&self) -> Vec<Section<'_>> {
        let sections = self.sections.iter();
        sections.map(|(z_mm, form_um)| Section { z_mm: *z_mm, angles: &self.angles, form_um }).collect()
    }

    /// Coordinates of all points, in µm.
    fn places(&self) -> Vec<[f64; 3]> {
        let sections = self.sections.iter();
        let points =
            sections.flat_map(|(z, form)| form.iter().zip(self.angles.sin_cos()).map(move |(d, at)| (*z, *d, at)));
        points.map(|(z, d, (sin, cos))| [(1e3 * RADIUS_MM + d) * cos, (1e3 * RADIUS_MM + d) * sin, 1e3 * z]).collect()
    }
}

/// Distance from the line through (x, y) at `z_mm` with slopes, by the cross product; `axis` is x, y in µm, slopes in µrad.
fn distance(place: [f64; 3], z_mm: f64, axis: [f64; 4]) -> f64 {
    let [a, b] = [1e-6 * axis[2], 1e-6 * axis[3]];
    let [x, y, z] = [place[0] - axis[0], place[1] - axis[1], place[2] - 1e3 * z_mm];
    let cross = [y - z * b, z * a - x, x * b - y * a];
    (cross.iter().map(|c| c * c).sum::<f64>() / (1.0 + a * a + b * b)).sqrt()
}

fn axis(cylinder: &Cylinder) -> [f64; 4] {
    [cylinder.x_um, cylinder.y_um, cylinder.slope_x_urad, cylinder.slope_y_urad]
}

/// What stands against the optimum.
fn check(wall: &Wall, reference: Reference) -> Result<(), String> {
    let points = Points::of_sections(RADIUS_MM, &wall.sections());
    let cylinder = points.reference(reference).ok_or("none found")?;
    let places = wall.places();
    let distances: Vec<f64> = places.iter().map(|place| distance(*place, cylinder.z_mm, axis(&cylinder))).collect();
    for (found, expected) in points.deviations_um(&cylinder).zip(&distances) {
        let expected = expected - 1e3 * RADIUS_MM - cylinder.deviation_um;
        // Rounding of coordinates of 15 mm.
        if (found - expected).abs() > 1e-9 {
            return Err(format!("deviation {found} instead of {expected}"));
        }
    }
    let there = || distances.iter().copied().filter(|distance| distance.is_finite());
    let (low, high) = (there().fold(f64::INFINITY, f64::min), there().fold(0.0, f64::max));
    let (mut balance, mut sums) = ([0.0; 4], [0.0; 2]);
    for touch in &cylinder.touches {
        let lacks = if touch.outer { high - distances[touch.point] } else { distances[touch.point] - low };
        if lacks > 1e-6 || touch.multiplier < 0.0 {
            return Err(format!("{touch:?} lacks {lacks} µm"));
        }
        let sign = if touch.outer { 1.0 } else { -1.0 };
        sums[usize::from(touch.outer)] += touch.multiplier;
        for k in 0..4 {
            let moved = |by: f64| {
                let mut axis = axis(&cylinder);
                axis[k] += by;
                distance(places[touch.point], cylinder.z_mm, axis)
            };
            // ±20 µm at the middle, ±20 µm at the ends (20 mm off): per µm.
            let step = if k < 2 { 20.0 } else { 1000.0 };
            balance[k] += sign * touch.multiplier * (moved(step) - moved(-step)) / 40.0;
        }
    }
    // MICY and MCCY take a thousandth of the zone into account, which chooses among axes of the same radius.
    let expected = match reference {
        Reference::MaximumInscribed => [1.001, 1e-3],
        Reference::MinimumCircumscribed => [1e-3, 1.001],
        _ => [1.0, 1.0],
    };
    if sums.iter().zip(expected).any(|(sum, expected)| (sum - expected).abs() > 1e-9) {
        return Err(format!("multipliers add up to {sums:?}"));
    }
    // A remaining slope of 1e-6 could be worth 1e-6 of a move: moves are below 100 µm. Central differences of a distance of
    // 15 mm over 20 µm are true to (20/15000)²/6 = 3e-7.
    if balance.iter().any(|slope| slope.abs() > 2e-6) {
        return Err(format!("multipliers do not balance: {balance:?}, {:?}", cylinder.touches));
    }
    Ok(())
}

#[test]
fn multipliers_prove_the_optimum() {
    let mut wrong = Vec::new();
    for seed in 0..300 {
        let wall = Wall::random(seed);
        for reference in &Reference::ALL[1..] {
            if let Err(problem) = check(&wall, *reference) {
                wrong.push(format!("{seed}, {}: {problem}", reference.cylinder_symbol()));
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong, such as\n{}", wrong.len(), wrong[..wrong.len().min(12)].join("\n"));
}

#[test]
fn a_cone_and_a_banana() {
    let angles = Angles::equal(36);
    let wall = |form: &dyn Fn(f64, f64) -> f64| Wall {
        sections: (0..=10)
            .map(|ring| {
                let z = f64::from(ring);
                (z, (0..36).map(|i| form(z, TAU * f64::from(i) / 36.0)).collect())
            })
            .collect(),
        angles: angles.clone(),
    };
    let lscy =
        |wall: &Wall| Points::of_sections(RADIUS_MM, &wall.sections()).reference(Reference::LeastSquares).unwrap();
    // 0.3 µm/mm of radius over 10 mm: diameters differ by 6 µm, half of which is the taper; generatrices are straight.
    let cone = wall(&|z, _| 0.3 * z);
    let lines = Generatrices::of(&cone.sections(), RADIUS_MM, &lscy(&cone)).unwrap();
    assert!((lines.cyltt_um() - 3.0).abs() < 1e-9 && lines.largest_strt_um() < 1e-9, "{lines:?}");
    // Opposite generatrices part by twice the slope.
    assert!((lines.largest_parallelism_um() - 6.0).abs() < 1e-9, "{lines:?}");
    // A bow x = 0.04 (z − 5)² µm, from 0 to 1 and back: its least-squares line is at the mean 0.4, ends 0.6 off.
    let banana = wall(&|z, angle| 0.04 * (z - 5.0).powi(2) * angle.cos());
    let found = lscy(&banana);
    let lines = Generatrices::of(&banana.sections(), RADIUS_MM, &found).unwrap();
    // 1e-3: the bow's cosine is not quite a displaced circle (1 µm²/30 mm).
    assert!((lines.largest_strt_um() - 1.0).abs() < 1e-3 && lines.cyltt_um() < 1e-3, "{lines:?}");
    assert!(lines.strt_mzli_um.iter().zip(&lines.strt_lsli_um).all(|(zone, line)| *zone <= line + 1e-12));
    let median = MedianLine::of(&banana.sections(), RADIUS_MM, &found);
    assert!((median.straightness_um - 1.2).abs() < 1e-3, "{median:?}");
    assert!((median.coaxiality_um[5] - 0.8).abs() < 1e-3 && (median.coaxiality_um[0] - 1.2).abs() < 1e-3, "{median:?}");
}

#[test]
fn what_is_not_determined_is_not_given() {
    let angles = Angles::equal(8);
    let flat = [0.0; 8];
    let at = |z_mm| Section { z_mm, angles: &angles, form_um: &flat };
    for sections in [vec![], vec![at(1.0)], vec![at(1.0), at(1.0)], vec![at(f64::NAN), at(1.0)]] {
        let points = Points::of_sections(RADIUS_MM, &sections);
        assert!(Reference::ALL.iter().all(|reference| points.reference(*reference).is_none()));
    }
    let points = Points::of_sections(RADIUS_MM, &[at(0.0), at(1.0)]);
    for reference in Reference::ALL {
        let values = points.values(&points.reference(reference).unwrap());
        // A perfect cylinder: rounding.
        assert!(values.cylt_um < 1e-9, "{}: {values:?}", reference.cylinder_symbol());
    }
}

#[test]
fn a_part_of_a_turn_surrounds_nothing() {
    // 40 % of the turn: an inscribed cylinder could grow for ever, a circumscribed one cannot shrink for ever.
    let angles = Angles::equal(50);
    let form_um: Vec<f64> = (0..50).map(|i| if i < 20 { f64::from(i * i % 7) } else { f64::NAN }).collect();
    let sections: Vec<Section> =
        [0.0, 5.0, 20.0].map(|z_mm| Section { z_mm, angles: &angles, form_um: &form_um }).to_vec();
    let points = Points::of_sections(RADIUS_MM, &sections);
    assert!((points.coverage() - 0.4).abs() < 1e-12);
    assert_eq!(points.reference(Reference::MaximumInscribed), None);
    let lscy = points.reference(Reference::LeastSquares).unwrap();
    assert_eq!(points.values(&lscy).points, 60);
    let mut circle = roundness::Points::default();
    circle.set_profile(&angles, &form_um, RADIUS_MM);
    assert_eq!(circle.reference(roundness::Reference::MaximumInscribed), None);
    let found = circle.reference(roundness::Reference::MinimumCircumscribed).unwrap();
    assert!(found.outer.iter().all(|point| *point < 20), "{found:?}");
}
