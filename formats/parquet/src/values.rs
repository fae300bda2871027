//! The table of the standards' values.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, StringArray, UInt32Array};
use arrow_schema::{DataType, Schema};
use runout_core::{
    evaluate::{Value, uncertainty::Uncertainty},
    pipeline::run::Summary,
};
use serde_json::json;

use crate::columns::{column, number, numbers, text};

/// Columns of `values.parquet`.
pub fn schema() -> Schema {
    let uncertain = |name: &str, meaning: &str| {
        column(name, DataType::Float64, true, "the value's", &format!("{meaning}; null where it is not known"))
    };
    let order = |name: &str, meaning: &str| column(name, DataType::UInt32, false, "1/rev", meaning);
    Schema::new(vec![
        text("station", true, "name of the axial station; null for the whole part"),
        text("section", true, "id of the section; null for a station or the whole part"),
        column("z_mm", DataType::Float64, true, "mm", "place of the section along the axis; null where there is none"),
        text("symbol", false, "the standard's symbol"),
        number("value", "the column unit", "the number"),
        text("unit", false, "its unit; empty for a number without one"),
        text("standard", false, "standard and clause, or paper and equation"),
        order("band_low_upr", "lowest order that it was computed over"),
        order("band_high_upr", "highest order that it was computed over; of a filter, where half passes"),
        text("lost_orders", false, "orders of it that the layout cannot tell and that are not in the value, as JSON"),
        column(
            "weakened_above_upr",
            DataType::Float64,
            true,
            "1/rev",
            "a filter before the average passes less than half above, where the value's filter asks for more; null where nothing is missing",
        ),
        column(
            "absent_above_upr",
            DataType::UInt32,
            true,
            "1/rev",
            "highest order there is, where the value's filter passes 0.1 % or more above it; null where nothing is missing",
        ),
        text("filter", false, "the filter applied"),
        text("reference", false, "what the profile was referred to"),
        number("coverage", "", "share of the profile or surface that was there"),
        uncertain("std", "standard uncertainty"),
        uncertain("low_95", "lower end of the 95 % interval"),
        uncertain("high_95", "upper end of the 95 % interval"),
        column("draws", DataType::UInt32, true, "", "draws of the Monte Carlo; null without uncertainty"),
        text(
            "no_uncertainty",
            true,
            "why no uncertainty is stated; null where one is, or where the errors are not known",
        ),
    ])
}

/// One row a value.
pub fn rows(summary: &Summary) -> Vec<ArrayRef> {
    let rows = summary.values();
    let uncertainty = |of: fn(&Uncertainty) -> f64| -> ArrayRef {
        Arc::new(rows.iter().map(|row| row.value.uncertainty.as_ref().map(of)).collect::<Float64Array>())
    };
    let texts = |of: fn(&Value) -> &str| -> ArrayRef {
        Arc::new(StringArray::from_iter_values(rows.iter().map(|row| of(row.value))))
    };
    let order = |end: usize| -> ArrayRef {
        Arc::new(UInt32Array::from_iter_values(rows.iter().map(|row| whole(row.value.band_upr[end]))))
    };
    vec![
        Arc::new(rows.iter().map(|row| row.station).collect::<StringArray>()),
        Arc::new(rows.iter().map(|row| row.section).collect::<StringArray>()),
        Arc::new(rows.iter().map(|row| row.z_mm).collect::<Float64Array>()),
        texts(|value| &value.symbol),
        numbers(rows.iter().map(|row| row.value.value)),
        texts(|value| &value.unit),
        texts(|value| &value.source),
        order(0),
        order(1),
        Arc::new(StringArray::from_iter_values(rows.iter().map(|row| json!(row.value.lost_orders).to_string()))),
        Arc::new(rows.iter().map(|row| row.value.weakened_above_upr).collect::<Float64Array>()),
        Arc::new(rows.iter().map(|row| row.value.absent_above_upr.map(whole)).collect::<UInt32Array>()),
        texts(|value| &value.filter),
        texts(|value| &value.reference),
        numbers(rows.iter().map(|row| row.value.coverage)),
        uncertainty(|uncertainty| uncertainty.std),
        uncertainty(|uncertainty| uncertainty.interval_95[0]),
        uncertainty(|uncertainty| uncertainty.interval_95[1]),
        Arc::new(
            rows.iter()
                .map(|row| row.value.uncertainty.as_ref().map(|uncertainty| whole(uncertainty.draws)))
                .collect::<UInt32Array>(),
        ),
        Arc::new(rows.iter().map(|row| row.value.no_uncertainty.as_deref()).collect::<StringArray>()),
    ]
}

fn whole(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}
