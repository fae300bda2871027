//! `asynchronous-line`: the axis moves at an order that is not whole, as by a bearing's cage or a belt. The averaged
//! turn hides it, all but a leak; the turns show it (`diagnose/lines.rs`), and there its size and order are fitted. Here it
//! is only there or not.

use runout_core::Complex64;

use super::{About, ActsOn, Alterations, MOST_LINES, Predicted, SpindleEffect, TurnEvidence};

/// A line of the turns' spectrum.
pub(crate) struct AsynchronousLine {
    /// Its place among those that were found, the largest first.
    pub number: usize,
}

impl SpindleEffect for AsynchronousLine {
    fn about(&self) -> About {
        About {
            id: "asynchronous-line",
            does: "a motion that repeats, but not with the turn",
            acts_on: ActsOn::Rig,
            parameters: Vec::new(),
        }
    }

    fn alter(&self, _target: usize, _values: &[f64], alterations: &mut Alterations) {
        alterations.lines.push((self.number, None));
    }

    fn partials(&self, _target: usize, _predicted: &Predicted) -> Vec<Vec<Complex64>> {
        Vec::new()
    }

    fn last_of_list(&self) -> Option<String> {
        (self.number + 1 == MOST_LINES).then(|| format!("{MOST_LINES} lines are looked for at most"))
    }

    fn turn_evidence(&self) -> Option<TurnEvidence> {
        Some(TurnEvidence::Line(self.number))
    }
}
