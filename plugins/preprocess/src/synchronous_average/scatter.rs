//! Covariance of single turns across channels, one harmonic at a time, in one pass.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::{
    Complex64,
    numerics::lanes::{Arithmetic, FusedWork, fused, load},
};

/// Orders that are worked on at once.
const LANES: usize = 8;

/// Sums and products over turns, taken from the first one: what is left is the turns' scatter, so that no digits are lost
/// where the scatter is far below the signal.
///
/// Real and imaginary parts stand apart, in planes `[channel][re, im][order]`.
pub(super) struct Scatter {
    channels: usize,
    orders: usize,
    /// Length of a plane: the orders, and as many zeros as fill the last lanes.
    plane: usize,
    turns: usize,
    /// The first turn, as all planes.
    pivot: Vec<f64>,
    /// The turn under work less the pivot, d.
    turn: Vec<f64>,
    /// Σ d.
    sum: Vec<f64>,
    /// Σ d dᴴ on and below the diagonal, `[row][column ≤ row][re, im][order]`.
    products: Vec<f64>,
    /// Σ d².
    squares: Vec<f64>,
}

impl Scatter {
    pub(super) fn new(orders: usize, channels: usize) -> Self {
        let plane = orders.next_multiple_of(LANES);
        let values = 2 * channels * plane;
        Self {
            channels,
            orders,
            plane,
            turns: 0,
            pivot: vec![0.0; values],
            turn: vec![0.0; values],
            sum: vec![0.0; values],
            products: vec![0.0; 2 * triangle(channels) * plane],
            squares: vec![0.0; values],
        }
    }

    /// Turns taken.
    pub(super) fn turns(&self) -> usize {
        self.turns
    }

    /// Takes one turn's harmonics, `[channel][order]`.
    pub(super) fn add(&mut self, turn: &[Complex64]) {
        self.turns += 1;
        if self.turns == 1 {
            part(turn, self.orders, self.plane, &mut self.pivot);
        } else {
            fused(Summing { scatter: self, turn });
        }
    }

    /// 1/(T−1) Σ (cₜ − mean)(cₜ − mean)ᴴ, `[order][channel][channel]`; `None` below two turns.
    pub(super) fn covariance(&self) -> Option<Vec<Complex64>> {
        if self.turns < 2 {
            return None;
        }
        let (channels, turns) = (self.channels, self.turns as f64);
        let mut covariance = vec![Complex64::ZERO; self.orders * channels * channels];
        for (order, covariance) in covariance.chunks_exact_mut(channels * channels).enumerate() {
            let sum = |channel| self.at(&self.sum, order, channel);
            for row in 0..channels {
                for column in 0..=row {
                    let products = self.at(&self.products, order, triangle(row) + column);
                    let value = (products - sum(row) * sum(column).conj() / turns) / (turns - 1.0);
                    covariance[column * channels + row] = value.conj();
                    covariance[row * channels + column] = value;
                }
                covariance[row * channels + row].im = 0.0;
            }
        }
        Some(covariance)
    }

    /// What turns are off their mean by: 1/(T−1) Σ (cₜ − mean)² and Σ |cₜ − mean|², `[order][channel]`; `None` below two turns.
    pub(super) fn deviations(&self) -> Option<(Vec<Complex64>, Vec<f64>)> {
        let turns = self.turns as f64;
        let each = || (0..self.orders).flat_map(|order| (0..self.channels).map(move |channel| (order, channel)));
        let sum = |order, channel| self.at(&self.sum, order, channel);
        let square = |(order, channel)| {
            (self.at(&self.squares, order, channel) - sum(order, channel).powi(2) / turns) / (turns - 1.0)
        };
        let power = |(order, channel)| {
            let products = self.at(&self.products, order, triangle(channel) + channel).re;
            (products - sum(order, channel).norm_sqr() / turns) / (turns - 1.0)
        };
        (self.turns > 1).then(|| (each().map(square).collect(), each().map(power).collect()))
    }

    /// A number of a pair of planes.
    fn at(&self, planes: &[f64], order: usize, pair: usize) -> Complex64 {
        let re = 2 * pair * self.plane + order;
        Complex64::new(planes[re], planes[re + self.plane])
    }
}

/// A turn on its way into the sums.
struct Summing<'a> {
    scatter: &'a mut Scatter,
    /// `[channel][order]`.
    turn: &'a [Complex64],
}

impl FusedWork for Summing<'_> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        let Scatter { channels, orders, plane, pivot, turn, sum, products, squares, .. } = self.scatter;
        part(self.turn, *orders, *plane, turn);
        for ((value, pivot), sum) in turn.iter_mut().zip(&*pivot).zip(&mut *sum) {
            *value -= pivot;
            *sum += *value;
        }
        for (turn, squares) in turn.chunks_exact(2 * *plane).zip(squares.chunks_exact_mut(2 * *plane)) {
            let ((turn_re, turn_im), (re, im)) = (turn.split_at(*plane), squares.split_at_mut(*plane));
            for (((a, b), re), im) in turn_re.iter().zip(turn_im).zip(re).zip(im) {
                *re = A::mul_add(*a, *a, A::mul_add(-b, *b, *re));
                *im = A::mul_add(2.0 * a, *b, *im);
            }
        }
        let mut products = products.chunks_exact_mut(2 * *plane);
        for row in 0..*channels {
            for column in 0..=row {
                let Some((re, im)) = products.next().map(|pair| pair.split_at_mut(*plane)) else { return };
                let [a, b] = [row, column].map(|channel| turn[2 * channel * *plane..][..2 * *plane].split_at(*plane));
                for first in (0..*plane).step_by(LANES) {
                    let [a_re, a_im, b_re, b_im] = [a.0, a.1, b.0, b.1].map(|part| load::<LANES>(part, first));
                    let (mut real, mut imaginary): ([f64; LANES], [f64; LANES]) = (load(re, first), load(im, first));
                    for lane in 0..LANES {
                        real[lane] = A::mul_add(a_re[lane], b_re[lane], real[lane]);
                    }
                    for lane in 0..LANES {
                        real[lane] = A::mul_add(a_im[lane], b_im[lane], real[lane]);
                    }
                    for lane in 0..LANES {
                        imaginary[lane] = A::mul_add(a_im[lane], b_re[lane], imaginary[lane]);
                    }
                    for lane in 0..LANES {
                        imaginary[lane] = A::mul_add(-a_re[lane], b_im[lane], imaginary[lane]);
                    }
                    re[first..first + LANES].copy_from_slice(&real);
                    im[first..first + LANES].copy_from_slice(&imaginary);
                }
            }
        }
    }
}

/// Sets real and imaginary parts apart, from `[channel][order]` into planes.
#[inline(always)]
fn part(turn: &[Complex64], orders: usize, plane: usize, planes: &mut [f64]) {
    for (turn, planes) in turn.chunks_exact(orders).zip(planes.chunks_exact_mut(2 * plane)) {
        let (re, im) = planes.split_at_mut(plane);
        for ((turn, re), im) in turn.iter().zip(re).zip(im) {
            (*re, *im) = (turn.re, turn.im);
        }
    }
}

/// Entries on and below the diagonal of a square matrix.
fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}
