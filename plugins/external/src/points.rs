//! A separator of points that is a program: points out, values and a residual in.

use std::{
    collections::HashSet,
    sync::{Mutex, PoisonError},
};

use runout_core::{
    Error, Result,
    fault::Fault,
    points::{PointColumn, PointKind, Points},
    stage::{Outcome, PointSeparator},
    summary::Value,
    table::{ArrayRef, ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, numbers, numbers_or_null, texts},
};
use serde_json::Value as Json;

use crate::{
    answer::Answer,
    frame::Frame,
    session::Session,
    tables::{Table, encode},
};

const VALUES: [&str; 6] = ["symbol", "of", "value", "std", "unit", "about"];
const RESIDUAL: [&str; 2] = ["row", "residual_um"];
/// Units that a column's name may end in.
const UNITS: [&str; 8] = ["mm", "um", "nm", "deg", "rad", "urad", "s", "m"];

/// A program for measured points.
pub(crate) struct ProgramForPoints {
    session: Session,
    config: Json,
    columns: Vec<PointColumn>,
}

impl ProgramForPoints {
    /// For columns of numbers and of texts.
    ///
    /// # Errors
    /// When there are no numbers, or a name is there twice.
    pub(crate) fn new(
        session: Session,
        config: Json,
        numbers: &[String],
        labels: &[String],
    ) -> std::result::Result<Self, Fault> {
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
        Ok(Self { session, config, columns })
    }

    fn request(&self, points: &Points) -> Result<Vec<u8>> {
        let (mut specs, mut cells): (Vec<ColumnSpec>, Vec<ArrayRef>) = (Vec::new(), Vec::new());
        for column in &self.columns {
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
        let about = [("stage", "separate-points".to_owned()), ("config", self.config.to_string())];
        let frame = encode(&spec.name, &spec.rows(cells)?, &about);
        let frame = frame.map_err(|error| Error::caused("write", "the table points", error))?;
        let mut request = Vec::new();
        frame.append_to(&mut request);
        Frame::end().append_to(&mut request);
        Ok(request)
    }
}

impl PointSeparator for ProgramForPoints {
    fn columns(&self) -> Vec<PointColumn> {
        self.columns.clone()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![residual()]
    }

    fn notes(&self) -> Vec<String> {
        vec!["a program separates: what it observes is known after the run".into()]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let object = points.input.display().to_string();
        let count = points.columns.first().map_or(0, |column| column.values.len());
        self.session.answer(("separate", &object), self.request(points)?, |answer| outcome(answer, count))
    }
}

/// What an answer says of so many points.
fn outcome(answer: &[Frame], count: usize) -> std::result::Result<Outcome, String> {
    let answer = Answer::of(answer, &["values", "residual"])?;
    let table = Table::decode(answer.table("values").ok_or("gave no table `values`")?, &VALUES)?;
    let [symbol, of] = ["symbol", "of"].map(|name| table.texts(name));
    let symbol = table.needed("symbol", symbol)?;
    let value = table.needed("value", table.numbers("value"))?;
    let unit = table.needed("unit", table.texts("unit"))?;
    let (of, std, about) = (of?, table.numbers("std")?, table.texts("about")?);
    let mut values: Vec<Value> = Vec::new();
    for row in 0..table.count() {
        let text = |column: &Option<Vec<Option<String>>>| column.as_ref().and_then(|column| column[row].clone());
        let Some(symbol) = symbol[row].as_deref().filter(|symbol| !symbol.is_empty()) else {
            return Err(format!("gave row {} of `values` without a symbol", row + 1));
        };
        let std = std.as_ref().and_then(|std| std[row]);
        if std.is_some_and(|std| std < 0.0) {
            return Err(format!("gave {symbol} with a `std` below 0"));
        }
        let [number, deviation] = [value[row], std].map(|number| number.unwrap_or(f64::NAN));
        let about = text(&about).unwrap_or_else(|| "by a program".into());
        let mut found = Value::new(symbol, number, deviation, unit[row].as_deref().unwrap_or(""), &about);
        found.of = text(&of);
        if values.iter().any(|known| known.symbol == found.symbol && known.of == found.of) {
            return Err(format!("gave {symbol} {} twice", found.of.unwrap_or_default()));
        }
        if std.is_none() {
            found.no_uncertainty = Some("the program gives no `std`".into());
        }
        values.push(found);
    }
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
    let convention = "values and residuals are those of a program".into();
    Ok(Outcome { convention, tables, values, remarks: answer.warnings, ..Outcome::default() })
}

fn residual() -> TableSpec {
    let left = ColumnSpec::number("residual_um", "um", "what the program's fit leaves of the point").or_null();
    let row = ColumnSpec::count("row", "", "number of the point, from 0");
    TableSpec::new("residual", "what the program's fit leaves of each point", vec![row, left])
        .optional()
        .figure(Figure::lines("residual", "Residual", "row", [Measure::new("residual_um")]))
}

/// A name that lasts as long as the process, as names of columns do; kept once, however often it is asked for.
fn lasting(name: &str) -> &'static str {
    static KNOWN: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(text) = known.iter().find(|text| **text == name) {
        return text;
    }
    let text: &'static str = Box::leak(name.into());
    known.push(text);
    text
}
