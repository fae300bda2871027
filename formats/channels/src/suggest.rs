//! What a file holds, and a `[load]` table to start from.

use std::{
    collections::BTreeMap,
    fmt::{self, Write as _},
    path::Path,
    sync::Arc,
};

use runout_core::{Result, input_file::InputFile};
use serde::Serialize;

use crate::{
    channel::{Channel, ChannelFile, Samples},
    formats,
    hints::is_time,
    signal::BLOCK,
    unit::{self, Known},
};

/// Readings that are shown of each channel.
const SHOWN: usize = 5;
/// Samples of a channel that are examined for marks.
const LOOKED_AT: usize = 1 << 18;
/// Channels whose samples are examined.
const MOST_CHANNELS: usize = 256;
/// Share of samples that are low or high in a trace of pulses.
const PULSES: f64 = 0.9;
/// Share of the range within which a sample is low or high.
const LEVEL: f64 = 0.2;
/// Names of setups that a rig of a reversal has.
const SETUPS: [&str; 2] = ["initial", "reversed"];

/// What a file of named channels holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelsReport {
    /// Name of the format: "tdms".
    pub format: &'static str,
    /// The channels, in the file's order.
    pub channels: Vec<ChannelReport>,
    /// Path of the channel that looks like the once-per-turn mark or the encoder.
    pub mark: Option<String>,
    /// A `[load]` table to start from.
    pub load: String,
    /// The parts of that `[load]` table.
    #[serde(skip)]
    pub suggestion: Suggestion,
    /// What a reader should know of the file.
    pub remarks: Vec<String>,
}

/// A channel and its first readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelReport {
    /// What the file says of it.
    #[serde(flatten)]
    pub channel: Channel,
    /// Its first readings.
    pub first: Vec<f64>,
}

/// How a channel gives the angle.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Turning {
    Pulses { threshold: f64, hysteresis: f64 },
    Angle,
}

/// A `[load]` table to start from.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Suggestion {
    /// The file, as the table names it.
    pub path: String,
    /// Setups with their groups; empty where the file has no groups that are alike.
    pub setups: Vec<[String; 2]>,
    /// Sensors with their channels.
    pub channels: Vec<[String; 2]>,
    /// The lines behind: mark, unit, rate.
    pub rest: String,
}

impl Suggestion {
    /// The suggestion with a rig's own setups and sensors, in their order; what the rig has no name for becomes a comment.
    #[must_use]
    pub fn for_rig(mut self, setups: &[&str], sensors: &[&str]) -> Self {
        let mut comments = String::new();
        if self.setups.is_empty() && setups.len() > 1 {
            comments.push_str("# with a file for each setup of the rig: pattern = \"{setup}.…\" in place of path\n");
        }
        for (what, entries, names) in [("groups", &mut self.setups, setups), ("channels", &mut self.channels, sensors)]
        {
            let more: Vec<String> = entries.iter().skip(names.len()).map(|[_, name]| quoted(name)).collect();
            if !more.is_empty() {
                let _ = writeln!(comments, "# {what} of the file that the rig does not have: {}", more.join(", "));
            }
            if !entries.is_empty() && entries.len() < names.len() {
                let _ = writeln!(
                    comments,
                    "# the rig has more than the {} {what} that were found in the file",
                    entries.len()
                );
            }
            entries.truncate(names.len());
            entries.iter_mut().zip(names).for_each(|(entry, name)| (*name).clone_into(&mut entry[0]));
        }
        self.rest.push_str(&comments);
        self
    }
}

impl fmt::Display for Suggestion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let entries = |entries: &[[String; 2]]| {
            let entry = |[name, of]: &[String; 2]| format!("{} = {}", key(name), quoted(of));
            entries.iter().map(entry).collect::<Vec<_>>().join(", ")
        };
        writeln!(f, "[load]\nplugin = \"channels\"\npath = {}", quoted(&self.path))?;
        if !self.setups.is_empty() {
            writeln!(f, "setups = {{ {} }}", entries(&self.setups))?;
        }
        writeln!(f, "channels = {{ {} }}", entries(&self.channels))?;
        f.write_str(&self.rest)
    }
}

/// Looks into a file; nothing where it is of none of the formats.
///
/// # Errors
/// When it is of one of them and damaged, or cannot be read.
pub fn inspect(path: &Path) -> Result<Option<ChannelsReport>> {
    let input = InputFile::new(path)?;
    let Ok(format) = formats::format_of(&input, None) else { return Ok(None) };
    let file: Arc<dyn ChannelFile> = match formats::open(&input, Some(format.name)) {
        Ok(file) => file.into(),
        // Nothing at its beginning says that a text is a table.
        Err(_) if format.name == formats::TEXT => return Ok(None),
        Err(error) => return Err(error),
    };
    let mut channels = Vec::with_capacity(file.channels().len());
    let mut turning: Vec<Option<Turning>> = Vec::new();
    for (index, channel) in file.channels().iter().enumerate() {
        let wanted = if index < MOST_CHANNELS { LOOKED_AT } else { 0 };
        let values = if channel.kind.is_number() { beginning(&*file, index, wanted)? } else { Vec::new() };
        turning.push(if is_time(channel) { None } else { turning_of(channel, &values) });
        channels.push(ChannelReport { channel: channel.clone(), first: values.into_iter().take(SHOWN).collect() });
    }
    let mark = best_mark(file.channels(), &turning);
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let suggestion = table(&name, file.channels(), mark.map(|(index, turning)| (&file.channels()[index], turning)));
    let mark = mark.map(|(index, _)| file.channels()[index].path());
    let (load, remarks) = (suggestion.to_string(), file.remarks());
    Ok(Some(ChannelsReport { format: format.name, channels, mark, load, suggestion, remarks }))
}

fn beginning(file: &dyn ChannelFile, index: usize, wanted: usize) -> Result<Vec<f64>> {
    let mut column = [Vec::new()];
    let mut samples: Box<dyn Samples> = file.read(&[index])?;
    while column[0].len() < wanted && samples.next(BLOCK.min(wanted), &mut column)? > 0 {}
    let [values] = column;
    Ok(values)
}

/// Of all that look like marks, one that is named like one, or else the first.
fn best_mark(channels: &[Channel], turning: &[Option<Turning>]) -> Option<(usize, Turning)> {
    let found = || turning.iter().enumerate().filter_map(|(index, turning)| Some((index, (*turning)?)));
    found().find(|(index, _)| is_mark(&channels[*index].path())).or_else(|| found().next())
}

/// Whether a name is one of marks and encoders.
fn is_mark(name: &str) -> bool {
    let name = name.to_lowercase();
    ["index", "mark", "trig", "tach", "key", "once", "enc", "angle", "winkel", "pulse", "z-"]
        .iter()
        .any(|word| name.contains(word))
}

/// How a channel gives the angle, by its name's and unit's hint and its samples.
fn turning_of(channel: &Channel, values: &[f64]) -> Option<Turning> {
    if values.len() < 16 || values.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    let range = high - low;
    if range <= 0.0 {
        return None;
    }
    let is_angle = matches!(channel.unit.as_deref().and_then(unit::known), Some(Known::Turns(_)));
    let steps = values.windows(2).map(|pair| pair[1] - pair[0]);
    let (mut up, mut down) = (0_usize, 0_usize);
    for step in steps {
        up += usize::from(step > 0.0);
        down += usize::from(step < 0.0);
    }
    // A saw tooth falls once a turn; an unwrapped angle never.
    let is_saw = up.min(down) * 16 <= up.max(down) && up + down > values.len() / 4;
    if is_saw && (is_angle || is_mark(&channel.name)) {
        return Some(Turning::Angle);
    }
    let level = |value: &f64| {
        let share = (value - low) / range;
        if share < LEVEL { Some(false) } else { (share > 1.0 - LEVEL).then_some(true) }
    };
    let levels: Vec<bool> = values.iter().filter_map(level).collect();
    let rises = levels.windows(2).filter(|pair| !pair[0] && pair[1]).count();
    let is_trace = levels.len() as f64 >= PULSES * values.len() as f64 && rises >= 2;
    is_trace.then(|| Turning::Pulses { threshold: rounded(low + 0.5 * range), hysteresis: rounded(0.25 * range) })
}

/// Three digits, as a person would state a threshold.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// The table for the file.
fn table(file: &str, channels: &[Channel], mark: Option<(&Channel, Turning)>) -> Suggestion {
    let mut text = String::new();
    let is_signal = |channel: &Channel| channel.kind.is_number() && channel.samples > 1 && !is_time(channel);
    // Where groups have one channel each, of one name, the groups are the channels.
    let mut signals = channels.iter().filter(|channel| is_signal(channel));
    let one_name = signals.next().filter(|first| signals.all(|channel| channel.name == first.name));
    let by_group = one_name.is_some() && channels.iter().filter(|channel| is_signal(channel)).count() > 1;
    let is_mark = |channel: &Channel| {
        mark.is_some_and(|(mark, _)| mark.name == channel.name && (!by_group || mark.group == channel.group))
    };
    let is_sensor = |channel: &&Channel| is_signal(channel) && !is_mark(channel);
    let sensors: Vec<&Channel> = channels.iter().filter(is_sensor).collect();
    // Channels that one group has are those of all: setups have the same.
    let mut groups: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    let mut order = Vec::new();
    for channel in &sensors {
        let names = groups.entry(&channel.group).or_default();
        if names.is_empty() {
            order.push(channel.group.as_str());
        }
        names.push(&channel.name);
    }
    let first = order.first().copied().unwrap_or_default();
    let names = groups.get(first).cloned().unwrap_or_default();
    let alike: Vec<&str> = order.iter().copied().filter(|group| groups.get(group) == Some(&names)).collect();
    let has_setups = alike.len() > 1 && !by_group;
    let id = |number: usize| {
        SETUPS
            .get(number)
            .filter(|_| alike.len() == 2)
            .map_or_else(|| format!("setup-{}", number + 1), |id| (*id).to_owned())
    };
    let alike_groups = alike.iter().enumerate().filter(|_| has_setups);
    let setups = alike_groups.map(|(number, group)| [id(number), (*group).to_owned()]).collect();
    let is_unique = |name: &str| channels.iter().filter(|channel| channel.name == name).count() == 1;
    let path = |channel: &Channel| {
        if has_setups || is_unique(&channel.name) { channel.name.clone() } else { channel.path() }
    };
    let chosen: Vec<&Channel> = sensors.iter().copied().filter(|channel| by_group || channel.group == first).collect();
    let entry = |(number, channel): (usize, &&Channel)| [format!("S{}", number + 1), path(channel)];
    let sensors = chosen.iter().enumerate().map(entry).collect();
    match mark {
        Some((mark, Turning::Angle)) => {
            let unit = mark.unit.clone().filter(|unit| unit::known(unit).is_some()).unwrap_or_else(|| "deg".into());
            let _ = writeln!(text, "angle = {{ channel = {}, unit = {} }}", quoted(&path(mark)), quoted(&unit));
        }
        Some((mark, Turning::Pulses { threshold, hysteresis })) => {
            let _ = writeln!(
                text,
                "marker = {{ channel = {}, threshold = {threshold:?}, hysteresis = {hysteresis:?}, edge = \"rising\" }}",
                quoted(&path(mark))
            );
        }
        None => text.push_str("# the channel of the once-per-turn mark was not found: marker = { channel = \"…\" }\n"),
    }
    let units = || chosen.iter().map(|channel| channel.unit.as_deref().and_then(unit::known));
    if units().any(|unit| unit.is_none()) {
        text.push_str("# the file has no unit for all of them; write theirs\nunit = \"um\"\n");
    }
    if units().any(|unit| matches!(unit, Some(Known::Volts(_)))) {
        text.push_str("# voltages: give the sensors of [rig] unit = \"V\" and um_per_volt\n");
    }
    let has_time = channels.iter().any(|channel| channel.group == first && is_time(channel));
    if !has_time && chosen.iter().any(|channel| channel.rate_hz.is_none()) {
        text.push_str("# the file has no sampling rate; write yours\n# sample_rate_hz = 5120\n");
    }
    Suggestion { path: file.to_owned(), setups, channels: sensors, rest: text }
}

/// A key of TOML.
fn key(name: &str) -> String {
    let is_bare =
        !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-'));
    if is_bare { name.to_owned() } else { quoted(name) }
}

/// A text of TOML.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
