//! `runout example`: a pipeline with its data, which the program holds.

use std::{fs, path::PathBuf};

use runout_core::{Error, fault::known_names};
use serde::Serialize;

use super::print;
use crate::{
    args::ExampleArgs,
    failure::Failure,
    render::{page::Page, table::Table},
};

/// A pipeline that runs as it is.
struct Example {
    name: &'static str,
    about: &'static str,
    /// Name and text of each file, the pipeline first.
    files: &'static [(&'static str, &'static str)],
}

macro_rules! example {
    ($name:literal, $about:literal, $folder:literal, [$($file:literal),*]) => {
        Example {
            name: $name,
            about: $about,
            files: &[$(($file, include_str!(concat!("../../../examples/", $folder, "/", $file)))),*],
        }
    };
}

const EXAMPLES: [Example; 4] = [
    example!(
        "three-point",
        "three probes around a shaft, as text",
        "08-text-recording",
        ["pipeline.toml", "shaft.csv"]
    ),
    example!("r-test", "an R-test of a C axis, as published", "11-measured-r-test", ["pipeline.toml", "r-test.csv"]),
    example!(
        "touch-probe",
        "touches of a ring by a touch-trigger probe (simulated)",
        "15-touch-probe",
        ["pipeline.toml", "touches.csv"]
    ),
    example!(
        "spatial-error",
        "errors of a machine over its travel (simulated)",
        "17-spatial-error",
        ["pipeline.toml", "axes.toml", "readings.csv"]
    ),
];

/// What was written, or could be.
#[derive(Debug, Serialize)]
struct ExampleReport {
    /// Names of the examples, with what they are; none where one was written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    examples: Vec<[&'static str; 2]>,
    /// The files written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    written: Vec<PathBuf>,
}

/// Writes an example into a folder of its name, or lists them.
///
/// # Errors
/// When there is no such example, a file is there already, or it cannot be written.
pub(crate) fn execute(args: &ExampleArgs, json: bool) -> Result<(), Failure> {
    let Some(name) = &args.name else {
        let examples = EXAMPLES.iter().map(|example| [example.name, example.about]).collect();
        return print(&ExampleReport { examples, written: Vec::new() }, json, |report| {
            let mut page = Page::default();
            let mut table = Table::new(2, ["example", "what it is"]);
            for row in &report.examples {
                table.row(*row);
            }
            page.headed_table("Examples", &table);
            page.line("");
            page.line("runout example NAME writes one into a folder of its name.");
            page.into_text()
        });
    };
    let Some(example) = EXAMPLES.iter().find(|example| example.name == name) else {
        let help = known_names(name, EXAMPLES.iter().map(|example| example.name));
        return Err(Failure::Name { message: format!("there is no example `{name}`"), help });
    };
    let folder = args.out.clone().unwrap_or_else(|| name.into());
    let files: Vec<(PathBuf, &str)> = example.files.iter().map(|(file, text)| (folder.join(file), *text)).collect();
    if let Some((there, _)) = files.iter().find(|(path, _)| fs::symlink_metadata(path).is_ok()) {
        let message = format!("`{}` is there already", there.display());
        return Err(Failure::Name { message, help: "name another folder by --out".into() });
    }
    fs::create_dir_all(&folder).map_err(|error| Error::caused("create", folder.display().to_string(), error))?;
    for (path, text) in &files {
        runout_core::atomic_file::write(path, text.as_bytes())?;
    }
    let written = files.into_iter().map(|(path, _)| path).collect();
    print(&ExampleReport { examples: Vec::new(), written }, json, |report| {
        let paths: Vec<String> = report.written.iter().map(|path| path.display().to_string()).collect();
        format!("written: {}\n  runout run {}\n", paths.join(", "), paths[0])
    })
}
