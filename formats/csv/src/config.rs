//! `[load] plugin = "csv"`: which file holds which setup and station.

use std::path::{Path, PathBuf};

use runout_core::{
    Error, ErrorKind, Result,
    fault::{Fault, known_names},
    marker::Marker,
    measurement::StationKey,
    pipeline::{Context, StageConfig},
    rig::Rig,
    stage::{Loader, Request, Source, SourceKind},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{recording::CsvRecording, stated::Stated};

/// No converter of displacement sensors is as fast: a higher number is a mistake.
const HIGHEST_RATE_HZ: f64 = 1e9;

/// `[load] plugin = "csv"`: one file a setup and station.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CsvConfig {
    /// The axial stations.
    pub stations: Vec<StationConfig>,
    /// Paths of the files, relative to the TOML, with `{setup}` and `{station}` in the place of their names.
    #[serde(alias = "path")]
    pub pattern: Option<String>,
    /// The files one by one, instead of a pattern.
    #[serde(default)]
    pub files: Vec<FileConfig>,
    /// Sampling rate in Hz, where the files have no column `time_s`.
    pub sample_rate_hz: Option<f64>,
    /// Speed of the spindle as set, in rpm.
    pub speed_rpm: Option<f64>,
    /// The once-per-turn mark as an analogue trace in a column of its own, instead of a column `index` of 0 and 1: a turn
    /// begins where it crosses a threshold, between two samples.
    pub marker: Option<Marker>,
}

/// An axial station.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StationConfig {
    /// Its name.
    pub name: String,
    /// Carriage position that is added to each sensor's z, in mm.
    #[serde(default)]
    pub z_mm: f64,
}

/// One file.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileConfig {
    /// The file, relative to the TOML.
    pub path: PathBuf,
    /// Id of its setup in the rig.
    pub setup: String,
    /// Name of its station.
    pub station: String,
}

impl StageConfig for CsvConfig {
    type Stage = Box<dyn Loader>;
    const NAME: &'static str = "csv";
    const ABOUT: &'static str = "text files of columns, one a setup and station; comma, semicolon or tab";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let mut stations: Vec<StationKey> = Vec::with_capacity(self.stations.len());
        if self.stations.is_empty() {
            return Err(Fault::at("stations", "expected at least one station"));
        }
        for (index, station) in self.stations.iter().enumerate() {
            stations.push(station.check(&stations).map_err(|fault| fault.under_item("stations", index))?);
        }
        stations.sort_by(|a, b| a.z_mm.total_cmp(&b.z_mm).then_with(|| a.name.cmp(&b.name)));
        if let Some(rate_hz) = self.sample_rate_hz.filter(|rate_hz| !(*rate_hz > 0.0 && *rate_hz <= HIGHEST_RATE_HZ)) {
            let message =
                format!("expected a sampling rate above 0 and up to {HIGHEST_RATE_HZ:e} Hz, found {rate_hz:?}");
            return Err(Fault::at("sample_rate_hz", message));
        }
        if let Some(speed_rpm) = self.speed_rpm.filter(|speed_rpm| !(speed_rpm.is_finite() && *speed_rpm > 0.0)) {
            return Err(Fault::at("speed_rpm", format!("expected a number above 0, found {speed_rpm}")));
        }
        if let Some(marker) = &self.marker {
            marker.check_with(context.rig).map_err(|fault| fault.under("marker"))?;
        }
        // A pipeline without a rig is refused as a whole, with a better message than could be given here.
        let paths = match (context.rig, &self.pattern) {
            (None, _) => Vec::new(),
            (Some(rig), None) => self.listed(context, rig, &stations)?,
            (Some(rig), Some(pattern)) if self.files.is_empty() => expanded(pattern, context, rig, &stations)?,
            (Some(_), Some(_)) => {
                return Err(Fault::at("pattern", "expected either `pattern` or `files`, found both"));
            }
        };
        Ok(Box::new(CsvLoader {
            stations,
            paths,
            stated: Stated { sample_rate_hz: self.sample_rate_hz, speed_rpm: self.speed_rpm, marker: self.marker },
        }))
    }
}

impl StationConfig {
    /// The station, where its name is none of `known`.
    ///
    /// # Errors
    /// The first value that cannot be.
    pub fn check(&self, known: &[StationKey]) -> std::result::Result<StationKey, Fault> {
        if self.name.is_empty() || known.iter().any(|known| known.name == self.name) {
            let message = format!("names of stations must differ and not be empty, found `{}`", self.name);
            return Err(Fault::at("name", message));
        }
        if !self.z_mm.is_finite() {
            return Err(Fault::at("z_mm", "expected a finite position in mm"));
        }
        Ok(StationKey { name: self.name.clone(), z_mm: self.z_mm })
    }
}

impl CsvConfig {
    /// `[station][setup]` from the list of files.
    fn listed(
        &self,
        context: &Context,
        rig: &Rig,
        stations: &[StationKey],
    ) -> std::result::Result<Vec<Vec<PathBuf>>, Fault> {
        if self.files.is_empty() {
            return Err(
                Fault::here("expected `pattern` or `files`, found neither").help("pattern = \"{setup}_{station}.csv\"")
            );
        }
        let mut paths = vec![vec![None; rig.setups.len()]; stations.len()];
        for (index, file) in self.files.iter().enumerate() {
            let fault = |key: &str, message: String| Fault::at(key, message).under_item("files", index);
            let setup = rig.setup(&file.setup).ok_or_else(|| {
                let known = rig.setups.iter().map(|setup| setup.id.as_str());
                fault("setup", format!("the rig has no setup `{}`", file.setup)).help(known_names(&file.setup, known))
            })?;
            let station = stations.iter().position(|key| key.name == file.station).ok_or_else(|| {
                let known = stations.iter().map(|key| key.name.as_str());
                fault("station", format!("there is no station `{}`", file.station))
                    .help(known_names(&file.station, known))
            })?;
            let place: &mut Option<PathBuf> = &mut paths[station][setup];
            if let Some(known) = place {
                let message = format!("`{}` at `{}` is already in {}", file.setup, file.station, known.display());
                return Err(fault("path", message));
            }
            *place = Some(context.path(&file.path));
        }
        let complete = |(station, files): (&StationKey, Vec<Option<PathBuf>>)| {
            let found = files.into_iter().zip(&rig.setups).map(|(path, setup)| {
                path.ok_or_else(|| {
                    Fault::at("files", format!("no file for the setup `{}` at `{}`", setup.id, station.name))
                })
            });
            found.collect()
        };
        stations.iter().zip(paths).map(complete).collect()
    }
}

/// `[station][setup]` from a pattern.
fn expanded(
    pattern: &str,
    context: &Context,
    rig: &Rig,
    stations: &[StationKey],
) -> std::result::Result<Vec<Vec<PathBuf>>, Fault> {
    for (word, count) in [("{setup}", rig.setups.len()), ("{station}", stations.len())] {
        if count > 1 && !pattern.contains(word) {
            return Err(Fault::at(
                "pattern",
                format!("expected `{word}` in the pattern, to distinguish {count} of them"),
            ));
        }
    }
    let path = |setup: &str, station: &str| {
        context.path(Path::new(&pattern.replace("{setup}", setup).replace("{station}", station)))
    };
    let paths = |key: &StationKey| rig.setups.iter().map(|setup| path(&setup.id, &key.name)).collect();
    Ok(stations.iter().map(paths).collect())
}

struct CsvLoader {
    stations: Vec<StationKey>,
    paths: Vec<Vec<PathBuf>>,
    stated: Stated,
}

impl Loader for CsvLoader {
    fn kind(&self) -> SourceKind {
        SourceKind::Turns
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        let rig = wanted.rig.filter(|_| !self.paths.is_empty());
        let rig = rig.ok_or_else(|| {
            Error::new("open", "the CSV files", "recorded turns need a [rig]").of(ErrorKind::Configuration)
        })?;
        let recording = CsvRecording::open(rig, self.stations.clone(), &self.paths, self.stated.clone())?;
        Ok(Source::Turns(Box::new(recording)))
    }
}
