//! The standards' values: of closed and open profiles, walls and height maps.

pub mod areal;
pub mod control_chart;
pub mod cylindricity;
pub mod drawn;
mod extremes;
pub mod gaps;
mod near;
pub mod open_errors;
pub mod parameter;
pub mod position;
pub mod reference;
pub mod roundness;
pub mod slope;
pub mod straightness;
pub mod texture;
pub mod twist;

use runout_draws::Uncertainty;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One value of a section, of a station or of the whole part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Value {
    /// The standard's symbol.
    pub symbol: String,
    /// Its unit; empty for a number without one.
    pub unit: String,
    /// The number.
    pub value: f64,
    /// Standard and clause, or paper and equation.
    pub source: String,
    /// Undulations per revolution over which it was computed, both ends included; a filter's end is where half passes.
    pub band_upr: [usize; 2],
    /// Orders not observable with the layout, of which the filter passes a hundredth or more: they are not in the value.
    pub lost_orders: Vec<usize>,
    /// Undulations per revolution from which on a filter before the average passes less than half of the power, where the
    /// value's own filter passes a hundredth or more: what is above is not in the value; null where nothing is missing.
    #[serde(default)]
    pub weakened_above_upr: Option<f64>,
    /// Highest order that there is, where the value's own filter passes a thousandth or more of those above: they are not in
    /// the value; null where nothing is missing.
    #[serde(default)]
    pub absent_above_upr: Option<usize>,
    /// The filter applied.
    pub filter: String,
    /// What the profile was referred to.
    pub reference: String,
    /// Share of the profile or surface that was there; gaps are left out.
    pub coverage: f64,
    /// From the covariance of the separation; null where none is known.
    pub uncertainty: Option<Uncertainty>,
    /// Why no uncertainty is stated, where the errors are known and intervals by them do not hold; null otherwise.
    #[serde(default)]
    pub no_uncertainty: Option<String>,
    /// By how much noise has raised it, where that is more than its standard uncertainty; null otherwise. The interval is without it.
    #[serde(default)]
    pub raised_by_noise: Option<f64>,
    /// What of its own data refutes it: then its uncertainty is widened to what is left unexplained, and no limit is kept by it; null
    /// otherwise.
    #[serde(default)]
    pub refuted_by: Option<String>,
}
