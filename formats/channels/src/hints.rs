//! What some formats say of channels by other variables beside them: a sampling rate or step, and a unit.

use runout_core::Result;

use crate::{
    channel::{Channel, ChannelFile, Kind, Samples},
    unit,
};

/// Names of variables that hold a sampling rate in Hz.
const RATES: [&str; 11] = [
    "fs",
    "fs_hz",
    "sample_rate",
    "samplerate",
    "sample_rate_hz",
    "sampling_rate",
    "samplingrate",
    "sampling_rate_hz",
    "rate",
    "rate_hz",
    "sampling_frequency",
];
/// Names of variables that hold the time from sample to sample in s.
const STEPS: [&str; 8] =
    ["dt", "dt_s", "delta_t", "tinterval", "interval", "sample_interval", "sampling_interval", "wf_increment"];
/// Names of variables that hold a unit.
const UNITS: [&str; 3] = ["unit", "units", "einheit"];
/// Names of channels that hold the times of the samples.
const TIMES: [&str; 12] = [
    "time",
    "time_s",
    "t",
    "t_s",
    "times",
    "timestamp",
    "timestamps",
    "zeit",
    "x_value",
    "x-axis",
    "elapsed",
    "elapsed_s",
];
/// Under which property the text of a variable is.
pub(crate) const TEXT: &str = "text";

/// A file whose channels got what variables beside them say.
struct Hinted {
    file: Box<dyn ChannelFile>,
    channels: Vec<Channel>,
}

/// Gives channels without a rate or unit that of a variable in their group, or in one above it.
pub(crate) fn hinted(file: Box<dyn ChannelFile>) -> Box<dyn ChannelFile> {
    let lacks = |channel: &Channel| channel.samples > 1 && (channel.rate_hz.is_none() || channel.unit.is_none());
    let hints: Vec<Hint> =
        file.channels().iter().enumerate().filter_map(|(index, channel)| Hint::of(&*file, index, channel)).collect();
    if hints.is_empty() || !file.channels().iter().any(lacks) {
        return file;
    }
    let mut channels = file.channels().to_vec();
    for channel in channels.iter_mut().filter(|channel| lacks(channel)) {
        // The nearest group, which has the longest name.
        let mut above: Vec<&Hint> = hints.iter().filter(|hint| hint.is_above(&channel.group)).collect();
        above.sort_by_key(|hint| std::cmp::Reverse(hint.group.len()));
        let rate_hz = || above.iter().find_map(|hint| hint.rate_hz);
        channel.rate_hz = channel.rate_hz.or_else(rate_hz);
        let unit = || above.iter().find_map(|hint| hint.unit.clone().filter(|_| hint.group == channel.group));
        channel.unit = channel.unit.take().or_else(unit);
    }
    Box::new(Hinted { file, channels })
}

/// Whether a name in lower case is that of a sampling rate in Hz.
pub(crate) fn is_rate(name: &str) -> bool {
    RATES.contains(&name)
}

/// Whether a name in lower case is that of the time from sample to sample in s.
pub(crate) fn is_step(name: &str) -> bool {
    STEPS.contains(&name)
}

/// Whether a channel is named like one of times.
pub(crate) fn is_time(channel: &Channel) -> bool {
    let is_named = TIMES.contains(&channel.name.to_lowercase().as_str());
    let is_seconds =
        channel.unit.as_deref().and_then(unit::known).is_none_or(|unit| matches!(unit, unit::Known::Seconds(_)));
    channel.kind.is_number() && is_named && is_seconds
}

struct Hint {
    group: String,
    rate_hz: Option<f64>,
    unit: Option<String>,
}

impl Hint {
    fn of(file: &dyn ChannelFile, index: usize, channel: &Channel) -> Option<Self> {
        let name = channel.name.to_lowercase();
        let group = channel.group.clone();
        if channel.kind == Kind::Text {
            let text = channel.properties.iter().find(|(key, _)| key == TEXT).map(|(_, text)| text.clone());
            return UNITS.contains(&name.as_str()).then_some(Self { group, rate_hz: None, unit: text });
        }
        let (is_rate, is_step) = (is_rate(&name), is_step(&name));
        if channel.samples != 1 || !channel.kind.is_number() || !(is_rate || is_step) {
            return None;
        }
        let mut column = [Vec::new()];
        file.read(&[index]).ok()?.next(1, &mut column).ok()?;
        let value = column[0].first().copied().filter(|value| value.is_finite() && *value > 0.0)?;
        Some(Self { group, rate_hz: Some(if is_rate { value } else { value.recip() }), unit: None })
    }

    fn is_above(&self, group: &str) -> bool {
        self.group.is_empty() || group == self.group || group.starts_with(&format!("{}/", self.group))
    }
}

impl ChannelFile for Hinted {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        self.file.read(channels)
    }

    fn remarks(&self) -> Vec<String> {
        self.file.remarks()
    }
}
