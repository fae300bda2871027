//! A domain's own values as files hold them.

use runout_draws::Uncertainty;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::Value;

/// A value of a result.
#[derive(Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "NamedValue")]
pub struct OwnValue {
    /// The standard's symbol, or a short name.
    symbol: String,
    /// What it is of, where the result has several: a part, a section, an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    of: Option<String>,
    /// The number; null where it is not observable.
    value: Option<f64>,
    /// Its standard uncertainty; null where it is not known.
    std: Option<f64>,
    /// Its unit; empty for a number without one.
    unit: String,
    /// What it is, with standard and clause.
    about: String,
    /// Where the truth lies with 95 % probability; absent where that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    interval_95: Option<[f64; 2]>,
    /// What it was referred to, where it is a standard's value of an open profile or a height map: "LSLI", "mean line".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reference: Option<String>,
    /// The filter applied, as limits name it; absent as `reference` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    filter: Option<String>,
    /// Why no uncertainty is stated of a standard's value; absent where one is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    no_uncertainty: Option<String>,
    /// What of its own data refutes it: then its uncertainty is widened to what is left unexplained, and no limit is kept by it;
    /// absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    refuted_by: Option<String>,
    /// Whether the result opens with it; absent where it does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    is_key: bool,
}

/// Writes them.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(values: &[Value], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(values.iter().map(OwnValue::from))
}

/// Reads them.
///
/// # Errors
/// Those of the deserializer.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Value>, D::Error> {
    Ok(Vec::<OwnValue>::deserialize(deserializer)?.into_iter().map(Value::from).collect())
}

impl From<&Value> for OwnValue {
    fn from(value: &Value) -> Self {
        let Value { symbol, of, unit, source, reference, filter, no_uncertainty, refuted_by, is_key, .. } =
            value.clone();
        let (number, std, interval_95) = (value.number(), value.std(), value.interval_95());
        Self {
            symbol,
            of,
            value: number,
            std,
            unit,
            about: source,
            interval_95,
            reference,
            filter,
            no_uncertainty,
            refuted_by,
            is_key,
        }
    }
}

impl From<OwnValue> for Value {
    fn from(own: OwnValue) -> Self {
        let [value, std] = [own.value, own.std].map(|number| number.unwrap_or(f64::NAN));
        let plain = Self::new(&own.symbol, value, std, &own.unit, &own.about);
        let with_interval = |known: Uncertainty| match own.interval_95 {
            Some(interval_95) => Uncertainty { interval_95, ..known },
            None => known,
        };
        Self {
            of: own.of,
            reference: own.reference,
            filter: own.filter,
            uncertainty: plain.uncertainty.clone().map(with_interval),
            no_uncertainty: own.no_uncertainty,
            refuted_by: own.refuted_by,
            is_key: own.is_key,
            ..plain
        }
    }
}
