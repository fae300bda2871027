//! Error motion of the axis.

use runout_core::{evaluate::Value, summary::StationSummary};

use super::{unit, with_uncertainty};
use crate::render::{
    number::{lacking, place, significant, spread},
    page::Page,
    table::Table,
};

const KINDS: [&str; 3] = ["synchronous", "asynchronous", "total"];

/// One row a direction, one column a kind of value: of a station with ±, of several from the lowest to the highest.
pub(crate) fn section(page: &mut Page, stations: &[StationSummary]) {
    let Some(first) = stations.iter().flat_map(|station| &station.motion_values).find(|value| is_plot(value)) else {
        return;
    };
    let values = || stations.iter().flat_map(|station| &station.motion_values).filter(|value| is_about(value, first));
    let mut directions: Vec<(String, String)> = Vec::new();
    for value in values() {
        let direction = (parts(value).1, unit(&value.unit));
        if !directions.contains(&direction) {
            directions.push(direction);
        }
    }
    let line = stations.iter().find_map(|station| station.motion_along_deg);
    let about = first.reference.as_deref().unwrap_or_default();
    let named = |direction: &str| match line {
        _ if is_axial(direction) && about != "PC" => format!("{direction} (PC)"),
        Some(line_deg) => direction.replace("along", &format!("along {line_deg}°")),
        None => direction.to_owned(),
    };
    let mut table = Table::new(1, std::iter::once("").chain(KINDS));
    for (direction, unit) in &directions {
        let cell = |kind: &str| {
            let found = values().filter(|value| parts(value) == (kind, direction.clone()));
            cell(&found.collect::<Vec<_>>())
        };
        table.row(std::iter::once(format!("{} {unit}", named(direction))).chain(KINDS.map(cell)));
    }
    let of = if stations.len() > 1 { ", lowest to highest of the stations" } else { "" };
    let places: Vec<f64> = stations.iter().filter_map(|station| station.motion_z_mm).collect();
    let at = match spread(places) {
        Some([low, _, high]) if low < high => {
            format!(", radial at z {} to {} mm", place(low), place(high))
        }
        Some([low, ..]) => format!(", radial at z = {} mm", place(low)),
        None => String::new(),
    };
    page.headed_table(format_args!("Error motion of the axis about {about}{at}, peak to valley and rms{of}"), &table);
}

/// Whether it is drawn about a centre.
fn is_plot(value: &Value) -> bool {
    !["asynchronous", "fundamental"].iter().any(|kind| value.symbol.starts_with(kind))
}

/// Whether it has no centre, or that of `first`.
fn is_about(value: &Value, first: &Value) -> bool {
    !is_plot(value) || value.reference == first.reference || is_axial(&parts(value).1)
}

/// Whether a direction is along the axis: its values have a centre of their own.
fn is_axial(direction: &str) -> bool {
    ["axial", "face"].iter().any(|along| direction.starts_with(along))
}

/// Kind and direction: "synchronous", "radial x". The fundamental is synchronous motion at 1/rev.
fn parts(value: &Value) -> (&str, String) {
    let residual = value.symbol.strip_prefix("residual-");
    let symbol = residual.unwrap_or(&value.symbol);
    let (kind, direction) = symbol.split_once('-').unwrap_or((symbol, ""));
    match kind {
        // Along the axis there are both: with the fundamental and without it.
        _ if residual.is_some() && is_axial(direction) => {
            let (direction, rms) = direction.strip_suffix("-rms").map_or((direction, ""), |one| (one, " rms"));
            (kind, format!("{} residual{rms}", direction.replace('-', " ")))
        }
        "fundamental" => ("synchronous", format!("{direction} fundamental")),
        _ => (kind, direction.replace('-', " ")),
    }
}

fn cell(values: &[&Value]) -> String {
    match values {
        [] => String::new(),
        [only] => with_uncertainty(only) + &lacking(&only.lost_orders),
        several => match spread(several.iter().map(|value| value.value)) {
            Some([low, _, high]) => {
                let lost = several.first().map_or_else(String::new, |value| lacking(&value.lost_orders));
                format!("{} to {}{lost}", significant(low, 3), significant(high, 3))
            }
            None => String::new(),
        },
    }
}
