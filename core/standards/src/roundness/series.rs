//! Reference circles of a profile that is a finite sum of harmonics: contacts between the angles.

use std::{cell::RefCell, f64::consts::TAU, rc::Rc};

use super::{Angles, Circle, Points, Reference, Undetermined, Values};
use runout_numerics::{Complex64, interpolation::Curve};

/// Looks at all angles before giving up; two or three are usual.
const MOST_LOOKS: usize = 20;
const MOST_NEWTON: usize = 8;
/// Extremes between angles are looked at where the parabola through three angles brings them within this many times the
/// largest rise between angles of the highest (lowest) one; at 16 angles a wave the parabola's own rise is good to a few percent.
const MARGIN: f64 = 0.5;

/// The reference circle and the values about it of the profile Re Σ cₙ e^{inθ} (`harmonics`, from order 0, in µm) about a circle of
/// `radius_mm`, as [`Series::about`] finds them.
///
/// # Errors
/// As [`Points::determine`].
pub fn between_angles(
    harmonics: &[Complex64],
    profile_um: &[f64],
    radius_mm: f64,
    reference: Reference,
) -> Result<(Circle, Values), Undetermined> {
    Series::new(harmonics, profile_um, radius_mm).about(reference)
}

/// A profile Re Σ cₙ e^{inθ} about a circle, for several of its reference circles.
pub struct Series<'a> {
    curve: Curve<'a>,
    profile_um: &'a [f64],
    angles: Rc<Angles>,
    points: Points,
    /// Of the profile's own points, the largest |w|.
    span_um: f64,
    heights: Vec<f64>,
}

impl Drop for Series<'_> {
    fn drop(&mut self) {
        let spare = (std::mem::take(&mut self.points), std::mem::take(&mut self.heights));
        // A thread that ends keeps nothing.
        let _ = SPARE.try_with(|kept| kept.replace(spare));
    }
}

thread_local! {
    /// Memory of the last series: asking the system for it each time costs as much as a reference circle.
    static SPARE: RefCell<(Points, Vec<f64>)> = RefCell::default();
}

/// An extreme between angles.
struct Extreme {
    angle_rad: f64,
    outward: bool,
}

impl<'a> Series<'a> {
    /// From harmonics by order from 0, in µm, and the profile itself on equal angles from 0, at least some to a wave of the
    /// highest order; where it is NaN, there is none.
    #[must_use]
    pub fn new(harmonics: &'a [Complex64], profile_um: &'a [f64], radius_mm: f64) -> Self {
        let angles = Angles::shared(profile_um.len());
        let (mut points, mut heights) = SPARE.take();
        points.set_profile(&angles, profile_um, radius_mm);
        heights.resize(profile_um.len(), 0.0);
        let (curve, span_um) = (Curve::new(harmonics, profile_um), points.span_um);
        Self { curve, profile_um, angles, points, span_um, heights }
    }

    /// A reference circle and the values about it.
    ///
    /// Between two angles that are there, the distance from a centre has its extremes where its derivative is 0: they join
    /// the points until no extreme lies outside the circle's bounds. LSCI, and RONq about each circle, are those of the equal
    /// angles. Contacts of the circle from the number of angles on lie between angles.
    ///
    /// # Errors
    /// As [`Points::determine`].
    pub fn about(&mut self, reference: Reference) -> Result<(Circle, Values), Undetermined> {
        let found = self.search(reference);
        self.points.cloud.truncate(self.profile_um.len());
        self.points.span_um = self.span_um;
        found
    }

    fn search(&mut self, reference: Reference) -> Result<(Circle, Values), Undetermined> {
        let mut circle = self.points.determine(reference)?;
        let tolerance = self.points.tolerance();
        for _ in 0..MOST_LOOKS {
            let place = [circle.x_um, circle.y_um];
            let (low, high) = self.points.cloud.extremes(0..self.points.len(), &place);
            let before = self.points.len();
            for extreme in self.extremes(place, low, high) {
                let angle = self.stationary(place, extreme.angle_rad);
                let [form, ..] = self.curve.at(angle);
                self.points.push(angle, form);
                let last = self.points.len() - 1;
                let height = self.points.cloud.height(last, &place);
                if !(if extreme.outward { height > high + tolerance } else { height < low - tolerance }) {
                    self.points.cloud.truncate(last);
                }
            }
            if self.points.len() == before {
                break;
            }
            // LSCI stays that of the equal angles.
            if reference == Reference::LeastSquares {
                break;
            }
            circle = self.points.determine(reference)?;
        }
        let values = self.points.values_of_first(&circle, self.profile_um.len());
        Ok((circle, values))
    }

    /// Extremes of the distance from a place that may exceed the highest or the lowest.
    fn extremes(&mut self, place: [f64; 2], low: f64, high: f64) -> Vec<Extreme> {
        let count = self.heights.len();
        self.points.cloud.heights(&place, &mut self.heights);
        let heights = &self.heights;
        // No parabola through three heights rises above their middle by more than an eighth of their bend.
        let rise = 0.125 * largest_bend(heights);
        let [above, below] = [high - (1.0 + MARGIN) * rise, low + (1.0 + MARGIN) * rise];
        let mut found = Vec::new();
        for (index, here) in heights.iter().enumerate().filter(|(_, here)| **here > above || **here < below) {
            let [before, after] = [(index + count - 1) % count, (index + 1) % count].map(|index| heights[index]);
            let (ahead, behind) = (here - after, here - before);
            let is_top = ahead >= 0.0 && behind > 0.0;
            let is_bottom = ahead <= 0.0 && behind < 0.0;
            if is_top || is_bottom {
                // The parabola through three points.
                let bend = ahead + behind;
                let (aside, top) = (0.5 * (behind - ahead) / bend, here + (behind - ahead).powi(2) / (8.0 * bend));
                if if is_top { top > high - MARGIN * rise } else { top < low + MARGIN * rise } {
                    let angle_rad = (index as f64 + aside) * TAU / count as f64;
                    found.push(Extreme { angle_rad, outward: is_top });
                }
            }
        }
        found
    }

    /// Where the squared distance from a place is stationary, by Newton's method from an angle, within a step of it.
    fn stationary(&self, [x_um, y_um]: [f64; 2], start: f64) -> f64 {
        let step = TAU / self.angles.len() as f64;
        let mut angle = start;
        for _ in 0..MOST_NEWTON {
            let [form, slope, bend] = self.curve.at(angle);
            let (rho, (sin, cos)) = (self.points.radius_um() + form, angle.sin_cos());
            let (along, across) = (x_um * cos + y_um * sin, y_um * cos - x_um * sin);
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
}

/// The largest |second difference| of heights around a turn.
fn largest_bend(heights: &[f64]) -> f64 {
    const LANES: usize = 8;
    let [first, second, .., before, last] = *heights else { return f64::INFINITY };
    let mut largest = [0.0; LANES];
    let mut look = |lane: usize, bend: f64| {
        // Comparisons with NaN are false: what is not there changes nothing.
        largest[lane] = if bend.abs() > largest[lane] { bend.abs() } else { largest[lane] };
    };
    let inner = heights[1..].chunks(LANES).zip(heights.chunks(LANES)).zip(heights[2..].chunks(LANES));
    for ((here, before), after) in inner {
        for (lane, ((here, before), after)) in here.iter().zip(before).zip(after).enumerate() {
            look(lane, 2.0 * here - before - after);
        }
    }
    look(0, 2.0 * first - last - second);
    look(1, 2.0 * last - before - first);
    largest.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use runout_numerics::fourier::Fourier;

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
