//! Error motion of the axis.

use runout_core::{
    evaluate::{Value, error_motion::MotionKind},
    summary::StationSummary,
};

use super::{unit, with_uncertainty};
use crate::render::{
    number::{lacking, place, significant, spread},
    page::Page,
    table::Table,
};

const KINDS: [MotionKind; 3] = [MotionKind::Synchronous, MotionKind::Asynchronous, MotionKind::Total];

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
    let mut table = Table::new(1, std::iter::once("").chain(KINDS.map(MotionKind::name)));
    for (direction, unit) in &directions {
        let cell = |kind: MotionKind| {
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
    MotionKind::split(&value.symbol).is_some_and(|(kind, _)| kind.has_centre())
}

/// Whether it has no centre, or that of `first`.
fn is_about(value: &Value, first: &Value) -> bool {
    !is_plot(value) || value.reference == first.reference || is_axial(&parts(value).1)
}

/// Whether a direction is along the axis: its values have a centre of their own.
fn is_axial(direction: &str) -> bool {
    ["axial", "face"].iter().any(|along| direction.starts_with(along))
}

/// Column and row: synchronous, "radial x". Residual and fundamental motion are rows of synchronous motion.
fn parts(value: &Value) -> (MotionKind, String) {
    let (kind, direction) = MotionKind::split(&value.symbol).unwrap_or((MotionKind::Synchronous, &value.symbol));
    let name = direction.replace('-', " ");
    match kind {
        // Along the axis there are both: with the fundamental and without it.
        MotionKind::ResidualSynchronous if is_axial(direction) => {
            let (name, rms) = name.strip_suffix(" rms").map_or((name.as_str(), ""), |one| (one, " rms"));
            (MotionKind::Synchronous, format!("{name} residual{rms}"))
        }
        MotionKind::Fundamental => (MotionKind::Synchronous, format!("{name} fundamental")),
        MotionKind::ResidualSynchronous => (MotionKind::Synchronous, name),
        _ => (kind, name),
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
