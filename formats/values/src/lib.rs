//! Values of a result with their uncertainties, limits and decisions, for other programs: the exporters `csv`, `xlsx` and `q-das`.
//!
//! ```toml
//! [[export]]
//! plugin = "xlsx"
//! path = "out/values.xlsx"
//! tables = ["form"]
//! ```

mod csv;
mod file;
mod q_das;
mod sheets;
mod xlsx;

use runout_core::{
    pipeline::{Plugin, Registry},
    summary::{Decision, ReportedValue},
};

pub use csv::CsvConfig;
pub use q_das::QDasConfig;
pub use xlsx::XlsxConfig;

/// Adds the exporters `csv`, `xlsx` and `q-das`.
pub fn register(registry: &mut Registry) {
    registry.exporters.add(Plugin::of::<CsvConfig>());
    registry.exporters.add(Plugin::of::<XlsxConfig>());
    registry.exporters.add(Plugin::of::<QDasConfig>());
}

/// A cell of a value's row.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cell<'a> {
    Text(&'a str),
    Number(f64),
    Empty,
}

impl Cell<'_> {
    fn number(number: Option<f64>) -> Self {
        number.map_or(Self::Empty, Self::Number)
    }
}

impl<'a> Cell<'a> {
    fn text(text: Option<&'a str>) -> Self {
        text.filter(|text| !text.is_empty()).map_or(Self::Empty, Self::Text)
    }
}

/// Names of the columns, with the width of a sheet's column in characters.
const COLUMNS: [(&str, u16); 18] = [
    ("station", 12),
    ("of", 16),
    ("z_mm", 10),
    ("symbol", 18),
    ("reference", 22),
    ("filter", 20),
    ("order", 8),
    ("value", 12),
    ("unit", 8),
    ("std", 12),
    ("low_95", 12),
    ("high_95", 12),
    ("interval", 10),
    ("lower_limit", 12),
    ("upper_limit", 12),
    ("decision", 16),
    ("remark", 40),
    ("about", 60),
];

/// A value's row, as [`COLUMNS`].
fn row<'a>(value: &ReportedValue<'a>) -> [Cell<'a>; COLUMNS.len()] {
    let (reported, value) = (value, value.value());
    let (place, id) = (reported.placed, reported.placed.id());
    let [low, high] = value.interval_95().map_or([None; 2], |ends| ends.map(Some));
    let [lower, upper] = reported.limit.map_or([None; 2], |(limit, found)| found.ends(limit));
    [
        Cell::text(place.station),
        Cell::text(id.of),
        Cell::number(place.z_mm),
        Cell::text(Some(id.symbol)),
        Cell::text(id.reference),
        Cell::text(id.filter),
        Cell::number(id.order().map(|order| order as f64)),
        Cell::number(value.number()),
        Cell::text(Some(&value.unit)),
        Cell::number(value.std()),
        Cell::number(low),
        Cell::number(high),
        Cell::text(value.uncertainty.as_ref().map(|known| known.kind.name())),
        Cell::number(lower),
        Cell::number(upper),
        Cell::text(decision(reported).map(decision_name)),
        Cell::text(reported.remark()),
        Cell::text(Some(&value.source)),
    ]
}

fn decision(value: &ReportedValue) -> Option<Decision> {
    value.limit.map(|(_, found)| found.decision)
}

/// As `summary.json` writes it.
fn decision_name(decision: Decision) -> &'static str {
    match decision {
        Decision::Conforms => "conforms",
        Decision::DoesNotConform => "does-not-conform",
        Decision::Undecided => "undecided",
    }
}
