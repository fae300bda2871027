//! `runout compare`: several separators on the same preprocessed data.

use std::path::{Path, PathBuf};

use runout_core::{
    Error, Result,
    atomic_file::{self, resolved},
    fault::known_names,
    pipeline::{
        Pipeline, Registry,
        compare::{Comparing, ComparingPoints, Comparison, StationComparison},
        document::{Document, Sources},
    },
};
use runout_parquet::{ComparisonTable, comparison_figures, comparison_rows};

use super::{fail_on, pipeline, print, report::OverviewReport};
use crate::{args::CompareArgs, failure::Failure, progress::Progress, render};

/// Compares separators and says how they differ.
///
/// # Errors
/// When the configuration is wrong, nothing can be compared, or the data or a file fails.
pub(crate) fn execute(args: &CompareArgs, json: bool, registry: &Registry) -> std::result::Result<(), Failure> {
    known(&args.with, registry)?;
    let (sources, mut pipeline) = pipeline(&args.pipeline, registry)?;
    let mut output = Output::named(args.out.as_deref(), &sources)?;
    if pipeline.route.point_separator().is_some() {
        return points(args, json, registry, &sources, &pipeline, output);
    }
    let comparing = match Comparing::new(&mut pipeline, &args.with, registry, sources.folder()) {
        Ok(comparing) => comparing,
        Err(fault) => return Err(Document::parse(&sources)?.diagnose(fault).into()),
    };
    let progress = Progress::new("stations");
    let whole = json || matches!(output, Output::Document(_));
    let others: Vec<String> = comparing.methods.iter().map(|method| method.name.clone()).collect();
    let table = comparison_figures(&others);
    let begin = |path| OverviewReport::begin(path, comparing.title().to_owned(), &sources, vec![table.clone()]);
    let mut report = args.report.as_deref().map(begin).transpose()?;
    let mut stations = Vec::new();
    let take = |station: StationComparison| {
        output.take(&station)?;
        if let Some(report) = &mut report {
            report.rows(&table, &comparison_rows(&table, &station)?)?;
        }
        stations.push(if whole { station } else { station.without_orders() });
        Ok(())
    };
    let mut comparison = comparing.run(args.threads, &progress, outputs(args), take)?;
    drop(progress);
    comparison.stations = stations;
    output.finish(&comparison)?;
    write_report(report, &comparison)?;
    print(&comparison, json, render::compare::text)?;
    fail_on(comparison.warnings.len(), args.warnings)
}

/// Compares methods on measured points, which are in memory as a whole.
fn points(
    args: &CompareArgs,
    json: bool,
    registry: &Registry,
    sources: &Sources,
    pipeline: &Pipeline,
    output: Output,
) -> std::result::Result<(), Failure> {
    if let Output::Table(path, _) = &output {
        let message = format!("{}: measured points have no orders to write as a table", path.display());
        return Err(Failure::Name { message, help: "name a file that ends in .json".into() });
    }
    let comparing = match ComparingPoints::new(pipeline, &args.with, registry, sources) {
        Ok(comparing) => comparing,
        Err(fault) => return Err(Document::parse(sources)?.diagnose(fault).into()),
    };
    let begin = |path| OverviewReport::begin(path, pipeline.title.clone(), sources, Vec::new());
    let report = args.report.as_deref().map(begin).transpose()?;
    let comparison = comparing.run(outputs(args))?;
    output.finish(&comparison)?;
    write_report(report, &comparison)?;
    print(&comparison, json, render::compare::text)?;
    fail_on(comparison.warnings.len(), args.warnings)
}

/// The files that are to be written.
fn outputs(args: &CompareArgs) -> Vec<PathBuf> {
    args.out.iter().chain(&args.report).cloned().collect()
}

/// Writes the report, where there is to be one.
fn write_report(report: Option<OverviewReport>, comparison: &Comparison) -> Result<()> {
    let Some(report) = report else { return Ok(()) };
    let (_, overview) = render::compare::page(comparison).into_overview(None);
    report.finish(comparison.provenance.clone(), &overview)
}

/// Refuses names that no separator has.
///
/// # Errors
/// The first that none has.
pub(crate) fn known(names: &[String], registry: &Registry) -> std::result::Result<(), Failure> {
    let known = || registry.separators.iter().map(|plugin| plugin.name);
    match names.iter().find(|name| !known().any(|known| known == name.as_str())) {
        None => Ok(()),
        Some(name) => {
            let message = format!("unknown separator `{name}`");
            Err(Failure::Name { message, help: known_names(name, known()) })
        }
    }
}

/// Where the comparison goes order by order.
enum Output {
    Nowhere,
    /// A table, begun with the first station.
    Table(PathBuf, Option<Box<ComparisonTable>>),
    Document(PathBuf),
}

impl Output {
    fn named(path: Option<&Path>, sources: &Sources) -> std::result::Result<Self, Failure> {
        let Some(path) = path else { return Ok(Self::Nowhere) };
        let refuse = |message: String, help: &str| Failure::Name { message, help: help.to_owned() };
        let shown = path.display();
        if sources.files().any(|file| resolved(file) == resolved(path)) {
            return Err(refuse(format!("{shown} is read as configuration"), "name another file"));
        }
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("parquet") => Ok(Self::Table(path.to_owned(), None)),
            Some("json") => Ok(Self::Document(path.to_owned())),
            _ => Err(refuse(format!("the format of {shown} is not known"), "end it in .parquet or .json")),
        }
    }

    fn take(&mut self, station: &StationComparison) -> Result<()> {
        let Self::Table(path, table) = self else { return Ok(()) };
        let table = match table {
            Some(table) => table,
            None => table.insert(Box::new(ComparisonTable::create(path.clone())?)),
        };
        table.append(station)
    }

    fn finish(self, comparison: &Comparison) -> Result<()> {
        match self {
            Self::Nowhere | Self::Table(_, None) => {}
            Self::Table(_, Some(table)) => {
                table.close(comparison)?.commit()?;
            }
            Self::Document(path) => {
                let text = serde_json::to_vec_pretty(comparison)
                    .map_err(|error| Error::caused("write", path.display().to_string(), error))?;
                atomic_file::write(path, &text)?;
            }
        }
        Ok(())
    }
}
