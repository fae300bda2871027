//! What a comparison found, for people and programs.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{pipeline::config::candidate::Refusal, summary::LostOrders};
use runout_turning::provenance::Provenance;

/// What a comparison found.
///
/// Form counts from order 2, motion from 1. Arrays by order begin at order 1; null where an order is lost or not known,
/// and never 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct Comparison {
    /// The pipeline's title.
    pub title: String,
    /// Enough to repeat the comparison.
    pub provenance: Provenance,
    /// The pipeline's own separator, with which the others are compared.
    pub reference: String,
    /// All methods that fit the rig, the reference first.
    pub methods: Vec<MethodSummary>,
    /// Separators that cannot take the rig.
    pub refused: Vec<Refusal>,
    /// One entry a station; none of measured points.
    pub stations: Vec<StationComparison>,
    /// Of measured points: every value that a method gives.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<ValueComparison>,
    /// Of measured points: columns with standard uncertainties in tables that several methods give.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<ColumnComparison>,
    /// Files written.
    pub outputs: Vec<PathBuf>,
    /// What the user should know of the data: of the whole, then of each station, behind the station's name.
    pub warnings: Vec<String>,
}

/// What is observable by a method with the rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct MethodSummary {
    /// The plugin's name, with a number where several are compared.
    pub method: String,
    /// Ids of the sensors and setups that it does not use.
    pub unused: Vec<String>,
    /// Orders at which one of its unknowns is not observable.
    pub lost_orders: LostOrders,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// One station of a [`Comparison`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StationComparison {
    /// Its name.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// Form of each section, then motion.
    pub quantities: Vec<QuantityComparison>,
    /// What the user should know of this station; it is in the warnings of the whole too.
    pub warnings: Vec<String>,
}

impl StationComparison {
    /// The comparison without what is given order by order.
    #[must_use]
    pub fn without_orders(mut self) -> Self {
        for quantity in &mut self.quantities {
            quantity.values.iter_mut().for_each(|value| value.harmonics = Harmonics::default());
            quantity.differences.iter_mut().for_each(|one| one.by_order = DifferenceOrders::default());
        }
        self
    }
}

/// One unknown, by every method by which it is observable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct QuantityComparison {
    /// "form", "x", "y", "tilt_x", "tilt_y".
    pub quantity: String,
    /// The section whose form it is; null for motion.
    pub section: Option<String>,
    /// "um" or "urad".
    pub unit: String,
    /// By method.
    pub values: Vec<MethodValue>,
    /// Each other method minus the reference.
    pub differences: Vec<Difference>,
}

/// What one method says of an unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MethodValue {
    /// The method.
    pub method: String,
    /// Place of the section, or of the plane whose displacement x and y are, in mm; null for tilt. Methods that give
    /// tilt state x and y in the plane of the first method that does not.
    pub z_mm: Option<f64>,
    /// Root mean square over the angles, of the observable orders.
    pub rms: f64,
    /// Standard uncertainty at any one angle, from the covariance of the averages; null without one.
    pub std: Option<f64>,
    /// Peak-to-valley roundness deviation about the least-squares circle, of a form, in µm.
    pub ront_um: Option<f64>,
    /// True error of a form (root mean square over observable orders from 2), where the recording carries the truth.
    pub truth_rms_error_um: Option<f64>,
    /// Orders that are not observable.
    pub lost_orders: Vec<usize>,
    /// Order by order.
    pub harmonics: Harmonics,
}

/// Coefficients by order from 1: form is Re Σ c e^{+inα}, motion Re Σ c e^{−inΦ}.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Harmonics {
    /// Real part of c; null where the order is lost.
    pub re: Vec<Option<f64>>,
    /// Imaginary part of c; null where the order is lost.
    pub im: Vec<Option<f64>>,
    /// Root of E|error of c|², both parts together; null where not known.
    pub std: Vec<Option<f64>>,
}

/// A method against the reference.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Difference {
    /// The method.
    pub method: String,
    /// Why there is no difference; the numbers are null then.
    pub not_compared: Option<String>,
    /// Plane in which x and y were compared, in mm.
    pub z_mm: Option<f64>,
    /// How many orders are observable by both.
    pub orders_compared: usize,
    /// Root mean square of the difference over the angles, of the orders that are observable by both.
    pub rms: Option<f64>,
    /// Its value expected from the covariance of the averages, from the joint covariance; null without one.
    pub expected_rms: Option<f64>,
    /// Share of the orders compared with E_n ≤ 1: 0.982 is what scatter alone gives. Null without a covariance.
    pub share_within: Option<f64>,
    /// The largest E_n.
    pub worst: Option<Worst>,
    /// Order by order.
    pub by_order: DifferenceOrders,
}

/// The order with the largest E_n.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct Worst {
    /// Undulations per revolution.
    pub order: usize,
    /// |difference| / (2 · its standard uncertainty).
    pub e_n: f64,
}

/// Differences by order from 1; null where the order is not observable by one of the two.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DifferenceOrders {
    /// |c of the method − c of the reference|.
    pub difference: Vec<Option<f64>>,
    /// Root of E|error of that difference|², from the joint covariance; null without one.
    pub std: Vec<Option<f64>>,
    /// difference / (2 std); 0 where both are equal to rounding, null where std is not known.
    pub e_n: Vec<Option<f64>>,
}

/// A value of measured points by every method that gives it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ValueComparison {
    /// Its symbol.
    pub symbol: String,
    /// What it is of, where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// Its unit.
    pub unit: String,
    /// What it is.
    pub about: String,
    /// What it was referred to, where it is a standard's value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// The filter applied, where it is a standard's value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// By method.
    pub values: Vec<ValueOf>,
    /// Each other method minus the reference, where both give a number.
    pub differences: Vec<ValueDifference>,
}

/// A value as one method gives it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ValueOf {
    /// The method.
    pub method: String,
    /// The number; null where it is lost.
    pub value: Option<f64>,
    /// Its standard uncertainty; null where it is not known.
    pub std: Option<f64>,
}

/// A value against the reference's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ValueDifference {
    /// The method.
    pub method: String,
    /// The method's value less the reference's.
    pub difference: f64,
    /// |difference| / (2·√(u² + u²)), with both standard uncertainties as of independent results; null where one is not known.
    pub e_n: Option<f64>,
    /// The method's standard uncertainty over the reference's; null where one is not known.
    pub std_ratio: Option<f64>,
}

/// A column of a table by every method that gives the same rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColumnComparison {
    /// The table.
    pub table: String,
    /// The column; its unit is part of the name.
    pub column: String,
    /// Each other method minus the reference.
    pub differences: Vec<ColumnDifference>,
}

/// A column against the reference's, over the rows in which both give a number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColumnDifference {
    /// The method.
    pub method: String,
    /// Rows compared.
    pub rows: usize,
    /// Root mean square of the difference.
    pub rms: f64,
    /// The largest difference, without sign.
    pub largest: f64,
    /// The method's standard uncertainty over the reference's, root mean squares; null where one is not known.
    pub std_ratio: Option<f64>,
    /// Share of the rows with E_n ≤ 1; null where the uncertainties are not known.
    pub share_within: Option<f64>,
    /// The largest E_n.
    pub worst_e_n: Option<f64>,
}
