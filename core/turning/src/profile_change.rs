//! A profile that is changed behind the average, harmonic by harmonic.

use crate::profile::{Part, Profile};
use runout_numerics::Complex64;

/// What becomes of each harmonic c of the mean: `new`, and of errors δ beside it `gain`·δ; both `[order][channel]`, the first in µm.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileChange {
    /// The mean as it is taken from now on.
    pub new: Vec<Complex64>,
    /// What errors of it are multiplied by: 1 where something is subtracted.
    pub gain: Vec<Complex64>,
    /// What the user should know of it.
    pub warnings: Vec<String>,
}

impl ProfileChange {
    /// A harmonic beside the mean of all turns: of a part of them, or of one turn.
    fn of(&self, index: usize, mean: Complex64, other: Complex64) -> Complex64 {
        self.new[index] + self.gain[index] * (other - mean)
    }

    /// Covariances across channels, `[order][channel][channel]`.
    fn covariance(&self, channels: usize, covariance: &mut [Complex64]) {
        for (index, entry) in covariance.iter_mut().enumerate() {
            let (order, channel, other) =
                (index / (channels * channels), index / channels % channels, index % channels);
            *entry *= self.gain[order * channels + channel] * self.gain[order * channels + other].conj();
        }
    }

    fn part(&self, part: &mut Part, mean: &[Complex64], channels: usize) {
        part.mean.iter_mut().enumerate().for_each(|(index, other)| *other = self.of(index, mean[index], *other));
        for covariance in [&mut part.covariance, &mut part.scatter].into_iter().flatten() {
            self.covariance(channels, covariance);
        }
        part.neighbours.iter_mut().for_each(|beside| beside.multiply(&self.gain));
    }
}

impl Profile {
    /// The profile with each harmonic changed; covariances, parts and single turns follow to first order. What is kept of the
    /// motion of single turns ([`Profile::spread`]) stays as it was measured.
    ///
    /// # Panics
    /// Where the change has fewer numbers than the mean.
    #[must_use]
    pub fn changed(mut self, change: &ProfileChange) -> Self {
        let channels = self.channels();
        let mean = std::mem::replace(&mut self.mean, change.new.clone());
        for covariance in [&mut self.covariance, &mut self.scatter, &mut self.scatter_beside].into_iter().flatten() {
            change.covariance(channels, covariance);
        }
        for turn in self.levels.levels_um.chunks_exact_mut(channels.max(1)) {
            for (channel, level) in turn.iter_mut().enumerate() {
                *level = change.of(channel, mean[channel], (*level).into()).re;
            }
        }
        if let Some(split) = &mut self.split {
            change.part(&mut split.fit, &mean, channels);
            change.part(&mut split.held_out, &mean, channels);
            split.neighbours.iter_mut().for_each(|beside| beside.multiply(&change.gain));
            let of_turn = split.turns.orders * channels;
            for (index, harmonic) in split.turns.harmonics.iter_mut().enumerate() {
                let own = index % of_turn.max(1);
                *harmonic = change.of(own, mean[own], *harmonic);
            }
        }
        self.warnings.extend(change.warnings.iter().cloned());
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_multiplied_and_what_is_subtracted_leaves_them() {
        let one = Complex64::ONE;
        let profile = Profile {
            sensors: vec![0, 1],
            mean: vec![2.0 * one, 3.0 * one, one, Complex64::I],
            covariance: Some(vec![one; 8]),
            ..Profile::default()
        };
        // Channel 0 is read twice as large from order 1 on; 0.5 µm are subtracted from channel 1.
        let gain = vec![one, one, 2.0 * Complex64::I, one];
        let new = vec![2.0 * one, 2.5 * one, 2.0 * Complex64::I, Complex64::I];
        let changed = profile.changed(&ProfileChange { new: new.clone(), gain, warnings: Vec::new() });
        assert_eq!(changed.mean, new);
        let i = Complex64::I;
        assert_eq!(changed.covariance, Some(vec![one, one, one, one, 4.0 * one, 2.0 * i, -2.0 * i, one]));
    }
}
