//! One capture: which channels of which files it is made of.

use std::{path::PathBuf, sync::Arc};

use runout_core::{
    Error, ErrorKind, Result,
    clock::ClockScan,
    measurement::StationKey,
    rig::{Rig, Unit},
};

use crate::{
    channel::{Channel, ChannelFile},
    config::{ChannelConfig, ChannelsConfig},
    files::Files,
    hints::is_time,
    select, unit,
};

/// Sampling rates that differ by a smaller share are the same: rounding of a time column.
const SAME_RATE: f64 = 1e-3;
/// Instants that differ by a smaller share of a sample are the same.
const SAME_INSTANT: f64 = 0.01;
/// Samples that are read at a time.
pub(crate) const BLOCK: usize = 1 << 13;
/// A file and one of its channels.
#[derive(Clone)]
pub(crate) struct Signal {
    pub(crate) file: Arc<dyn ChannelFile>,
    pub(crate) index: usize,
    /// For messages: `run.tdms:Run 0/X1`.
    pub(crate) shown: String,
}

impl Signal {
    pub(crate) fn channel(&self) -> &Channel {
        &self.file.channels()[self.index]
    }

    pub(crate) fn error(&self, problem: impl std::fmt::Display) -> Error {
        Error::new("read", &self.shown, problem)
    }

    /// Passes all samples through once.
    pub(crate) fn each(&self, mut take: impl FnMut(f64) -> Result<()>) -> Result<()> {
        let mut samples = self.file.read(&[self.index])?;
        let mut column = [Vec::new()];
        while samples.next(BLOCK, &mut column)? > 0 {
            column[0].drain(..).try_for_each(&mut take)?;
        }
        Ok(())
    }

    /// Lowest and highest of all samples, and whether there are no others.
    pub(crate) fn range(&self) -> Result<(f64, f64, bool)> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        self.each(|value| {
            (low, high) = (low.min(value), high.max(value));
            Ok(())
        })?;
        let mut has_others = false;
        self.each(|value| {
            has_others |= value > low && value < high;
            Ok(())
        })?;
        Ok((low, high, !has_others))
    }
}

/// How the numbers of a channel become those of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Conversion {
    pub(crate) gain: f64,
    pub(crate) offset: f64,
}

/// The signals of a capture.
pub(crate) struct Signals {
    /// Of each sensor of the rig.
    pub(crate) sensors: Vec<(Signal, Conversion)>,
    pub(crate) samples: u64,
    pub(crate) rate_hz: Option<f64>,
    /// Time of the first sample, in s.
    pub(crate) start_s: f64,
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
        let rate_hz = self.rate_hz(&sensors)?;
        let start_s = same_start(&sensors, rate_hz)?;
        let lengths = || sensors.iter().map(|(signal, _)| signal.channel().samples);
        let samples = lengths().min().unwrap_or(0);
        if let Some((longer, _)) = sensors.iter().find(|(signal, _)| signal.channel().samples > samples) {
            let more = longer.channel().samples - samples;
            remarks
                .push(format!("{}: its last {more} samples are not used: another channel ends before", longer.shown));
        }
        if samples == 0 {
            let shown = sensors.first().map_or_else(String::new, |(signal, _)| signal.shown.clone());
            return Err(Error::new("read", shown, "expected samples, found none").of(ErrorKind::InsufficientData));
        }
        for (signal, _) in &sensors {
            for remark in signal.file.remarks() {
                if !remarks.contains(&remark) {
                    remarks.push(remark);
                }
            }
        }
        Ok(Signals { sensors, samples, rate_hz, start_s, remarks })
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

    /// The rate of the sensors' channels.
    fn rate_hz(&self, sensors: &[(Signal, Conversion)]) -> Result<Option<f64>> {
        let Some((first, _)) = sensors.first() else { return Ok(None) };
        let stated = self.config.sample_rate_hz;
        for (signal, _) in sensors {
            if let (Some(one), Some(other)) = (first.channel().rate_hz, signal.channel().rate_hz)
                && (one / other - 1.0).abs() > SAME_RATE
            {
                let problem = format!("its sampling rate is {other} Hz, that of {} {one} Hz", first.shown);
                let half_hz = 0.5 * one.min(other);
                return Err(signal.error(problem).help(format!(
                    "the slower one holds nothing above {half_hz} Hz, where what is separated would be wrong: record all sensors at one rate, \
                     or bring the faster ones to the lower rate, behind a low-pass"
                )));
            }
        }
        let found = match first.channel().rate_hz {
            Some(rate_hz) => Some(rate_hz),
            // A time column takes a look at each sample: only where it is named, or nothing else says the rate.
            None if self.config.time.is_some() || stated.is_none() => self.clock(first)?,
            None => None,
        };
        match (stated, found) {
            (Some(stated), Some(found)) if (found / stated - 1.0).abs() > SAME_RATE => {
                let problem = format!("its sampling rate is {found} Hz, that of the configuration {stated} Hz");
                Err(first.error(problem).help("leave `sample_rate_hz` out of [load], or correct it"))
            }
            (stated, found) => Ok(stated.or(found)),
        }
    }

    /// The rate by a channel of times beside another one.
    fn clock(&self, beside: &Signal) -> Result<Option<f64>> {
        let time = match &self.config.time {
            Some(name) => Some(self.signal(name)?),
            None => time_beside(beside),
        };
        let Some(time) = time else { return Ok(None) };
        let factor = match time.channel().unit.as_deref().and_then(unit::known) {
            Some(unit::Known::Seconds(factor)) => factor,
            _ => 1.0,
        };
        let mut scan = ClockScan::default();
        let (mut sample, help) = (0_u64, "state `sample_rate_hz` in [load] where the times have too few digits");
        time.each(|value| {
            let failed = |problem: String| time.error(format!("sample {sample}: {problem}")).help(help);
            if !value.is_finite() {
                return Err(failed(format!("expected a time, found {value}")));
            }
            scan.push(value * factor).map_err(failed)?;
            sample += 1;
            Ok(())
        })?;
        scan.rate_hz().map_err(|problem| time.error(problem).help(help))
    }
}

/// A channel of times in the same group, as long as another one.
fn time_beside(beside: &Signal) -> Option<Signal> {
    let channels = beside.file.channels();
    let own = beside.channel();
    let index = channels
        .iter()
        .position(|channel| is_time(channel) && channel.group == own.group && channel.samples == own.samples)?;
    let shown = beside.shown.replace(&own.path(), &channels[index].path());
    Some(Signal { file: Arc::clone(&beside.file), index, shown })
}

/// When the first samples were taken, which has to be at one time.
fn same_start(sensors: &[(Signal, Conversion)], rate_hz: Option<f64>) -> Result<f64> {
    let start_s = |signal: &Signal| signal.channel().start_s.unwrap_or(0.0);
    let Some((first, _)) = sensors.first() else { return Ok(0.0) };
    let at_s = start_s(first);
    for (signal, _) in sensors {
        let off = (start_s(signal) - at_s) * rate_hz.unwrap_or(0.0);
        if off.abs() > SAME_INSTANT {
            let problem = format!("its first sample is {off:.3} samples later than that of {}", first.shown);
            return Err(signal.error(problem).help("record all sensors by one trigger, or shift them before"));
        }
    }
    Ok(at_s)
}
