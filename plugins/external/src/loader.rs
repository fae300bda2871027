//! A loader of points: the columns that are wanted out, points in.

use std::path::PathBuf;

use runout_core::{
    Error, Result,
    input_file::InputFile,
    points::{Column, Labels, PointColumn, PointKind, Points, Trace},
    stage::{Loader, Request, Source, SourceKind},
    table::{ColumnSpec, TableSpec, flags, texts},
};
use serde_json::Value;

use crate::{
    answer::Answer,
    frame::Frame,
    responder::Responder,
    session::Session,
    tables::{Table, encode},
};

/// What reads a file of a format of its own.
pub(crate) struct ExternalLoader {
    pub responder: Responder,
    pub config: Value,
    pub path: PathBuf,
}

impl ExternalLoader {
    fn request(&self, wanted: &[PointColumn]) -> Result<Vec<u8>> {
        let columns =
            [("name", "name of a column"), ("unit", "its unit"), ("kind", "what it holds"), ("about", "what it is")];
        let mut columns: Vec<ColumnSpec> = columns.map(|(name, about)| ColumnSpec::name(name, about)).into();
        columns.push(ColumnSpec::flag("optional", "whether the points may lack it"));
        let spec = TableSpec::new("columns", "columns that the separator takes of the points", columns);
        let rows = spec.rows(vec![
            texts(wanted.iter().map(|column| column.name)),
            texts(wanted.iter().map(|column| column.unit)),
            texts(wanted.iter().map(|column| kind(column.kind))),
            texts(wanted.iter().map(|column| column.about)),
            flags(wanted.iter().map(|column| column.optional)),
        ])?;
        let path = std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone());
        let about = [
            ("stage", "load-points".to_owned()),
            ("config", self.config.to_string()),
            ("path", path.display().to_string()),
        ];
        let frame = encode(&spec.name, &rows, &about);
        let frame = frame.map_err(|error| Error::caused("write", "the table columns", error))?;
        let mut request = Vec::new();
        frame.append_to(&mut request);
        Frame::end().append_to(&mut request);
        Ok(request)
    }
}

impl Loader for ExternalLoader {
    fn kind(&self) -> SourceKind {
        SourceKind::Points
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        let input = InputFile::new(&self.path)?;
        let session = Session::new(self.responder.clone());
        let object = self.path.display().to_string();
        let request = self.request(wanted.columns)?;
        let mut points = session.answer(("read", &object), request, |answer| points(answer, wanted.columns))?;
        points.input.clone_from(&self.path);
        points.opened = vec![input];
        Ok(Source::Points(points))
    }
}

fn kind(kind: PointKind) -> &'static str {
    match kind {
        PointKind::Number => "number",
        PointKind::Flag => "flag",
        PointKind::Label => "label",
        PointKind::Trace => "trace",
        PointKind::TraceKind => "trace-kind",
    }
}

/// The points of an answer, with the columns that are wanted.
fn points(answer: &[Frame], wanted: &[PointColumn]) -> std::result::Result<Points, String> {
    let answer = Answer::of(answer, &["points"])?;
    let names: Vec<&str> = wanted.iter().map(|column| column.name).collect();
    let table = Table::decode(answer.table("points").ok_or("gave no table `points`")?, &names)?;
    let mut points = Points { remarks: answer.warnings, ..Points::default() };
    let [mut trace, mut trace_kind] = [None, None];
    for column in wanted {
        let name = column.name;
        if matches!(column.kind, PointKind::Number | PointKind::Flag) {
            let Some(cells) = optional(column, &table, table.numbers(name))? else { continue };
            let values: Option<Vec<f64>> = cells.into_iter().collect();
            let values = values.ok_or_else(|| format!("gave points with a null in the column `{name}`"))?;
            if column.kind == PointKind::Flag && values.iter().any(|value| ![0.0, 1.0].contains(value)) {
                return Err(format!("gave points whose column `{name}` has other numbers than 0 and 1"));
            }
            points.columns.push(Column { name: name.into(), values });
        } else {
            let Some(cells) = optional(column, &table, table.texts(name))? else { continue };
            let values: Option<Vec<String>> = cells.into_iter().collect();
            let values = values.ok_or_else(|| format!("gave points with a null in the column `{name}`"))?;
            match column.kind {
                PointKind::Trace => trace = Some(values),
                PointKind::TraceKind => trace_kind = Some(values),
                _ => points.labels.push(Labels { name: name.into(), values }),
            }
        }
    }
    points.traces = match trace {
        Some(ids) => traces(&ids, trace_kind.as_deref().unwrap_or(&ids))?,
        None => vec![Trace { id: "points".into(), kind: "points".into(), points: 0..table.count() }],
    };
    Ok(points)
}

/// A column's cells, which it must have unless it may lack.
fn optional<T>(
    column: &PointColumn,
    table: &Table,
    found: std::result::Result<Option<T>, String>,
) -> std::result::Result<Option<T>, String> {
    if column.optional { found } else { table.needed(column.name, found).map(Some) }
}

/// Stretches of points of one trace, which does not come back.
fn traces(ids: &[String], kinds: &[String]) -> std::result::Result<Vec<Trace>, String> {
    let mut traces: Vec<Trace> = Vec::new();
    for (index, (id, kind)) in ids.iter().zip(kinds).enumerate() {
        if let Some(last) = traces.last_mut().filter(|last| last.id == *id && last.kind == *kind) {
            last.points.end = index + 1;
            continue;
        }
        if traces.iter().any(|trace| trace.id == *id) {
            return Err(format!(
                "gave points of trace {id} in two stretches, or of two kinds: they follow one another"
            ));
        }
        traces.push(Trace { id: id.clone(), kind: kind.clone(), points: index..index + 1 });
    }
    Ok(traces)
}
