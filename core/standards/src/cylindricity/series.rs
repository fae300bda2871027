//! Reference cylinders of a wall whose sections are finite sums of harmonics: contacts between the angles.

use super::{Cylinder, Points, Reference, Section, Undetermined, Values};
use crate::{extremes::extremes, near::DeviationSpread};
use runout_numerics::{Complex64, interpolation::Curve};

/// Evaluations of all points before giving up; two or three are usual.
const MOST_LOOKS: usize = 20;

/// A wall of sections Re Σ cₙ e^{inθ}, for several of its reference cylinders.
///
/// Contacts only at angles err to first order where contacts of MICY and MCCY are nearly opposite: they hold the axis along their
/// chord by differences of the size of what lies between angles.
#[derive(Debug)]
pub struct Series<'a> {
    sections: &'a [Section<'a>],
    curves: Vec<Curve<'a>>,
    points: Points,
    /// Points on the equal angles, and the largest |w| of them.
    count: usize,
    span_um: f64,
    deviations_um: Vec<f64>,
}

impl<'a> Series<'a> {
    /// From sections on equal angles from 0, at least some to a wave of the highest order, and the harmonics of each by order
    /// from 0, in µm; where a section's form is NaN, there is none.
    #[must_use]
    pub fn new(sections: &'a [Section<'a>], harmonics: &'a [Vec<Complex64>], radius_mm: f64) -> Self {
        let each = sections.iter().zip(harmonics);
        let curves = each.map(|(section, harmonics)| Curve::new(harmonics, section.form_um)).collect();
        let points = Points::of_sections(radius_mm, sections);
        let (count, span_um) = (points.len(), points.span_um);
        Self { sections, curves, points, count, span_um, deviations_um: Vec::new() }
    }

    /// A reference cylinder and the values about it.
    ///
    /// Between two angles that are there, the distance from the axis has its extremes where its derivative along the section is 0: they join
    /// the points until no extreme lies outside the cylinder's bounds. LSCY, and CYLq about each cylinder, are those of the equal
    /// angles. Contacts from the number of points on lie between angles.
    ///
    /// # Errors
    /// As [`Points::determine`].
    pub fn about(&mut self, reference: Reference) -> Result<(Cylinder, Values), Undetermined> {
        let found = self.search(reference);
        self.points.truncate(self.count);
        self.points.span_um = self.span_um;
        found
    }

    fn search(&mut self, reference: Reference) -> Result<(Cylinder, Values), Undetermined> {
        let mut cylinder = self.points.determine(reference)?;
        for _ in 0..MOST_LOOKS {
            let grown = self.grow(&cylinder);
            // LSCY stays that of the equal angles.
            if !grown || reference == Reference::LeastSquares {
                break;
            }
            let nearby = self.points.reference_near(reference, &cylinder);
            cylinder = nearby.map_or_else(|| self.points.determine(reference), Ok)?;
        }
        let deviations_um: Vec<f64> = self.points.deviations_um(&cylinder).collect();
        let (on_angles, between) = deviations_um.split_at(self.count);
        let mut course = DeviationSpread::of(on_angles.iter().copied());
        for deviation in between {
            (course.low, course.high) = (course.low.min(*deviation), course.high.max(*deviation));
        }
        Ok((cylinder, course.into()))
    }

    /// Adds the extremes between angles that exceed those of all points; whether there are any.
    fn grow(&mut self, cylinder: &Cylinder) -> bool {
        let Some(axis) = self.points.axis_of(cylinder) else { return false };
        let (frame, before) = (self.points.frame(&axis), self.points.len());
        self.points.held.fill(&frame, &mut self.deviations_um);
        let DeviationSpread { low, high, .. } = DeviationSpread::of(self.deviations_um.iter().copied());
        let tolerance = self.points.tolerance();
        let mut first = 0;
        for (section, curve) in self.sections.iter().zip(&self.curves) {
            let deviations_um = &self.deviations_um[first..first + section.form_um.len()];
            first += section.form_um.len();
            // A lean moves a section's extremes by its square only: the heights found there are exact, the angles nearly so.
            let zeta = self.points.zeta(section.z_mm);
            let centre_um = [axis[0] + axis[2] * zeta, axis[1] + axis[3] * zeta];
            for extreme in extremes(deviations_um, [low, high]) {
                let angle_rad = extreme.stationary(curve, self.points.radius_um, centre_um);
                let [form_um, ..] = curve.at(angle_rad);
                self.points.push((angle_rad.sin_cos(), section.z_mm, form_um));
                let last = self.points.len() - 1;
                let deviation = frame.deviation(self.points.held.at(last));
                if !(if extreme.outward { deviation > high + tolerance } else { deviation < low - tolerance }) {
                    self.points.truncate(last);
                }
            }
        }
        self.points.len() > before
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::f64::consts::TAU;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::roundness::Angles;
    use runout_numerics::fourier::Fourier;

    const RADIUS_MM: f64 = 30.0;

    fn wall(random: &mut ChaCha8Rng, highest: usize, lobed: bool) -> Vec<Vec<Complex64>> {
        let mut ring = |_| {
            let mut harmonics = vec![Complex64::ZERO; highest + 1];
            for (order, harmonic) in harmonics.iter_mut().enumerate().skip(2) {
                let size = if lobed && order > 2 { 0.1 } else { 2.0 };
                let amplitude = size * random.random_range(0.0..1.0) / order as f64;
                *harmonic = Complex64::from_polar(amplitude, random.random_range(0.0..TAU));
            }
            harmonics
        };
        (0..4).map(&mut ring).collect()
    }

    fn of_grid(harmonics: &[Vec<Complex64>], count: usize, references: &[Reference], between: bool) -> Vec<f64> {
        let angles = Angles::equal(count);
        let mut fourier = Fourier::new(count);
        let forms: Vec<Vec<f64>> =
            harmonics.iter().map(|harmonics| fourier.synthesise(harmonics.iter().copied()).to_vec()).collect();
        let heights = [0.0, 11.0, 24.0, 30.0];
        let sections = forms.iter().zip(heights);
        let sections: Vec<Section> =
            sections.map(|(form_um, z_mm)| Section { z_mm, angles: &angles, form_um }).collect();
        let mut series = Series::new(&sections, harmonics, RADIUS_MM);
        let points = Points::of_sections(RADIUS_MM, &sections);
        let cylt = |reference: &Reference| {
            let found = if between {
                series.about(*reference).unwrap().1
            } else {
                points.values(&points.reference(*reference).unwrap())
            };
            found.cylt_um
        };
        references.iter().map(cylt).collect()
    }

    /// Values do not depend on the angles, and are those of very many angles.
    #[test]
    fn values_are_those_of_every_grid() {
        let (mut worst, mut worst_on_angles): (f64, f64) = (0.0, 0.0);
        for seed in 0..60 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let highest = random.random_range(4..40);
            // Few others beside two lobes: nearly opposite contacts.
            let harmonics = wall(&mut random, highest, seed % 2 == 0);
            let of = |count: usize, between: bool| of_grid(&harmonics, count, &Reference::ALL, between);
            let [one, two] = [16 * highest, 23 * highest + 1].map(|count| of(count, true));
            let coarse = of(16 * highest, false);
            for ((one, two), coarse) in one.iter().zip(&two).zip(&coarse) {
                worst = worst.max((one - two).abs() / two);
                worst_on_angles = worst_on_angles.max((coarse - two).abs() / two);
            }
            if seed % 10 < 2 {
                for ((one, dense), reference) in one.iter().zip(of(400 * highest, false)).zip(Reference::ALL) {
                    assert!((one - dense).abs() < 3e-3 * dense, "{seed} {reference:?} {one} {dense}");
                }
            }
        }
        println!("{worst} {worst_on_angles}");
        assert!(worst < 2e-4, "{worst}");
    }
}
