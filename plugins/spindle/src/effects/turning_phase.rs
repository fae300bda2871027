//! `turn-ratio`, `lost-samples`: all channels of a setup turn against its mark, steadily or since samples are lost. Single turns show by how much;
//! the average of the turns has H(n) of order n,
//!
//! | effect | H(n) |
//! | --- | --- |
//! | `turn-ratio`, δ a turn | mean of e^{inδt} over the turns t that are averaged, counted from the first mark |
//! | `lost-samples`, δ from a turn on | 1 − q + q·e^{−inδ}, q the share of the turns behind it |
//!
//! and ∂/∂δ = (H′/H)·u. The angle before the step, and at the first mark, is the declared one.

use runout_core::{Complex64, consistency::turns::PhaseCourse};

use super::{About, ActsOn, Alterations, Predicted, RAD_PER_DEG, SpindleEffect, TurnEvidence, parameter};

/// How a setup turns against its mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TurningPhase {
    /// By the same angle every turn.
    TurnRatio,
    /// By one angle at one turn.
    LostSamples,
}

impl SpindleEffect for TurningPhase {
    fn about(&self) -> About {
        let (id, does, parameters) = match self {
            Self::TurnRatio => (
                "turn-ratio",
                "the mark of a setup is on a shaft that turns by another angle",
                vec![parameter("turning", "deg/rev", 0.01)],
            ),
            Self::LostSamples => (
                "lost-samples",
                "samples of a setup are lost: from one turn on, its readings are those of later angles",
                vec![parameter("lost", "deg", 0.3), parameter("after", "rev", 1.0)],
            ),
        };
        About { id, does, acts_on: ActsOn::Setup, parameters }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let turning = &mut alterations.setups[target].turning;
        match self {
            Self::TurnRatio => turning.run_rad += values[0] * RAD_PER_DEG,
            Self::LostSamples => {
                turning.step_rad -= values[0] * RAD_PER_DEG;
                turning.step_at = values[1];
            }
        }
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let turning = &predicted.alterations.setups[target].turning;
        let of = |slope: &dyn Fn(usize) -> Complex64| {
            // Without noise: H changes its size, and so would the noise of high orders.
            let read = |at: usize| predicted.part[at] + predicted.along[at];
            predicted.each(|reading| reading.setup == target, |order, at| slope(order) * read(at))
        };
        match self {
            Self::TurnRatio => vec![of(&|order| turning.of_run_slope(order) * RAD_PER_DEG)],
            Self::LostSamples => {
                let [by, place] = [0, 1].map(|which| move |order: usize| turning.of_step_slopes(order)[which]);
                vec![of(&|order| by(order) * -RAD_PER_DEG), of(&place)]
            }
        }
    }

    fn turn_evidence(&self) -> Option<TurnEvidence> {
        Some(TurnEvidence::Phase)
    }

    fn phase_partials(&self, target: usize, setup: usize, phase: &PhaseCourse) -> Vec<[f64; 2]> {
        match (self, phase.step_at) {
            (Self::TurnRatio, None) if target == setup => vec![[RAD_PER_DEG, 0.0]],
            (Self::LostSamples, Some(_)) if target == setup => vec![[-RAD_PER_DEG, 0.0], [0.0, 1.0]],
            _ => Vec::new(),
        }
    }

    fn at_phase(&self, phase: &PhaseCourse) -> Vec<f64> {
        match phase.step_at {
            None => vec![phase.by_rad / RAD_PER_DEG],
            Some([turns, _]) => vec![-phase.by_rad / RAD_PER_DEG, turns],
        }
    }

    fn first_order_like(&self) -> Option<&'static str> {
        Some("index-offset")
    }
}
