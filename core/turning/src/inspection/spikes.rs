//! Readings that a channel has once or seldom, far from what it reads in all other turns.

/// A channel's farthest reading of that kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Spike {
    /// Index of the channel in the capture.
    pub channel: usize,
    /// The sample, to within [`within_samples`](Self::within_samples).
    pub near_sample: u64,
    /// How well its place is known: 0 for the farthest reading of the recording, half of a turn for others.
    pub within_samples: u64,
    /// The reading, in µm.
    pub reading_um: f64,
    /// What the channel reads at most, or at least, in turns without such readings.
    pub usual_um: f64,
    /// Stretches of about a turn that have such readings.
    pub stretches: usize,
}

/// Fewer stretches than these have no usual extremes.
const FEWEST: usize = 8;
/// More than these are joined in pairs, so that a long recording takes no more memory.
const MOST: usize = 8192;
/// A reading is far from the others where it is beyond the upper quartile of the stretches' extremes by more than this many
/// times the distance of the quartiles. The extremes of 2500 readings with Gaussian noise go as far in less than one of 10⁷ turns.
const FAR: f64 = 10.0;
/// And by more than this share of the usual swing: what is less moves the mean of some turns by less than other errors do.
const MATTERS: f64 = 0.05;
/// Turns before and after go less than this share as far.
const ALONE: f64 = 0.5;
/// Extremes that stay far for longer are a course of the signal: a run-up, a drift, a step.
const SHORT: usize = 2;

/// A channel's extremes, stretch after stretch.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Extents {
    /// Samples of a stretch, at least; 0 where nothing is to be kept.
    length: u64,
    stretches: Vec<Extent>,
    under_way: Extent,
    /// Highest reading so far, and highest of the negated readings.
    records: [f64; 2],
}

/// Lowest and highest reading, and near which samples they are.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Extent {
    samples: u64,
    /// Highest reading, and highest of the negated readings.
    far: [(f64, SamplePlace); 2],
}

/// A sample, to within so many others.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SamplePlace {
    sample: u64,
    within: u64,
}

impl Extent {
    const NONE: Self = Self { samples: 0, far: [(f64::NEG_INFINITY, SamplePlace { sample: 0, within: 0 }); 2] };

    fn join(&mut self, other: &Self) {
        self.samples += other.samples;
        for (far, other) in self.far.iter_mut().zip(other.far) {
            if other.0 > far.0 {
                *far = other;
            }
        }
    }
}

impl Extents {
    /// For turns of so many samples.
    pub(super) fn new(turn_samples: Option<f64>) -> Self {
        let length = turn_samples.map_or(0, |turn| turn.ceil() as u64);
        Self { length, stretches: Vec::new(), under_way: Extent::NONE, records: [f64::NEG_INFINITY; 2] }
    }

    /// Takes note of the extremes of samples from `start` on, which follow those before. `readings` are the same samples, in
    /// which an extreme is looked for where none was farther before: a spike is one, and others are few.
    pub(super) fn note<'a>(
        &mut self,
        [lowest, highest]: [f64; 2],
        [start, samples]: [u64; 2],
        readings: impl Fn() -> Box<dyn Iterator<Item = &'a f64> + 'a>,
    ) {
        if self.length == 0 {
            return;
        }
        let mut place = |side: usize, far: f64, reading: f64| {
            let middle = SamplePlace { sample: start + samples / 2, within: samples.div_ceil(2) };
            if far <= self.records[side] {
                return (far, middle);
            }
            self.records[side] = far;
            let found = readings().position(|other| other.total_cmp(&reading).is_eq());
            (far, found.map_or(middle, |sample| SamplePlace { sample: start + sample as u64, within: 0 }))
        };
        let far = [place(0, highest, highest), place(1, -lowest, lowest)];
        self.under_way.join(&Extent { samples, far });
        if self.under_way.samples < self.length {
            return;
        }
        self.stretches.push(std::mem::replace(&mut self.under_way, Extent::NONE));
        if self.stretches.len() > MOST {
            self.length *= 2;
            let joined = |pair: &[Extent]| {
                let mut joined = Extent::NONE;
                for extent in pair {
                    joined.join(extent);
                }
                joined
            };
            self.stretches = self.stretches.chunks(2).map(joined).collect();
        }
    }

    /// The farthest reading that is far from all usual ones.
    pub(super) fn spike(&self, channel: usize) -> Option<Spike> {
        // The last one may be shorter, and its extremes are then nearer.
        let last = Some(self.under_way).filter(|extent| extent.samples > 0);
        let stretches: Vec<Extent> = self.stretches.iter().copied().chain(last).collect();
        if stretches.len() < FEWEST {
            return None;
        }
        let sorted = |side: usize| {
            let mut values: Vec<f64> = stretches.iter().map(|extent| extent.far[side].0).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let sides = [sorted(0), sorted(1)];
        let swing: f64 = sides.iter().map(|values| values[values.len() / 2]).sum();
        let spikes = sides.iter().enumerate().filter_map(|(side, values)| {
            let [lower, upper] = [values.len() / 4, values.len() * 3 / 4].map(|place| values[place]);
            let limit = upper + (FAR * (upper - lower)).max(MATTERS * swing);
            let sign = if side == 0 { 1.0 } else { -1.0 };
            let value = |extent: &Extent| extent.far[side].0;
            let mut far: Vec<(f64, SamplePlace)> = Vec::new();
            let (mut before, mut rest) = (None, &stretches[..]);
            for run in stretches.chunk_by(|a, b| (value(a) > limit) == (value(b) > limit)) {
                rest = &rest[run.len()..];
                let highest = run.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
                let beside = before.into_iter().chain(rest.first()).map(value).fold(f64::NEG_INFINITY, f64::max);
                if highest > limit && run.len() <= SHORT && beside - upper < ALONE * (highest - upper) {
                    far.extend(run.iter().map(|extent| extent.far[side]));
                }
                before = run.last();
            }
            let (reading, near) = far.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
            let usual = values.iter().copied().rfind(|value| *value <= limit)?;
            Some(Spike {
                channel,
                near_sample: near.sample,
                within_samples: near.within,
                reading_um: sign * reading,
                usual_um: sign * usual,
                stretches: far.len(),
            })
        });
        let distance = |spike: &Spike| (spike.reading_um - spike.usual_um).abs();
        spikes.max_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_recording_takes_no_more_memory_and_keeps_its_spike() {
        let mut extents = Extents::new(Some(100.0));
        for turn in 0..10 * MOST as u64 {
            let noise = 0.01 * (turn as f64 * 0.7).sin();
            let highest = if turn == 33_333 { 50.0 } else { 10.0 + noise };
            let readings: Vec<f64> = (0..100).map(|sample| if sample == 7 { highest } else { -10.0 + noise }).collect();
            extents.note([-10.0 + noise, highest], [100 * turn, 100], || Box::new(readings.iter()));
            assert!(extents.stretches.len() <= MOST);
        }
        let spike = extents.spike(3);
        let expected = Spike {
            channel: 3,
            near_sample: 3_333_307,
            within_samples: 0,
            reading_um: 50.0,
            usual_um: 10.01,
            stretches: 1,
        };
        let usual_um = spike.as_ref().map_or(f64::NAN, |spike| spike.usual_um);
        assert!((usual_um - expected.usual_um).abs() < 1e-6, "{usual_um}");
        assert_eq!(spike, Some(Spike { usual_um, ..expected }));
    }
}
