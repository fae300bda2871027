//! `[load] plugin = "channels"`: what the configuration says of a recording of named channels.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use runout_core::{
    fault::{Fault, known_names},
    marker::Edge,
    measurement::StationKey,
    rig::Rig,
};
use runout_csv::StationConfig;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{formats::FORMATS, unit};

/// No converter of displacement sensors is as fast: a higher number is a mistake.
const HIGHEST_RATE_HZ: f64 = 1e9;

/// `[load] plugin = "channels"`: a recording of named channels in one of many formats, recognised by the file's first bytes.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelsConfig {
    /// The file, relative to the TOML.
    pub path: Option<PathBuf>,
    /// Paths of several files, relative to the TOML, instead of `path`: `{setup}`, `{station}` and `{channel}` are in the place of their
    /// names, as in `"{setup}_{station}.tdms"`.
    pub pattern: Option<String>,
    /// The format, where the first bytes of the file do not say it: `tdms`, `mat`, `hdf5`, `text`, `npy`, `npz`, `parquet`, `arrow`, `uff`
    /// or `wav`.
    pub format: Option<String>,
    /// The axial stations; one without a name where it is left out. Their names are parts of the files' names, or groups in the groups of
    /// the setups.
    #[serde(default)]
    pub stations: Vec<StationConfig>,
    /// Of each setup of the rig, its group, variable or part of the file's name; without it the names as they are.
    #[serde(default)]
    pub setups: BTreeMap<String, String>,
    /// Of each sensor of the rig, its channel; without it the channel named like the sensor. Where a format has levels, groups stand
    /// before the name: `"Group/Channel"`, `"struct.field"`; a column of a matrix is `"data[:, 3]"`, counted from 0.
    #[serde(default)]
    pub channels: BTreeMap<String, ChannelConfig>,
    /// Where channels lie in the file, with `{setup}`, `{station}` and `{channel}` in the place of their names:
    /// `"runs/{setup}/{channel}/values"`.
    pub channel_path: Option<String>,
    /// The once-per-turn mark, as a trace of pulses or a channel of 0 and 1: a turn begins where it crosses the threshold.
    pub marker: Option<MarkConfig>,
    /// The angle of the spindle, sample by sample; it may begin anew with each turn.
    pub angle: Option<AngleConfig>,
    /// Pulses of an encoder in one turn: `marker` then has so many pulses a turn, or `angle` and `times` count them.
    pub pulses_per_turn: Option<u32>,
    /// The once-per-turn mark beside the pulses of an encoder: where the angle is 0.
    pub zero: Option<MarkConfig>,
    /// The channel of the times of the marks, in s unless the file says otherwise, counted as those of the samples.
    pub times: Option<String>,
    /// The channel of the times of the samples, where it is not named like one.
    pub time: Option<String>,
    /// Unit of the sensors' numbers, where the file has none: `um`, `mm`, `nm`, `mil`, `in`, `V` or `mV`.
    pub unit: Option<String>,
    /// Sampling rate in Hz, where the file has none.
    pub sample_rate_hz: Option<f64>,
    /// Speed of the spindle as set, in rpm.
    pub speed_rpm: Option<f64>,
}

/// The channel of a sensor: its name, or how its numbers become those of the sensor.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ChannelConfig {
    /// The name.
    Name(String),
    /// With a conversion: number · gain + offset, in the unit.
    Converted(ConvertedConfig),
}

/// `{ channel = "X1", gain = 12.5, offset = -3.0, unit = "um" }`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConvertedConfig {
    /// Its name.
    pub channel: String,
    /// What the file's numbers are multiplied by.
    #[serde(default = "one")]
    pub gain: f64,
    /// What is added then.
    #[serde(default)]
    pub offset: f64,
    /// Unit of the result.
    pub unit: Option<String>,
}

fn one() -> f64 {
    1.0
}

impl ChannelConfig {
    /// The channel's name.
    #[must_use]
    pub fn channel(&self) -> &str {
        match self {
            Self::Name(name) => name,
            Self::Converted(converted) => &converted.channel,
        }
    }
}

/// `marker = { channel = "Index", threshold = 2.5, hysteresis = 0.5, edge = "rising" }`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarkConfig {
    /// The channel of the mark.
    pub channel: String,
    /// Where the trace crosses this value a turn begins, in the unit of the channel; the middle of its range where it is left out.
    pub threshold: Option<f64>,
    /// How far the trace must have been on the other side of the threshold before it counts again, in the unit of the channel; a quarter
    /// of its range where it is left out.
    pub hysteresis: Option<f64>,
    /// Which of the two crossings of a pulse counts.
    #[serde(default)]
    pub edge: Edge,
}

/// `angle = { channel = "Enc", unit = "deg" }`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngleConfig {
    /// The channel of the angle.
    pub channel: String,
    /// Its unit: `deg`, `rad`, `rev`, or `counts` with `pulses_per_turn`; by default the file's, or else degrees.
    pub unit: Option<String>,
}

impl ChannelsConfig {
    /// Checks all values, and gives the stations.
    pub(crate) fn checked(&self, rig: Option<&Rig>) -> std::result::Result<Vec<StationKey>, Fault> {
        self.check_files(rig)?;
        self.check_numbers()?;
        self.check_channels(rig)?;
        self.check_turns(rig)?;
        self.check_stations()
    }

    fn check_files(&self, rig: Option<&Rig>) -> std::result::Result<(), Fault> {
        match (&self.path, &self.pattern) {
            (None, None) => {
                let help = "path = \"run.tdms\", or pattern = \"{setup}.tdms\" with a file for each setup";
                return Err(Fault::here("expected `path` or `pattern`, found neither").help(help));
            }
            (Some(_), Some(_)) => return Err(Fault::at("pattern", "expected either `path` or `pattern`, found both")),
            (Some(path), None) if path.as_os_str().is_empty() => {
                return Err(Fault::at("path", "expected the path of a file, found none"));
            }
            _ => {}
        }
        if let Some(name) = &self.format
            && !FORMATS.iter().any(|format| format.name == name)
        {
            let known = FORMATS.iter().map(|format| format.name);
            return Err(Fault::at("format", format!("there is no format `{name}`")).help(known_names(name, known)));
        }
        let Some(rig) = rig else { return Ok(()) };
        if let Some(setup) = self.setups.keys().find(|setup| rig.setup(setup).is_none()) {
            let known = rig.setups.iter().map(|setup| setup.id.as_str());
            let fault = Fault::at(setup.clone(), format!("the rig has no setup `{setup}`"));
            return Err(fault.help(known_names(setup, known)).under("setups"));
        }
        Ok(())
    }

    fn check_numbers(&self) -> std::result::Result<(), Fault> {
        let range = 0.0..=HIGHEST_RATE_HZ;
        if let Some(rate_hz) = self.sample_rate_hz.filter(|rate_hz| !range.contains(rate_hz) || *rate_hz == 0.0) {
            let message =
                format!("expected a sampling rate above 0 and up to {HIGHEST_RATE_HZ:e} Hz, found {rate_hz:?}");
            return Err(Fault::at("sample_rate_hz", message));
        }
        if let Some(speed_rpm) = self.speed_rpm.filter(|speed_rpm| !(speed_rpm.is_finite() && *speed_rpm > 0.0)) {
            return Err(Fault::at("speed_rpm", format!("expected a number above 0, found {speed_rpm}")));
        }
        if let Some(unit) = self.unit.as_ref().filter(|unit| !is_reading(unit)) {
            return Err(
                Fault::at("unit", format!("expected a unit of length or voltage, found `{unit}`")).help(unit::HELP)
            );
        }
        if self.pulses_per_turn == Some(0) {
            return Err(Fault::at("pulses_per_turn", "expected a number above 0, found 0"));
        }
        Ok(())
    }

    fn check_channels(&self, rig: Option<&Rig>) -> std::result::Result<(), Fault> {
        for (sensor, channel) in &self.channels {
            let fault = |message: String| Fault::at(sensor.clone(), message).under("channels");
            if let Some(rig) = rig.filter(|rig| rig.sensor(sensor).is_none()) {
                let known = rig.sensors.iter().map(|sensor| sensor.id.as_str());
                return Err(fault(format!("the rig has no sensor `{sensor}`")).help(known_names(sensor, known)));
            }
            if channel.channel().is_empty() {
                return Err(fault("expected the name of a channel, found none".into()));
            }
            if let ChannelConfig::Converted(converted) = channel {
                let ConvertedConfig { gain, offset, unit, .. } = converted;
                if !(gain.is_finite() && *gain != 0.0 && offset.is_finite()) {
                    return Err(fault(format!(
                        "expected a finite gain other than 0 and offset, found {gain} and {offset}"
                    )));
                }
                if let Some(unit) = unit.as_ref().filter(|unit| !is_reading(unit)) {
                    return Err(fault(format!("expected a unit of length or voltage, found `{unit}`")).help(unit::HELP));
                }
            }
        }
        Ok(())
    }

    fn check_turns(&self, rig: Option<&Rig>) -> std::result::Result<(), Fault> {
        let stated =
            [("marker", self.marker.is_some()), ("angle", self.angle.is_some()), ("times", self.times.is_some())];
        let stated: Vec<&str> = stated.iter().filter(|(_, is_stated)| *is_stated).map(|(name, _)| *name).collect();
        if let [first, second, ..] = stated[..] {
            return Err(Fault::at(
                second,
                format!("expected one way to know the turns, found `{first}` and `{second}`"),
            ));
        }
        for (key, mark) in [("marker", &self.marker), ("zero", &self.zero)] {
            let Some(mark) = mark else { continue };
            let fault = |key: &str, message: String| Fault::at(key, message);
            let checked = match mark {
                MarkConfig { channel, .. } if channel.is_empty() => {
                    Err(fault("channel", "expected the name of the channel with the mark, found none".into()))
                }
                MarkConfig { threshold: Some(value), .. } if !value.is_finite() => {
                    Err(fault("threshold", format!("expected a finite number, found {value}")))
                }
                MarkConfig { hysteresis: Some(value), .. } if !(value.is_finite() && *value >= 0.0) => {
                    Err(fault("hysteresis", format!("expected a number of at least 0, found {value}")))
                }
                _ => Ok(()),
            };
            checked.map_err(|fault| fault.under(key))?;
        }
        if let Some(unit) = self.angle.as_ref().and_then(|angle| angle.unit.as_deref()) {
            let fault = |message: String| Err(Fault::at("unit", message).under("angle"));
            match unit::known(unit) {
                Some(unit::Known::Turns(_)) => {}
                Some(unit::Known::Counts) if self.pulses_per_turn.is_some() => {}
                Some(unit::Known::Counts) => return fault("an angle in counts needs `pulses_per_turn`".into()),
                _ => return fault(format!("expected \"deg\", \"rad\", \"rev\" or \"counts\", found `{unit}`")),
            }
        }
        let by_pulses = self.pulses_per_turn.is_some() && self.angle.is_none();
        if self.zero.is_some() && !by_pulses {
            return Err(Fault::at(
                "zero",
                "a mark of the zero belongs to the pulses of an encoder: add `pulses_per_turn`",
            ));
        }
        let is_alone = rig.is_none_or(|rig| rig.setups.len() == 1) && self.stations.len() < 2;
        if by_pulses && self.zero.is_none() && !is_alone {
            let message =
                "pulses of an encoder do not say where the angle is 0, which setups and stations have to share";
            return Err(
                Fault::at("pulses_per_turn", message).help("name the channel of the once-per-turn mark by `zero`")
            );
        }
        Ok(())
    }

    fn check_stations(&self) -> std::result::Result<Vec<StationKey>, Fault> {
        let mut stations: Vec<StationKey> = Vec::with_capacity(self.stations.len());
        for (index, station) in self.stations.iter().enumerate() {
            stations.push(station.check(&stations).map_err(|fault| fault.under_item("stations", index))?);
        }
        if stations.is_empty() {
            let stem = self.path.as_deref().and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
            stations.push(StationKey { name: stem.unwrap_or_else(|| "station".into()), z_mm: 0.0 });
        }
        stations.sort_by(|a, b| a.z_mm.total_cmp(&b.z_mm).then_with(|| a.name.cmp(&b.name)));
        Ok(stations)
    }
}

/// Whether a unit is one of sensors' numbers.
fn is_reading(text: &str) -> bool {
    matches!(unit::known(text), Some(unit::Known::LengthUm(_) | unit::Known::Volts(_)))
}
