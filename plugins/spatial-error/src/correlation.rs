//! Correlation by scaled distance, for many pairs of places at once.
//!
//! The exponential is written out, because the standard library's is a call and does not go into vector registers: argument
//! reduction after Cody and Waite, then the Taylor polynomial of order 12 on |r| ≤ ln 2 / 2, below 2 units in the last place.

#![allow(clippy::inline_always, reason = "what is not inlined is compiled for narrow registers")]

use runout_core::numerics::lanes::{Arithmetic, FusedWork, fused};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A family of covariances: correlation R by the distance d, scaled by the range of each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// exp(−d). The range of pykrige is 3 times this one.
    Exponential,
    /// exp(−d²/2).
    Gaussian,
    /// 1 − 1.5 d + 0.5 d³, and 0 from d = 1 on.
    Spherical,
    /// (1 + √3 d) exp(−√3 d).
    #[serde(rename = "matern-3/2")]
    Matern32,
    /// (1 + √5 d + 5 d²/3) exp(−√5 d).
    #[serde(rename = "matern-5/2")]
    Matern52,
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Exponential, Self::Gaussian, Self::Spherical, Self::Matern32, Self::Matern52];

    /// Its name in TOML.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exponential => "exponential",
            Self::Gaussian => "gaussian",
            Self::Spherical => "spherical",
            Self::Matern32 => "matern-3/2",
            Self::Matern52 => "matern-5/2",
        }
    }

    /// Correlation at a scaled distance.
    #[must_use]
    pub fn correlation(self, distance: f64) -> f64 {
        let mut out = [0.0];
        let places = Scaled { axes: [vec![distance], vec![0.0], vec![0.0]] };
        self.correlations(places.from(0), 1.0, [0.0; 3], &mut out);
        out[0]
    }

    /// `factor`·R between each of `places` and one more place.
    pub(crate) fn correlations(self, places: [&[f64]; 3], factor: f64, at: [f64; 3], out: &mut [f64]) {
        match self {
            Self::Exponential => Values::<Exponential>::run(places, factor, at, out),
            Self::Gaussian => Values::<Gaussian>::run(places, factor, at, out),
            Self::Spherical => Values::<Spherical>::run(places, factor, at, out),
            Self::Matern32 => Values::<Matern32>::run(places, factor, at, out),
            Self::Matern52 => Values::<Matern52>::run(places, factor, at, out),
        }
    }

    /// Σ `weights`·R between `places` and each of `queries`, into `out`.
    pub(crate) fn sums(self, places: &Scaled, weights: &[f64], queries: &[[f64; 3]], out: &mut [f64]) {
        match self {
            Self::Exponential => Sums::<Exponential>::run(places, weights, queries, out),
            Self::Gaussian => Sums::<Gaussian>::run(places, weights, queries, out),
            Self::Spherical => Sums::<Spherical>::run(places, weights, queries, out),
            Self::Matern32 => Sums::<Matern32>::run(places, weights, queries, out),
            Self::Matern52 => Sums::<Matern52>::run(places, weights, queries, out),
        }
    }

    /// R, and −2 ∂R/∂(d²), between each of `places` and one more place.
    pub(crate) fn slopes(self, places: &Scaled, at: [f64; 3], values: &mut [f64], slopes: &mut [f64]) {
        match self {
            Self::Exponential => Slopes::<Exponential>::run(places, at, values, slopes),
            Self::Gaussian => Slopes::<Gaussian>::run(places, at, values, slopes),
            Self::Spherical => Slopes::<Spherical>::run(places, at, values, slopes),
            Self::Matern32 => Slopes::<Matern32>::run(places, at, values, slopes),
            Self::Matern52 => Slopes::<Matern52>::run(places, at, values, slopes),
        }
    }
}

/// Places with each coordinate divided by its range, one array an axis.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scaled {
    pub axes: [Vec<f64>; 3],
}

impl Scaled {
    pub(crate) fn of(places: &[[f64; 3]], range_mm: [f64; 3]) -> Self {
        Self { axes: [0, 1, 2].map(|axis| places.iter().map(|place| place[axis] / range_mm[axis]).collect()) }
    }

    pub(crate) fn len(&self) -> usize {
        self.axes[0].len()
    }

    /// Coordinates of the places from one on.
    pub(crate) fn from(&self, first: usize) -> [&[f64]; 3] {
        [0, 1, 2].map(|axis| &self.axes[axis][first..])
    }

    /// One place.
    pub(crate) fn at(&self, place: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.axes[axis][place])
    }
}

/// Sum of products, eight at a time.
#[inline(always)]
fn dot<A: Arithmetic>(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 32];
    let (a_groups, b_groups) = (a.chunks_exact(32), b.chunks_exact(32));
    let rest: f64 = a_groups.remainder().iter().zip(b_groups.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_groups.zip(b_groups) {
        for lane in 0..32 {
            sums[lane] = A::mul_add(a[lane], b[lane], sums[lane]);
        }
    }
    rest + sums.iter().sum::<f64>()
}

/// exp(x) for x ≤ 0; below −700 it is exp(−700).
#[inline(always)]
fn exp<A: Arithmetic>(x: f64) -> f64 {
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    let x = if x > -700.0 { x } else { -700.0 };
    let shifted = A::mul_add(x, std::f64::consts::LOG2_E, SHIFT);
    let n = shifted - SHIFT;
    let r = A::mul_add(n, -LN_2_HIGH, x);
    let r = A::mul_add(n, -LN_2_LOW, r);
    let mut p = 1.0 / 479_001_600.0;
    for factorial in [39_916_800.0, 3_628_800.0, 362_880.0, 40_320.0, 5_040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0] {
        p = A::mul_add(p, r, 1.0 / factorial);
    }
    // The lowest bits of `shifted` are n; the product with 2ⁿ is a sum in the exponent.
    f64::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 52))
}

/// A correlation, by the squared scaled distance.
trait Shape {
    fn value<A: Arithmetic>(square: f64) -> f64;
    /// The value and −2 dR/d(d²).
    fn slope<A: Arithmetic>(square: f64) -> (f64, f64);
}

struct Exponential;
struct Gaussian;
struct Spherical;
struct Matern32;
struct Matern52;

impl Shape for Exponential {
    #[inline(always)]
    fn value<A: Arithmetic>(square: f64) -> f64 {
        exp::<A>(-square.sqrt())
    }

    #[inline(always)]
    fn slope<A: Arithmetic>(square: f64) -> (f64, f64) {
        let distance = square.sqrt();
        let value = exp::<A>(-distance);
        // The product with a squared difference vanishes at distance 0.
        (value, if distance > 0.0 { value / distance } else { 0.0 })
    }
}

impl Shape for Gaussian {
    #[inline(always)]
    fn value<A: Arithmetic>(square: f64) -> f64 {
        exp::<A>(-0.5 * square)
    }

    #[inline(always)]
    fn slope<A: Arithmetic>(square: f64) -> (f64, f64) {
        let value = Self::value::<A>(square);
        (value, value)
    }
}

impl Shape for Spherical {
    #[inline(always)]
    fn value<A: Arithmetic>(square: f64) -> f64 {
        let distance = square.sqrt();
        let distance = if distance < 1.0 { distance } else { 1.0 };
        1.0 - distance * (1.5 - 0.5 * distance * distance)
    }

    #[inline(always)]
    fn slope<A: Arithmetic>(square: f64) -> (f64, f64) {
        let distance = square.sqrt();
        let inside = distance > 0.0 && distance < 1.0;
        (Self::value::<A>(square), if inside { 1.5 * (1.0 - square) / distance } else { 0.0 })
    }
}

impl Shape for Matern32 {
    #[inline(always)]
    fn value<A: Arithmetic>(square: f64) -> f64 {
        let a = (3.0 * square).sqrt();
        (1.0 + a) * exp::<A>(-a)
    }

    #[inline(always)]
    fn slope<A: Arithmetic>(square: f64) -> (f64, f64) {
        let a = (3.0 * square).sqrt();
        let e = exp::<A>(-a);
        ((1.0 + a) * e, 3.0 * e)
    }
}

impl Shape for Matern52 {
    #[inline(always)]
    fn value<A: Arithmetic>(square: f64) -> f64 {
        let a = (5.0 * square).sqrt();
        (1.0 + a + a * a * (1.0 / 3.0)) * exp::<A>(-a)
    }

    #[inline(always)]
    fn slope<A: Arithmetic>(square: f64) -> (f64, f64) {
        let a = (5.0 * square).sqrt();
        let e = exp::<A>(-a);
        ((1.0 + a + a * a * (1.0 / 3.0)) * e, 5.0 / 3.0 * (1.0 + a) * e)
    }
}

#[inline(always)]
fn square<A: Arithmetic>(x: f64, y: f64, z: f64, at: [f64; 3]) -> f64 {
    let (x, y, z) = (x - at[0], y - at[1], z - at[2]);
    A::mul_add(z, z, A::mul_add(y, y, x * x))
}

struct Values<'a, S> {
    axes: [&'a [f64]; 3],
    factor: f64,
    at: [f64; 3],
    out: &'a mut [f64],
    shape: std::marker::PhantomData<S>,
}

impl<'a, S: Shape> Values<'a, S> {
    fn run(axes: [&'a [f64]; 3], factor: f64, at: [f64; 3], out: &'a mut [f64]) {
        fused(Self { axes, factor, at, out, shape: std::marker::PhantomData });
    }
}

impl<S: Shape> FusedWork for Values<'_, S> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        values::<S, A>(self.axes, self.factor, self.at, self.out);
    }
}

#[inline(always)]
fn values<S: Shape, A: Arithmetic>(axes: [&[f64]; 3], factor: f64, at: [f64; 3], out: &mut [f64]) {
    let [x, y, z] = axes;
    for (((out, x), y), z) in out.iter_mut().zip(x).zip(y).zip(z) {
        *out = factor * S::value::<A>(square::<A>(*x, *y, *z, at));
    }
}

struct Sums<'a, S> {
    axes: [&'a [f64]; 3],
    weights: &'a [f64],
    queries: &'a [[f64; 3]],
    out: &'a mut [f64],
    shape: std::marker::PhantomData<S>,
}

impl<'a, S: Shape> Sums<'a, S> {
    fn run(places: &'a Scaled, weights: &'a [f64], queries: &'a [[f64; 3]], out: &'a mut [f64]) {
        let axes = places.from(0);
        fused(Self { axes, weights, queries, out, shape: std::marker::PhantomData });
    }
}

impl<S: Shape> FusedWork for Sums<'_, S> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        let mut row = vec![0.0; self.weights.len()];
        for (query, out) in self.queries.iter().zip(self.out) {
            values::<S, A>(self.axes, 1.0, *query, &mut row);
            *out = dot::<A>(&row, self.weights);
        }
    }
}

struct Slopes<'a, S> {
    axes: [&'a [f64]; 3],
    at: [f64; 3],
    values: &'a mut [f64],
    rates: &'a mut [f64],
    shape: std::marker::PhantomData<S>,
}

impl<'a, S: Shape> Slopes<'a, S> {
    fn run(places: &'a Scaled, at: [f64; 3], values: &'a mut [f64], rates: &'a mut [f64]) {
        let axes = places.from(0);
        fused(Self { axes, at, values, rates, shape: std::marker::PhantomData });
    }
}

impl<S: Shape> FusedWork for Slopes<'_, S> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        let [x, y, z] = self.axes;
        let out = self.values.iter_mut().zip(self.rates);
        for ((((value, slope), x), y), z) in out.zip(x).zip(y).zip(z) {
            (*value, *slope) = S::slope::<A>(square::<A>(*x, *y, *z, self.at));
        }
    }
}

/// Sums of products of one vector with others.
pub(crate) struct Dots<'a, const N: usize> {
    pub one: &'a [f64],
    pub others: [&'a [f64]; N],
    pub out: &'a mut [f64; N],
}

impl<const N: usize> FusedWork for Dots<'_, N> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        for (out, other) in self.out.iter_mut().zip(self.others) {
            *out = dot::<A>(self.one, other);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn the_exponential_is_that_of_the_standard_library() {
        let mut worst: f64 = 0.0;
        for step in 0..70_000 {
            let x = -0.01 * f64::from(step);
            let found = Family::Exponential.correlation(-x);
            worst = worst.max((found / x.exp() - 1.0).abs());
        }
        assert!(worst < 5e-16, "{worst:e}");
        assert!(Family::Gaussian.correlation(1e9) < 1e-300);
    }

    #[test]
    fn slopes_are_those_of_finite_differences() {
        for family in Family::ALL {
            for step in 1..40 {
                let distance = 0.037 * f64::from(step);
                let places = Scaled { axes: [vec![distance], vec![0.0], vec![0.0]] };
                let (mut value, mut slope) = ([0.0], [0.0]);
                family.slopes(&places, [0.0; 3], &mut value, &mut slope);
                let h = 1e-5;
                let by_difference = (family.correlation(distance + h) - family.correlation(distance - h)) / (2.0 * h);
                // −2 dR/d(d²) = −(dR/dd)/d
                assert!((value[0] - family.correlation(distance)).abs() < 1e-15, "{family:?}");
                assert!((slope[0] * distance + by_difference).abs() < 1e-8, "{family:?} at {distance}");
            }
        }
    }
}
