//! The three tables: their columns, and one station's rows.

use std::{collections::HashMap, iter::repeat_n, sync::Arc};

use arrow_array::{ArrayRef, BooleanArray, Float64Array, StringArray, UInt32Array};
use arrow_schema::{DataType, Field, Schema};
use runout_core::{
    azimuth::Azimuth,
    pipeline::run::StationResult,
    separation::{ALONG_COLUMN, MotionColumn, Quantity, motion_columns},
};

pub(super) fn column(name: &str, kind: DataType, nullable: bool, unit: &str, meaning: &str) -> Field {
    let about = [("unit", unit), ("meaning", meaning)].map(|(key, value)| (key.to_owned(), value.to_owned()));
    Field::new(name, kind, nullable).with_metadata(HashMap::from(about))
}

pub(super) fn text(name: &str, nullable: bool, meaning: &str) -> Field {
    column(name, DataType::Utf8, nullable, "", meaning)
}

pub(super) fn number(name: &str, unit: &str, meaning: &str) -> Field {
    column(name, DataType::Float64, false, unit, meaning)
}

/// Columns of `form.parquet`.
pub fn form_schema() -> Schema {
    Schema::new(vec![
        text("section", false, "id of the section"),
        text("station", false, "name of the axial station"),
        number("z_mm", "mm", "place of the section along the axis"),
        number("angle_deg", "deg", "the part's own angle"),
        number("form_um", "um", "deviation of the section's form, outward positive; orders that are lost are left out"),
        number("std_um", "um", "standard uncertainty of form_um at any one angle, from the scatter; NaN if not known"),
    ])
}

/// One station's rows of `form.parquet`.
pub fn form(result: &StationResult) -> Vec<ArrayRef> {
    let separation = &result.separation;
    let sections: Vec<_> = (separation.sections.iter().enumerate())
        .filter_map(|(index, at)| separation.position(Quantity::Form(index)).map(|unknown| (unknown, at)))
        .collect();
    let angles = result.angles;
    let rows = sections.len() * angles;
    let ids = sections.iter().flat_map(|(_, at)| repeat_n(at.id.as_str(), angles));
    vec![
        Arc::new(StringArray::from_iter_values(ids)),
        Arc::new(StringArray::from_iter_values(repeat_n(result.station.as_str(), rows))),
        numbers(sections.iter().flat_map(|(_, at)| repeat_n(at.z_mm, angles))),
        numbers(sections.iter().flat_map(|_| angles_deg(angles))),
        numbers(sections.iter().flat_map(|(unknown, _)| result.over_angle(*unknown))),
        numbers(sections.iter().flat_map(|(unknown, _)| repeat_n(separation.angle_std(*unknown), angles))),
    ]
}

/// Columns of `motion.parquet`; `line` is that of the motion, where that is neither x nor y.
pub fn motion_schema(line: Option<Azimuth>) -> Schema {
    let mut fields =
        vec![text("station", false, "name of the axial station"), number("angle_deg", "deg", "the spindle's angle")];
    let (name, unit, meaning) = ALONG_COLUMN;
    fields.extend(line.map(|_| number(name, unit, meaning)));
    let motions = motion_columns(line);
    let value = |MotionColumn { quantity, name, about }: &MotionColumn| {
        let meaning = format!("{about}; orders that are lost are left out; null where it was not solved for");
        column(name, DataType::Float64, true, quantity.unit(), &meaning)
    };
    let uncertainty = |MotionColumn { quantity, name, .. }: &MotionColumn| {
        let meaning = format!("standard uncertainty of {name} at any one angle, from the scatter; NaN if not known");
        column(&format!("std_{name}"), DataType::Float64, true, quantity.unit(), &meaning)
    };
    fields.extend(motions.iter().map(value));
    fields.extend(motions.iter().map(uncertainty));
    Schema::new(fields)
}

/// One station's rows of `motion.parquet`.
pub fn motion(result: &StationResult) -> Vec<ArrayRef> {
    let angles = result.angles;
    let line = result.separation.azimuth();
    let motions = motion_columns(line).into_iter();
    let unknowns: Vec<Option<usize>> = motions.map(|motion| result.separation.position(motion.quantity)).collect();
    let or_nulls = |values: Option<ArrayRef>| values.unwrap_or_else(|| Arc::new(Float64Array::new_null(angles)));
    let value = |unknown: Option<usize>| or_nulls(unknown.map(|unknown| numbers(result.over_angle(unknown))));
    let uncertainty = |unknown: Option<usize>| {
        or_nulls(unknown.map(|unknown| numbers(repeat_n(result.separation.angle_std(unknown), angles))))
    };
    let mut columns: Vec<ArrayRef> = vec![
        Arc::new(StringArray::from_iter_values(repeat_n(result.station.as_str(), angles))),
        numbers(angles_deg(angles)),
    ];
    columns.extend(line.map(|line| numbers(repeat_n(line.degrees(), angles))));
    columns.extend(unknowns.iter().copied().map(value));
    columns.extend(unknowns.iter().copied().map(uncertainty));
    columns
}

/// Columns of `harmonics.parquet`.
pub fn harmonics_schema() -> Schema {
    const UNIT: &str = "um; urad for tilt";
    Schema::new(vec![
        text("quantity", false, "form, x, y, tilt_x, tilt_y, along or tilt_along"),
        text("section", true, "id of the section; null for motion"),
        text("station", false, "name of the axial station"),
        column("order", DataType::UInt32, false, "1/rev", "undulations per revolution"),
        number("re", UNIT, "real part of c; NaN where the layout cannot tell it"),
        number("im", UNIT, "imaginary part of c; NaN where the layout cannot tell it"),
        number("std", UNIT, "root of E|error of c|², both parts together, from the scatter; NaN if not known"),
        column("observable", DataType::Boolean, false, "", "whether the layout can tell this order"),
    ])
}

/// One station's rows of `harmonics.parquet`: orders from 1, and 0 where a level is known.
pub fn harmonics(result: &StationResult) -> Vec<ArrayRef> {
    let separation = &result.separation;
    let width = separation.unknowns.len();
    let orders = separation.estimate.len() / width.max(1);
    // The places of each unknown's rows in the separation.
    let rows: Vec<_> = (0..width)
        .map(|unknown| {
            let level = separation.estimate.get(unknown).is_some_and(|level| level.re != 0.0);
            (usize::from(!level)..orders).map(move |order| order * width + unknown)
        })
        .collect();
    let lengths = || rows.iter().map(ExactSizeIterator::len);
    let count = lengths().sum();
    let section = |quantity: &Quantity| match quantity {
        Quantity::Form(section) => separation.sections.get(*section).map(|at| at.id.as_str()),
        _ => None,
    };
    let observable = |place: usize| separation.observable.get(place).copied().unwrap_or(false);
    let number = |value: &dyn Fn(usize) -> f64| -> ArrayRef {
        let mut numbers = Vec::with_capacity(count);
        for places in &rows {
            numbers.extend(places.clone().map(|place| if observable(place) { value(place) } else { f64::NAN }));
        }
        Arc::new(Float64Array::from(numbers))
    };
    let each = || separation.unknowns.iter().zip(lengths());
    vec![
        Arc::new(StringArray::from_iter_values(each().flat_map(|(quantity, length)| repeat_n(quantity.id(), length)))),
        Arc::new(each().flat_map(|(quantity, length)| repeat_n(section(quantity), length)).collect::<StringArray>()),
        Arc::new(StringArray::from_iter_values(repeat_n(result.station.as_str(), count))),
        Arc::new(UInt32Array::from_iter_values(lengths().flat_map(|length| (orders - length) as u32..orders as u32))),
        number(&|place| separation.estimate[place].re),
        number(&|place| separation.estimate[place].im),
        number(&|place| separation.variance.get(place).map_or(f64::NAN, |variance| variance.sqrt())),
        Arc::new(rows.iter().cloned().flatten().map(|place| Some(observable(place))).collect::<BooleanArray>()),
    ]
}

pub(super) fn angles_deg(angles: usize) -> impl Iterator<Item = f64> {
    (0..angles).map(move |index| 360.0 * index as f64 / angles as f64)
}

pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(values))
}
