//! What a line does to single turns, and the amplitudes that fit them best.

use std::f64::consts::TAU;

use runout_core::{Complex64, profile::Turns};

/// The turns of a setup in the layout's order of channels.
pub(super) struct Capture<'a> {
    pub turns: &'a Turns,
    pub channels: Vec<usize>,
    pub fitted: usize,
    /// Mean length of a turn, in samples.
    pub turn_samples: f64,
}

/// What a line keeps to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fixed {
    /// Periods a turn, as motion of the machine.
    Order,
    /// Periods a second, as the mains: its order differs where captures differ in speed. The length of the turns that its
    /// order counts in, in samples.
    Time { turn_samples: f64 },
}

impl Capture<'_> {
    /// Order of a line in this capture.
    pub(crate) fn order(&self, line: f64, fixed: Fixed) -> f64 {
        match fixed {
            Fixed::Order => line,
            Fixed::Time { turn_samples } => line * self.turn_samples / turn_samples,
        }
    }

    /// Periods of a line since the capture's first turn when a turn begins.
    fn periods(&self, turn: usize, line: f64, fixed: Fixed) -> f64 {
        match fixed {
            Fixed::Order => line * self.turns.numbers[turn] as f64,
            Fixed::Time { turn_samples } => line * (self.turns.spans[turn][0] - self.turns.spans[0][0]) / turn_samples,
        }
    }

    /// By how many periods a line of a fixed order and one of another kind come apart over the turns.
    pub(crate) fn apart(&self, line: f64, fixed: Fixed) -> f64 {
        let each = (0..self.turns.count())
            .map(|turn| self.periods(turn, line, fixed) - self.periods(turn, line, Fixed::Order));
        let (low, high) =
            each.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), one| (low.min(one), high.max(one)));
        high - low
    }

    /// What a line does to turns.
    pub(crate) fn shape(&self, line: f64, fixed: Fixed, orders: usize) -> Shape {
        let order = self.order(line, fixed);
        Shape { sides: (0..orders).map(|harmonic| sides(order, harmonic as f64)).collect() }
    }

    /// Phase of a line at the start of a turn.
    pub(crate) fn phase(&self, turn: usize, line: f64, fixed: Fixed) -> Complex64 {
        Complex64::cis(TAU * self.periods(turn, line, fixed).fract())
    }
}

/// Harmonics of a turn that a line begins at phase 0.
pub(super) struct Shape {
    /// `[harmonic][forward, backward]`.
    sides: Vec<[Complex64; 2]>,
}

impl Shape {
    /// Coefficients cₙ of Re(a e^{iνθ}) for a = 1 and a = i, the line beginning at a phase.
    pub(crate) fn at(&self, phase: Complex64, harmonic: usize) -> [Complex64; 2] {
        let [forward, backward] = self.sides[harmonic];
        let (forward, backward) = (phase * forward, phase.conj() * backward);
        [forward + backward, Complex64::I * (forward - backward)]
    }
}

fn sides(line: f64, harmonic: f64) -> [Complex64; 2] {
    let whole = |x: f64| {
        // ∫₀^{2π} e^{ixφ} dφ / 2π
        if x.abs() < 1e-9 { Complex64::ONE } else { (Complex64::cis(TAU * x) - 1.0) / Complex64::new(0.0, TAU * x) }
    };
    let scale = if harmonic == 0.0 { 0.5 } else { 1.0 };
    [whole(line + harmonic) * scale, whole(harmonic - line) * scale]
}

/// Amplitudes `[setup][channel]` that fit the turns to be fitted best, and the sum of squares that they explain in each.
pub(super) struct Amplitudes {
    pub found: Vec<Vec<Complex64>>,
    pub explained: Vec<Vec<f64>>,
}

impl Amplitudes {
    pub(crate) fn new(captures: &[Capture], line: f64, fixed: Fixed) -> Self {
        let mut all = Self { found: Vec::new(), explained: Vec::new() };
        for capture in captures {
            let (turns, low) = (capture.fitted, capture.turns.orders);
            let shape = capture.shape(line, fixed, low);
            let mut columns = vec![[Complex64::ZERO; 2]; turns * low];
            for (turn, columns) in columns.chunks_exact_mut(low).enumerate() {
                let phase = capture.phase(turn, line, fixed);
                columns.iter_mut().enumerate().for_each(|(order, column)| *column = shape.at(phase, order));
            }
            // About the mean over the turns.
            for order in 0..low {
                let mut mean = [Complex64::ZERO; 2];
                for column in columns[order..].iter().step_by(low) {
                    mean.iter_mut().zip(column).for_each(|(mean, value)| *mean += value / turns as f64);
                }
                for column in columns[order..].iter_mut().step_by(low) {
                    column.iter_mut().zip(mean).for_each(|(value, mean)| *value -= mean);
                }
            }
            let dot = |a: Complex64, b: Complex64| a.re * b.re + a.im * b.im;
            let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
            for [a, b] in &columns {
                aa += dot(*a, *a);
                ab += dot(*a, *b);
                bb += dot(*b, *b);
            }
            let determinant = (aa * bb - ab * ab).max(f64::MIN_POSITIVE);
            let of_channel = |channel: &usize| {
                let (mut a, mut b) = (0.0, 0.0);
                let values = capture.turns.harmonics.iter().skip(*channel).step_by(capture.turns.channels);
                for ([of_a, of_b], value) in columns.iter().zip(values) {
                    a += dot(*of_a, *value);
                    b += dot(*of_b, *value);
                }
                let found = Complex64::new(a * bb - b * ab, b * aa - a * ab) / determinant;
                (found, a * found.re + b * found.im)
            };
            let (found, explained) = capture.channels.iter().map(of_channel).unzip();
            all.found.push(found);
            all.explained.push(explained);
        }
        all
    }

    /// Sum of squares that they explain.
    pub(crate) fn all_explained(&self) -> f64 {
        self.explained.iter().flatten().sum()
    }
}
