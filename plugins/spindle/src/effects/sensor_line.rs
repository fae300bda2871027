//! `sensor-line`: one channel has a line that the others do not have as a motion of the axis would, as by electrical pick-up. The
//! averaged turn hides it, all but a leak; the turns show it (`diagnose/lines`), and there its size and frequency are fitted. Here
//! it is only there or not.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect, TurnEvidence};

/// A line of the turns' spectrum in one channel.
pub(crate) struct SensorLine {
    /// Its place among those that were found, the largest first.
    pub number: usize,
}

impl SpindleEffect for SensorLine {
    fn about(&self) -> About {
        About {
            id: "sensor-line",
            does: "a line in one channel that is no motion: electrical pick-up",
            acts_on: ActsOn::Sensor,
            parameters: Vec::new(),
        }
    }

    fn alter(&self, target: usize, _values: &[f64], alterations: &mut Alterations) {
        alterations.lines.push((self.number, Some(target)));
    }

    fn partials(&self, _target: usize, _predicted: &Predicted) -> Vec<Vec<Complex64>> {
        Vec::new()
    }

    fn turn_evidence(&self) -> Option<TurnEvidence> {
        Some(TurnEvidence::Line(self.number))
    }
}
