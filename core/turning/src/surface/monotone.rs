//! Monotone piecewise cubic interpolation on uneven knots.
//!
//! F. N. Fritsch, R. E. Carlson, "Monotone piecewise cubic interpolation", SIAM J. Numer. Anal. 17(2), 238-246 (1980);
//! slopes as weighted harmonic means after F. N. Fritsch, J. Butland, "A method for constructing local monotone piecewise
//! cubic interpolants", SIAM J. Sci. Stat. Comput. 5(2), 300-304 (1984). Between two knots the curve never leaves the
//! range of their two values.

/// Knots that a value depends on, at most.
pub(super) const STENCIL: usize = 4;

/// A position among ascending knots: the interval that it lies in, with one neighbour at each side where there is one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stencil {
    first: usize,
    knots: usize,
    /// The interval's lower knot, counted from `first`: 0 or 1.
    lower: usize,
    widths: [f64; STENCIL - 1],
    /// Place within the interval, 0 to 1.
    fraction: f64,
}

impl Stencil {
    /// Finds the interval; `None` outside the knots, or with fewer than two.
    pub(super) fn locate(knots: &[f64], at: f64) -> Option<Self> {
        let (start, end) = (*knots.first()?, *knots.last()?);
        if knots.len() < 2 || !(start..=end).contains(&at) {
            return None;
        }
        let interval = knots.partition_point(|knot| *knot <= at).saturating_sub(1).min(knots.len() - 2);
        let first = interval.saturating_sub(1);
        let last = (interval + 2).min(knots.len() - 1);
        let mut widths = [1.0; STENCIL - 1];
        for (width, pair) in widths.iter_mut().zip(knots[first..=last].windows(2)) {
            *width = pair[1] - pair[0];
        }
        let lower = interval - first;
        let fraction = (at - knots[interval]) / widths[lower];
        Some(Self { first, knots: last - first + 1, lower, widths, fraction })
    }

    /// Index of the stencil's knot, the last one standing in for those that it lacks.
    pub(super) fn knot(&self, index: usize) -> usize {
        self.first + index.min(self.knots - 1)
    }

    /// The interpolated value, from those at [`knot`](Self::knot) 0 to 3.
    pub(super) fn value(&self, values: [f64; STENCIL]) -> f64 {
        let h = &self.widths;
        let secant = |index: usize| (values[index + 1] - values[index]) / h[index];
        let lower = self.lower;
        let here = secant(lower);
        let before = (lower > 0).then(|| (h[lower - 1], secant(lower - 1)));
        let after = (lower + 2 < self.knots).then(|| (h[lower + 1], secant(lower + 1)));
        let width = h[lower];
        let (left, right) = match (before, after) {
            (None, None) => (here, here),
            (Some(before), None) => (inner_slope(before, (width, here)), end_slope((width, here), before)),
            (None, Some(after)) => (end_slope((width, here), after), inner_slope((width, here), after)),
            (Some(before), Some(after)) => (inner_slope(before, (width, here)), inner_slope((width, here), after)),
        };
        let t = self.fraction;
        let s = 1.0 - t;
        s * s * (1.0 + 2.0 * t) * values[lower]
            + t * t * (1.0 + 2.0 * s) * values[lower + 1]
            + width * t * s * (s * left - t * right)
    }
}

/// Slope at a knot between two intervals (width, secant): 0 at an extremum, else the harmonic mean of the secants, in
/// which the narrower interval's counts more.
fn inner_slope((width0, secant0): (f64, f64), (width1, secant1): (f64, f64)) -> f64 {
    if secant0 * secant1 <= 0.0 {
        return 0.0;
    }
    let weight0 = width0 + 2.0 * width1;
    let weight1 = 2.0 * width0 + width1;
    (weight0 + weight1) / (weight0 / secant0 + weight1 / secant1)
}

/// Slope at an end: of the parabola through the three last knots, limited to what keeps the end interval monotone.
fn end_slope((width0, secant0): (f64, f64), (width1, secant1): (f64, f64)) -> f64 {
    let slope = ((2.0 * width0 + width1) * secant0 - width0 * secant1) / (width0 + width1);
    if slope * secant0 <= 0.0 {
        0.0
    } else if secant0 * secant1 <= 0.0 && slope.abs() > 3.0 * secant0.abs() {
        3.0 * secant0
    } else {
        slope
    }
}
