//! `cross-talk`: the reading of a sensor has a share s of what another one reads; `channel-ghost`: that of every channel has a share of what
//! the channel before it reads, as a multiplexed converter leaves it that settles too slowly. ∂/∂s = displacement that the other one reads.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, pair_of, parameter};
use crate::alterations::CrossTalk;

/// A share of one channel in another.
pub(crate) struct OfOneChannel;

/// A share of the channel before in every channel.
pub(crate) struct ChannelGhost;

impl SpindleEffect for OfOneChannel {
    fn about(&self) -> About {
        About {
            id: "cross-talk",
            does: "a share of the first sensor's reading is in that of the second",
            acts_on: ActsOn::SensorCopy,
            parameters: vec![parameter("share", "1", 0.01)],
        }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let [from, to] = pair_of(target, alterations.sensors.len());
        alterations.cross_talk.push(CrossTalk { from, to, share: values[0] });
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let pair = pair_of(target, predicted.alterations.sensors.len());
        vec![read_by_others(predicted, |from, to| [from, to] == pair)]
    }
}

impl SpindleEffect for ChannelGhost {
    fn about(&self) -> About {
        About {
            id: "channel-ghost",
            does: "every channel has a share of the one before it",
            acts_on: ActsOn::Rig,
            parameters: vec![parameter("share", "1", 0.01)],
        }
    }

    fn alter(&self, _target: usize, values: &[f64], alterations: &mut Alterations) {
        let later = 1..alterations.sensors.len();
        alterations.cross_talk.extend(later.map(|to| CrossTalk { from: to - 1, to, share: values[0] }));
    }

    fn partials(&self, _target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        vec![read_by_others(predicted, |from, to| from + 1 == to)]
    }
}

/// In each reading, the sum of what the chosen others read in the same setup: `is_read` gets their index and its own.
fn read_by_others(predicted: &Predicted, is_read: impl Fn(usize, usize) -> bool) -> Vec<Complex64> {
    let readings = &predicted.layout.readings;
    let mut partial = predicted.nothing();
    for (to, reading) in readings.iter().enumerate() {
        for (from, other) in readings.iter().enumerate() {
            if other.setup == reading.setup && is_read(other.sensor, reading.sensor) {
                let rows =
                    partial.chunks_exact_mut(readings.len()).zip(predicted.readings.chunks_exact(readings.len()));
                rows.skip(1).for_each(|(partial, row)| partial[to] += row[from]);
            }
        }
    }
    partial
}
