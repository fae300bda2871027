//! The standards' values of a separated form.

pub mod areal;
pub mod cylindricity;
pub mod parameter;
pub mod roundness;
pub mod straightness;
pub mod texture;
pub mod uncertainty;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One value of one section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Value {
    /// The standard's symbol.
    pub symbol: String,
    /// Its unit.
    pub unit: String,
    /// The number.
    pub value: f64,
    /// Standard and clause, or paper and equation.
    pub source: String,
    /// Undulations per revolution over which it was computed, both ends included.
    pub band_upr: [usize; 2],
    /// Orders of that band that the layout cannot tell: they are not in the value.
    pub lost_orders: Vec<usize>,
    /// The filter applied.
    pub filter: String,
    /// What the profile was referred to.
    pub reference: String,
    /// From the covariance of the separation; null where none is known.
    pub uncertainty: Option<uncertainty::Uncertainty>,
}
