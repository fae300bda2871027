//! Speeds at which a natural frequency is a multiple of the speed: lines of the Campbell diagram that cross.

use std::collections::BTreeMap;

use runout_core::Result;

use crate::modal::{Modal, Mode};

/// A mode whose frequency is `ratio` times the speed.
#[derive(Debug, Clone)]
pub struct Crossing {
    /// In rad/s.
    pub speed: f64,
    /// The mode at this speed.
    pub mode: Mode,
}

/// Relative accuracy of a crossing of a damped rotor.
const ACCURACY: f64 = 1e-9;
/// Crossings closer than this are at one speed, relative.
const SAME: f64 = 10.0 * ACCURACY;
/// A difference that is this many times as large as the accuracy, with the speed known to the accuracy, is a jump.
const JUMP: f64 = 100.0;
/// Steps of a search; bisection alone needs 30.
const MOST_STEPS: usize = 60;

/// Finds crossings of one rotor, and keeps the frequencies that it computes on the way.
pub struct Search<'a> {
    modal: &'a Modal,
    known: BTreeMap<u64, Vec<f64>>,
}

impl<'a> Search<'a> {
    /// A search for this rotor.
    #[must_use]
    pub fn new(modal: &'a Modal) -> Self {
        Self { modal, known: BTreeMap::new() }
    }

    /// The lowest crossings, ascending. Without damping they are eigenvalues of their own; with damping, roots of
    /// ωₙ(Ω) − ratio·Ω, whose every value is an eigenvalue problem at its speed.
    ///
    /// # Errors
    /// When eigenvalues do not converge.
    pub fn crossings(&mut self, ratio: f64, count: usize) -> Result<Vec<Crossing>> {
        let mut undamped = self.modal.crossings(ratio)?;
        if self.modal.is_conservative() {
            undamped.truncate(count);
            return Ok(undamped.into_iter().map(|(speed, mode)| Crossing { speed, mode }).collect());
        }
        let roots =
            self.roots(ratio, count, &undamped.iter().map(|(speed, _)| *speed).collect::<Vec<_>>(), ACCURACY)?;
        let same = |a: &(f64, usize), b: &(f64, usize)| b.0 - a.0 <= SAME * b.0;
        roots.chunk_by(same).map(|roots| self.at(roots)).collect::<Result<Vec<_>>>().map(|found| found.concat())
    }

    /// Speeds of the lowest crossings, ascending, with a relative accuracy of one in a thousand.
    ///
    /// # Errors
    /// When eigenvalues do not converge.
    pub fn speeds(&mut self, ratio: f64, count: usize) -> Result<Vec<f64>> {
        let undamped: Vec<f64> = self.modal.crossings(ratio)?.into_iter().map(|(speed, _)| speed).collect();
        if self.modal.is_conservative() {
            return Ok(undamped.into_iter().take(count).collect());
        }
        Ok(self.roots(ratio, count, &undamped, 1e-3)?.into_iter().map(|(speed, _)| speed).collect())
    }

    /// Roots and the number of their frequency among all at that speed, in the order of speed.
    fn roots(&mut self, ratio: f64, count: usize, undamped: &[f64], accuracy: f64) -> Result<Vec<(f64, usize)>> {
        let mut found = Vec::new();
        let mut low = 0.0;
        for high in grid(undamped, count) {
            let (at_low, at_high) = (self.frequencies(low)?.clone(), self.frequencies(high)?.clone());
            for number in 0..at_low.len() {
                let (first, last) = (at_low[number] - ratio * low, at_high[number] - ratio * high);
                // Motion that does not oscillate at either end meets no line.
                if at_high[number].max(at_low[number]) > 0.0 && (first > 0.0) != (last > 0.0) {
                    let root = self.root(ratio, number, (low, first), (high, last), accuracy)?;
                    found.extend(root.map(|speed| (speed, number)));
                }
            }
            low = high;
            if found.len() >= count {
                break;
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(count);
        Ok(found)
    }

    /// The Illinois variant of the false position (Dowell and Jarratt 1971). `None` where the difference jumps over 0, as a motion
    /// begins to oscillate there.
    fn root(
        &mut self,
        ratio: f64,
        number: usize,
        (mut low, mut at_low): (f64, f64),
        (mut high, mut at_high): (f64, f64),
        accuracy: f64,
    ) -> Result<Option<f64>> {
        for _ in 0..MOST_STEPS {
            let middle = (low * at_high - high * at_low) / (at_high - at_low);
            let value = self.frequencies(middle)?[number] - ratio * middle;
            let near = accuracy * ratio * middle;
            if value.abs() <= near || (high - low).abs() <= accuracy * high {
                return Ok(Some(middle).filter(|_| value.abs() <= JUMP * near));
            }
            if (value > 0.0) == (at_high > 0.0) {
                (high, at_high) = (middle, value);
                at_low *= 0.5;
            } else {
                (low, at_low) = (high, at_high);
                (high, at_high) = (middle, value);
            }
        }
        Ok(None)
    }

    /// The modes of roots at one speed, by the numbers of their frequencies among all.
    ///
    /// They are of one eigenvalue problem: where two frequencies are equal but for rounding (one mode grows and the other decays as fast), which
    /// of them comes first changes with the speed by chance.
    fn at(&self, roots: &[(f64, usize)]) -> Result<Vec<Crossing>> {
        let speed = roots.iter().map(|(speed, _)| speed).sum::<f64>() / roots.len() as f64;
        let modes = self.modal.at(speed)?;
        let still = self.modal.size().saturating_sub(modes.len());
        let mode = |number: usize| Some(Crossing { speed, mode: modes.get(number.checked_sub(still)?)?.clone() });
        Ok(roots.iter().filter_map(|(_, number)| mode(*number)).collect())
    }

    fn frequencies(&mut self, speed: f64) -> Result<&Vec<f64>> {
        let key = speed.to_bits();
        if !self.known.contains_key(&key) {
            let found = self.modal.frequencies(speed)?;
            self.known.insert(key, found);
        }
        Ok(&self.known[&key])
    }
}

/// Speeds between the crossings of the undamped rotor, and above them.
fn grid(undamped: &[f64], count: usize) -> Vec<f64> {
    let mut speeds: Vec<f64> = Vec::new();
    for pair in undamped.windows(2).take(count + 2) {
        // Nearer crossings are those of two planes: each has a frequency of its own.
        if pair[1] > 1.02 * pair[0] {
            speeds.push((pair[0] * pair[1]).sqrt());
        }
    }
    let last = undamped.get(..undamped.len().min(count + 3)).and_then(<[f64]>::last).copied().unwrap_or(0.0);
    if last > 0.0 {
        // Damping can hold a rotor at its bearings and raise frequencies above those without it.
        speeds.extend([1.1 * last, 1.5 * last, 2.5 * last]);
    }
    speeds
}
