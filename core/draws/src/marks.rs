//! Marks of a profile: scratches, bumps and the like, narrow and alone, of which all orders are in phase.

use runout_numerics::{
    Complex64,
    fourier::{Fourier, quick_length},
};

use crate::spectrum::{Noise, Spectrum};

/// Widths at which marks are sought: standard deviations of Gaussian curves, in degrees.
pub(crate) const WIDTHS_DEG: [f64; 12] = [0.09, 0.18, 0.35, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0];
/// Those of which noise has some by chance, of a point or two of many, begin the list.
pub(crate) const NARROW: usize = 3;
/// A curve is no narrower than this over the highest order: else one order is like the next.
const NARROWEST: f64 = 1.5;
/// Orders above this over a width have less than e⁻¹⁸ of its curve.
const VANISHES: f64 = 6.0;
/// Angles to a wave of the highest order at which marks are sought.
const ANGLES_A_WAVE: usize = 4;

/// A mark of height 1, and what finds its height in a profile.
#[derive(Debug, Clone)]
pub(crate) struct Mark {
    pub shape: Vec<Complex64>,
    /// Re Σ g c is the height in harmonics c, by generalised least squares.
    finder: Vec<Complex64>,
}

impl Mark {
    /// Its height in a profile.
    fn height(&self, harmonics: &[Complex64]) -> f64 {
        self.finder.iter().zip(harmonics).map(|(finder, harmonic)| (finder * harmonic).re).sum()
    }

    fn of_shape(&self, other: &Self) -> f64 {
        self.finder.iter().zip(&other.shape).map(|(finder, shape)| (finder * shape).re).sum()
    }
}

/// Marks in the order in which they were found: each height is taken from what those before have left.
#[derive(Debug, Clone, Default)]
pub(crate) struct Marks {
    pub all: Vec<Mark>,
    /// Of each mark, what it finds of the shape of each one before it.
    overlaps: Vec<Vec<f64>>,
}

impl Marks {
    /// Adds up to `most` marks of these widths that stand out of noise and waves by more than so many standard deviations.
    pub(crate) fn find(
        &mut self,
        harmonics: &[Complex64],
        noise: Noise<'_>,
        widths_deg: &[f64],
        (threshold, most): (f64, usize),
    ) {
        let mut rest = self.without(harmonics);
        let count = harmonics.len().min(noise.reach());
        let mut curves: Vec<(Vec<f64>, Fourier)> = (widths_deg.iter().map(|width| width.to_radians()))
            .filter(|width| width * count as f64 > NARROWEST)
            .map(|width| {
                let orders = count.min((VANISHES / width) as usize + 1);
                let curve = (0..orders).map(|order| (-0.5 * (width * order as f64).powi(2)).exp()).collect();
                (curve, Fourier::new(quick_length(ANGLES_A_WAVE * orders).max(8)))
            })
            .collect();
        for _ in 0..most {
            let weights: Vec<f64> =
                Spectrum::of(&rest, noise).background().iter().map(|of| of.map_or(0.0, f64::recip)).collect();
            let mut best = (threshold, None);
            for (curve, fourier) in &mut curves {
                let curve: &[f64] = curve;
                let seen: f64 = curve.iter().zip(&weights).map(|(curve, weight)| curve * curve * weight).sum();
                if seen <= 0.0 {
                    continue;
                }
                let matched =
                    rest.iter().zip(curve).zip(&weights).map(|((rest, curve), weight)| rest * (curve * weight));
                let scale = (0.5 * seen).sqrt().recip();
                let (angle, largest) =
                    (fourier.synthesise(matched).iter().enumerate()).fold((0, 0.0), |best, (angle, value)| {
                        if value.abs() > best.1 { (angle, value.abs()) } else { best }
                    });
                if largest * scale > best.0 {
                    let angle = std::f64::consts::TAU * angle as f64 / fourier.length() as f64;
                    best = (largest * scale, Some((curve, angle, seen)));
                }
            }
            let Some((curve, angle, seen)) = best.1 else { break };
            let shape = |order: usize| {
                let height = if weights[order] > 0.0 { curve[order] } else { 0.0 };
                Complex64::from_polar(height, -(order as f64) * angle)
            };
            let shape: Vec<Complex64> = (0..curve.len()).map(shape).collect();
            let finder = shape.iter().zip(&weights).map(|(shape, weight)| shape.conj() * (weight / seen)).collect();
            self.push(Mark { shape, finder });
            rest = self.without(harmonics);
        }
    }

    fn push(&mut self, mark: Mark) {
        self.overlaps.push(self.all.iter().map(|before| mark.of_shape(before)).collect());
        self.all.push(mark);
    }

    /// Heights of all in a profile.
    pub(crate) fn heights(&self, harmonics: &[Complex64]) -> Vec<f64> {
        let mut heights: Vec<f64> = Vec::with_capacity(self.all.len());
        for (mark, overlaps) in self.all.iter().zip(&self.overlaps) {
            let of_others: f64 = heights.iter().zip(overlaps).map(|(height, overlap)| height * overlap).sum();
            heights.push(mark.height(harmonics) - of_others);
        }
        heights
    }

    /// The sum of all with these heights.
    pub(crate) fn sum(&self, heights: &[f64], orders: usize) -> Vec<Complex64> {
        let mut sum = vec![Complex64::ZERO; orders];
        for (mark, height) in self.all.iter().zip(heights) {
            sum.iter_mut().zip(&mark.shape).for_each(|(sum, shape)| *sum += shape * height);
        }
        sum
    }

    /// A profile less its marks.
    pub(crate) fn without(&self, harmonics: &[Complex64]) -> Vec<Complex64> {
        let marks = self.sum(&self.heights(harmonics), harmonics.len());
        harmonics.iter().zip(marks).map(|(all, mark)| all - mark).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::spectrum::VarianceFrom;

    const ORDERS: usize = 1200;
    /// Orders that a low-pass leaves, and what it leaves of those above.
    const PASSED: usize = 600;
    const LEFT: f64 = 1e-3;

    /// How many of 40 profiles of noise behind a low-pass have a mark: alone, and with a scratch of so many standard deviations of the noise over the angle.
    fn with_marks(scratch: f64) -> usize {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let passed = |order: usize| if order < PASSED { 1.0 } else { LEFT };
        let variance: Vec<f64> = (0..ORDERS).map(|order| passed(order).powi(2)).collect();
        let squares = vec![0; ORDERS];
        let noise =
            Noise { variance: &variance, squares: &squares, variance_from: VarianceFrom::OrdersBeside, lowest: 2 };
        let width = 0.18_f64.to_radians();
        let sum: f64 = (0..PASSED).map(|order| (-0.5 * (width * order as f64).powi(2)).exp()).sum();
        let height = scratch * (0.5 * PASSED as f64).sqrt() / sum;
        let mut one = |_: &usize| {
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let of_order = |order: usize| {
                let white = Complex64::new(normal(), normal()) * std::f64::consts::FRAC_1_SQRT_2;
                // What is left above the low-pass is more than its noise, and has one phase: rounding has such orders.
                let left = if order < PASSED { Complex64::ZERO } else { Complex64::from(0.3) };
                let scratch = height * (-0.5 * (width * order as f64).powi(2)).exp();
                passed(order) * (white + left + Complex64::from_polar(scratch, -(order as f64)))
            };
            let harmonics: Vec<Complex64> = (0..ORDERS).map(of_order).collect();
            let mut marks = Marks::default();
            marks.find(&harmonics, noise, &WIDTHS_DEG, (5.0, 1));
            !marks.all.is_empty()
        };
        (0..40).filter(|profile| one(profile)).count()
    }

    #[test]
    fn what_a_low_pass_leaves_is_no_mark() {
        assert!(with_marks(0.0) <= 1, "{}", with_marks(0.0));
        assert!(with_marks(8.0) >= 39, "{}", with_marks(8.0));
    }
}
