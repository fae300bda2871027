//! How the channels of a setup turn against its mark, and what the average of its turns keeps of them.

use runout_core::Complex64;

/// How the channels of a setup turn against its mark, and over which turns they are averaged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    /// Every turn, in rad.
    pub run_rad: f64,
    /// From one turn on, in rad.
    pub step_rad: f64,
    /// The turn from which on it is there.
    pub step_at: f64,
    /// First turn that is averaged, and the first that is not any more.
    pub turns: [f64; 2],
}

/// A turn that neither runs nor steps.
impl Default for Turning {
    fn default() -> Self {
        Self { run_rad: 0.0, step_rad: 0.0, step_at: 0.5, turns: [0.0, 1.0] }
    }
}

/// Least |H|: an order that turns by whole periods is lost, and its readings stay finite.
const LEAST: f64 = 1e-3;

impl Turning {
    /// Whether they turn at all.
    #[must_use]
    pub fn is_there(&self) -> bool {
        self.run_rad != 0.0 || self.step_rad != 0.0
    }

    /// H(n).
    #[must_use]
    pub fn response(&self, order: usize) -> Complex64 {
        if !self.is_there() {
            return Complex64::ONE;
        }
        let response = self.of_run(order) * self.of_step(order);
        if response.norm() < LEAST { Complex64::from(LEAST) } else { response }
    }

    /// ∂ln H/∂(run), per rad.
    pub(crate) fn of_run_slope(&self, order: usize) -> Complex64 {
        let ([from, to], number) = (self.turns, order as f64);
        let half = 0.5 * number * (to - from);
        let turned = half * self.run_rad;
        // cot x − 1/x.
        let of_size = if turned.abs() < 1e-3 { -turned / 3.0 } else { turned.tan().recip() - turned.recip() };
        Complex64::new(half * of_size, 0.5 * number * (from + to))
    }

    /// ∂ln H/∂(step), per rad, and ∂ln H/∂(its turn).
    pub(crate) fn of_step_slopes(&self, order: usize) -> [Complex64; 2] {
        let ([from, to], number, behind) = (self.turns, order as f64, self.share_behind());
        let turned = Complex64::cis(number * self.step_rad);
        let is_within = behind > 0.0 && behind < 1.0;
        let place = if is_within { (Complex64::ONE - turned) / (to - from) } else { Complex64::ZERO };
        [Complex64::I * number * behind * turned, place].map(|slope| slope / self.of_step(order))
    }

    fn of_run(&self, order: usize) -> Complex64 {
        let ([from, to], number) = (self.turns, order as f64);
        let turned = 0.5 * number * self.run_rad * (to - from);
        let size = if turned.abs() < 1e-8 { 1.0 } else { turned.sin() / turned };
        Complex64::from_polar(size, 0.5 * number * self.run_rad * (from + to))
    }

    fn of_step(&self, order: usize) -> Complex64 {
        let behind = self.share_behind();
        Complex64::from(1.0 - behind) + Complex64::cis(order as f64 * self.step_rad) * behind
    }

    fn share_behind(&self) -> f64 {
        let [from, to] = self.turns;
        ((to - self.step_at) / (to - from)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of turns that are turned one by one.
    #[test]
    fn the_average_is_that_of_single_turns() {
        let turning = Turning { run_rad: 2e-4, step_rad: 0.01, step_at: 25.0, turns: [10.0, 70.0] };
        for order in [1, 7, 60] {
            let of = |turn: usize| {
                let step = if turn < 25 { 0.0 } else { 0.01 };
                Complex64::cis(order as f64 * (2e-4 * (turn as f64 + 0.5) + step))
            };
            let mean = (10..70).map(of).sum::<Complex64>() / 60.0;
            // A step and a run together are the product to first order only.
            assert!((turning.response(order) - mean).norm() < 0.01 * order as f64, "{order}");
            for alone in [Turning { run_rad: 0.0, ..turning }, Turning { step_rad: 0.0, ..turning }] {
                let of = |turn: usize| {
                    let step = if turn < 25 { 0.0 } else { alone.step_rad };
                    Complex64::cis(order as f64 * (alone.run_rad * (turn as f64 + 0.5) + step))
                };
                let mean = (10..70).map(of).sum::<Complex64>() / 60.0;
                assert!((alone.response(order) - mean).norm() < 1e-4, "{order} {alone:?}");
            }
        }
    }
}
