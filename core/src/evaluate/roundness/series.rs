//! Reference circles of a profile that is a finite sum of harmonics: contacts between the angles.

use std::f64::consts::TAU;

use super::{Angles, Circle, Points, Reference, Undetermined, Values};
use crate::{Complex64, evaluate::near::Course};

/// Looks at all angles before giving up; two or three are usual.
const MOST_LOOKS: usize = 20;
const MOST_NEWTON: usize = 8;
/// Extremes between angles are looked at where the parabola through three angles brings them within this many times the
/// largest rise between angles of the highest (lowest) one; at 16 angles a wave the parabola's own rise is good to a few percent.
const MARGIN: f64 = 0.5;

/// The reference circle and the values about it of the profile Re Σ cₙ e^{inθ} (`harmonics`, from order 0, in µm) about a circle of
/// `radius_mm`. `profile_um` is the same profile on equal angles from 0, at least some to a wave of the highest order; where it
/// is NaN, there is none.
///
/// Between two angles that are there, the distance from a centre has its extremes where its derivative, which the series gives,
/// is 0: they join the points until no extreme lies outside the circle's bounds. LSCI, and RONq about each circle, are those of
/// the equal angles. Contacts of the circle from `profile_um.len()` on lie between angles.
///
/// # Errors
/// As [`Points::determine`].
pub fn between_angles(
    harmonics: &[Complex64],
    profile_um: &[f64],
    radius_mm: f64,
    reference: Reference,
) -> Result<(Circle, Values), Undetermined> {
    let count = profile_um.len();
    let mut at_rad: Vec<f64> = (0..count).map(|index| TAU * index as f64 / count as f64).collect();
    let mut form_um = profile_um.to_vec();
    let mut points = Points::default();
    let equal = Angles::equal(count);
    points.set_profile(&equal, profile_um, radius_mm);
    let mut circle = points.determine(reference)?;
    let squares = Course::of(points.deviations_um(&circle)).rms();
    let tolerance = points.tolerance();
    for _ in 0..MOST_LOOKS {
        let deviations: Vec<f64> = points.deviations_um(&circle).collect();
        let Course { low, high, .. } = Course::of(deviations.iter().copied());
        let mut grown = false;
        for (angle, outward) in extremes(&deviations[..count], low, high) {
            let angle = stationary(harmonics, 1e3 * radius_mm, &circle, angle, TAU / count as f64);
            let form = at(harmonics, angle)[0];
            let deviation = deviation(1e3 * radius_mm + form, angle, &circle) - 1e3 * radius_mm - circle.deviation_um;
            let beyond = if outward { deviation > high + tolerance } else { deviation < low - tolerance };
            if beyond {
                at_rad.push(angle);
                form_um.push(form);
                grown = true;
            }
        }
        if !grown {
            break;
        }
        points.set_profile(&at_rad.iter().copied().collect::<Angles>(), &form_um, radius_mm);
        if reference != Reference::LeastSquares {
            circle = points.determine(reference)?;
        }
    }
    let values = Values { points: count, ..points.values(&circle) };
    let ronq_um = if reference == Reference::LeastSquares {
        squares
    } else {
        points.set_profile(&equal, profile_um, radius_mm);
        points.values(&circle).ronq_um
    };
    let points = profile_um.iter().filter(|form| form.is_finite()).count();
    Ok((circle, Values { ronq_um, points, ..values }))
}

/// Angles in rad near which deviations on equal angles have an extreme that may reach the highest (true) or the lowest.
fn extremes(deviations: &[f64], low: f64, high: f64) -> Vec<(f64, bool)> {
    let count = deviations.len();
    let mut found = Vec::new();
    let mut largest: f64 = 0.0;
    for index in 0..count {
        let [before, here, after] =
            [(index + count - 1) % count, index, (index + 1) % count].map(|index| deviations[index]);
        let (ahead, behind) = (here - after, here - before);
        let is_top = ahead >= 0.0 && behind > 0.0;
        let is_bottom = ahead <= 0.0 && behind < 0.0;
        if is_top || is_bottom {
            // The parabola through three points.
            let bend = ahead + behind;
            let (aside, rise) = (0.5 * (behind - ahead) / bend, (behind - ahead).powi(2) / (8.0 * bend));
            largest = largest.max(rise.abs());
            found.push((index as f64 + aside, here + rise, is_top));
        }
    }
    let reaches = |(_, value, top): &(f64, f64, bool)| {
        if *top { *value > high - MARGIN * largest } else { *value < low + MARGIN * largest }
    };
    let near = found.into_iter().filter(reaches);
    near.map(|(place, _, top)| (place * TAU / count as f64, top)).collect()
}

/// Where the squared distance from the circle's centre is stationary, by Newton's method from an angle, within a step of it.
fn stationary(harmonics: &[Complex64], radius_um: f64, circle: &Circle, start: f64, step: f64) -> f64 {
    let mut angle = start;
    for _ in 0..MOST_NEWTON {
        let [form, slope, bend] = at(harmonics, angle);
        let (rho, (sin, cos)) = (radius_um + form, angle.sin_cos());
        let (along, across) = (circle.x_um * cos + circle.y_um * sin, circle.y_um * cos - circle.x_um * sin);
        // Derivatives of ½(ρ² − 2ρ c·e + c²).
        let first = rho * slope - slope * along - rho * across;
        let second = slope * slope + rho * bend - bend * along - 2.0 * slope * across + rho * along;
        let moved = first / second;
        if !moved.is_finite() {
            break;
        }
        angle = (angle - moved).clamp(start - step, start + step);
        if moved.abs() < 1e-9 * step {
            break;
        }
    }
    angle
}

/// Distance of a point from the circle's centre.
fn deviation(rho: f64, angle: f64, circle: &Circle) -> f64 {
    let (sin, cos) = angle.sin_cos();
    (rho * cos - circle.x_um).hypot(rho * sin - circle.y_um)
}

/// The series and its first two derivatives by the angle in rad.
fn at(harmonics: &[Complex64], angle: f64) -> [f64; 3] {
    let turn = Complex64::cis(angle);
    let mut wave = Complex64::ONE;
    let mut sums = [0.0; 3];
    for (order, harmonic) in harmonics.iter().enumerate() {
        // Rounding of the product's powers is taken back now and then.
        if order % 64 == 0 {
            wave = Complex64::cis(order as f64 * angle);
        }
        let (n, value) = (order as f64, harmonic * wave);
        sums[0] += value.re;
        sums[1] -= n * value.im;
        sums[2] -= n * n * value.re;
        wave *= turn;
    }
    sums
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::numerics::fourier::Fourier;

    const RADIUS_MM: f64 = 30.0;

    fn on(harmonics: &[Complex64], count: usize) -> Vec<f64> {
        Fourier::new(count).synthesise(harmonics.iter().copied()).to_vec()
    }

    /// Values do not depend on the angles, and are those of very many angles.
    #[test]
    fn values_are_those_of_every_grid() {
        let mut worst: f64 = 0.0;
        for seed in 0..300 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let highest = random.random_range(4..40);
            let mut harmonics = vec![Complex64::ZERO; highest + 1];
            for (order, harmonic) in harmonics.iter_mut().enumerate().skip(2) {
                let amplitude = random.random_range(0.0..2.0) / order as f64;
                *harmonic = Complex64::from_polar(amplitude, random.random_range(0.0..TAU));
            }
            // Few others beside two lobes: nearly opposite contacts.
            if seed % 3 == 0 {
                harmonics.iter_mut().skip(3).for_each(|harmonic| *harmonic *= 0.05);
            }
            for reference in Reference::ALL {
                let of = |count: usize| {
                    let profile_um = on(&harmonics, count);
                    between_angles(&harmonics, &profile_um, RADIUS_MM, reference).unwrap().1
                };
                let [one, two] = [16 * highest, 23 * highest + 1].map(of);
                worst = worst.max((one.ront_um - two.ront_um).abs() / two.ront_um);
                if seed % 30 == 0 {
                    let profile_um = on(&harmonics, 400 * highest);
                    let mut points = Points::default();
                    points.set_profile(&Angles::equal(profile_um.len()), &profile_um, RADIUS_MM);
                    let circle = points.reference(reference).unwrap();
                    let dense = points.values(&circle).ront_um;
                    // Crests between 400 angles a wave: 3e-5 of the wave, more where the centre is held loosely.
                    assert!((one.ront_um - dense).abs() < 3e-3 * dense, "{seed} {reference:?} {one:?} {dense}");
                }
            }
        }
        // Nearly opposite contacts hold the centre along their chord by differences of rounding's size.
        assert!(worst < 2e-4, "{worst}");
    }

    #[test]
    fn a_gap_stays_a_gap() {
        let mut harmonics = vec![Complex64::ZERO; 4];
        harmonics[3] = Complex64::from_polar(2.0, 0.1);
        let mut profile_um = on(&harmonics, 60);
        let all = between_angles(&harmonics, &profile_um, RADIUS_MM, Reference::LeastSquares).unwrap().1;
        // Form²/R.
        assert!((all.ront_um - 4.0).abs() < 1e-3 && all.points == 60, "{all:?}");
        for (index, value) in profile_um.iter_mut().enumerate() {
            if index % 20 < 8 || index % 20 > 16 {
                *value = f64::NAN;
            }
        }
        let dales = between_angles(&harmonics, &profile_um, RADIUS_MM, Reference::MinimumCircumscribed).unwrap().1;
        // From the dale at −2 µm to the last angle, 96°.
        let expected = 2.0 + 2.0 * (288_f64.to_radians() + 0.1).cos();
        assert!((dales.ront_um - expected).abs() < 2e-3 && dales.points == 27, "{dales:?} {expected}");
    }
}
