//! Reference circles of a profile that is a finite sum of harmonics: contacts between the angles.

use std::{cell::RefCell, f64::consts::TAU};

use super::{Angles, Circle, Points, Reference, Undetermined, Values};
use crate::extremes::extremes;
use runout_numerics::{Complex64, interpolation::Curve};

/// Evaluations of all angles before giving up; two or three are usual.
const MOST_LOOKS: usize = 20;

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

/// A reference circle with the two places of the profile that are farthest from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Located {
    /// The circle.
    pub circle: Circle,
    /// Angle of the highest point, in rad from 0 to 2π, and its deviation from the circle, in µm.
    pub peak: [f64; 2],
    /// Angle of the lowest point, in rad from 0 to 2π, and its deviation from the circle, in µm.
    pub valley: [f64; 2],
}

/// A profile Re Σ cₙ e^{inθ} about a circle, for several of its reference circles.
pub struct Series<'a> {
    curve: Curve<'a>,
    profile_um: &'a [f64],
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
        Self { curve, profile_um, points, span_um, heights }
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
        let count = self.profile_um.len();
        self.with_contacts(reference, |points, circle| (circle.clone(), points.values_of_first(circle, count)))
    }

    /// A reference circle and where the profile is highest and lowest about it: RONt is the difference of both deviations.
    ///
    /// # Errors
    /// As [`Points::determine`].
    pub fn located(&mut self, reference: Reference) -> Result<Located, Undetermined> {
        self.with_contacts(reference, |points, circle| {
            let there = || points.deviations_um(circle).enumerate().filter(|(_, deviation)| !deviation.is_nan());
            let by_height = |(_, one): &(usize, f64), (_, other): &(usize, f64)| one.total_cmp(other);
            let place = |found: Option<(usize, f64)>| {
                let (point, deviation) = found?;
                let [x, y] = points.cloud.features(point);
                Some([y.atan2(x).rem_euclid(TAU), deviation])
            };
            let [peak, valley] = [place(there().max_by(by_height)), place(there().min_by(by_height))];
            let lost = [f64::NAN; 2];
            Located { circle: circle.clone(), peak: peak.unwrap_or(lost), valley: valley.unwrap_or(lost) }
        })
    }

    /// RONt alone about a reference circle.
    ///
    /// # Errors
    /// As [`Points::determine`].
    pub fn ront_um(&mut self, reference: Reference) -> Result<f64, Undetermined> {
        self.with_contacts(reference, Points::ront_um)
    }

    /// What is seen of the points and those between them about a reference circle.
    fn with_contacts<T>(
        &mut self,
        reference: Reference,
        look: impl Fn(&Points, &Circle) -> T,
    ) -> Result<T, Undetermined> {
        let found = self.search(reference).map(|circle| look(&self.points, &circle));
        self.points.cloud.truncate(self.profile_um.len());
        self.points.span_um = self.span_um;
        found
    }

    fn search(&mut self, reference: Reference) -> Result<Circle, Undetermined> {
        let mut circle = self.points.determine(reference)?;
        let tolerance = self.points.tolerance();
        for _ in 0..MOST_LOOKS {
            let place = [circle.x_um, circle.y_um];
            let (low, high) = self.points.cloud.extremes(0..self.points.len(), &place);
            let before = self.points.len();
            self.points.cloud.heights(&place, &mut self.heights);
            for extreme in extremes(&self.heights, [low, high]) {
                let angle = extreme.stationary(&self.curve, self.points.radius_um(), place);
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
        Ok(circle)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::f64::consts::TAU;

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

    /// Three lobes about a centre that is known: peak and valley are where the wave has them, and RONt is between them.
    #[test]
    fn peak_and_valley_are_where_the_profile_has_them() {
        let mut harmonics = vec![Complex64::ZERO; 12];
        harmonics[3] = Complex64::from_polar(2.0, 0.4);
        // A crest that is higher than the other two, between the angles.
        harmonics[11] = Complex64::from_polar(0.3, 0.0);
        let profile_um = on(&harmonics, 180);
        let height = |angle: f64| 2.0 * (3.0 * angle + 0.4).cos() + 0.3 * (11.0 * angle).cos();
        let dense = (0..360_000).map(|step| f64::from(step) * TAU / 360_000.0);
        let highest = dense.clone().max_by(|one, other| height(*one).total_cmp(&height(*other))).unwrap();
        let lowest = dense.min_by(|one, other| height(*one).total_cmp(&height(*other))).unwrap();
        let mut series = Series::new(&harmonics, &profile_um, RADIUS_MM);
        let found = series.located(Reference::LeastSquares).unwrap();
        let expected = [[highest, height(highest)], [lowest, height(lowest)]];
        for ([angle, deviation], [at, by]) in [found.peak, found.valley].into_iter().zip(expected) {
            assert!((angle - at).abs() < 1e-3 && (deviation - by).abs() < 1e-3, "{found:?} {at} {by}");
        }
        for reference in Reference::ALL {
            let found = series.located(reference).unwrap();
            let ront_um = series.ront_um(reference).unwrap();
            assert!((found.peak[1] - found.valley[1] - ront_um).abs() < 1e-9, "{reference:?} {found:?} {ront_um}");
            let side = match reference {
                Reference::MaximumInscribed => found.valley[1],
                Reference::MinimumCircumscribed => found.peak[1],
                Reference::MinimumZone => found.peak[1] + found.valley[1],
                Reference::LeastSquares => 0.0,
            };
            assert!(side.abs() < 1e-9, "{reference:?} {found:?}");
        }
    }

    /// Two lobes and little else have contacts between angles that are the same but for rounding: these circles are found too.
    #[test]
    fn two_lobes_have_all_circles() {
        for seed in (0..200).chain([141, 552, 646, 847, 875, 901, 1372, 1775]) {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let small = 10_f64.powf(random.random_range(-5.0..-1.0));
            let mut harmonics = vec![Complex64::ZERO; 46];
            for (order, harmonic) in harmonics.iter_mut().enumerate().skip(2) {
                let passed = (-0.69 * (order as f64 / 15.0).powi(2)).exp();
                let amplitude = if order == 2 { 2.0 } else { small * passed * random.random_range(0.0..1.0) };
                *harmonic = Complex64::from_polar(amplitude, random.random_range(0.0..TAU));
            }
            let profile_um = on(&harmonics, 720);
            for reference in Reference::ALL {
                let ront_um = between_angles(&harmonics, &profile_um, 20.0, reference).unwrap().1.ront_um;
                assert!(
                    (4.0 - 30.0 * small..4.0 + 60.0 * small + 1e-3).contains(&ront_um),
                    "{seed} {reference:?} {ront_um} {small}"
                );
            }
        }
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
