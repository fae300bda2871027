//! The files that a pipeline writes: exporters of `run` and of `diagnose`, none of which writes over another file.

use runout_error::fault::Fault;
use std::path::{Path, PathBuf};

use toml::{Spanned, de::DeValue};

use super::diagnose::Diagnose;
use crate::{
    atomic_file::resolved,
    pipeline::{
        document::{self, Sources, Table},
        registry::{Context, Registry},
    },
    stage::{Exporter, Takes},
};
use runout_error::{Error, ErrorKind};
use runout_table::TableSpec;

const SUMMARY: &str = "summary.json";
const SUMMARY_USE: &str = "where the run's summary goes";
pub(crate) const DIAGNOSIS: &str = "diagnosis.json";
const DIAGNOSIS_USE: &str = "where the diagnosis goes";
const DIAGNOSED: &str = "diagnosed";
const DIAGNOSED_USE: &str = "written by `diagnose`";

fn beside(output: &Path, name: &str) -> PathBuf {
    output.with_file_name(name)
}

pub(crate) fn beside_the_first(exporters: &[Box<dyn Exporter>], tables: &[TableSpec], name: &str) -> Option<PathBuf> {
    exporters.iter().find_map(|exporter| exporter.outputs(tables).first().map(|path| beside(path, name)))
}

/// Where the summary of these exports goes: where the first exporter has it.
pub(crate) fn summary_path(exporters: &[Box<dyn Exporter>], tables: &[TableSpec]) -> Option<PathBuf> {
    exporters.iter().find_map(|exporter| exporter.summary(tables))
}

pub(crate) fn written(exporters: &[Box<dyn Exporter>], tables: &[TableSpec]) -> Vec<PathBuf> {
    exporters.iter().flat_map(|exporter| exporter.outputs(tables)).chain(summary_path(exporters, tables)).collect()
}

/// Refuses to write over what the run reads.
pub(crate) fn spare_inputs(outputs: &[PathBuf], inputs: &[PathBuf]) -> runout_error::Result<()> {
    let read: Vec<PathBuf> = inputs.iter().map(|input| resolved(input)).collect();
    for output in outputs {
        // What is read is there.
        if output.exists() && read.contains(&resolved(output)) {
            let problem = "it is what the run reads";
            return Err(Error::new("write", output.display().to_string(), problem)
                .of(ErrorKind::Configuration)
                .help("export to another path"));
        }
    }
    Ok(())
}

/// The exporters of `run` and those of `diagnose`.
#[derive(Default)]
pub(crate) struct Exports {
    pub exporters: Vec<Box<dyn Exporter>>,
    pub diagnosed: Vec<Box<dyn Exporter>>,
}

/// What exporters are built from.
pub(crate) struct Exporting<'a> {
    pub registry: &'a Registry,
    pub context: &'a Context<'a>,
    /// Whether the result has a surface: form, or heights on a plane.
    pub gives_surface: bool,
    /// Whether there is a model for the closed loop.
    pub has_model: bool,
    pub tables: &'a [TableSpec],
    pub diagnose: &'a Diagnose,
}

impl Exporting<'_> {
    /// The exporters, none of which writes over what is read or what another file is for.
    pub(crate) fn exports(&self, tables: &[Table], sources: &Sources) -> Result<Exports, Fault> {
        let Self { registry, context, diagnose, .. } = self;
        let mut exports = Exports::default();
        let files = sources.files().map(|file| (resolved(file), "read as configuration")).collect();
        let mut taken = Taken { files, tables: self.tables };
        taken.files.extend(diagnose.path.as_ref().map(|path| (resolved(path), DIAGNOSIS_USE)));
        for table in tables {
            let exporter = registry.exporters.build(table, context)?;
            if exporter.takes() == Takes::Surface && !self.gives_surface {
                let message = "this exporter takes form along an axis or a height map; [separate] gives neither";
                let fault = Fault::at("plugin", message);
                return Err(document::resolve(fault.help("take one that writes tables"), table));
            }
            if let Some((needed, help)) = exporter.needs()
                && !self.tables.iter().any(|table| table.name == needed)
            {
                let message = format!("this exporter takes the table `{needed}`; [separate] does not give it");
                return Err(document::resolve(Fault::at("plugin", message).help(help), table));
            }
            taken
                .add(&*exporter, "written by an exporter", &[(SUMMARY, SUMMARY_USE)])
                .map_err(|fault| document::resolve(fault, table))?;
            exports.exporters.push(exporter);
        }
        if !self.has_model {
            return Ok(exports);
        }
        let beside: &[_] = match &diagnose.path {
            None => &[(SUMMARY, DIAGNOSED_USE), (DIAGNOSIS, DIAGNOSIS_USE)],
            Some(_) => &[(SUMMARY, DIAGNOSED_USE)],
        };
        for (table, exporter) in tables.iter().zip(&exports.exporters) {
            let moved = self.diagnosed(table, &**exporter);
            let diagnosed = registry.exporters.build(&moved, context)?;
            taken.add(&*diagnosed, DIAGNOSED_USE, beside).map_err(|fault| document::resolve(fault, table))?;
            exports.diagnosed.push(diagnosed);
        }
        Ok(exports)
    }

    /// The table of an exporter with another path: a folder `out` becomes `out/diagnosed`, a file `out/shaft.glb`
    /// `out/diagnosed/shaft.glb`. `out` of `[diagnose]` stands for the folder where there is one.
    fn diagnosed<'t>(&self, table: &Table<'t>, exporter: &dyn Exporter) -> Table<'t> {
        let mut keys = table.get_ref().clone();
        if let Some(value) = keys.get_mut("path")
            && let Some(path) = value.get_ref().as_str().map(PathBuf::from)
        {
            let is_file = exporter.outputs(self.tables).contains(&self.context.path(&path));
            let folder = match (&self.diagnose.out, is_file) {
                (Some(out), _) => out.clone(),
                (None, true) => path.with_file_name(DIAGNOSED),
                (None, false) => path.join(DIAGNOSED),
            };
            let moved =
                if is_file { path.file_name().map_or(folder.clone(), |name| folder.join(name)) } else { folder };
            *value.get_mut() = DeValue::String(moved.to_string_lossy().into_owned().into());
        }
        Spanned::new(table.span(), keys)
    }
}

/// Files that are read or written, each with its use.
struct Taken<'a> {
    files: Vec<(PathBuf, &'static str)>,
    tables: &'a [TableSpec],
}

impl Taken<'_> {
    /// Adds an exporter's files, and those beside the first of them where no exporter of this kind has brought them.
    fn add(
        &mut self,
        exporter: &dyn Exporter,
        own_use: &'static str,
        beside_it: &[(&str, &'static str)],
    ) -> Result<(), Fault> {
        for output in exporter.outputs(self.tables) {
            let place = resolved(&output);
            if let Some((_, use_of_it)) = self.files.iter().find(|(other, _)| *other == place) {
                return Err(Fault::at("path", format!("{} is already {use_of_it}", output.display())));
            }
            self.files.push((place, own_use));
            for (name, use_of_it) in beside_it {
                // A summary of a diagnosis is one of its files.
                if self.files.iter().all(|(path, known)| known != use_of_it || !path.ends_with(name)) {
                    self.files.push((resolved(&beside(&output, name)), use_of_it));
                }
            }
        }
        Ok(())
    }
}
