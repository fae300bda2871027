//! The loader: matches a file's groups with the rig.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use hdf5_metno::{File, LocationType, dataset::Layout};
use runout_core::{
    Error, ErrorKind, Result,
    checksum::Checksum,
    fault::Fault,
    input_file::InputFile,
    marker::Marker,
    measurement::{Recording, SampleStream, StationKey, StationTruth},
    pipeline::{Context, StageConfig},
    rig::Rig,
    stage::{Loader, Request, Source, SourceKind},
};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    TRUTH,
    capture::{CaptureSource, Phase},
    extent,
    orientation::Orientation,
    stream::{Hdf5Stream, columns_of},
    structure, truth,
};
use crate::{
    MEASUREMENT_FORMAT, VERSION, heaps,
    links::Links,
    node::{self, Place},
    superblock, utf8_path,
};

/// `[load] plugin = "hdf5"`: a measurement file of version 1.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hdf5Config {
    /// The file, relative to the TOML.
    pub path: PathBuf,
    /// The once-per-turn mark as an analogue trace, instead of a dataset `index`: a channel of the samples, or a dataset of the
    /// station. A turn begins where it crosses a threshold, between two samples.
    pub marker: Option<Marker>,
    /// Follows external links, virtual data sets and data in other files, all of which are then inputs with a checksum; by default they
    /// are refused.
    #[serde(default)]
    pub follow_links: bool,
}

impl StageConfig for Hdf5Config {
    type Stage = Box<dyn Loader>;
    const NAME: &'static str = "hdf5";
    const ABOUT: &'static str = "a measurement file: setups and stations with their samples, read in blocks";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the path of a measurement file, found none"));
        }
        if let Some(marker) = &self.marker {
            marker.check_with(context.rig).map_err(|fault| fault.under("marker"))?;
        }
        Ok(Box::new(Hdf5Loader {
            path: context.path(&self.path),
            marker: self.marker,
            follow_links: self.follow_links,
        }))
    }
}

struct Hdf5Loader {
    path: PathBuf,
    marker: Option<Marker>,
    follow_links: bool,
}

impl Loader for Hdf5Loader {
    fn kind(&self) -> SourceKind {
        SourceKind::Turns
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        let rig = wanted.rig.ok_or_else(|| {
            Error::new("open", self.path.display().to_string(), "recorded turns need a [rig] that names the sensors")
                .of(ErrorKind::Configuration)
        })?;
        Ok(Source::Turns(Box::new(Hdf5Recording::open(&self.path, rig, self.marker.clone(), self.follow_links)?)))
    }
}

/// A measurement file, matched with a rig.
struct Hdf5Recording {
    file: File,
    place: Place,
    links: Arc<Links>,
    rig: Rig,
    marker: Option<Marker>,
    stations: Vec<StationKey>,
    remarks: Vec<String>,
    checksum: Checksum,
    /// Whether samples lie in the file as they are wanted, so that the checksum sees them.
    is_plain: bool,
}

/// Carriage positions of one station that differ by less are the same: a micrometre, the resolution of a usual scale.
const SAME_STATION_MM: f64 = 0.001;

impl Hdf5Recording {
    /// Opens a file and checks everything but the samples themselves.
    fn open(path: &Path, rig: &Rig, marker: Option<Marker>, follow_links: bool) -> Result<Self> {
        utf8_path::check(path)?;
        let (file, place, links) = node::open(path, follow_links)?;
        check_format(&file, &place)?;
        let mut remarks = Vec::new();
        let setups = setups(&file, &place, rig, &mut remarks)?;
        let names = stations(&file, &place, rig, &mut remarks)?;
        let mut keys: Vec<StationKey> = Vec::with_capacity(names.len());
        let mut extra_channels = Vec::new();
        let mut is_plain = true;
        let mut extents = Vec::new();
        let structures = structure::of(links.input())?;
        for name in names {
            let mut z_mm = None;
            for setup in &setups {
                let (group, setup_place) = node::group(&file, &place, setup)?;
                let source = CaptureSource::open(&group, &setup_place, &name, marker.as_ref())?;
                source.phase.check()?;
                // Chunks of the new format have checksums; behind a block of the user, their places count from elsewhere.
                extents.extend(source.extents(structures.as_ref().is_some_and(|found| found.from_start)));
                columns_of(&source.stored.sensors, rig, &source.samples_place)?;
                is_plain &= source.dataset.layout() == Layout::Contiguous
                    && source.stored.orientation == Orientation::SampleRows;
                let named = |id: &&String| {
                    rig.sensor(id).is_some() || marker.as_ref().is_some_and(|marker| marker.channel == **id)
                };
                for id in source.stored.sensors.iter().filter(|id| !named(id)) {
                    if !extra_channels.contains(id) {
                        extra_channels.push(id.clone());
                    }
                }
                if matches!(source.phase, Phase::Angle(..)) && group.link_exists(&format!("{name}/{}", super::INDEX)) {
                    remarks.push(format!("{}: the encoder's angle was used, not the index", source.place));
                }
                match z_mm {
                    Some((first, known)) if f64::abs(known - source.z_mm) > SAME_STATION_MM => {
                        return Err(source.place.error(format!(
                            "attribute `z_mm`: expected the {known} mm of the setup `{first}`, found {} mm",
                            source.z_mm
                        )));
                    }
                    Some(_) => {}
                    None => z_mm = Some((setup, source.z_mm)),
                }
            }
            keys.push(StationKey { name, z_mm: z_mm.map_or(0.0, |(_, z_mm)| z_mm) });
        }
        if links.is_one_file() {
            let bytes = structures.as_ref().map_or_else(Vec::new, |found| found.bytes.clone());
            extent::check(extents, bytes, links.input().bytes())?;
            if let Some(structures) = structures.filter(|found| found.from_start)
                && let Some(data) = heaps::all_data(&file)
            {
                remarks.extend(structure::remark(links.input(), &structures, data)?);
            }
        }
        if !extra_channels.is_empty() {
            remarks.push(format!("{place}: channels that the rig does not name: {}", extra_channels.join(", ")));
        }
        keys.sort_by(|a, b| a.z_mm.total_cmp(&b.z_mm).then_with(|| a.name.cmp(&b.name)));
        remarks.extend(superblock::remark(links.input())?);
        let (rig, stations) = (rig.clone(), keys);
        let checksum = Checksum::of(links.input());
        is_plain &= links.is_one_file();
        Ok(Self { file, place, links, rig, marker, stations, remarks, checksum, is_plain })
    }
}

impl Recording for Hdf5Recording {
    fn stations(&self) -> &[StationKey] {
        &self.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let (Some(key), Some(at)) = (self.stations.get(station), self.rig.setups.get(setup)) else {
            return Err(self.place.error(format!("there is no station {station} in setup {setup}")));
        };
        let (group, place) = node::group(&self.file, &self.place, &at.id)?;
        let mut source = CaptureSource::open(&group, &place, &key.name, self.marker.as_ref())?;
        source.z_mm = key.z_mm;
        Ok(Box::new(Hdf5Stream::new(source, &self.rig, setup, &key.name, self.checksum.reader())?))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.links.inputs().iter().map(|file| file.path().to_owned()).collect()
    }

    fn opened(&self) -> Result<Vec<InputFile>> {
        Ok(self.links.inputs())
    }

    fn checksum(&self) -> Option<&Checksum> {
        self.is_plain.then_some(&self.checksum)
    }

    fn truth(&self, station: usize) -> Result<Option<StationTruth>> {
        match self.stations.get(station) {
            Some(key) => truth::read(&self.file, &self.place, &self.rig, &key.name),
            None => Ok(None),
        }
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

fn check_format(file: &File, place: &Place) -> Result<()> {
    let format = node::needed(node::text(file, place, "format")?, place, "format").map_err(|error| {
        error.help("a measurement file of version 1 has the attributes format, version, length_unit")
    })?;
    if format != MEASUREMENT_FORMAT {
        return Err(place.error(format!("attribute `format`: expected \"{MEASUREMENT_FORMAT}\", found \"{format}\"")));
    }
    let version = node::needed(node::number(file, place, "version")?, place, "version")?;
    if version as u64 != VERSION || version.fract() != 0.0 {
        return Err(place
            .error(format!("attribute `version`: expected {VERSION}, found {version}"))
            .help("a newer runout may read it"));
    }
    let unit = node::needed(node::text(file, place, "length_unit")?, place, "length_unit")?;
    if unit != "um" {
        let help = "write length_unit = \"um\", and give each sensor of [rig] the unit of its numbers: unit = \"mm\"";
        let problem = format!("attribute `length_unit`: expected \"um\", found \"{unit}\"");
        return Err(place.error(problem).help(help));
    }
    Ok(())
}

/// The rig's setups, all of which the file has to hold.
fn setups<'a>(file: &File, place: &Place, rig: &'a Rig, remarks: &mut Vec<String>) -> Result<Vec<&'a str>> {
    let found: Vec<String> = node::members(file, place)?.into_iter().filter(|name| name != TRUTH).collect();
    for setup in &rig.setups {
        if !found.contains(&setup.id) {
            return Err(place.error(format!(
                "expected a group for the setup `{}`, found {}",
                setup.id,
                if found.is_empty() { "none".into() } else { found.join(", ") }
            )));
        }
    }
    let extra: Vec<String> = found.into_iter().filter(|name| rig.setup(name).is_none()).collect();
    if !extra.is_empty() {
        remarks.push(format!("{place}: setups that the rig does not name: {}", extra.join(", ")));
    }
    Ok(rig.setups.iter().map(|setup| setup.id.as_str()).collect())
}

/// Names of the stations, which all setups have to share.
fn stations(file: &File, place: &Place, rig: &Rig, remarks: &mut Vec<String>) -> Result<Vec<String>> {
    let mut by_setup: Vec<(Place, Vec<String>)> = Vec::with_capacity(rig.setups.len());
    for setup in &rig.setups {
        let (group, place) = node::group(file, place, &setup.id)?;
        let mut names = Vec::new();
        for name in node::members(&group, &place)? {
            if node::kind(&group, &place, &name)? == LocationType::Group {
                names.push(name);
            } else {
                remarks.push(format!("{}: no group, and so no station", place.child(&name)));
            }
        }
        by_setup.push((place, names));
    }
    let mut all: Vec<String> = by_setup.iter().flat_map(|(_, names)| names.iter().cloned()).collect();
    all.sort();
    all.dedup();
    if all.is_empty() {
        return Err(place.error("expected at least one station in each setup, found none"));
    }
    for name in &all {
        let has = |(_, names): &&(Place, Vec<String>)| names.contains(name);
        let with = by_setup.iter().find(has);
        if let (Some((place, _)), Some((with, _))) = (by_setup.iter().find(|setup| !has(setup)), with) {
            return Err(place.error(format!("the station `{name}` is missing, which {with} has")));
        }
    }
    Ok(all)
}
