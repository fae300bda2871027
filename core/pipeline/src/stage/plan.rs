//! What is observable with a layout of measured points and how well, and what to add to it.

use std::collections::BTreeMap;

use runout_closed_loop::{
    diagnosis::LostOrders,
    foresight::{Foresight, name},
};
use schemars::JsonSchema;
use serde::Serialize;

/// What is observable with a layout of measured points and how well, and what to add to it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct PointPlan {
    /// Noise gain of what is solved for, by groups that the domain names ("location", "component"; "lobing", "form").
    pub noise_gain: BTreeMap<String, Vec<NoiseGain>>,
    /// Orders that the layout does not separate, where the domain has orders.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_orders: Option<LostOrders>,
    /// Effects that would show, be blind or confounded, and the measurement that all figures hold for.
    #[serde(flatten)]
    pub foresight: Foresight,
    /// The layout as it is.
    pub score: LayoutScore,
    /// What to add, best first.
    pub suggestions: Vec<PointAddition>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Noise gain of something that is solved for.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NoiseGain {
    /// Its symbol; empty for an order of the group.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub quantity: String,
    /// Its order, in undulations per revolution.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<usize>,
    /// Standard deviation for 1 µm in every reading; null where it is lost.
    pub gain: Option<f64>,
    /// Its unit: "um", "urad".
    pub unit: String,
}

/// A layout in three numbers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct LayoutScore {
    /// How many of the unknowns are lost.
    pub lost: usize,
    /// The worst noise gain of the others, in µm for 1 µm in every reading; null where there are none.
    pub worst: Option<f64>,
    /// What has it.
    pub worst_of: Option<String>,
    /// Root mean square of the noise gains, in µm.
    pub rms: Option<f64>,
}

/// Something to add to a layout.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PointAddition {
    /// "ball", "setup".
    pub add: String,
    /// In words.
    pub text: String,
    /// As an entry of the list that it belongs to, in TOML.
    pub entry: String,
    /// The layout with it.
    pub after: LayoutScore,
    /// Noise gain with it, as in the plan.
    pub noise_gain: BTreeMap<String, Vec<NoiseGain>>,
    /// Effects, "effect target", that are blind as it is and would show with this.
    pub reveals: Vec<String>,
    /// Confounded sets that would be distinguished.
    pub distinguishes: Vec<Vec<String>>,
}

impl NoiseGain {
    /// Of a quantity; not finite where it is lost.
    #[must_use]
    pub fn of(quantity: &str, gain: f64, unit: &str) -> Self {
        Self { quantity: quantity.into(), order: None, gain: gain.is_finite().then_some(gain), unit: unit.into() }
    }

    /// Of an order; not finite where it is lost.
    #[must_use]
    pub fn of_order(order: usize, gain: f64) -> Self {
        Self { quantity: String::new(), order: Some(order), gain: gain.is_finite().then_some(gain), unit: "um".into() }
    }
}

impl LayoutScore {
    /// Of named noise gains in µm, not finite where lost.
    #[must_use]
    pub fn of(gains: &[(String, f64)]) -> Self {
        let known = || gains.iter().filter(|(_, gain)| gain.is_finite());
        let count = known().count();
        let worst = known().max_by(|a, b| a.1.total_cmp(&b.1));
        let squares: f64 = known().map(|(_, gain)| gain * gain).sum();
        Self {
            lost: gains.len() - count,
            worst: worst.map(|(_, gain)| *gain),
            worst_of: worst.map(|(name, _)| name.clone()),
            rms: (count > 0).then(|| (squares / count as f64).sqrt()),
        }
    }

    /// Fewer lost, then a smaller root mean square.
    #[must_use]
    pub fn compare(&self, other: &Self) -> std::cmp::Ordering {
        let rms = |score: &Self| score.rms.unwrap_or(f64::INFINITY);
        self.lost.cmp(&other.lost).then(rms(self).total_cmp(&rms(other)))
    }
}

impl PointAddition {
    /// What changes of the effects that would show.
    #[must_use]
    pub fn changing(self, before: &Foresight, after: &Foresight) -> Self {
        let now: Vec<String> = after.blind_names().collect();
        let shows = |blind: &String| after.visible.iter().any(|one| name(&one.effect, &one.targets) == *blind);
        let reveals = before.blind_names().filter(|blind| !now.contains(blind) && shows(blind)).collect();
        let distinguishes = before
            .confounded
            .iter()
            .filter(|set| !set.iter().any(|one| now.contains(one)) && !after.confounded.contains(set));
        let distinguishes = distinguishes.cloned().collect();
        Self { reveals, distinguishes, ..self }
    }
}
