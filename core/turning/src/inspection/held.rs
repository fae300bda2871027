//! Readings that stand for several samples: the recorder is faster than the sensor.

/// A channel whose readings stand for several samples each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HeldChannel {
    /// Index of the channel in the capture.
    pub channel: usize,
    /// Samples that a reading stands for, about.
    pub samples: usize,
}

/// Frames that are examined, at most and at least.
pub(super) const FRAMES: [usize; 2] = [256, 4096];
/// Share of the samples that are equal to the one before, from which on readings are held.
const EQUAL: f64 = 0.4;
/// A change of so many of the finest steps is none of a coarse converter, whose readings stand still by themselves.
const STEPS: f64 = 8.0;

/// Examines the first frames of a capture.
pub(super) fn held(samples: &[f64], channels: usize) -> Vec<HeldChannel> {
    let one = |channel: usize| {
        let readings = || samples.iter().skip(channel).step_by(channels).take(FRAMES[1]);
        let steps = || readings().zip(readings().skip(1)).map(|(before, now)| (now - before).abs());
        let all = steps().count();
        let equal = steps().take(FRAMES[0]).filter(|step| *step == 0.0).count();
        if (equal as f64) < EQUAL * all.min(FRAMES[0]) as f64 {
            return None;
        }
        let mut changes: Vec<f64> = steps().filter(|step| *step > 0.0).collect();
        changes.sort_by(f64::total_cmp);
        let [finest, .., _] = changes[..] else { return None };
        let is_fine = changes[changes.len() / 2] > STEPS * finest;
        let samples = all as f64 / changes.len() as f64;
        (is_fine && 1.0 - samples.recip() >= EQUAL).then(|| HeldChannel { channel, samples: samples.round() as usize })
    };
    (0..channels).filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two channels of 2000 frames: a wave with a scatter, and the same held, each rounded to steps.
    fn found(held_for: usize, step: f64, turn: f64) -> Vec<HeldChannel> {
        let reading = |frame: usize| {
            let scatter = (frame.wrapping_mul(2_654_435_761) >> 7) % 1000;
            let value = 8.0 * (std::f64::consts::TAU * frame as f64 / turn).sin() + 4e-5 * scatter as f64;
            (value / step).round() * step
        };
        let frames = (0..2000).flat_map(|frame| [reading(frame), reading(frame / held_for * held_for)]);
        held(&frames.collect::<Vec<f64>>(), 2)
    }

    #[test]
    fn held_readings_are_found_and_coarse_ones_are_not() {
        for samples in [2, 4, 8] {
            assert_eq!(found(samples, 1e-5, 256.0), [HeldChannel { channel: 1, samples }]);
        }
        assert!(found(1, 1e-5, 256.0).is_empty());
        // Steps of the converter that are as large as what the signal changes by from sample to sample, and far larger.
        assert!(
            found(1, 0.2, 256.0).is_empty() && found(1, 0.2, 20_000.0).is_empty() && found(1, 5.0, 256.0).is_empty()
        );
    }
}
