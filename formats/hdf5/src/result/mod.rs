//! The exporter: form, motion and harmonics in one file, with everything that is needed to repeat the run.
//!
//! ```text
//! /            format = "runout-result", version = 1, title, program, convention
//! /TABLE       one group a table of the result, with the attribute about: one dataset a column. Of a spindle form, motion,
//!              harmonics and values; of measured points those of their separator
//! /provenance  configuration, inputs/{path, bytes, blake3}
//! /warnings    [n] texts: the run's, then each station's behind its name
//! /notes       [n] texts: those of the warnings that say nothing wrong
//! /effects     [n] texts: the effects that the results are corrected for, with their values; none after a run
//! /summary     the run's summary as JSON
//! /diagnosis   what the closed loop found, as JSON; of `diagnose` only
//! /surface_map form over angle and z, where the run built it: z_mm [rings], deviation_um [rings, angles], radius_mm; angles are
//!              equally spaced from 0
//! ```
//!
//! One dataset a column reads as `pandas.DataFrame({name: table[name][:] for name in table})`; names are UTF-8 of fixed length, other
//! texts of any length (`.asstr()` in h5py). Each column has the attributes `unit` and `about`, and the
//! attribute `figures` of the file is what to draw of which table, as JSON. What was not solved for, and lost
//! orders, are NaN.

mod read;
mod table;

pub use read::{StoredResult, read_result};

use std::path::{Path, PathBuf};

use hdf5_metno::{File, Group, types::VarLenUnicode};
use runout_core::{
    Result,
    atomic_file::PendingFile,
    fault::Fault,
    pipeline::{Context, StageConfig},
    provenance::Input,
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    surface::Surface,
    table::{RecordBatch, TableSpec},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{RESULT_FORMAT, VERSION, node};
use table::{LONG, SHORT, TableGroup};

/// `[[export]] plugin = "hdf5"`: a result file.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ResultConfig {
    /// The file to write, relative to the TOML.
    pub path: PathBuf,
}

impl StageConfig for ResultConfig {
    type Stage = Box<dyn Exporter>;
    const NAME: &'static str = "hdf5";
    const ABOUT: &'static str = "one file with the tables of a result and where they came from";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.file_name().is_none() {
            return Err(Fault::at("path", format!("expected the path of a file, found `{}`", self.path.display())));
        }
        Ok(Box::new(ResultExporter { path: context.path(&self.path) }))
    }
}

struct ResultExporter {
    path: PathBuf,
}

impl Exporter for ResultExporter {
    fn takes(&self) -> Takes {
        Takes::Tables
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        if result.longest_name.is_some_and(|longest| longest <= SHORT) {
            Ok(Box::new(ResultExport::<SHORT>::begin(&self.path, result)?))
        } else {
            Ok(Box::new(ResultExport::<LONG>::begin(&self.path, result)?))
        }
    }
}

/// A result file being written. The tables come first: they have to be closed before the file gets its name.
struct ResultExport<const N: usize> {
    tables: Vec<TableGroup<N>>,
    file: File,
    pending: PendingFile,
}

impl<const N: usize> ResultExport<N> {
    fn begin(path: &Path, result: &ResultInfo) -> Result<Self> {
        let pending = PendingFile::new(path)?;
        let begin = || -> hdf5_metno::Result<_> {
            let file = create(pending.path(), &result.title)?;
            node::put_text(&file, read::FIGURES, &read::figures(&result.tables)?)?;
            let always = result.tables.iter().filter(|table| !table.optional);
            let tables = always.map(|table| TableGroup::create(&file, table)).collect::<hdf5_metno::Result<_>>()?;
            Ok((tables, file))
        };
        let (tables, file) = begin().map_err(|error| pending.caused(error))?;
        Ok(Self { tables, file, pending })
    }
}

/// A result file with its head.
fn create(path: &Path, title: &str) -> hdf5_metno::Result<File> {
    let file = node::create_file(path)?;
    node::put_text(&file, "format", RESULT_FORMAT)?;
    node::put(&file, "version", &VERSION)?;
    node::put_text(&file, "title", title)?;
    Ok(file)
}

/// Adds where the numbers came from, when they are all there.
fn complete(file: &File, result: &Completed) -> hdf5_metno::Result<()> {
    let Completed { summary, about, .. } = result;
    let provenance = &summary.provenance;
    node::put_text(file, "program", &provenance.program)?;
    node::put_text(file, "convention", &about.convention)?;
    for (key, value) in &about.notes {
        match value.parse::<f64>() {
            Ok(number) => node::put(file, key, &number)?,
            Err(_) => node::put_text(file, key, value)?,
        }
    }
    let json = serde_json::to_string_pretty(*summary)
        .map_err(|error| hdf5_metno::Error::from(format!("the summary: {error}")))?;
    put_dataset(file, read::SUMMARY, &json)?;
    if let Some(diagnosis) = result.diagnosis {
        let json = serde_json::to_string_pretty(diagnosis)
            .map_err(|error| hdf5_metno::Error::from(format!("the diagnosis: {error}")))?;
        put_dataset(file, read::DIAGNOSIS, &json)?;
    }
    if let Some(surface) = result.surface {
        put_surface(file, surface)?;
    }
    put_texts(file, "warnings", summary.warnings.iter())?;
    put_texts(file, read::NOTES, summary.notes.iter())?;
    put_texts(file, "effects", summary.effects.iter().map(ToString::to_string))?;
    let group = node::create_group(file, "provenance")?;
    put_dataset(&group, "configuration", &provenance.configuration)?;
    let inputs = node::create_group(&group, "inputs")?;
    put_texts(&inputs, "path", provenance.inputs.iter().map(|input| &input.path))?;
    put_texts(&inputs, "blake3", provenance.inputs.iter().map(|input| &input.blake3))?;
    let bytes: Vec<u64> = provenance.inputs.iter().map(|Input { bytes, .. }| *bytes).collect();
    inputs.new_dataset_builder().with_data(&bytes).create("bytes")?;
    // What the disk refuses comes out here, and not when the file is closed.
    file.flush()
}

impl<const N: usize> Export for ResultExport<N> {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        let place = self.tables.iter().position(|known| known.name == table.name);
        let mut append = || -> hdf5_metno::Result<()> {
            let known = if let Some(place) = place {
                &mut self.tables[place]
            } else {
                self.tables.push(TableGroup::create(&self.file, table)?);
                let last = self.tables.len() - 1;
                &mut self.tables[last]
            };
            known.append(rows)
        };
        append().map_err(|error| self.pending.caused(error))
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        complete(&self.file, result).map_err(|error| self.pending.caused(error))?;
        let Self { tables, file, pending } = *self;
        drop((tables, file));
        Ok(vec![pending])
    }
}

/// Group of the surface.
const SURFACE: &str = "surface_map";

fn put_surface(file: &File, surface: &Surface) -> hdf5_metno::Result<()> {
    let group = node::create_group(file, SURFACE)?;
    node::put(&group, "radius_mm", &surface.radius_mm)?;
    node::put_text(&group, "interpolation", surface.interpolation)?;
    let column = |name: &str, unit: &str, shape: &[usize], values: &[f64]| -> hdf5_metno::Result<()> {
        let dataset = group.new_dataset::<f64>().shape(shape).create(name)?;
        dataset.write_raw(values)?;
        node::put_text(&dataset, "unit", unit)
    };
    let rings = surface.z_mm.len();
    column("z_mm", "mm", &[rings], &surface.z_mm)?;
    column("deviation_um", "um", &[rings, surface.angles], &surface.deviation_um)
}

fn put_dataset(group: &Group, name: &str, text: &str) -> hdf5_metno::Result<()> {
    group.new_dataset::<VarLenUnicode>().create(name)?.write_scalar(&node::unicode(text)?)
}

fn put_texts(group: &Group, name: &str, texts: impl Iterator<Item = impl AsRef<str>>) -> hdf5_metno::Result<()> {
    let texts: hdf5_metno::Result<Vec<VarLenUnicode>> = texts.map(|text| node::unicode(text.as_ref())).collect();
    group.new_dataset_builder().with_data(&texts?).create(name).map(|_| ())
}
