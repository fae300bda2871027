//! The exporter `xlsx`: a sheet of values, one of each table that is asked for, and one of what they are.

use std::{io::BufWriter, path::PathBuf};

use runout_core::{
    Error, ErrorKind, Result,
    atomic_file::PendingFile,
    fault::{Fault, known_names},
    pipeline::{Context, StageConfig},
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    summary::{Decision, Summary},
    table::{RecordBatch, TableSpec},
};
use rust_xlsxwriter::{Color, DocProperties, ExcelDateTime, Format, Workbook, Worksheet, XlsxError};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    COLUMNS, Cell, decision,
    file::check_ending,
    row,
    sheets::{Sheets, fitting, header},
};

/// `[[export]] plugin = "xlsx"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct XlsxConfig {
    /// The file to write, ending in `.xlsx`. Its first sheet has the values.
    pub path: PathBuf,
    /// Tables of the result that have a sheet too, by their names: `["form", "harmonics"]`.
    #[serde(default)]
    pub tables: Vec<String>,
}

impl StageConfig for XlsxConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "xlsx";
    const ABOUT: &'static str =
        "values with limits as an Excel workbook, coloured by decision, and a sheet a table that is asked for";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        check_ending(&self.path, &["xlsx"])?;
        Ok(Box::new(Xlsx { path: context.path(&self.path), tables: self.tables }))
    }
}

struct Xlsx {
    path: PathBuf,
    tables: Vec<String>,
}

impl Exporter for Xlsx {
    fn takes(&self) -> Takes {
        Takes::Tables
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        let place = PendingFile::new(&self.path)?;
        let mut workbook = Workbook::new();
        let mut tables = Vec::new();
        for name in &self.tables {
            let Some(table) = result.tables.iter().find(|table| table.name == *name) else {
                let known = known_names(name, result.tables.iter().map(|table| table.name.as_str()));
                return Err(Error::new(
                    "write",
                    place.destination().display().to_string(),
                    format!("the result has no table `{name}`"),
                )
                .of(ErrorKind::Configuration)
                .help(known));
            };
            let sheets = Sheets::begin(&mut workbook, table).map_err(|error| place.caused(error))?;
            tables.push((table.clone(), sheets));
        }
        Ok(Box::new(Book { place, workbook, tables }))
    }
}

/// A workbook whose rows are coming.
struct Book {
    place: PendingFile,
    workbook: Workbook,
    tables: Vec<(TableSpec, Sheets)>,
}

impl Export for Book {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        let Self { place, workbook, tables } = self;
        let asked = tables.iter_mut().find(|(known, _)| known.name == table.name);
        asked.map_or(Ok(()), |(_, sheets)| sheets.add(workbook, table, rows)).map_err(|error| place.caused(error))
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let place = self.place;
        let file = place.create()?;
        let mut workbook = self.workbook;
        let filled = fill(&mut workbook, self.tables, result);
        filled.and_then(|()| workbook.save_to_writer(BufWriter::new(file))).map_err(|error| place.caused(error))?;
        Ok(vec![place])
    }
}

fn fill(
    workbook: &mut Workbook,
    tables: Vec<(TableSpec, Sheets)>,
    result: &Completed,
) -> std::result::Result<(), XlsxError> {
    // Equal runs give equal bytes.
    let properties =
        DocProperties::new().set_title(&result.summary.title).set_comment(&result.summary.provenance.program);
    workbook.set_properties(&properties.set_creation_datetime(&ExcelDateTime::from_ymd(2000, 1, 1)?));
    let mut values = workbook.new_worksheet_with_constant_memory()?;
    values.set_name("values")?;
    write_values(&mut values, result.summary)?;
    workbook.push_worksheet(values);
    let specs: Vec<TableSpec> = tables.iter().map(|(table, _)| table.clone()).collect();
    for (_, sheets) in tables {
        sheets.finish(workbook);
    }
    let mut about = workbook.new_worksheet_with_constant_memory()?;
    about.set_name("about")?;
    write_about(&mut about, &specs, result)?;
    workbook.push_worksheet(about);
    Ok(())
}

fn write_values(sheet: &mut Worksheet, summary: &Summary) -> std::result::Result<(), XlsxError> {
    let values = summary.reported_values();
    header(sheet, COLUMNS.iter().map(|(name, width)| (*name, f64::from(*width))), values.len() as u32)?;
    let fills = [Decision::Conforms, Decision::DoesNotConform, Decision::Undecided].map(|one| (one, fill_of(one)));
    for (index, value) in values.iter().enumerate() {
        let at = index as u32 + 1;
        let decided = decision(value);
        let fill = decided.and_then(|decided| fills.iter().find(|(one, _)| *one == decided)).map(|(_, fill)| fill);
        for (column, cell) in row(value).iter().enumerate() {
            let column = column as u16;
            match (cell, fill) {
                (Cell::Text(text), Some(fill)) => sheet.write_string_with_format(at, column, fitting(text), fill)?,
                (Cell::Text(text), None) => sheet.write_string(at, column, fitting(text))?,
                (Cell::Number(number), Some(fill)) => sheet.write_number_with_format(at, column, *number, fill)?,
                (Cell::Number(number), None) => sheet.write_number(at, column, *number)?,
                (Cell::Empty, Some(fill)) => sheet.write_blank(at, column, fill)?,
                (Cell::Empty, None) => sheet,
            };
        }
    }
    Ok(())
}

/// Green, red and yellow, as spreadsheets mark good, bad and neutral cells.
fn fill_of(decision: Decision) -> Format {
    let [background, letters] = match decision {
        Decision::Conforms => [0x00C6_EFCE, 0x0000_6100],
        Decision::DoesNotConform => [0x00FF_C7CE, 0x009C_0006],
        Decision::Undecided => [0x00FF_EB9C, 0x009C_5700],
    };
    Format::new().set_background_color(Color::RGB(background)).set_font_color(Color::RGB(letters))
}

/// What the numbers are: title, warnings, inputs, columns, configuration.
fn write_about(sheet: &mut Worksheet, tables: &[TableSpec], result: &Completed) -> std::result::Result<(), XlsxError> {
    let summary = result.summary;
    let mut lines: Vec<[String; 2]> = vec![
        ["title".into(), summary.title.clone()],
        ["program".into(), summary.provenance.program.clone()],
        ["convention".into(), result.about.convention.clone()],
    ];
    lines.extend(summary.head.entries().into_iter().map(|(name, text)| [name.to_owned(), text.to_owned()]));
    lines.extend(result.about.notes.iter().map(|(name, text)| [name.clone(), text.clone()]));
    let inputs = summary.provenance.inputs.iter();
    lines.extend(inputs.map(|input| ["input".into(), format!("{}, BLAKE3 {}", input.path, input.blake3)]));
    lines.extend(summary.warnings.iter().map(|warning| ["warning".into(), warning.clone()]));
    for table in tables {
        lines.push([format!("table {}", table.name), table.about.clone()]);
        for column in &table.columns {
            let unit = if column.unit.is_empty() { String::new() } else { format!(" [{}]", column.unit) };
            lines.push([format!("{}.{}", table.name, column.name), format!("{}{unit}", column.about)]);
        }
    }
    lines.extend(summary.provenance.configuration.lines().map(|line| ["configuration".into(), line.to_owned()]));
    header(sheet, [("what", 30.0), ("text", 120.0)].into_iter(), lines.len() as u32)?;
    for (index, line) in lines.iter().enumerate() {
        for (column, text) in line.iter().enumerate() {
            sheet.write_string(index as u32 + 1, column as u16, fitting(text))?;
        }
    }
    Ok(())
}
