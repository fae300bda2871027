//! The standards' values of a result: which (`[evaluate]`), of what, each with what is known of its error, and the limits that they have to keep
//! (`[[limit]]`).

mod areal;
mod axis_motion;
mod circles;
mod config;
mod cylindricity;
pub mod error_motion;
pub mod evaluable;
mod evaluables;
mod filter;
mod generatrix;
pub mod height_grid;
mod key;
mod known;
mod limit;
mod limit_check;
mod open_profile;
mod part;
mod plane_map;
mod positions;
mod roundness;
mod run_out;
mod section;
mod section_gaps;
mod station;
mod steepest;
mod texture;
mod value;
mod wall;

pub use areal::add_areal;
pub use circles::ReferenceCircle;
pub use config::{ArealFilter, Evaluate, EvaluateConfig, FormRemoval, Group};
pub use evaluables::Evaluated;
pub use generatrix::add_generatrices;
pub use key::key_symbols;
pub use known::{KnownValue, Referred};
pub use limit::{Decision, Limit, LimitSummary, LimitValue, Orders, UpperCurve, decide, nan_for_null};
pub use part::{PartSummary, part_summary};
pub use section::section_values;
pub use station::EvaluatedStation;
pub use value::{PlacedValue, Value, ValueId, own};

use filter::Filter;
use runout_draws::{Interval, Uncertainty};

/// What a number is, before it is known.
#[derive(Debug, Clone)]
struct Label {
    symbol: &'static str,
    unit: &'static str,
    source: String,
    reference: String,
}

impl Label {
    fn new(symbol: &'static str, unit: &'static str, source: impl Into<String>, reference: impl Into<String>) -> Self {
        Self { symbol, unit, source: source.into(), reference: reference.into() }
    }

    /// A value under it, unfiltered.
    fn of(self, value: f64) -> Value {
        Value::referred(self.symbol, value, self.unit, &self.source, &self.reference)
    }
}

/// Angles on which a form is evaluated, per wave of the highest order, at least: its crests are then missed by less than a
/// fiftieth of that wave's amplitude, 1 − cos(π/16).
const POINTS_A_WAVE: usize = 16;

/// What a profile holds.
#[derive(Debug, Clone, Default)]
struct Content {
    /// Highest order.
    highest: usize,
    /// Highest order that every part of it has.
    all_to: usize,
    /// Orders not observable with the layout.
    lost: Vec<usize>,
    /// Order of which filters before the average pass half.
    half_power_upr: Option<f64>,
    /// Whether there is form above that order, weakened.
    shows_weakened: bool,
    /// Whether there is form above the highest order.
    shows_absent: bool,
}

impl Content {
    /// Highest order of which at least half is there.
    fn highest_passed(&self) -> usize {
        self.half_power_upr.map_or(self.highest, |half| self.highest.min(half as usize))
    }
}

/// Units as files write them: "um", "um/deg". Micro is a sign of its own and a Greek letter.
fn ascii_unit(unit: &str) -> String {
    unit.replace(['\u{b5}', '\u{3bc}'], "u").replace('°', "deg")
}

/// A number, and what is known of its error.
#[derive(Debug, Clone)]
struct NumberFound {
    value: f64,
    uncertainty: Option<Uncertainty>,
    /// Why there is none, where the errors are known.
    no_uncertainty: Option<String>,
    raised_by_noise: Option<f64>,
}

impl NumberFound {
    /// A number found as `value`, of which draws are known, where errors are.
    fn of(value: f64, known: Option<&Interval>) -> Self {
        let uncertainty = known.and_then(|known| known.at(value));
        Self { value, uncertainty, no_uncertainty: None, raised_by_noise: known.and_then(Interval::raised_by_noise) }
    }

    /// The number without its uncertainty, and why it has none.
    fn without_uncertainty(self, reason: &str) -> Self {
        Self { uncertainty: None, no_uncertainty: Some(reason.to_owned()), raised_by_noise: None, ..self }
    }

    /// Says why nothing is known, where nothing is.
    fn or_because(self, reason: &str) -> Self {
        if self.uncertainty.is_some() { self } else { self.without_uncertainty(reason) }
    }
}

impl From<(f64, Option<Uncertainty>)> for NumberFound {
    fn from((value, uncertainty): (f64, Option<Uncertainty>)) -> Self {
        Self { value, uncertainty, no_uncertainty: None, raised_by_noise: None }
    }
}

/// Numbers under their labels; what is no number is left out: the profile or the wall does not have that value.
fn labelled(labels: Vec<Label>, found: Vec<NumberFound>, filter: &Filter, held: &Content, coverage: f64) -> Vec<Value> {
    let lost_orders = filter.lost(&held.lost);
    let weakened_above_upr = held
        .half_power_upr
        .filter(|half| filter.asks_for_more_than(*half) || (held.shows_weakened && filter.passes_everything()));
    let absent_above_upr = Some(held.all_to)
        .filter(|order| filter.reaches_above(*order) || (held.shows_absent && filter.passes_everything()));
    let known = labels.into_iter().zip(found).filter(|(_, found)| found.value.is_finite());
    known
        .map(|(label, NumberFound { value, uncertainty, no_uncertainty, raised_by_noise })| Value {
            band_upr: filter.band_upr(held.highest_passed()),
            lost_orders: lost_orders.clone(),
            weakened_above_upr,
            absent_above_upr,
            no_uncertainty,
            filter: Some(filter.name.clone()),
            coverage,
            uncertainty,
            raised_by_noise,
            ..label.of(value)
        })
        .collect()
}

#[cfg(test)]
mod axis_motion_tests;
#[cfg(test)]
mod bump_tests;
#[cfg(test)]
mod cost_tests;
#[cfg(test)]
mod coverage_tests;
#[cfg(test)]
mod evaluable_tests;
#[cfg(test)]
mod extreme_tests;
#[cfg(test)]
mod gap_tests;
#[cfg(test)]
mod likely_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
#[path = "../../../tests/support/trials.rs"]
mod trials;
