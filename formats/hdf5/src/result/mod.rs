//! The exporter: form, motion and harmonics in one file, with everything that is needed to repeat the run.
//!
//! ```text
//! /            format = "runout-result", version = 1, title, program, convention
//! /form        section, station, z_mm, angle_deg, form_um, std_um: one dataset a column
//! /motion      station, angle_deg, x_um, y_um, tilt_x_urad, tilt_y_urad, and std_… of each; where motion is observable along
//!              one line only, along_um, tilt_along_urad, and along_deg (also the attribute motion_along_deg of the file)
//! /harmonics   quantity, section, station, order, re, im, std, observable
//! /provenance  configuration, inputs/{path, bytes, blake3}
//! /straightness z_mm, part_um, part_std_um, slide_um, slide_std_um; then there is no form, motion and harmonics
//! /angle       of a quadrature signal: index or time_s, phase_deg, corrected_deg, std_deg; then there is nothing else
//! /warnings    [n] texts: the run's, then each station's behind its name
//! /effects     [n] texts: the effects that the results are corrected for, with their values; none after a run
//! /summary     the run's summary as JSON
//! ```
//!
//! One dataset a column reads as `pandas.DataFrame({name: table[name][:] for name in table})`; texts of the tables are
//! UTF-8 of fixed length (`.asstr()` in h5py). Each column has the attributes `unit` and `meaning`. What was not solved for, and what the layout cannot tell, is NaN.

mod numbers;
mod straightness;
mod table;

use std::path::{Path, PathBuf};

use hdf5_metno::{File, Group, types::VarLenUnicode};
use runout_core::{
    Error, Result,
    atomic_file::PendingFile,
    pipeline::{
        error::Fault,
        registry::{Context, StageConfig},
        run::{RunInfo, StationResult, Summary},
    },
    provenance::Input,
    separation::{CONVENTION, Quantity},
    stage::{Export, Exporter, StraightnessExporter, TableExporter},
    surface::Surface,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{RESULT_FORMAT, VERSION, node};
use table::{FormTable, HarmonicsTable, LONG, MotionTable, SHORT};

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
    const ABOUT: &'static str = "one file with form, motion, harmonics (or straightness) and where they came from";

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
    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn straightness(&self) -> Option<&dyn StraightnessExporter> {
        Some(self)
    }

    fn tables(&self) -> Option<&dyn TableExporter> {
        Some(self)
    }

    fn begin(&self, run: &RunInfo) -> Result<Box<dyn Export>> {
        let sections = run.rig.iter().flat_map(|rig| &rig.sections);
        let longest = run.stations.iter().chain(sections).map(String::len).max();
        // Without stations the names that will come are not known.
        if !run.stations.is_empty() && longest.is_some_and(|longest| longest <= SHORT) {
            Ok(Box::new(ResultExport::<SHORT>::begin(&self.path, &run.title)?))
        } else {
            Ok(Box::new(ResultExport::<LONG>::begin(&self.path, &run.title)?))
        }
    }
}

/// A result file being written. The datasets come first: they have to be closed before the file gets its name.
struct ResultExport<const N: usize> {
    form: FormTable<N>,
    motion: MotionTable<N>,
    harmonics: HarmonicsTable<N>,
    file: File,
    pending: Option<PendingFile>,
}

impl<const N: usize> ResultExport<N> {
    fn begin(path: &Path, title: &str) -> Result<Self> {
        let pending = PendingFile::new(path)?;
        let begin = || -> hdf5_metno::Result<Self> {
            let file = create(pending.path(), title, CONVENTION)?;
            Ok(Self {
                form: FormTable::create(&file)?,
                motion: MotionTable::create(&file)?,
                harmonics: HarmonicsTable::create(&file)?,
                file,
                // Taken in below: the closure only borrows it.
                pending: None,
            })
        };
        let export = begin().map_err(|error| pending.failure(error))?;
        Ok(Self { pending: Some(pending), ..export })
    }

    fn failure(&self, problem: impl ToString) -> Error {
        match &self.pending {
            Some(pending) => pending.failure(problem),
            None => Error::new("write", "the result", problem),
        }
    }
}

/// A result file with its head.
fn create(path: &Path, title: &str, convention: &str) -> hdf5_metno::Result<File> {
    let file = File::with_options().with_fapl(|access| access.libver_v110()).create(path)?;
    node::put_text(&file, "format", RESULT_FORMAT)?;
    node::put(&file, "version", &VERSION)?;
    node::put_text(&file, "title", title)?;
    node::put_text(&file, "convention", convention)?;
    Ok(file)
}

/// Adds where the numbers came from, when they are all there.
fn complete(file: &File, summary: &Summary) -> hdf5_metno::Result<()> {
    let provenance = &summary.provenance;
    node::put_text(file, "program", &provenance.program)?;
    let json = serde_json::to_string_pretty(summary)
        .map_err(|error| hdf5_metno::Error::from(format!("the summary: {error}")))?;
    put_dataset(file, "summary", &json)?;
    put_texts(file, "warnings", summary.all_warnings())?;
    put_texts(file, "effects", summary.effects.iter().map(ToString::to_string))?;
    let group = file.create_group("provenance")?;
    put_dataset(&group, "configuration", &provenance.configuration)?;
    let inputs = group.create_group("inputs")?;
    put_texts(&inputs, "path", provenance.inputs.iter().map(|input| &input.path))?;
    put_texts(&inputs, "blake3", provenance.inputs.iter().map(|input| &input.blake3))?;
    let bytes: Vec<u64> = provenance.inputs.iter().map(|Input { bytes, .. }| *bytes).collect();
    inputs.new_dataset_builder().with_data(&bytes).create("bytes")?;
    // What the disk refuses comes out here, and not when the file is closed.
    file.flush()
}

impl<const N: usize> Export for ResultExport<N> {
    fn station(&mut self, result: &StationResult) -> Result<()> {
        let name = table::name(&result.station).map_err(|error| self.failure(error))?;
        let separation = &result.separation;
        for (unknown, quantity) in separation.unknowns.iter().enumerate() {
            let written = match quantity {
                Quantity::Form(section) => match separation.sections.get(*section) {
                    Some(section) => self.form.append(result, &name, section, unknown),
                    None => Err(format!("the form of section {section} has no section").into()),
                },
                _ => Ok(()),
            };
            written
                .and_then(|()| self.harmonics.append(separation, &name, unknown))
                .map_err(|error| self.failure(error))?;
        }
        if separation.unknowns.iter().any(|unknown| !unknown.is_form()) {
            self.motion.append(result, &name).map_err(|error| self.failure(error))?;
        }
        if let Some(line) = separation.azimuth() {
            node::put_once(&self.file, "motion_along_deg", &line.degrees()).map_err(|error| self.failure(error))?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>, summary: &Summary, _surface: Option<&Surface>) -> Result<Vec<PendingFile>> {
        complete(&self.file, summary).map_err(|error| self.failure(error))?;
        let Self { form, motion, harmonics, file, pending } = *self;
        drop((form, motion, harmonics, file));
        Ok(pending.into_iter().collect())
    }
}

fn put_dataset(group: &Group, name: &str, text: &str) -> hdf5_metno::Result<()> {
    group.new_dataset::<VarLenUnicode>().create(name)?.write_scalar(&node::unicode(text)?)
}

fn put_texts(group: &Group, name: &str, texts: impl Iterator<Item = impl AsRef<str>>) -> hdf5_metno::Result<()> {
    let texts: hdf5_metno::Result<Vec<VarLenUnicode>> = texts.map(|text| node::unicode(text.as_ref())).collect();
    group.new_dataset_builder().with_data(&texts?).create(name).map(|_| ())
}
