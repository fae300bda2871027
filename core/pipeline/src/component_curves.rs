//! Errors of axes as curves over their positions, with location errors beside them: tables that any domain may give and any exporter may
//! read (ISO 230-1).
//!
//! A row of `component_curves` is a node of an axis: its six component errors, for the point `at` of the machine. Rotations act on what the
//! axis carries, with arms from that point. Axes stand in the order of the chain, from the base to the tool. `location_errors` has what is
//! constant: squareness, and place and orientation of a rotary axis.

use runout_error::{Error, ErrorKind, Result};
use runout_table::{
    Array, ColumnSpec, Figure, Float64Array, Measure, RecordBatch, StringArray, TableRows, TableSpec, numbers,
    numbers_or_null, texts,
};

/// Name of the table of curves.
pub const CURVES: &str = "component_curves";
/// Name of the table of location errors.
pub const LOCATION: &str = "location_errors";

/// Letters of the directions and of the rotations about them.
const DIRECTIONS: [&str; 3] = ["X", "Y", "Z"];
const ROTATIONS: [&str; 3] = ["A", "B", "C"];

/// What an axis carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carries {
    /// The tool.
    Tool,
    /// The workpiece.
    Work,
}

/// A node of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// X, Y, Z, A, B or C.
    pub axis: String,
    /// What the axis carries.
    pub carries: Carries,
    /// Its position: mm of a linear axis, ° of a rotary one.
    pub position: f64,
    /// The point of the machine that the errors are of, in mm.
    pub at_mm: [f64; 3],
    /// EX, EY, EZ in µm, EA, EB, EC in µrad; NaN where not observable.
    pub errors: [f64; 6],
    /// Their standard uncertainties.
    pub std: [f64; 6],
}

/// A constant error of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Location {
    /// EC0Y, EX0C and the like.
    pub symbol: String,
    /// In the unit; NaN where not observable.
    pub value: f64,
    /// Its standard uncertainty.
    pub std: f64,
}

impl Location {
    /// `um` or `urad`.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        if self.symbol.get(1..2).is_some_and(|letter| ROTATIONS.contains(&letter)) { "urad" } else { "um" }
    }
}

/// Names of the errors of an axis: EXX, EYX, EZX, EAX, EBX, ECX.
#[must_use]
pub fn symbols(axis: &str) -> [String; 6] {
    let [x, y, z] = DIRECTIONS.map(|letter| format!("E{letter}{axis}"));
    let [a, b, c] = ROTATIONS.map(|letter| format!("E{letter}{axis}"));
    [x, y, z, a, b, c]
}

/// Whether an axis turns.
#[must_use]
pub fn is_rotary(axis: &str) -> bool {
    ROTATIONS.contains(&axis)
}

const ERRORS: [(&str, &str); 6] =
    [("ex", "um"), ("ey", "um"), ("ez", "um"), ("ea", "urad"), ("eb", "urad"), ("ec", "urad")];

/// The table of curves of linear or of rotary axes, with its figures.
#[must_use]
pub fn curves_table(rotary: bool, about: &str) -> TableSpec {
    let (position, unit) = if rotary { ("position_deg", "deg") } else { ("position_mm", "mm") };
    let mut columns = vec![
        ColumnSpec::name("axis", "the axis, in the order of the chain"),
        ColumnSpec::name("carries", "tool or work"),
        ColumnSpec::number(position, unit, "position of the node").repeating(),
    ];
    columns.extend(DIRECTIONS.map(|letter| {
        let name = format!("at_{}_mm", letter.to_lowercase());
        ColumnSpec::number(name, "mm", "point of the machine that the errors are of").repeating()
    }));
    columns.extend(ERRORS.map(|(name, unit)| {
        let about =
            format!("component error {} of the axis (ISO 230-1); null where not observable", name.to_uppercase());
        ColumnSpec::number(format!("{name}_{unit}"), unit, about).or_null()
    }));
    columns.extend(ERRORS.map(|(name, unit)| {
        let about = format!("standard uncertainty of {name}_{unit}");
        ColumnSpec::number(format!("std_{name}_{unit}"), unit, about).or_null()
    }));
    let measures = |part: std::ops::Range<usize>| {
        ERRORS[part].iter().map(|(name, unit)| {
            Measure::new(format!("{name}_{unit}"))
                .with_std(format!("std_{name}_{unit}"))
                .with_symbol(name.to_uppercase())
        })
    };
    TableSpec::new(CURVES, about, columns)
        .figure(
            Figure::lines("component-curves-um", "Displacement of the axes", position, measures(0..3)).panels(["axis"]),
        )
        .figure(
            Figure::lines("component-curves-urad", "Rotation of the axes", position, measures(3..6)).panels(["axis"]),
        )
}

/// Rows of [`curves_table`].
///
/// # Errors
/// When the rows are not of the table.
pub fn curves_rows(spec: &TableSpec, nodes: &[Node]) -> Result<TableRows> {
    let known = |value: f64| value.is_finite().then_some(value);
    let mut columns = vec![
        texts(nodes.iter().map(|node| &node.axis)),
        texts(nodes.iter().map(|node| if node.carries == Carries::Tool { "tool" } else { "work" })),
        numbers(nodes.iter().map(|node| node.position)),
    ];
    columns.extend([0, 1, 2].map(|axis| numbers(nodes.iter().map(|node| node.at_mm[axis]))));
    columns.extend((0..6).map(|index| numbers_or_null(nodes.iter().map(|node| known(node.errors[index])))));
    columns.extend((0..6).map(|index| numbers_or_null(nodes.iter().map(|node| known(node.std[index])))));
    Ok(TableRows { table: spec.name.clone(), rows: spec.rows(columns)? })
}

/// The table of location errors.
#[must_use]
pub fn location_table() -> TableSpec {
    let columns = vec![
        ColumnSpec::name("symbol", "name of the error (ISO 230-1)"),
        ColumnSpec::name("unit", "um or urad"),
        ColumnSpec::number("value", "", "the error, in the unit; null where not observable").or_null(),
        ColumnSpec::number("std", "", "its standard uncertainty").or_null(),
    ];
    TableSpec::new(LOCATION, "location errors of the axes: constant beside the component curves", columns)
}

/// Rows of [`location_table`].
///
/// # Errors
/// When the rows are not of the table.
pub fn location_rows(errors: &[Location]) -> Result<TableRows> {
    let spec = location_table();
    let known = |value: f64| value.is_finite().then_some(value);
    let rows = spec.rows(vec![
        texts(errors.iter().map(|error| &error.symbol)),
        texts(errors.iter().map(Location::unit)),
        numbers_or_null(errors.iter().map(|error| known(error.value))),
        numbers_or_null(errors.iter().map(|error| known(error.std))),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}

/// What the two tables say, as an exporter reads it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ComponentCurves {
    /// Nodes, axis by axis.
    pub nodes: Vec<Node>,
    /// Location errors.
    pub location: Vec<Location>,
}

impl ComponentCurves {
    /// Takes rows, where they are of one of the two tables.
    ///
    /// # Errors
    /// When a column is missing.
    pub fn take(&mut self, table: &str, rows: &RecordBatch) -> Result<()> {
        match table {
            CURVES => self.take_nodes(rows),
            LOCATION => self.take_location(rows),
            _ => Ok(()),
        }
    }

    fn take_nodes(&mut self, rows: &RecordBatch) -> Result<()> {
        let position = if rows.column_by_name("position_deg").is_some() { "position_deg" } else { "position_mm" };
        let (axes, carries, position) = (names(rows, "axis")?, names(rows, "carries")?, values(rows, position)?);
        let at = ["at_x_mm", "at_y_mm", "at_z_mm"].map(|name| values(rows, name));
        let [x, y, z] = at;
        let at = [x?, y?, z?];
        let of = |before: &str| -> Result<Vec<&Float64Array>> {
            ERRORS.iter().map(|(name, unit)| values(rows, &format!("{before}{name}_{unit}"))).collect()
        };
        let (errors, std) = (of("")?, of("std_")?);
        let cell = |column: &Float64Array, row: usize| if column.is_null(row) { f64::NAN } else { column.value(row) };
        self.nodes.extend((0..rows.num_rows()).map(|row| Node {
            axis: axes.value(row).to_owned(),
            carries: if carries.value(row) == "work" { Carries::Work } else { Carries::Tool },
            position: cell(position, row),
            at_mm: [0, 1, 2].map(|axis| cell(at[axis], row)),
            errors: std::array::from_fn(|index| cell(errors[index], row)),
            std: std::array::from_fn(|index| cell(std[index], row)),
        }));
        Ok(())
    }

    fn take_location(&mut self, rows: &RecordBatch) -> Result<()> {
        let (symbols, value, std) = (names(rows, "symbol")?, values(rows, "value")?, values(rows, "std")?);
        let cell = |column: &Float64Array, row: usize| if column.is_null(row) { f64::NAN } else { column.value(row) };
        self.location.extend((0..rows.num_rows()).map(|row| Location {
            symbol: symbols.value(row).to_owned(),
            value: cell(value, row),
            std: cell(std, row),
        }));
        Ok(())
    }

    /// The axes, from the base to the tool.
    #[must_use]
    pub fn axes(&self) -> Vec<&str> {
        let mut axes: Vec<&str> = Vec::new();
        for node in &self.nodes {
            if !axes.contains(&node.axis.as_str()) {
                axes.push(&node.axis);
            }
        }
        axes
    }

    /// Nodes of an axis, in the order of their positions.
    #[must_use]
    pub fn of_axis(&self, axis: &str) -> Vec<&Node> {
        let mut nodes: Vec<&Node> = self.nodes.iter().filter(|node| node.axis == axis).collect();
        nodes.sort_by(|one, other| one.position.total_cmp(&other.position));
        nodes
    }
}

fn lacks(name: &str) -> Error {
    Error::new("read", format!("the table {CURVES}"), format!("it has no column `{name}` of the right type"))
        .of(ErrorKind::UnsuitableData)
}

fn names<'a>(rows: &'a RecordBatch, name: &str) -> Result<&'a StringArray> {
    rows.column_by_name(name).and_then(|column| column.as_any().downcast_ref()).ok_or_else(|| lacks(name))
}

fn values<'a>(rows: &'a RecordBatch, name: &str) -> Result<&'a Float64Array> {
    rows.column_by_name(name).and_then(|column| column.as_any().downcast_ref()).ok_or_else(|| lacks(name))
}
