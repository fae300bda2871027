//! `runout new`: a pipeline to start from, for a method and a file.

use std::{
    fs,
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
};

use runout_core::{
    Error, ErrorKind,
    fault::known_names,
    pipeline::{INCLUDE_KEY, Pipeline, Registry, document::Sources},
    rig::Rig,
};
use runout_hdf5::MEASUREMENT_FORMAT;
use serde::Serialize;

use super::{print, there_already};
use crate::{args::NewArgs, failure::Failure, templates::TEMPLATES};

/// What was written.
#[derive(Debug, Serialize)]
struct NewReport {
    /// The pipeline.
    pipeline: PathBuf,
    /// Its separator.
    method: String,
    /// What is to be done now, in words.
    next: Vec<String>,
}

/// Writes a pipeline that passes `check`.
///
/// # Errors
/// When there is no such method, the file is of another kind, or the pipeline is there already.
pub(crate) fn execute(args: &NewArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    let template = template(&args.method, registry)?;
    let output = args.out.clone().unwrap_or_else(|| format!("{}.toml", args.method).into());
    if !args.overwrite && fs::symlink_metadata(&output).is_ok() {
        return Err(there_already(&output, "name another file by --out, or add --overwrite"));
    }
    let folder = output.parent().unwrap_or(Path::new("")).to_owned();
    let checked = |text: &str| {
        let sources = Sources::from_text(&output.display().to_string(), text, folder.clone(), &[], INCLUDE_KEY)?;
        Pipeline::from_sources(&sources, registry).map_err(Failure::from)
    };
    let text = match &args.file {
        None => template.to_owned(),
        Some(file) => {
            let load = load(file, &folder, template, checked(template)?.rig.as_ref())?;
            with_object(&with_load(template, &load), file)
        }
    };
    let pipeline = checked(&text)?;
    runout_core::atomic_file::write(&output, text.as_bytes())?;
    let mut next = Vec::new();
    if pipeline.rig.is_some() {
        next.push(
            "describe your rig in [rig]: angles and places of the sensors, angles of part and sensors in each setup"
                .into(),
        );
    } else {
        next.push("give your numbers in [separate]".into());
    }
    if args.file.is_none() {
        next.push("name your file in [load]; `runout inspect FILE` shows its contents".into());
    }
    next.push(format!("runout check {0} && runout run {0}", output.display()));
    print(&NewReport { pipeline: output, method: args.method.clone(), next }, json, |report| {
        let lines: Vec<String> = report.next.iter().map(|line| format!("  {line}\n")).collect();
        format!("written: {}\n{}", report.pipeline.display(), lines.concat())
    })
}

/// The pipeline of a method.
fn template(method: &str, registry: &Registry) -> Result<&'static str, Failure> {
    if let Some((_, text)) = TEMPLATES.iter().find(|(name, _)| *name == method) {
        return Ok(text);
    }
    let is_registered = registry.separators.iter().any(|separator| separator.name == method);
    let names = TEMPLATES.iter().map(|(name, _)| *name);
    Err(if is_registered {
        let help = format!(
            "`runout plugins {method}` lists its keys; pipelines are there for {}",
            names.collect::<Vec<_>>().join(", ")
        );
        Failure::Name { message: format!("there is no pipeline to start from for `{method}`"), help }
    } else {
        Failure::Name { message: format!("there is no method `{method}`"), help: known_names(method, names) }
    })
}

/// The table `[load]` of a template, up to the blank line behind it.
fn load_of(template: &str) -> &str {
    let start = template.find("[load]").unwrap_or(template.len());
    let length = template[start..].find("\n\n").map_or(template.len() - start, |length| length + 1);
    &template[start..start + length]
}

fn with_load(template: &str, load: &str) -> String {
    template.replace(load_of(template), load)
}

/// Points as measured are those of circles, or of a profile, as their first line says, and no map whose form is taken off.
fn with_object(text: &str, file: &Path) -> String {
    let of_map = text.lines().find(|line| line.starts_with("form = \"plane\""));
    let (Some(of_map), true) = (of_map, load_of(text).contains("plugin = \"points\"\npath")) else {
        return text.to_owned();
    };
    let mut head = String::new();
    let read = fs::File::open(file).map(|file| BufReader::new(file.take(4096)).read_line(&mut head));
    let is_circle = read.is_err() || ["angle", "radius", "y_"].iter().any(|name| head.contains(name));
    let object = if is_circle { "cylinder" } else { "profile" };
    text.replace(of_map, &format!("object = \"{object}\"    # \"roundness\" of one circle, \"cylinder\", \"profile\""))
}

/// The table `[load]` of a file that the loader of this template, or one for the same kind of data, reads.
fn load(file: &Path, folder: &Path, template: &str, rig: Option<&Rig>) -> Result<String, Failure> {
    let refused = |problem: &str, help: &str| {
        Failure::Work(Error::new("read", file.display().to_string(), problem).of(ErrorKind::UnsuitableData).help(help))
    };
    if !file.is_file() {
        return Err(Error::new("read", file.display().to_string(), "there is no such file")
            .of(ErrorKind::MissingFile)
            .into());
    }
    let path = seen_from(folder, file);
    let table = |plugin: &str| format!("[load]\nplugin = \"{plugin}\"\npath = {}\n", toml::Value::String(path.clone()));
    let is_map = || runout_maps::is_map(file);
    let Some(rig) = rig else {
        return match plugin_of(template) {
            // A circle or a cylinder as measured is points.
            Some("height-map") if is_map()? => Ok(table("height-map")),
            Some("height-map") if load_of(template).contains("\"points\"") => Ok(table("points")),
            Some("height-map") => Err(refused("it is no height map", "X3P, SDF, SUR, HDF5 (runout-surface) or text")),
            Some(plugin) => Ok(table(plugin)),
            None => Ok(String::new()),
        };
    };
    if is_measurement(file) {
        return Ok(table("hdf5"));
    }
    let Some(report) = runout_channels::inspect(file)? else {
        let help = "TDMS, MAT, HDF5, LVM, CSV, NumPy, Parquet, Arrow, UFF and WAV are read; `runout inspect` shows its contents";
        return Err(refused("it is no recording of named channels", help));
    };
    if report.suggestion.channels.is_empty() {
        return Err(refused("it has no channel of samples", "`runout inspect` lists its channels"));
    }
    let setups: Vec<&str> = rig.setups.iter().map(|setup| setup.id.as_str()).collect();
    let sensors: Vec<&str> = rig.sensors.iter().map(|sensor| sensor.id.as_str()).collect();
    let mut suggestion = report.suggestion.for_rig(&setups, &sensors);
    suggestion.path = path;
    Ok(suggestion.to_string())
}

/// The loader that a template names.
fn plugin_of(template: &str) -> Option<&str> {
    load_of(template).lines().find_map(|line| line.strip_prefix("plugin = \"")?.strip_suffix('"'))
}

/// Whether it is this program's own measurement file.
fn is_measurement(file: &Path) -> bool {
    let is_hdf5 = fs::File::open(file).is_ok_and(|mut opened| {
        let mut signature = [0; 4];
        std::io::Read::read_exact(&mut opened, &mut signature).is_ok() && signature == *b"\x89HDF"
    });
    is_hdf5 && runout_hdf5::inspect(file).is_ok_and(|report| report.format.as_deref() == Some(MEASUREMENT_FORMAT))
}

/// A file's path as a pipeline in this folder names it.
fn seen_from(folder: &Path, file: &Path) -> String {
    let is_here = folder.as_os_str().is_empty() || file.is_absolute();
    let path = if is_here {
        file.to_owned()
    } else if let Ok(below) = file.strip_prefix(folder) {
        below.to_owned()
    } else {
        std::path::absolute(file).unwrap_or_else(|_| file.to_owned())
    };
    path.display().to_string()
}
