//! A periodic curve between equal angles on which a transform gave it.

use std::f64::consts::TAU;

use crate::Complex64;

/// Values on both sides through which a polynomial goes.
const THROUGH: usize = 16;
/// [`THROUGH`] as an exponent.
const POWER: i32 = 16;
/// The polynomial serves where it errs by less than this share of the curve's amplitudes; its second derivative then errs by
/// some ten times that of theirs.
const SHARE: f64 = 1e-10;

/// Re Σ cₙ e^{inα}, of which values on equal angles from 0 are known: at any angle, by a polynomial through the 16 nearest of
/// them where these are dense enough to give all digits, else from the series.
#[derive(Debug, Clone)]
pub struct Curve<'a> {
    series: &'a [Complex64],
    on_angles: &'a [f64],
    dense: bool,
}

impl<'a> Curve<'a> {
    /// From harmonics by order from 0 and their sum on equal angles; where that is NaN the series serves.
    #[must_use]
    pub fn new(series: &'a [Complex64], on_angles: &'a [f64]) -> Self {
        let step = TAU / on_angles.len() as f64;
        // Of a wave of k per step and THROUGH nodes, kⁿ/n! · Π|t − tᵢ|, up to one step outside the middle.
        let product: f64 = (0..THROUGH).map(|node| (8.5 - node as f64).abs().max(0.5)).product();
        let factorial: f64 = (1..=THROUGH).map(|factor| factor as f64).product();
        let error = |order: usize| (order as f64 * step).powi(POWER) * product / factorial;
        let (errors, sizes) = series.iter().enumerate().fold((0.0, 0.0), |(errors, sizes), (order, value)| {
            let size = value.norm_sqr().sqrt();
            (errors + size * error(order), sizes + size)
        });
        let dense = on_angles.len() > THROUGH && errors <= SHARE * sizes;
        Self { series, on_angles, dense }
    }

    /// The curve and its first two derivatives by the angle in rad.
    #[must_use]
    pub fn at(&self, angle: f64) -> [f64; 3] {
        self.near(angle).unwrap_or_else(|| self.by_series(angle))
    }

    /// By the polynomial; `None` where values are too far apart or missing.
    fn near(&self, angle: f64) -> Option<[f64; 3]> {
        let count = self.on_angles.len();
        let place = angle.rem_euclid(TAU) * count as f64 / TAU;
        let nearest = place.round();
        let aside = place - nearest;
        // Nodes from the middle outwards: 0, ±1, ∓1, ±2, …, first towards the place.
        let side = if aside < 0.0 { -1 } else { 1 };
        let node = |index: usize| {
            let distance = index.div_ceil(2).cast_signed();
            side * if index % 2 == 1 { distance } else { -distance }
        };
        let value = |index: usize| {
            let wanted = nearest as isize + node(index);
            self.on_angles[wanted.rem_euclid(count.cast_signed()) as usize]
        };
        if !self.dense {
            return None;
        }
        let nodes: [f64; THROUGH] = std::array::from_fn(|index| node(index) as f64);
        let mut differences: [f64; THROUGH] = std::array::from_fn(value);
        for order in 1..THROUGH {
            for index in (order..THROUGH).rev() {
                differences[index] =
                    (differences[index] - differences[index - 1]) / (nodes[index] - nodes[index - order]);
            }
        }
        let [mut sum, mut first, mut second] = [differences[THROUGH - 1], 0.0, 0.0];
        for index in (0..THROUGH - 1).rev() {
            let away = aside - nodes[index];
            second = second * away + 2.0 * first;
            first = first * away + sum;
            sum = sum * away + differences[index];
        }
        let per_rad = count as f64 / TAU;
        sum.is_finite().then_some([sum, first * per_rad, second * per_rad * per_rad])
    }

    fn by_series(&self, angle: f64) -> [f64; 3] {
        let turn = Complex64::cis(angle);
        let mut wave = Complex64::ONE;
        let mut sums = [0.0; 3];
        for (order, harmonic) in self.series.iter().enumerate() {
            // Rounding of the product's powers is corrected now and then.
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fourier::Fourier;

    /// Against the closed form, on 16 angles of the highest wave and on few.
    #[test]
    fn values_between_angles_are_those_of_the_waves() {
        let waves = [(2, 3.0, 0.4), (17, 0.5, 1.9), (100, 0.2, -0.7)];
        let mut series = vec![Complex64::ZERO; 101];
        for (order, size, phase) in &waves {
            series[*order] = Complex64::from_polar(*size, *phase);
        }
        for count in [1600, 250] {
            let mut fourier = Fourier::new(count);
            let mut on_angles = fourier.synthesise(series.iter().copied()).to_vec();
            on_angles[count / 2] = f64::NAN;
            let curve = Curve::new(&series, &on_angles);
            assert_eq!(curve.dense, count > 250);
            for point in 0..500 {
                let angle = 0.0137 * f64::from(point) - 0.2;
                let of = |turned: f64, power: i32| -> f64 {
                    let wave = |(order, size, phase): &(usize, f64, f64)| {
                        size * (*order as f64).powi(power) * (*order as f64 * angle + phase + turned).cos()
                    };
                    waves.iter().map(wave).sum()
                };
                let expected = [of(0.0, 0), of(0.25 * TAU, 1), of(0.5 * TAU, 2)];
                for (found, (expected, size)) in
                    curve.at(angle).into_iter().zip(expected.into_iter().zip([4.0, 35.0, 2e4]))
                {
                    assert!((found - expected).abs() < 1e-11 * size, "{count} {angle}: {found} {expected}");
                }
            }
        }
    }
}
