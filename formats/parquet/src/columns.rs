//! The three tables: their columns, and one station's rows.

use std::{collections::HashMap, iter::repeat_n, sync::Arc};

use arrow_array::{ArrayRef, BooleanArray, Float64Array, StringArray, UInt32Array};
use arrow_schema::{DataType, Field, Schema};
use runout_core::{
    pipeline::run::StationResult,
    separation::{Quantity, Separation},
};

/// Motions in the order of their columns, with those columns' names.
const MOTIONS: [(Quantity, &str, &str); 4] = [
    (Quantity::X, "x_um", "error motion along x"),
    (Quantity::Y, "y_um", "error motion along y"),
    (Quantity::TiltX, "tilt_x_urad", "tilt about x, right-handed"),
    (Quantity::TiltY, "tilt_y_urad", "tilt about y, right-handed"),
];

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

/// Columns of `motion.parquet`.
pub fn motion_schema() -> Schema {
    let mut fields =
        vec![text("station", false, "name of the axial station"), number("angle_deg", "deg", "the spindle's angle")];
    let value = |(quantity, name, meaning): (Quantity, &str, &str)| {
        let meaning = format!("{meaning}; orders that are lost are left out; null where it was not solved for");
        column(name, DataType::Float64, true, quantity.unit(), &meaning)
    };
    let uncertainty = |(quantity, name, _): (Quantity, &str, &str)| {
        let meaning = format!("standard uncertainty of {name} at any one angle, from the scatter; NaN if not known");
        column(&format!("std_{name}"), DataType::Float64, true, quantity.unit(), &meaning)
    };
    fields.extend(MOTIONS.map(value));
    fields.extend(MOTIONS.map(uncertainty));
    Schema::new(fields)
}

/// One station's rows of `motion.parquet`.
pub fn motion(result: &StationResult) -> Vec<ArrayRef> {
    let angles = result.angles;
    let unknowns = MOTIONS.map(|(quantity, _, _)| result.separation.position(quantity));
    let or_nulls = |values: Option<ArrayRef>| values.unwrap_or_else(|| Arc::new(Float64Array::new_null(angles)));
    let value = |unknown: Option<usize>| or_nulls(unknown.map(|unknown| numbers(result.over_angle(unknown))));
    let uncertainty = |unknown: Option<usize>| {
        or_nulls(unknown.map(|unknown| numbers(repeat_n(result.separation.angle_std(unknown), angles))))
    };
    let mut columns: Vec<ArrayRef> = vec![
        Arc::new(StringArray::from_iter_values(repeat_n(result.station.as_str(), angles))),
        numbers(angles_deg(angles)),
    ];
    columns.extend(unknowns.map(value));
    columns.extend(unknowns.map(uncertainty));
    columns
}

/// Columns of `harmonics.parquet`.
pub fn harmonics_schema() -> Schema {
    const UNIT: &str = "um; urad for tilt";
    Schema::new(vec![
        text("quantity", false, "form, x, y, tilt_x or tilt_y"),
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
    let rows: Vec<Row> = (separation.unknowns.iter().enumerate())
        .flat_map(|(unknown, quantity)| {
            (0..=separation.max_order()).filter_map(move |order| Row::of(separation, *quantity, unknown, order))
        })
        .collect();
    vec![
        Arc::new(StringArray::from_iter_values(rows.iter().map(|row| row.quantity))),
        Arc::new(rows.iter().map(|row| row.section).collect::<StringArray>()),
        Arc::new(StringArray::from_iter_values(repeat_n(result.station.as_str(), rows.len()))),
        Arc::new(UInt32Array::from_iter_values(rows.iter().map(|row| row.order))),
        numbers(rows.iter().map(|row| row.re)),
        numbers(rows.iter().map(|row| row.im)),
        numbers(rows.iter().map(|row| row.std)),
        Arc::new(rows.iter().map(|row| Some(row.observable)).collect::<BooleanArray>()),
    ]
}

/// One coefficient.
struct Row<'a> {
    quantity: &'static str,
    section: Option<&'a str>,
    order: u32,
    re: f64,
    im: f64,
    std: f64,
    observable: bool,
}

impl<'a> Row<'a> {
    fn of(separation: &'a Separation, quantity: Quantity, unknown: usize, order: usize) -> Option<Self> {
        let place = order * separation.unknowns.len() + unknown;
        let value = *separation.estimate.get(place)?;
        if order == 0 && value.re == 0.0 {
            return None;
        }
        let observable = separation.observable.get(place).copied().unwrap_or(false);
        let known = |value: f64| if observable { value } else { f64::NAN };
        let section = match quantity {
            Quantity::Form(section) => separation.sections.get(section).map(|at| at.id.as_str()),
            _ => None,
        };
        Some(Self {
            quantity: quantity.id(),
            section,
            order: order as u32,
            re: known(value.re),
            im: known(value.im),
            std: known(separation.variance.get(place).map_or(f64::NAN, |variance| variance.sqrt())),
            observable,
        })
    }
}

fn angles_deg(angles: usize) -> impl Iterator<Item = f64> {
    (0..angles).map(move |index| 360.0 * index as f64 / angles as f64)
}

pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(values))
}
