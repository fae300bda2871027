//! What every loader must do with its file, and with a damaged one.

use std::{
    fmt::Write,
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    sync::Arc,
};

use runout_core::{
    measurement::Block,
    pipeline::{Pipeline, Registry},
    stage::Source,
};
use serde::Deserialize;
use tempfile::TempDir;
use toml::{Table, Value};

use crate::{
    campaign, made,
    table::{Check, Kind, TestOutcome, on_two_threads},
};

const CHECKS: [Check; 5] = [
    Check("equal", "A file that is opened twice gives equal data, bit by bit."),
    Check("stations", "Stations that are read last to first give the same."),
    Check("missing", "A file that is not there, and a folder in its place, are errors that name it."),
    Check("cut", "A file that is cut off, at 24 places: an error in words or data, no panic."),
    Check("damaged", "A file with other bytes at 24 places: an error in words or data, no panic."),
];
const PLACES: usize = 24;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Reading {
    file: Option<String>,
    scenario: Option<Table>,
    made: Option<String>,
    #[serde(default)]
    keys: Table,
    #[serde(default)]
    pipeline: Table,
    elsewhere: Option<String>,
}

/// A file and the pipeline that reads it.
struct Loaded<'a> {
    text: String,
    name: String,
    bytes: Vec<u8>,
    folder: TempDir,
    registry: &'a Registry,
}

pub(crate) fn test(registry: &Arc<Registry>) -> Kind {
    let campaigns = campaign::campaigns("load");
    let names = registry.loaders.iter().map(|plugin| plugin.name).filter(|name| *name != "simulated");
    Kind {
        heading: "Loaders",
        about: "Each reads one file of an example, a simulator or a formula.",
        checks: &CHECKS,
        plugins: on_two_threads(names, |plugin| all(&campaigns, plugin, registry)),
    }
}

fn all(campaigns: &Table, plugin: &str, registry: &Registry) -> Vec<TestOutcome> {
    let keys = campaign::campaign_of(campaigns, "load", plugin)
        .and_then(|table| table.try_into::<Reading>().map_err(|error| error.to_string()));
    let elsewhere = keys.as_ref().ok().and_then(|keys| keys.elsewhere.clone());
    let loaded = keys.and_then(|keys| Loaded::new(keys, plugin, registry));
    let found = CHECKS.iter().map(|check| match (&elsewhere, &loaded) {
        (Some(why), _) => TestOutcome::Exempt(why.clone()),
        (None, Ok(loaded)) => loaded.check(check.0),
        (None, Err(why)) => TestOutcome::Fails(why.clone()),
    });
    found.collect()
}

impl<'a> Loaded<'a> {
    fn new(reading: Reading, plugin: &str, registry: &'a Registry) -> Result<Self, String> {
        let words = |error: std::io::Error| error.to_string();
        let folder = tempfile::tempdir().map_err(words)?;
        let (name, bytes) = match (&reading.file, &reading.scenario, &reading.made) {
            (Some(file), ..) => {
                let name = Path::new(file).file_name().map(|name| name.to_string_lossy().into_owned());
                (name.ok_or("no name of a file")?, fs::read(campaign::repository().join(file)).map_err(words)?)
            }
            (None, Some(scenario), _) => {
                let (file, out) = (folder.path().join("scenario.toml"), folder.path().join("data.h5"));
                fs::write(&file, scenario.to_string()).map_err(words)?;
                let command = ["simulate".into(), file.into(), "--out".into(), out.clone().into()];
                let made = runout_cli::documents::of_command(command.into(), registry);
                made.map_err(|_| "the scenario is refused".to_owned())?;
                ("data.h5".into(), fs::read(out).map_err(words)?)
            }
            (None, None, Some(made)) => ("data.csv".into(), made::points(made).into_bytes()),
            _ => return Err("its campaign names no file".into()),
        };
        let mut load = reading.keys;
        load.insert("plugin".into(), plugin.into());
        let mut text = reading.pipeline;
        text.insert("load".into(), Value::Table(load));
        Ok(Self { text: text.to_string(), name, bytes, folder, registry })
    }

    fn check(&self, check: &str) -> TestOutcome {
        match check {
            "equal" => self.twice(false).into(),
            "stations" => match self.written(&self.bytes).and_then(|()| self.is_of_points()) {
                Ok(true) => TestOutcome::Exempt("it gives points".into()),
                Ok(false) => self.twice(true).into(),
                Err(why) => TestOutcome::Fails(why),
            },
            "missing" => self.is_missing().into(),
            "cut" => {
                let cut = |place: usize| self.bytes[..self.bytes.len() * place / PLACES].to_vec();
                self.damaged(cut).into()
            }
            _ => {
                let other = |place: usize| {
                    let mut bytes = self.bytes.clone();
                    let at = bytes.len() * place / PLACES + 13 * place % 29;
                    if let Some(byte) = bytes.get_mut(at) {
                        *byte ^= 0x5A;
                    }
                    bytes
                };
                self.damaged(other).into()
            }
        }
    }

    fn written(&self, bytes: &[u8]) -> Result<(), String> {
        fs::write(self.folder.path().join(&self.name), bytes).map_err(|error| error.to_string())
    }

    fn pipeline(&self) -> Result<Pipeline, String> {
        Pipeline::from_toml(&self.text, self.folder.path(), self.registry).map_err(|error| format!("{error:?}"))
    }

    fn open<T>(&self, take: impl FnOnce(Source) -> Result<T, String>) -> Result<T, String> {
        let pipeline = self.pipeline()?;
        take(pipeline.loader.open(&pipeline.request()).map_err(|error| error.to_string())?)
    }

    fn is_of_points(&self) -> Result<bool, String> {
        self.open(|source| Ok(matches!(source, Source::Points(_))))
    }

    /// All data of the file, as text.
    fn data(&self, backwards: bool) -> Result<String, String> {
        self.open(|source| {
            let recording = match source {
                Source::Points(points) => return Ok(format!("{points:?}")),
                Source::Turns(recording) => recording,
            };
            let setups = self.pipeline()?.rig.map_or(0, |rig| rig.setups.len());
            let mut places: Vec<(usize, usize)> = (0..recording.stations().len())
                .flat_map(|station| (0..setups).map(move |setup| (station, setup)))
                .collect();
            if backwards {
                places.reverse();
            }
            let mut texts = Vec::new();
            for (station, setup) in places {
                let words = |error: runout_core::Error| error.to_string();
                let mut stream = recording.open(station, setup).map_err(words)?;
                let mut text = format!("{:?}", stream.capture());
                let mut block = Block::default();
                while stream.next_block(&mut block).map_err(words)? {
                    let _ = write!(text, "{:?}{:?}", block.samples, block.angle_rev);
                }
                texts.push(((station, setup), text));
            }
            texts.sort();
            Ok(format!("{texts:?}"))
        })
    }

    fn twice(&self, backwards: bool) -> Result<(), String> {
        self.written(&self.bytes)?;
        if self.data(false)? == self.data(backwards)? { Ok(()) } else { Err("the data differ".into()) }
    }

    fn is_missing(&self) -> Result<(), String> {
        let path = self.folder.path().join(&self.name);
        let _is_not_there = fs::remove_file(&path);
        let named = |what: &str| match self.data(false) {
            Ok(_) => Err(format!("{what} gives data")),
            Err(words) if words.contains(&self.name) => Ok(()),
            Err(words) => Err(format!("the error of {what} does not name it: {words}")),
        };
        named("a file that is not there")?;
        fs::create_dir(&path).map_err(|error| error.to_string())?;
        let found = named("a folder");
        fs::remove_dir(&path).map_err(|error| error.to_string())?;
        found
    }

    fn damaged(&self, damage: impl Fn(usize) -> Vec<u8>) -> Result<(), String> {
        (0..PLACES).try_for_each(|place| {
            self.written(&damage(place))?;
            match catch_unwind(AssertUnwindSafe(|| self.data(false))) {
                Err(_) => Err(format!("a panic at place {place} of {PLACES}")),
                Ok(Err(words)) if !words.contains(&self.name) => {
                    Err(format!("place {place} of {PLACES}: the error does not name the file: {words}"))
                }
                Ok(_) => Ok(()),
            }
        })
    }
}
