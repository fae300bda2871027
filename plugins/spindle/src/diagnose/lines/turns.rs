//! What a line does to single turns, and the amplitudes that fit them best.

use std::{f64::consts::TAU, ops::Range};

use runout_core::{Complex64, neighbours::Neighbours, profile::Turns};

use crate::diagnose::drift::Part;

/// The turns of a setup, without the lines that are known.
#[derive(Clone)]
pub(super) struct Capture {
    pub turns: Turns,
    /// The turns' channels in the layout's order.
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

impl Capture {
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

    /// A line of these amplitudes.
    pub(crate) fn line(&self, line: f64, fixed: Fixed, amplitudes: &[Complex64]) -> InCapture {
        let phases = (0..self.turns.count()).map(|turn| self.phase(turn, line, fixed)).collect();
        InCapture { order: self.order(line, fixed), phases, fitted: self.fitted, amplitudes: amplitudes.to_vec() }
    }

    /// Adds a line to the turns, or takes it out of them where `times` is −1.
    pub(crate) fn add(&mut self, line: &InCapture, times: f64) {
        let (orders, width) = (self.turns.orders, self.turns.channels);
        let sides: Vec<_> = (0..orders).map(|order| sides(line.order, order as f64)).collect();
        for (turn, phase) in self.turns.harmonics.chunks_exact_mut(orders * width).zip(&line.phases) {
            for (values, [forward, backward]) in turn.chunks_exact_mut(width).zip(&sides) {
                let (forward, backward) = (times * phase * forward, times * phase.conj() * backward);
                for (channel, amplitude) in self.channels.iter().zip(&line.amplitudes) {
                    values[*channel] += forward * amplitude + backward * amplitude.conj();
                }
            }
        }
    }
}

/// A line in one capture: Re(a e^{iνθ}) in each channel.
#[derive(Debug, Clone)]
pub(super) struct InCapture {
    /// ν.
    pub order: f64,
    /// At the start of each turn.
    phases: Vec<Complex64>,
    /// Turns that are fitted: the first.
    fitted: usize,
    /// a of each channel.
    pub amplitudes: Vec<Complex64>,
}

impl InCapture {
    fn turns(&self, part: Part) -> Range<usize> {
        match part {
            Part::Fitted => 0..self.fitted,
            Part::HeldOut => self.fitted..self.phases.len(),
            Part::All => 0..self.phases.len(),
        }
    }

    /// What it puts into the mean of some turns at an order, in one channel.
    pub(crate) fn leak(&self, part: Part, order: usize, channel: usize) -> Complex64 {
        // The mean phase is no phase, but turns add up one by one.
        let phase = mean(&self.phases[self.turns(part)]);
        let ([forward, backward], amplitude) = (sides(self.order, order as f64), self.amplitudes[channel]);
        phase * forward * amplitude + phase.conj() * backward * amplitude.conj()
    }

    /// Variance of an order over some turns in one channel, over the number of turns, by order from 0.
    pub(crate) fn scatter(&self, part: Part, orders: usize, channel: usize) -> Vec<f64> {
        let phases = &self.phases[self.turns(part)];
        let (center, count) = (mean(phases), phases.len() as f64);
        let off = || phases.iter().map(|phase| phase - center);
        let squares: f64 = off().map(|off| off.norm_sqr()).sum();
        let turned: Complex64 = off().map(|off| off * off).sum();
        let amplitude = self.amplitudes[channel];
        let of = |order: usize| {
            let [forward, backward] = sides(self.order, order as f64);
            let (forward, backward) = (forward * amplitude, backward * amplitude.conj());
            let sum =
                (forward.norm_sqr() + backward.norm_sqr()) * squares + 2.0 * (forward * backward.conj() * turned).re;
            sum / (count * (count - 1.0))
        };
        (0..orders).map(of).collect()
    }

    /// Takes it out of what stands beside whole orders in a record of some turns, in one of the record's channels.
    pub(crate) fn take_out_of(&self, neighbours: &mut Neighbours, part: Part, channel: usize, into: usize) {
        let phases = &self.phases[self.turns(part)];
        let (count, amplitude) = (phases.len().max(1) as f64, self.amplitudes[channel]);
        let center = mean(phases);
        neighbours.take_out(into, |slow| {
            let (mut forward, mut backward) = (Complex64::ZERO, Complex64::ZERO);
            for (turn, phase) in phases.iter().enumerate() {
                let slow = slow.phase(turn) / count;
                forward += slow * (phase - center);
                backward += slow * (phase - center).conj();
            }
            let (forward, backward) = (0.5 * forward * amplitude, 0.5 * backward * amplitude.conj());
            move |at| forward * within(at + self.order) + backward * within(at - self.order)
        });
    }
}

fn mean(values: &[Complex64]) -> Complex64 {
    values.iter().sum::<Complex64>() / values.len().max(1) as f64
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
    let scale = if harmonic == 0.0 { 0.5 } else { 1.0 };
    [within(line + harmonic) * scale, within(harmonic - line) * scale]
}

/// ∫₀^{2π} e^{ixφ} dφ / 2π.
fn within(x: f64) -> Complex64 {
    if x.abs() < 1e-9 { Complex64::ONE } else { (Complex64::cis(TAU * x) - 1.0) / Complex64::new(0.0, TAU * x) }
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
