//! One capture: which channels of which files it is made of.

use std::{path::PathBuf, sync::Arc};

use runout_core::{
    Error, ErrorKind, Result,
    measurement::StationKey,
    rig::{Rig, Unit},
};

use crate::{
    channel::{Channel, ChannelFile},
    clock::{Clock, Common, SAME_RATE, Scan, time_beside},
    config::{ChannelConfig, ChannelsConfig},
    files::Files,
    select,
    signal::{Conversion, Signal},
    unit,
};

/// The signals of a capture.
pub(crate) struct Signals {
    /// Of each sensor of the rig.
    pub(crate) sensors: Vec<(Signal, Conversion)>,
    /// When the samples of each were taken.
    pub(crate) clocks: Vec<Clock>,
    pub(crate) common: Common,
    pub(crate) remarks: Vec<String>,
}

/// Where a capture is.
pub(crate) struct Place<'a> {
    pub(crate) config: &'a ChannelsConfig,
    pub(crate) files: &'a Files,
    pub(crate) rig: &'a Rig,
    pub(crate) setup: usize,
    pub(crate) station: &'a StationKey,
}

/// Sensors of which one ends before another by more than this share were not recorded at one rate.
const UNLIKE_LENGTHS: f64 = 0.25;

impl Place<'_> {
    /// What the configuration calls the setup in the file.
    fn setup_name(&self) -> String {
        let id = &self.rig.setups[self.setup].id;
        self.config.setups.get(id).map_or(id.clone(), |name| name.replace("{station}", &self.station.name))
    }

    fn expanded(&self, template: &str, channel: &str) -> String {
        // The channel last: its name is not looked through.
        let names = template.replace("{setup}", &self.setup_name()).replace("{station}", &self.station.name);
        names.replace("{channel}", channel)
    }

    /// The file that holds a channel.
    pub(crate) fn path(&self, channel: &str) -> PathBuf {
        match (&self.config.path, &self.config.pattern) {
            (Some(path), _) => path.clone(),
            (None, pattern) => self.files.folder().join(self.expanded(pattern.as_deref().unwrap_or_default(), channel)),
        }
    }

    /// The group of the setup and station in the file; empty where files distinguish them, or there is only one.
    fn group(&self, file: &dyn ChannelFile) -> String {
        let pattern = self.config.pattern.as_deref().unwrap_or_default();
        let named = self.config.setups.get(&self.rig.setups[self.setup].id);
        let setup = if pattern.contains("{setup}") {
            String::new()
        } else if named.is_some() || self.rig.setups.len() > 1 {
            self.setup_name()
        } else {
            // The only setup is the whole file, unless it has a group of that name.
            let id = self.setup_name();
            let has = |channel: &Channel| channel.group == id || channel.group.starts_with(&format!("{id}/"));
            if file.channels().iter().any(has) { id } else { String::new() }
        };
        let is_named = pattern.contains("{station}") || named.is_some_and(|name| name.contains("{station}"));
        match (setup.is_empty(), is_named || self.config.stations.len() < 2) {
            (_, true) => setup,
            (true, false) => self.station.name.clone(),
            (false, false) => format!("{setup}/{}", self.station.name),
        }
    }

    /// The channel that a name of the configuration means here.
    pub(crate) fn signal(&self, name: &str) -> Result<Signal> {
        let path = self.path(name);
        let file = self.files.open(&path, self.config.format.as_deref())?;
        let shown = path.display().to_string();
        let found = if let Some(template) = &self.config.channel_path {
            select::find(file.channels(), "", &self.expanded(template, name))
        } else if name.contains("{setup}") || name.contains("{station}") {
            select::find(file.channels(), "", &self.expanded(name, ""))
        } else {
            select::find(file.channels(), &self.group(&*file), name)
        };
        // A file of one channel may have no name for it.
        let of_a_channel = self.config.pattern.as_ref().is_some_and(|pattern| pattern.contains("{channel}"));
        let index = match found {
            Err(_) if of_a_channel && file.channels().len() == 1 => 0,
            found => found.map_err(|problem| {
                let help =
                    "name the channels by `channels` in [load]; `runout inspect FILE` prints a table to start from";
                Error::new("read", &shown, problem).help(help)
            })?,
        };
        let shown = format!("{shown}:{}", file.channels()[index].path());
        Ok(Signal { file, index, shown })
    }

    /// The signals of the sensors, all of the same instants.
    pub(crate) fn signals(&self) -> Result<Signals> {
        let mut sensors = Vec::with_capacity(self.rig.sensors.len());
        let mut without_unit = Vec::new();
        for sensor in &self.rig.sensors {
            let configured = self.config.channels.get(&sensor.id);
            let signal = self.signal(configured.map_or(sensor.id.as_str(), ChannelConfig::channel))?;
            if !signal.channel().kind.is_number() {
                return Err(signal.error(format!("expected numbers, found {}", signal.channel().kind.name())));
            }
            let (conversion, has_unit) = self.conversion(&signal, configured, sensor.unit)?;
            if !has_unit {
                without_unit.push(signal.channel().name.clone());
            }
            sensors.push((signal, conversion));
        }
        let mut remarks = Vec::new();
        if !without_unit.is_empty() {
            let shown = self.path(&self.rig.sensors[0].id).display().to_string();
            let names = without_unit.join(", ");
            remarks.push(format!("{shown}: no unit of {names}: the numbers are taken as the sensors' of the rig"));
        }
        let signals: Vec<&Signal> = sensors.iter().map(|(signal, _)| signal).collect();
        let clocks = self.clocks(signals.iter().copied())?;
        let common = Common::of(&signals, &clocks)?;
        let samples = common.clock.samples;
        if samples == 0 {
            let shown = sensors.first().map_or_else(String::new, |(signal, _)| signal.shown.clone());
            return Err(Error::new("read", shown, "expected samples, found none").of(ErrorKind::InsufficientData));
        }
        let is_longer = |signal: &&&Signal| !common.is_resampled && signal.channel().samples > samples;
        if let Some(longer) = signals.iter().find(is_longer) {
            let all = longer.channel().samples;
            // One rate that is stated for channels of unlike length is that of one of them.
            if (all - samples) as f64 > UNLIKE_LENGTHS * samples as f64 {
                let problem = format!(
                    "it has {all} samples, where another sensor has {samples}: they were hardly recorded at the one rate that is stated"
                );
                return Err(longer.error(problem).of(ErrorKind::UnsuitableData).help(
                    "give channels of one rate, a file that states the rate of each (TDMS, WAV, UFF, attributes of HDF5), or cut the longer one",
                ));
            }
            let more = all - samples;
            remarks
                .push(format!("{}: its last {more} samples are not used: another channel ends before", longer.shown));
        }
        for (signal, _) in &sensors {
            for remark in signal.file.remarks() {
                if !remarks.contains(&remark) {
                    remarks.push(remark);
                }
            }
        }
        Ok(Signals { sensors, clocks, common, remarks })
    }

    /// From the numbers of the file to those of the sensor, and whether a unit says so.
    fn conversion(
        &self,
        signal: &Signal,
        configured: Option<&ChannelConfig>,
        sensor: Unit,
    ) -> Result<(Conversion, bool)> {
        let of_file = signal.channel().unit.as_deref();
        let stated = self.config.unit.as_deref();
        let failed = |problem: String| signal.error(problem).help(unit::HELP);
        let (gain, offset, text) = match configured {
            Some(ChannelConfig::Converted(converted)) => {
                let text = converted.unit.as_deref().or(of_file).or(stated);
                (converted.gain, converted.offset, text)
            }
            _ => match (of_file, stated) {
                (Some(found), Some(stated)) => {
                    let is_reading =
                        matches!(unit::known(found), Some(unit::Known::LengthUm(_) | unit::Known::Volts(_)));
                    if is_reading && unit::known(found) != unit::known(stated) {
                        let problem = format!("the file says `{found}`, the configuration `{stated}`");
                        return Err(signal.error(problem).help("leave `unit` out of [load]"));
                    }
                    (1.0, 0.0, Some(stated))
                }
                (found, stated) => (1.0, 0.0, found.or(stated)),
            },
        };
        let Some(text) = text.filter(|text| !text.trim().is_empty()) else {
            return Ok((Conversion { gain, offset }, false));
        };
        let factor = unit::factor(text, sensor).map_err(failed)?;
        Ok((Conversion { gain: gain * factor, offset: offset * factor }, true))
    }

    /// The clocks of the sensors' channels.
    ///
    /// # Errors
    /// When times are not even, or contradict the configuration.
    pub(crate) fn clocks<'a>(&self, sensors: impl Iterator<Item = &'a Signal>) -> Result<Vec<Clock>> {
        // Columns of one table share its times, which are looked through once.
        let mut scans: Vec<Scan> = Vec::new();
        let stated_hz = self.config.sample_rate_hz;
        let mut clocks = Vec::new();
        for signal in sensors {
            // A time column takes a check of each sample: only where it is named, or nothing else says the rate.
            let mut clock = match stated_hz {
                Some(_) if self.config.time.is_none() => Clock::stated(signal.channel(), 0.0),
                _ => self.clock(signal, &mut scans)?,
            };
            if let (Some(stated_hz), Some(found_hz)) = (stated_hz, clock.rate_hz)
                && (found_hz / stated_hz - 1.0).abs() > SAME_RATE
            {
                let problem = format!("its sampling rate is {found_hz} Hz, that of the configuration {stated_hz} Hz");
                return Err(signal.error(problem).help("leave `sample_rate_hz` out of [load], or correct it"));
            }
            clock.rate_hz = stated_hz.or(clock.rate_hz);
            clocks.push(clock);
        }
        Ok(clocks)
    }

    /// The clock of a channel by itself or by its channel of times.
    fn clock(&self, signal: &Signal, scans: &mut Vec<Scan>) -> Result<Clock> {
        let stated = Clock::stated(signal.channel(), 0.0);
        if stated.rate_hz.is_some() {
            return Ok(stated);
        }
        let Some(time) = self.times(signal)? else { return Ok(stated) };
        let known =
            scans.iter().position(|scan| Arc::ptr_eq(&scan.time.file, &time.file) && scan.time.index == time.index);
        let place = known.unwrap_or(scans.len());
        if known.is_none() {
            scans.push(Scan::of(time)?);
        }
        let Scan { rate_hz, start_s, .. } = scans[place];
        Ok(Clock { rate_hz, start_s: signal.channel().start_s.unwrap_or(start_s), ..stated })
    }

    /// The clock of a channel of marks or angles: its own, or that of the sensors where it has as many samples.
    ///
    /// # Errors
    /// When its times are not even.
    pub(crate) fn clock_beside(&self, signal: &Signal, sensors: &Common) -> Result<Clock> {
        let channel = signal.channel();
        if channel.rate_hz.is_none() && !sensors.is_resampled && channel.samples == sensors.clock.samples {
            return Ok(Clock { rate_hz: sensors.clock.rate_hz, ..Clock::stated(channel, sensors.begin_s) });
        }
        match channel.rate_hz {
            Some(_) => Ok(Clock::stated(channel, sensors.begin_s)),
            None => self.clock(signal, &mut Vec::new()),
        }
    }

    /// The channel of times beside another one.
    fn times(&self, beside: &Signal) -> Result<Option<Signal>> {
        match &self.config.time {
            Some(name) => self.signal(name).map(Some),
            None => Ok(time_beside(beside)),
        }
    }
}
