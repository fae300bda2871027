//! Cubic B-splines on even knots, and their least squares by Givens rotations of a banded matrix.

/// Knots of splines that follow a wave.
const KNOTS_A_WAVE: f64 = 8.0;
/// Splines that differ from 0 at one place.
pub(crate) const WIDTH: usize = 4;
/// A diagonal entry below this share of the largest belongs to a spline that no reading determines.
const DETERMINED: f64 = 1e-9;

/// Even knots, with a spline beyond each end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knots {
    first: f64,
    step: f64,
    intervals: usize,
}

/// The splines at one place: the first of four, their values and their derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Local {
    pub start: usize,
    pub value: [f64; WIDTH],
    pub slope: [f64; WIDTH],
}

impl Local {
    /// The spline's value with these coefficients.
    pub(crate) fn of(&self, coefficients: &[f64]) -> f64 {
        self.value.iter().zip(&coefficients[self.start..]).map(|(weight, entry)| weight * entry).sum()
    }

    /// Its derivative.
    pub(crate) fn slope_of(&self, coefficients: &[f64]) -> f64 {
        self.slope.iter().zip(&coefficients[self.start..]).map(|(weight, entry)| weight * entry).sum()
    }
}

impl Knots {
    /// Knots over a range, about `step` apart.
    pub(crate) fn over([first, last]: [f64; 2], step: f64) -> Self {
        let intervals = ((last - first) / step).ceil().max(1.0);
        Self { first, step: (last - first) / intervals, intervals: intervals as usize }
    }

    /// Knots whose splines follow all waves that are not shorter than `shortest_mm`: they leave less than 0.1 % of the shortest.
    pub(crate) fn for_waves(range: [f64; 2], shortest_mm: f64) -> Self {
        Self::over(range, shortest_mm / KNOTS_A_WAVE)
    }

    /// Number of splines.
    pub(crate) fn splines(&self) -> usize {
        self.intervals + WIDTH - 1
    }

    /// The splines at a place; beyond the range, the outermost polynomials.
    pub(crate) fn at(&self, place: f64) -> Local {
        let position = (place - self.first) / self.step;
        let start = (position.max(0.0) as usize).min(self.intervals - 1);
        let t = position - start as f64;
        let s = 1.0 - t;
        let value = [
            s * s * s / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0,
        ];
        let slope = [-0.5 * s * s, 1.5 * t * t - 2.0 * t, 2.0 * s - 1.5 * s * s, 0.5 * t * t];
        Local { start, value, slope: slope.map(|entry| entry / self.step) }
    }
}

/// A banded least-squares problem, factored row by row (Golub, Van Loan, *Matrix Computations*, 4th ed., section 5.2.5),
/// with several right-hand sides.
pub(crate) struct Banded {
    /// R, each row from its diagonal on.
    upper: Vec<[f64; WIDTH]>,
    /// Qᵀ·b, `[unknown][right-hand side]`.
    right: Vec<Vec<f64>>,
}

impl Banded {
    pub(crate) fn new(unknowns: usize, sides: usize) -> Self {
        Self { upper: vec![[0.0; WIDTH]; unknowns], right: vec![vec![0.0; sides]; unknowns] }
    }

    /// Adds one equation. Equations are best added in the order of `start`.
    pub(crate) fn add(&mut self, start: usize, mut weights: [f64; WIDTH], sides: &mut [f64]) {
        for (upper, right) in self.upper.iter_mut().zip(&mut self.right).skip(start) {
            if weights.iter().all(|weight| *weight == 0.0) {
                return;
            }
            if weights[0] != 0.0 {
                let length = upper[0].hypot(weights[0]);
                let (cosine, sine) = (upper[0] / length, weights[0] / length);
                for (upper, weight) in upper.iter_mut().zip(&mut weights) {
                    (*upper, *weight) = (cosine * *upper + sine * *weight, cosine * *weight - sine * *upper);
                }
                for (right, side) in right.iter_mut().zip(sides.iter_mut()) {
                    (*right, *side) = (cosine * *right + sine * *side, cosine * *side - sine * *right);
                }
            }
            weights = [weights[1], weights[2], weights[3], 0.0];
        }
    }

    fn floor(&self) -> f64 {
        DETERMINED * self.upper.iter().map(|row| row[0].abs()).fold(0.0, f64::max)
    }

    /// Unknowns that the equations determine.
    pub(crate) fn rank(&self) -> usize {
        let floor = self.floor();
        self.upper.iter().filter(|row| row[0].abs() > floor).count()
    }

    /// The solutions, `[right-hand side][unknown]`; an unknown that nothing determines is 0.
    pub(crate) fn solve(&self) -> Vec<Vec<f64>> {
        let floor = self.floor();
        let sides = self.right.first().map_or(0, Vec::len);
        let mut solutions = vec![vec![0.0; self.upper.len()]; sides];
        for (row, (upper, right)) in self.upper.iter().zip(&self.right).enumerate().rev() {
            if upper[0].abs() <= floor {
                continue;
            }
            for (solution, right) in solutions.iter_mut().zip(right) {
                let known: f64 = upper[1..].iter().zip(&solution[row + 1..]).map(|(a, b)| a * b).sum();
                solution[row] = (right - known) / upper[0];
            }
        }
        solutions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_follow_the_shortest_wave() {
        for phase in [0.0, 0.9, 2.0] {
            let knots = Knots::for_waves([0.0, 300.0], 50.0);
            let wave = |z: f64| (std::f64::consts::TAU * z / 50.0 + phase).sin();
            let mut problem = Banded::new(knots.splines(), 1);
            for index in 0..1200 {
                let at = knots.at(0.25 * f64::from(index));
                problem.add(at.start, at.value, &mut [wave(0.25 * f64::from(index))]);
            }
            let found = &problem.solve()[0];
            let left = (0..1200).map(|index| 0.25 * f64::from(index)).map(|z| knots.at(z).of(found) - wave(z));
            assert!((left.map(|left| left * left).sum::<f64>() / 600.0).sqrt() < 1e-3);
        }
    }

    #[test]
    fn splines_make_every_cubic_and_its_derivative() {
        let knots = Knots::over([-1.0, 6.0], 0.9);
        let cubic = |z: f64| 2.0 - z + 0.5 * z * z - 0.1 * z.powi(3);
        let slope = |z: f64| -1.0 + z - 0.3 * z * z;
        let mut problem = Banded::new(knots.splines(), 1);
        for index in 0..40 {
            let z = -1.0 + 7.0 * f64::from(index) / 39.0;
            let at = knots.at(z);
            problem.add(at.start, at.value, &mut [cubic(z)]);
        }
        assert_eq!(problem.rank(), knots.splines());
        let found = &problem.solve()[0];
        for z in [-1.0, 0.3, 2.75, 5.999, 6.0] {
            let at = knots.at(z);
            // 1e-11: rounding of numbers near 20.
            assert!((at.of(found) - cubic(z)).abs() < 1e-11, "{z}");
            assert!((at.slope_of(found) - slope(z)).abs() < 1e-10, "{z}");
        }
    }

    #[test]
    fn what_no_reading_determines_is_left_out() {
        let knots = Knots::over([0.0, 10.0], 1.0);
        let mut problem = Banded::new(knots.splines(), 1);
        for index in 0..12 {
            let at = knots.at(0.25 * f64::from(index));
            problem.add(at.start, at.value, &mut [1.0]);
        }
        assert_eq!(problem.rank(), 6, "three intervals have readings");
        let found = &problem.solve()[0];
        assert!((knots.at(1.7).of(found) - 1.0).abs() < 1e-12 && found.iter().all(|entry| entry.is_finite()));
    }
}
