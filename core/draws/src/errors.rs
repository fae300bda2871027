//! Errors of profiles, drawn from the variance of their harmonics.
//!
//! Errors of a separated form are normal, favour no phase, and do not couple orders: over the angle they are a stationary
//! process, so that one drawn profile, turned by any angle, is another draw. Each transform thus gives several draws.
//!
//! Normal numbers come from one table. A draw takes a stretch of it, from a place that its seed gives; further draws of the seed
//! take the stretches behind it, so that they have no number in common before the table ends.

use std::sync::LazyLock;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use runout_numerics::{Complex64, fourier::Fourier};

/// Complex normal numbers of the table: more than the draws of one form take.
const TABLE: usize = 1 << 17;

/// Pairs of independent normal numbers of variance 1.
static NORMALS: LazyLock<Vec<Complex64>> = LazyLock::new(|| {
    let mut random = ChaCha8Rng::seed_from_u64(0x006e_6f69_7365);
    (0..TABLE).map(|_| Complex64::new(StandardNormal.sample(&mut random), StandardNormal.sample(&mut random))).collect()
});

/// Random bits that depend on a seed and a number only (splitmix64: Steele, Lea, Flood, OOPSLA 2014).
fn bits(seed: u64, number: u64) -> u64 {
    let mut bits = seed.wrapping_add(number.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// Draws of normal numbers from one seed, a stretch of the table each.
#[derive(Debug, Clone, Copy)]
struct Draws {
    seed: u64,
    /// Numbers that each draw has to itself.
    stride: usize,
    /// Draws taken.
    taken: usize,
}

impl Draws {
    /// The next so many numbers, in stretches of the table: from its end on they are those of its beginning.
    fn next(&mut self, count: usize) -> impl Iterator<Item = &'static [Complex64]> + use<> {
        let first = bits(self.seed, 0) as usize % TABLE;
        let (mut from, mut left) = ((first + self.taken * self.stride) % TABLE, count);
        self.taken += 1;
        std::iter::from_fn(move || {
            let stretch = &NORMALS[from..TABLE.min(from + left)];
            (from, left) = (0, left - stretch.len());
            (!stretch.is_empty()).then_some(stretch)
        })
    }
}

/// A seed whose numbers have nothing in common with those of this one but the table.
pub(crate) fn another(seed: u64, number: u64) -> u64 {
    bits(seed, u64::MAX - number)
}

/// A source of noise, the same for all profiles that have a part of it.
struct Source {
    draws: Draws,
    /// What it adds to each order, by order from 0.
    amplitudes: Vec<Complex64>,
}

/// Draws of the errors of a profile on equal angles.
pub struct Errors {
    sources: Vec<Source>,
}

/// One draw of errors on equal angles.
#[derive(Debug, Clone, Copy)]
pub struct DrawnErrors<'a> {
    drawn_um: &'a [f64],
    /// Place of the first angle's error.
    from: usize,
    largest_um: f64,
}

impl<'a> DrawnErrors<'a> {
    /// These, in µm.
    #[must_use]
    pub fn new(errors_um: &'a [f64]) -> Self {
        Self { drawn_um: errors_um, from: 0, largest_um: largest(errors_um) }
    }

    /// These in µm, of which the largest is known, turned so that the first angle has the error of the angle of this number.
    pub(crate) fn turned(errors_um: &'a [f64], from: usize, largest_um: f64) -> Self {
        Self { drawn_um: errors_um, from, largest_um }
    }

    /// The error at an angle by its number, in µm.
    #[must_use]
    pub fn at(&self, angle: usize) -> f64 {
        let (place, count) = (angle + self.from, self.drawn_um.len());
        self.drawn_um[if place < count { place } else { place - count }]
    }

    /// Errors at the first angles, and at the others.
    #[must_use]
    pub fn parts(&self) -> [&'a [f64]; 2] {
        let (head, tail) = self.drawn_um.split_at(self.from);
        [tail, head]
    }

    /// At all angles, in µm.
    pub fn iter(&self) -> impl Iterator<Item = &'a f64> + use<'a> {
        let [first, others] = self.parts();
        first.iter().chain(others)
    }

    /// Fills `sum` with heights in µm to which these are added.
    pub fn added_to(&self, heights_um: &[f64], sum: &mut Vec<f64>) {
        sum.clear();
        for errors in self.parts() {
            let heights = &heights_um[sum.len()..];
            sum.extend(heights.iter().zip(errors).map(|(height, error)| height + error));
        }
    }

    /// The largest of them in µm, without sign.
    #[must_use]
    pub fn largest_um(&self) -> f64 {
        self.largest_um
    }
}

impl Errors {
    /// From the variance E|δ|² of the harmonics by order from 0; orders without a known variance, and those below
    /// `lowest`, are taken as exact. `None` where no variance is known.
    #[must_use]
    pub fn new(variance: &[f64], lowest: usize, seed: u64) -> Option<Self> {
        Self::of_sources([(seed, variance.iter().map(|variance| Complex64::from(variance.sqrt())).collect())], lowest)
    }

    /// From independent sources of noise, each with its seed and what its noise of E|g|² = 1 makes of each order: profiles that
    /// have a source in common have its noise in common.
    #[must_use]
    pub fn of_sources(sources: impl IntoIterator<Item = (u64, Vec<Complex64>)>, lowest: usize) -> Option<Self> {
        // A coefficient's real and imaginary part have half of its variance each; a level is real.
        let share = |order: usize| if order == 0 { 1.0 } else { 0.5_f64.sqrt() };
        let amplitude = |(order, amplitude): (usize, Complex64)| {
            if order >= lowest && amplitude.is_finite() { share(order) * amplitude } else { Complex64::ZERO }
        };
        let source = |(seed, amplitudes): (u64, Vec<Complex64>)| Source {
            draws: Draws { seed, stride: amplitudes.len(), taken: 0 },
            amplitudes: amplitudes.into_iter().enumerate().map(amplitude).collect(),
        };
        let sources: Vec<Source> = sources.into_iter().map(source).collect();
        let some = sources.iter().flat_map(|source| &source.amplitudes).any(|amplitude| *amplitude != Complex64::ZERO);
        some.then_some(Self { sources })
    }

    /// The errors, scaled so that the next so many draws have the power at each order that all have on average: else the standard
    /// deviation of so few would be off by 1/√(2·draws).
    #[must_use]
    pub(crate) fn balanced(mut self, draws: usize) -> Self {
        for Source { draws: numbers, amplitudes } in &mut self.sources {
            let mut power = vec![0.0; amplitudes.len()];
            let mut ahead = *numbers;
            for _ in 0..draws {
                let mut done = 0;
                for stretch in ahead.next(amplitudes.len()) {
                    let places = power[done..].iter_mut().zip(stretch);
                    places.for_each(|(sum, number)| *sum += number.norm_sqr());
                    done += stretch.len();
                }
            }
            // Real and imaginary part have a variance of 1 each.
            let share = |power: f64| if power > 0.0 { (2.0 * draws as f64 / power).sqrt() } else { 1.0 };
            amplitudes.iter_mut().zip(power).for_each(|(amplitude, power)| *amplitude *= share(power));
        }
        self
    }

    /// The standard deviation of an error at any one angle.
    #[must_use]
    pub fn std_um(&self) -> f64 {
        let amplitudes = self.sources.iter().flat_map(|source| &source.amplitudes);
        amplitudes.map(Complex64::norm_sqr).sum::<f64>().sqrt()
    }

    /// Fills `harmonics` with those of the next errors, independent of all before, by order from 0.
    pub(crate) fn harmonics(&mut self, harmonics: &mut Vec<Complex64>) {
        let orders = self.sources.iter().map(|source| source.amplitudes.len()).max().unwrap_or(0);
        harmonics.clear();
        harmonics.resize(orders, Complex64::ZERO);
        for Source { draws, amplitudes } in &mut self.sources {
            let mut done = 0;
            for stretch in draws.next(amplitudes.len()) {
                let all = done..done + stretch.len();
                let places = harmonics[all.clone()].iter_mut().zip(&amplitudes[all]);
                places.zip(stretch).for_each(|((sum, amplitude), number)| *sum += amplitude * number);
                done += stretch.len();
            }
        }
    }

    /// Fills `errors_um` with the next errors on the equal angles that `fourier` has, independent of all before.
    pub fn fresh(&mut self, fourier: &mut Fourier, errors_um: &mut [f64]) {
        let mut harmonics = Vec::new();
        self.harmonics(&mut harmonics);
        errors_um.copy_from_slice(&fourier.synthesise(harmonics)[..errors_um.len()]);
    }
}

/// The largest of some errors, without sign.
pub(crate) fn largest(errors: &[f64]) -> f64 {
    const LANES: usize = 8;
    // Lanes that do not wait for each other.
    let mut largest = [0.0_f64; LANES];
    for chunk in errors.chunks(LANES) {
        for (error, largest) in chunk.iter().zip(&mut largest) {
            let size = error.abs();
            *largest = if size > *largest { size } else { *largest };
        }
    }
    largest.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// Two profiles of one station: the second has 0.6i of the first one's noise, and 0.8 of its own.
    #[test]
    fn profiles_share_the_noise_of_their_sources() {
        let (orders, order) = (12, 5);
        let of = |share: Complex64| vec![share; orders];
        let own = (1, of(Complex64::ONE));
        let mut first = Errors::of_sources([own.clone()], 2).unwrap();
        let mut second =
            Errors::of_sources([(1, of(Complex64::new(0.0, 0.6))), (2, of(Complex64::from(0.8)))], 2).unwrap();
        assert!((first.std_um() - second.std_um()).abs() < 1e-12);
        let (mut squares, mut product) = ([0.0; 2], Complex64::ZERO);
        let mut harmonics = [Vec::new(), Vec::new()];
        for _ in 0..2000 {
            let [of_first, of_second] = &mut harmonics;
            first.harmonics(of_first);
            second.harmonics(of_second);
            let (a, b) = (of_first[order], of_second[order]);
            squares = [squares[0] + a.norm_sqr(), squares[1] + b.norm_sqr()];
            product += b * a.conj();
        }
        let product = product / (squares[0] * squares[1]).sqrt();
        // 2000 independent draws.
        assert!((squares[0] / squares[1] - 1.0).abs() < 0.1 && (product - Complex64::new(0.0, 0.6)).norm() < 0.06);
        // A source alone draws the same.
        let mut alone = Errors::new(&vec![1.0; orders], 2, 1).unwrap();
        let mut again = Errors::of_sources([own], 2).unwrap();
        let [one, other] = &mut harmonics;
        alone.harmonics(one);
        again.harmonics(other);
        assert_eq!(one, other);
    }

    /// Draws of one seed, and of others, are as independent as numbers of their own would be.
    #[test]
    fn draws_have_no_numbers_in_common() {
        let orders = 1000;
        let mut draws = Draws { seed: 3, stride: orders, taken: 0 };
        let all: Vec<Vec<Complex64>> = (0..100).map(|_| draws.next(orders).flatten().copied().collect()).collect();
        let mut largest: f64 = 0.0;
        for (index, one) in all.iter().enumerate() {
            let power = one.iter().map(Complex64::norm_sqr).sum::<f64>() / orders as f64;
            // 2 ± 2/√1000.
            assert!((power - 2.0).abs() < 0.35, "{index}: {power}");
            for other in &all[..index] {
                let product: Complex64 = one.iter().zip(other).map(|(a, b)| a * b.conj()).sum();
                largest = largest.max(product.norm() / (2.0 * orders as f64));
            }
        }
        // Of 4950 pairs, each 1/√1000 in the root mean square.
        assert!(largest < 0.13, "{largest}");
    }
}
