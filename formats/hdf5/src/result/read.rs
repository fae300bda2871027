//! A result file read back: what a report of it needs.

use std::path::Path;

use hdf5_metno::{
    Dataset, File,
    types::{FixedUnicode, TypeDescriptor, VarLenUnicode},
};
use runout_core::{
    Error, ErrorKind, Result,
    closed_loop::diagnosis::Diagnosis,
    stage::About,
    summary::Summary,
    surface::Surface,
    table::{ArrayRef, ColumnSpec, Figure, RecordBatch, TableSpec, circles, numbers, texts},
};
use serde::de::DeserializeOwned;

use super::{SURFACE, table::LONG};
use crate::{
    RESULT_FORMAT,
    node::{self, Place},
    text, utf8_path,
};

/// Rows of a table, or points of a surface, that fit in memory.
const MOST_ROWS: usize = 1 << 27;

/// A result as its file holds it.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct StoredResult {
    /// The pipeline's title.
    pub title: String,
    /// The tables of which figures are drawn, with the columns that these need.
    pub tables: Vec<(TableSpec, RecordBatch)>,
    /// What was found.
    pub summary: Summary,
    /// What its numbers are.
    pub about: About,
    /// Form over angle and z, where the run built it.
    pub surface: Option<Surface>,
    /// What the closed loop found, where the result is that of its final model.
    pub diagnosis: Option<Diagnosis>,
}

/// Reads a result file.
///
/// # Errors
/// When it is no result, or does not hold what one holds.
pub fn read_result(path: &Path) -> Result<StoredResult> {
    utf8_path::check(path)?;
    let (file, place, _) = node::open(path, false)?;
    if node::text(&file, &place, "format")?.as_deref() != Some(RESULT_FORMAT) {
        let error =
            Error::new("read", path.display().to_string(), format!("expected a file of the format {RESULT_FORMAT}"));
        return Err(error.of(ErrorKind::DamagedData).help("`[[export]] plugin = \"hdf5\"` of a run writes one"));
    }
    let figures = node::text(&file, &place, FIGURES)?.unwrap_or_else(|| "[]".into());
    let figures: Vec<(String, Vec<Figure>)> =
        serde_json::from_str(&figures).map_err(|error| place.error(format!("attribute `{FIGURES}`: {error}")))?;
    let mut tables = Vec::new();
    let circles: Vec<(String, Vec<String>)> =
        figures.iter().flat_map(|(_, figures)| figures).filter_map(circles_of).collect();
    // A result may lack a table that is optional.
    for (name, figures) in figures.into_iter().filter(|(name, _)| file.link_exists(name)) {
        let (group, place) = node::group(&file, &place, &name)?;
        let mut wanted: Vec<String> = figures.iter().flat_map(Figure::columns).map(str::to_owned).collect();
        wanted.extend(circles.iter().filter(|(table, _)| *table == name).flat_map(|(_, columns)| columns.clone()));
        tables.push(table(&group, &place, &name, wanted, figures)?);
    }
    let convention = node::text(&file, &place, "convention")?.unwrap_or_default();
    let mut summary: Summary = document(&file, &place, SUMMARY)?;
    let has_notes = file.dataset(NOTES).is_ok_and(|notes| notes.size() > 0);
    summary.notes = if has_notes { node::texts_of(&file, &place, NOTES)? } else { Vec::new() };
    let has_diagnosis = file.link_exists(DIAGNOSIS);
    Ok(StoredResult {
        title: node::text(&file, &place, "title")?.unwrap_or_default(),
        tables,
        summary,
        about: About { convention, ..About::default() },
        surface: file.link_exists(SURFACE).then(|| surface(&file, &place)).transpose()?,
        diagnosis: has_diagnosis.then(|| document(&file, &place, DIAGNOSIS)).transpose()?,
    })
}

pub(super) const SUMMARY: &str = "summary";
pub(super) const DIAGNOSIS: &str = "diagnosis";
pub(super) const NOTES: &str = "notes";
pub(super) const FIGURES: &str = "figures";

/// What to draw of which table, in the order in which they are declared.
pub(super) fn figures(tables: &[TableSpec]) -> hdf5_metno::Result<String> {
    let named: Vec<&String> =
        tables.iter().flat_map(|table| &table.figures).filter_map(|one| one.circles.as_ref()).collect();
    let drawn = tables.iter().filter(|table| !table.figures.is_empty() || named.contains(&&table.name));
    let figures: Vec<(&str, &[Figure])> = drawn.map(|table| (table.name.as_str(), table.figures.as_slice())).collect();
    serde_json::to_string(&figures).map_err(|error| format!("the figures: {error}").into())
}

/// A text that is JSON.
fn document<T: DeserializeOwned>(file: &File, place: &Place, name: &str) -> Result<T> {
    let (dataset, place) = node::dataset(file, place, name)?;
    let texts = text::variable(&dataset).map_err(|problem| place.error(problem))?;
    let [text] = &texts[..] else { return Err(place.error(format!("expected one text, found {}", texts.len()))) };
    serde_json::from_str(text).map_err(|error| {
        place
            .error(error)
            .help("the file is of another version of runout: repeat the run, or use the version that wrote it")
    })
}

/// The table of reference circles that a figure names, with its columns.
fn circles_of(figure: &Figure) -> Option<(String, Vec<String>)> {
    let names = figure.panels.iter().chain(&figure.curves).cloned();
    let columns = circles::columns().into_iter().map(|column| column.name);
    Some((figure.circles.clone()?, names.chain(columns).collect()))
}

/// A table with some of its columns, and its figures.
fn table(
    group: &hdf5_metno::Group,
    place: &Place,
    name: &str,
    mut wanted: Vec<String>,
    figures: Vec<Figure>,
) -> Result<(TableSpec, RecordBatch)> {
    wanted.sort_unstable();
    wanted.dedup();
    let (mut specs, mut columns) = (Vec::new(), Vec::new());
    for column in &wanted {
        let (dataset, place) = node::dataset(group, place, column)?;
        let unit = node::text(&dataset, &place, "unit")?.unwrap_or_default();
        let (values, is_number) = column_values(&dataset, &place)?;
        specs.push(if is_number {
            ColumnSpec::number(column, unit, "").or_null()
        } else {
            ColumnSpec::name(column, "")
        });
        columns.push(values);
    }
    let mut spec = TableSpec::new(name, node::text(group, place, "about")?.unwrap_or_default(), specs);
    let rows = spec.rows(columns).map_err(|error| place.error(error))?;
    spec.figures = figures;
    Ok((spec, rows))
}

/// The numbers or names of a column, and which of both they are.
fn column_values(dataset: &Dataset, place: &Place) -> Result<(ArrayRef, bool)> {
    let shape = node::written_shape(dataset, place)?;
    if shape.len() != 1 || shape[0] > MOST_ROWS {
        return Err(place.error(format!("expected a column of at most {MOST_ROWS} rows, found the shape {shape:?}")));
    }
    let kind = node::element_type(dataset, place)?;
    let failure = |error: hdf5_metno::Error| place.error(error);
    match kind {
        TypeDescriptor::FixedUnicode(_) => {
            let names = dataset.read_raw::<FixedUnicode<LONG>>().map_err(failure)?;
            Ok((texts(names.iter().map(FixedUnicode::as_str)), false))
        }
        TypeDescriptor::VarLenUnicode => {
            let names = text::variable(dataset).map_err(|problem| place.error(problem))?;
            Ok((texts(names.iter().map(VarLenUnicode::as_str)), false))
        }
        kind if node::is_number(&kind) => Ok((numbers(dataset.read_raw::<f64>().map_err(failure)?), true)),
        _ => Err(place.error("expected numbers or names")),
    }
}

fn surface(file: &File, place: &Place) -> Result<Surface> {
    let (group, place) = node::group(file, place, SURFACE)?;
    let column = |name: &str| -> Result<Vec<f64>> {
        let (dataset, place) = node::dataset(&group, &place, name)?;
        if node::written_shape(&dataset, &place)?.iter().fold(1, |product: usize, side| product.saturating_mul(*side))
            > MOST_ROWS
        {
            return Err(place.error(format!("expected at most {MOST_ROWS} points")));
        }
        dataset.read_raw::<f64>().map_err(|error| place.error(error))
    };
    let (z_mm, deviation_um) = (column("z_mm")?, column("deviation_um")?);
    let radius_mm = node::needed(node::positive(&group, &place, "radius_mm")?, &place, "radius_mm")?;
    let angles = deviation_um.len() / z_mm.len().max(1);
    if angles == 0 || angles * z_mm.len() != deviation_um.len() {
        return Err(place.error(format!("{} deviations do not fit {} rings", deviation_um.len(), z_mm.len())));
    }
    Ok(Surface { radius_mm, angles, z_mm, deviation_um, interpolation: "", meetings: Vec::new() })
}
