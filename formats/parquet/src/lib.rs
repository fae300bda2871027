//! Parquet tables of form, motion and harmonics: the exporter `parquet`.
//!
//! Its path is a folder that receives
//!
//! - `form.parquet`: form of each section over the part's angle, one row a (station, section, angle);
//! - `motion.parquet`: error motion over the spindle's angle, one row a (station, angle); only where a motion was
//!   solved for. Columns of a motion that was not (a tilt seen by one section) are null. Where all sensors look along one
//!   line that is neither x nor y, motion is in `along_um` and `tilt_along_urad`, and the line in `along_deg`;
//! - `harmonics.parquet`: the coefficients that both are made of, one row a (station, quantity, section, order).
//!   Orders run from 1; order 0, the mean level, has a row where the method knows it (its value is not 0);
//! - `reading.parquet`: averaged readings over the spindle's angle, one row a (station, setup, sensor, angle); only where no order
//!   of form is observable, so that readings are all that there is;
//! - `values.parquet`: the standards' values of sections, stations and the whole part, one row each.
//!
//! Orders that the layout cannot tell are NaN with `observable` false in the harmonics, and left out of the sums in
//! the other two, whose metadata names them. Where traces along an axis were separated, the folder receives
//! `straightness.parquet` instead, one row a position; where a model gives a table, that of its name (`angle.parquet`). Every column carries its unit and meaning, every file the configuration,
//! the checksums of the inputs and the warnings.

mod about;
mod columns;
mod comparison;
mod reading;
mod straightness;
mod table;
mod values;

use std::path::PathBuf;

use arrow_schema::Schema;
use runout_core::{
    Error, Result,
    atomic_file::PendingFile,
    pipeline::{
        error::Fault,
        registry::{Context, Plugin, Registry, StageConfig},
        run::{RunInfo, StationResult, Summary},
    },
    rig::Rig,
    stage::{Export, Exporter, StraightnessExporter, TableExporter},
    straightness::{CONVENTION, Straightness},
    surface::Surface,
    table::Table as NumberTable,
};
use schemars::JsonSchema;
use serde::Deserialize;

use about::Content;
pub use comparison::ComparisonTable;
use table::Table;

/// Adds the exporter `parquet`.
pub fn register(registry: &mut Registry) {
    registry.exporters.add(Plugin::of::<ParquetConfig>());
}

/// `[[export]] plugin = "parquet"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParquetConfig {
    /// Folder for form.parquet, motion.parquet, harmonics.parquet and values.parquet, or straightness.parquet, or a model's table (angle.parquet); made where it is missing.
    pub path: PathBuf,
}

impl StageConfig for ParquetConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "parquet";
    const ABOUT: &'static str = "tables of form, motion, harmonics and values, or of straightness";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a folder"));
        }
        Ok(Box::new(Parquet { folder: context.path(&self.path) }))
    }
}

/// The exporter `parquet`.
struct Parquet {
    folder: PathBuf,
}

impl Parquet {
    fn form(&self) -> PathBuf {
        self.folder.join("form.parquet")
    }

    fn motion(&self) -> PathBuf {
        self.folder.join("motion.parquet")
    }

    fn harmonics(&self) -> PathBuf {
        self.folder.join("harmonics.parquet")
    }

    fn reading(&self) -> PathBuf {
        self.folder.join("reading.parquet")
    }

    fn values(&self) -> PathBuf {
        self.folder.join("values.parquet")
    }

    fn straightness_table(&self) -> PathBuf {
        self.folder.join("straightness.parquet")
    }

    /// Refuses a file where the folder should be.
    fn folder_free(&self) -> Result<()> {
        if self.folder.is_file() {
            let shown = self.folder.display().to_string();
            return Err(Error::new("write to", shown, "there is a file of that name").help("name a folder"));
        }
        Ok(())
    }
}

impl Exporter for Parquet {
    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.form(), self.motion(), self.harmonics(), self.reading(), self.values(), self.straightness_table()]
    }

    fn straightness(&self) -> Option<&dyn StraightnessExporter> {
        Some(self)
    }

    fn tables(&self) -> Option<&dyn TableExporter> {
        Some(self)
    }

    fn begin(&self, run: &RunInfo) -> Result<Box<dyn Export>> {
        self.folder_free()?;
        Ok(Box::new(Tables {
            form: Table::create(self.form(), columns::form_schema())?,
            harmonics: Table::create(self.harmonics(), columns::harmonics_schema())?,
            values: Table::create(self.values(), values::schema())?,
            motion: None,
            motion_path: self.motion(),
            reading: None,
            reading_path: self.reading(),
            rig: run.rig.clone(),
            content: Content::default(),
        }))
    }
}

impl StraightnessExporter for Parquet {
    fn write(&self, result: &Straightness, summary: &Summary) -> Result<Vec<PendingFile>> {
        self.folder_free()?;
        let mut table = Table::create(self.straightness_table(), straightness::schema())?;
        table.append(straightness::rows(result))?;
        Ok(vec![table.close(&about::common(summary, CONVENTION))?])
    }
}

impl TableExporter for Parquet {
    fn table_output(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.parquet"))
    }

    fn write_table(&self, numbers: &NumberTable, summary: &Summary) -> Result<Vec<PendingFile>> {
        self.folder_free()?;
        let fields: Vec<_> =
            numbers.columns.iter().map(|column| columns::number(&column.name, &column.unit, &column.about)).collect();
        let mut table = Table::create(self.table_output(&numbers.name), Schema::new(fields))?;
        table.append(numbers.columns.iter().map(|column| columns::numbers(column.values.iter().copied())).collect())?;
        Ok(vec![table.close(&about::common(summary, &numbers.about))?])
    }
}

/// The tables being written.
struct Tables {
    form: Table,
    harmonics: Table,
    values: Table,
    motion: Option<Table>,
    motion_path: PathBuf,
    reading: Option<Table>,
    reading_path: PathBuf,
    rig: Option<Rig>,
    content: Content,
}

impl Export for Tables {
    fn station(&mut self, result: &StationResult) -> Result<()> {
        self.content.note(result);
        self.form.append(columns::form(result))?;
        self.harmonics.append(columns::harmonics(result))?;
        if result.separation.unknowns.iter().any(|unknown| !unknown.is_form()) {
            let table = if let Some(table) = &mut self.motion {
                table
            } else {
                let schema = columns::motion_schema(result.separation.azimuth());
                self.motion.insert(Table::create(self.motion_path.clone(), schema)?)
            };
            table.append(columns::motion(result))?;
        }
        if result.separation.tells_no_form() {
            let table = match &mut self.reading {
                Some(table) => table,
                None => self.reading.insert(Table::create(self.reading_path.clone(), reading::schema())?),
            };
            table.append(reading::rows(result, self.rig.as_ref()))?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>, summary: &Summary, _surface: Option<&Surface>) -> Result<Vec<PendingFile>> {
        let entries = self.content.entries(summary);
        self.values.append(values::rows(summary))?;
        // An earlier run's motion beside this run's form would be taken for this run's.
        let absent = [(self.motion.is_none(), self.motion_path), (self.reading.is_none(), self.reading_path)];
        let tables = [Some(self.form), self.motion, Some(self.harmonics), self.reading, Some(self.values)];
        let complete = close_all(tables.into_iter().flatten(), &entries)?;
        for (_, path) in absent.iter().filter(|(absent, path)| *absent && path.is_file()) {
            std::fs::remove_file(path)
                .map_err(|error| Error::new("remove the outdated", path.display().to_string(), error))?;
        }
        Ok(complete)
    }
}

/// Completes tables side by side: each has rows that were not packed yet, and nothing else is left to do meanwhile.
fn close_all(tables: impl Iterator<Item = Table>, entries: &[(String, String)]) -> Result<Vec<PendingFile>> {
    let stopped = |_| Err(Error::new("write", "the tables", "a thread that wrote them stopped"));
    std::thread::scope(|scope| {
        let closing: Vec<_> = tables.map(|table| scope.spawn(|| table.close(entries))).collect();
        closing.into_iter().map(|table| table.join().unwrap_or_else(stopped)).collect()
    })
}
