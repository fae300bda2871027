//! What stands beside each whole order in a record of turns: what is not synchronous.

use std::f64::consts::TAU;

use runout_numerics::Complex64;

/// Coefficients of a record of turns beside a whole order n, at n ± k/P: the power that the mean takes at n from what is not
/// synchronous. Their mean square is the covariance of the mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbours {
    /// P, in turns.
    pub period: usize,
    /// Channels.
    pub channels: usize,
    /// Equal angles of a turn.
    pub angles: usize,
    /// Of e^{−2πikm/P} over the turns at n and −n, k = 1, 2, …: `[k][side][order][channel]`, in µm.
    pub coefficients: Vec<Vec<Complex64>>,
}

impl Neighbours {
    /// Number of its coefficients.
    #[must_use]
    pub fn count(&self) -> usize {
        self.coefficients.iter().map(Vec::len).sum()
    }

    /// Covariance of the mean across channels, `[order][channel][channel]`.
    #[must_use]
    pub fn covariance(&self) -> Vec<Complex64> {
        let channels = self.channels;
        let orders = self.coefficients.first().map_or(0, |side| side.len() / channels.max(1));
        let mut covariance = vec![Complex64::ZERO; orders * channels * channels];
        let scale = 1.0 / self.coefficients.len() as f64;
        for side in &self.coefficients {
            let each = side.chunks_exact(channels).zip(covariance.chunks_exact_mut(channels * channels));
            for (values, covariance) in each {
                for (place, (row, target)) in values.iter().zip(covariance.chunks_exact_mut(channels)).enumerate() {
                    let row = row * scale;
                    target.iter_mut().zip(&values[..=place]).for_each(|(to, column)| *to += row * column.conj());
                }
            }
        }
        for covariance in covariance.chunks_exact_mut(channels * channels) {
            for row in 0..channels {
                covariance[row * channels + row].im = 0.0;
                for column in 0..row {
                    covariance[column * channels + row] = covariance[row * channels + column].conj();
                }
            }
        }
        covariance
    }

    /// Multiplies each order and channel, `[order][channel]`, on both sides.
    pub(crate) fn multiply(&mut self, gain: &[Complex64]) {
        self.coefficients
            .iter_mut()
            .for_each(|side| side.iter_mut().zip(gain).for_each(|(value, gain)| *value *= gain));
    }

    /// Takes a known signal out of a channel: `of` gives, for each [`Beside`], the mean of the signal times e^{iνθ} over the record as a
    /// function of ν, θ counted from each turn's start. Nothing happens to a channel that is not there.
    pub fn take_out<At: Fn(f64) -> Complex64>(&mut self, channel: usize, of: impl Fn(Beside) -> At) {
        if channel >= self.channels {
            return;
        }
        for (index, values) in self.coefficients.iter_mut().enumerate() {
            let (beside, side) = (Beside { by: index / 2 + 1, period: self.period }, index % 2);
            let (at, share) = (of(beside), beside.by as f64 / self.period as f64);
            for order in 0..values.len() / self.channels {
                let nu = if side == 0 { order as f64 } else { -(order as f64) } - share;
                let found = at(nu) * if order == 0 { 1.0 } else { 2.0 };
                values[order * self.channels + channel] -= if side == 0 { found } else { found.conj() };
            }
        }
    }

    /// Takes out what a channel creeps: `course` gives each turn's mean level and its rise over the turn, in µm.
    pub fn take_out_course(&mut self, channel: usize, course: &[[f64; 2]]) {
        let count = course.len().max(1) as f64;
        let [level, rise] = [0, 1].map(|which| course.iter().map(|turn| turn[which]).sum::<f64>() / count);
        let angles = self.angles;
        self.take_out(channel, |beside| {
            let (mut levels, mut rises) = (Complex64::ZERO, Complex64::ZERO);
            for (turn, [of_level, of_rise]) in course.iter().enumerate() {
                let phase = beside.phase(turn) / count;
                levels += phase * (of_level - level);
                rises += phase * (of_rise - rise);
            }
            move |nu| {
                let [flat, ramp] = ramp(nu, angles);
                levels * flat + rises * ramp
            }
        });
    }
}

/// A place k beside a whole order in a record of P turns.
#[derive(Debug, Clone, Copy)]
pub struct Beside {
    by: usize,
    period: usize,
}

impl Beside {
    /// e^{−2πikm/P} of the m-th turn.
    #[must_use]
    pub fn phase(self, turn: usize) -> Complex64 {
        Complex64::cis(-TAU * ((self.by * turn % self.period) as f64 / self.period as f64))
    }
}

/// Means of e^{iνφ} and of (φ/2π − ½)·e^{iνφ} over L equal angles from 0, ν not whole.
fn ramp(nu: f64, angles: usize) -> [Complex64; 2] {
    let count = angles as f64;
    let step = Complex64::cis(TAU * nu / count);
    let whole = Complex64::cis(TAU * nu);
    // Sums of a geometric series and of its terms times their number.
    let flat = (whole - 1.0) / (step - 1.0);
    let ramp = (whole * count - step * flat) / (step - 1.0);
    [flat / count, ramp / (count * count) - flat / (2.0 * count)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_the_sum_that_it_is() {
        for (nu, angles) in [(3.0 - 1.0 / 60.0, 512), (-2.0 - 2.0 / 48.0, 90), (-1.0 / 60.0, 64)] {
            let terms = (0..angles).map(|angle| {
                let phase = Complex64::cis(TAU * nu * angle as f64 / angles as f64) / angles as f64;
                [phase, phase * (angle as f64 / angles as f64 - 0.5)]
            });
            let sums = terms.fold([Complex64::ZERO; 2], |sum, term| [sum[0] + term[0], sum[1] + term[1]]);
            for (found, sum) in ramp(nu, angles).iter().zip(sums) {
                // Rounding of differences of numbers near 1 over 2π/60/512.
                assert!((found - sum).norm() < 1e-9, "{nu} {angles}: {found} {sum}");
            }
        }
    }
}
