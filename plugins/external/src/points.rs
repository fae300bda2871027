//! A separator of points: points out, values and a residual in.

use std::collections::HashSet;

use runout_core::{
    Error, Result,
    fault::Fault,
    points::{PointColumn, PointKind, Points},
    stage::{Outcome, PointSeparator},
    table::{ArrayRef, ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, numbers, numbers_or_null, texts},
};
use serde_json::Value as Json;

use crate::{
    answer::Answer,
    frame::Frame,
    session::Session,
    tables::{Table, encode},
    values::{Symbols, VALUES, lasting, values},
};

const RESIDUAL: [&str; 2] = ["row", "residual_um"];
/// Units that a column's name may end in.
const UNITS: [&str; 8] = ["mm", "um", "nm", "deg", "rad", "urad", "s", "m"];

/// A separator of measured points.
pub(crate) struct ExternalPointSeparator {
    session: Session,
    config: Json,
    columns: Vec<PointColumn>,
    symbols: Symbols,
}

impl ExternalPointSeparator {
    /// For columns of numbers and of texts; where symbols are declared, it gives no other values.
    ///
    /// # Errors
    /// When there are no numbers, or a name is there twice.
    pub(crate) fn new(
        session: Session,
        config: Json,
        [numbers, labels]: [&[String]; 2],
        symbols: Symbols,
    ) -> std::result::Result<Self, Fault> {
        Ok(Self { session, config, columns: columns([numbers, labels])?, symbols })
    }
}

impl PointSeparator for ExternalPointSeparator {
    fn columns(&self) -> Vec<PointColumn> {
        self.columns.clone()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![residual()]
    }

    fn symbols(&self) -> Symbols {
        self.symbols.clone()
    }

    fn notes(&self) -> Vec<String> {
        vec!["an external separator: what it observes is known after the run".into()]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let object = points.input.display().to_string();
        let count = points.columns.first().map_or(0, |column| column.values.len());
        self.session.answer(
            ("separate", &object),
            request(points, &self.columns, "separate-points", &self.config)?,
            |answer| outcome(answer, count, &self.symbols),
        )
    }
}

/// Columns of numbers and of texts that a program takes of points.
///
/// # Errors
/// When there are no numbers, or a name is there twice.
pub(crate) fn columns([numbers, labels]: [&[String]; 2]) -> std::result::Result<Vec<PointColumn>, Fault> {
    if numbers.is_empty() {
        return Err(Fault::at("columns", "expected at least one column of numbers").help("columns = [\"x_mm\"]"));
    }
    let mut known = HashSet::new();
    let kinds = [("columns", PointKind::Number, numbers), ("labels", PointKind::Label, labels)];
    let mut columns = Vec::new();
    for (key, kind, names) in kinds {
        for name in names {
            if name.is_empty() || !known.insert(name) {
                let problem = format!("names of columns must differ and not be empty, found `{name}`");
                return Err(Fault::at(key, problem));
            }
            let unit = name.rsplit_once('_').and_then(|(_, end)| UNITS.into_iter().find(|unit| *unit == end));
            let about = "for the program";
            columns.push(PointColumn::needed(lasting(name), kind, unit.unwrap_or(""), about));
        }
    }
    Ok(columns)
}

/// The request of a stage that takes points.
///
/// # Errors
/// When the points lack a column.
pub(crate) fn request(points: &Points, columns: &[PointColumn], stage: &str, config: &Json) -> Result<Vec<u8>> {
    let (mut specs, mut cells): (Vec<ColumnSpec>, Vec<ArrayRef>) = (Vec::new(), Vec::new());
    for column in columns {
        if column.kind == PointKind::Label {
            specs.push(ColumnSpec::name(column.name, column.about));
            let labels = points.labels(column.name);
            cells.push(texts(labels.ok_or_else(|| Error::new("find the column", column.name, "there is none"))?));
        } else {
            specs.push(ColumnSpec::number(column.name, column.unit, column.about));
            cells.push(numbers(points.column(column.name)?.iter().copied()));
        }
    }
    let spec = TableSpec::new("points", "measured points, in the order of the file", specs);
    let about = [("stage", stage.to_owned()), ("config", config.to_string())];
    let frame = encode(&spec.name, &spec.rows(cells)?, &about);
    let frame = frame.map_err(|error| Error::caused("write", "the table points", error))?;
    let mut request = Vec::new();
    frame.append_to(&mut request);
    Frame::end().append_to(&mut request);
    Ok(request)
}

/// What an answer says of so many points.
fn outcome(
    answer: &[Frame],
    count: usize,
    symbols: &[(&'static str, &'static str)],
) -> std::result::Result<Outcome, String> {
    let answer = Answer::of(answer, &[VALUES, "residual"])?;
    let values = values(&answer, symbols)?;
    let mut tables = Vec::new();
    if let Some(frame) = answer.table("residual") {
        let table = Table::decode(frame, &RESIDUAL)?;
        let row = table.needed("row", table.counts("row"))?;
        let left = table.needed("residual_um", table.numbers("residual_um"))?;
        let row: Option<Vec<usize>> = row.into_iter().map(|row| row.filter(|row| *row < count)).collect();
        let row =
            row.ok_or_else(|| format!("gave a residual of a row that is not one of 0 to {}", count.saturating_sub(1)))?;
        let rows = residual().rows(vec![counts(row), numbers_or_null(left)]).map_err(|error| error.to_string())?;
        tables.push(TableRows { table: residual().name, rows });
    }
    let convention = "values and residuals are those of an external separator".into();
    Ok(Outcome { convention, tables, values, remarks: answer.warnings, ..Outcome::default() })
}

fn residual() -> TableSpec {
    let left = ColumnSpec::number("residual_um", "um", "what the program's fit leaves of the point").or_null();
    let row = ColumnSpec::count("row", "", "number of the point, from 0");
    TableSpec::new("residual", "what the program's fit leaves of each point", vec![row, left])
        .optional()
        .figure(Figure::lines("residual", "Residual", "row", [Measure::new("residual_um")]))
}
