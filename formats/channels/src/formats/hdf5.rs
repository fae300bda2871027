//! HDF5 files of other programs: one dataset a channel or a column, tables of records, and MATLAB's 7.3.

use std::path::Path;

use runout_core::{Result, input_file::InputFile};
use runout_hdf5::{AttributeValue, Attributes, ForeignDataset, ForeignFile};

use super::Format;
use crate::{
    channel::{Channel, ChannelFile, Kind, Samples, checked},
    hints::{self, is_rate, is_step},
    lines::{Line, lines},
};

pub(super) const FORMAT: Format = Format {
    name: "hdf5",
    about: "HDF5 (h5py, exports of Dewesoft, HBM, imc)",
    // Before the signature there may be a block of the user, of 512 bytes or more.
    recognises: |head| {
        [0, 512, 1024, 2048].iter().any(|at| head.get(*at..).is_some_and(|head| head.starts_with(SIGNATURE)))
    },
    open: |input| open(input).map(|file| Box::new(file) as Box<dyn ChannelFile>),
};

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Names of attributes, in lower case.
const GAINS: [&str; 5] = ["gain", "scale", "scale_factor", "slope", "factor"];
const OFFSETS: [&str; 3] = ["offset", "add_offset", "intercept"];
const UNITS: [&str; 6] = ["unit", "units", "unit_string", "einheit", "engineering_units", "ni_unitdescription"];
const STARTS: [&str; 5] = ["start_s", "t0", "wf_start_offset", "start_time_s", "trigger_offset_s"];
/// Samples that are read at a time, at least.
const BLOCK: usize = 1 << 15;
/// Samples that are read at a time where chunks are larger.
const MOST: usize = 1 << 22;

struct Hdf5 {
    shown: String,
    file: ForeignFile,
    channels: Vec<Channel>,
    parts: Vec<Part>,
}

/// Where the numbers of a channel are.
#[derive(Debug, Clone)]
struct Part {
    dataset: usize,
    field: Option<String>,
    line: Line,
    gain: f64,
    offset: f64,
}

pub(super) fn open(input: &InputFile) -> Result<impl ChannelFile + use<>> {
    let path: &Path = input.path();
    let file = ForeignFile::open(path)?;
    let mut found = Hdf5 { shown: path.display().to_string(), file, channels: Vec::new(), parts: Vec::new() };
    for dataset in 0..found.file.datasets.len() {
        found.dataset(dataset);
    }
    Ok(found)
}

impl Hdf5 {
    fn dataset(&mut self, number: usize) {
        let dataset = &self.file.datasets[number];
        let (name, group) = dataset
            .path
            .split_last()
            .map_or((String::new(), String::new()), |(name, group)| (name.clone(), group.join("/")));
        let shape: Vec<u64> = dataset.shape.iter().map(|extent| *extent as u64).collect();
        // Distances do not matter: numbers are asked for by their place.
        let found = lines(&shape, &vec![0; shape.len()]).unwrap_or_default();
        let (mut channels, mut parts) = (Vec::new(), Vec::new());
        if dataset.numbers.is_empty() || dataset.text.is_some() {
            let mut channel =
                Channel::new(&*group, &*name, if dataset.text.is_some() { Kind::Text } else { Kind::Other }, 1);
            channel.properties.extend(dataset.text.clone().map(|text| (hints::TEXT.to_owned(), text)));
            channels.push(channel);
            let line = Line { suffix: String::new(), samples: 0, offset: 0, stride: 0, time: 0, at: 0 };
            parts.push(Part { dataset: number, field: None, line, gain: 1.0, offset: 0.0 });
        } else {
            for line in &found {
                for (field, kind) in &dataset.numbers {
                    let (group, plain) = match field {
                        None => (group.clone(), name.clone()),
                        Some(field) if group.is_empty() => (name.clone(), field.clone()),
                        Some(field) => (format!("{group}/{name}"), field.clone()),
                    };
                    let mut channel = Channel::new(group, plain + &line.suffix, kind_of(kind), line.samples);
                    self.describe(dataset, &mut channel);
                    let of = |names: &[&str], default: f64| {
                        let values = numbers(&dataset.attributes, names).unwrap_or_default();
                        // One for all, or one a column.
                        match values[..] {
                            [one] => one,
                            _ => values
                                .get(line.at as usize)
                                .copied()
                                .filter(|_| values.len() == found.len())
                                .unwrap_or(default),
                        }
                    };
                    let (gain, offset) = (of(&GAINS, 1.0), of(&OFFSETS, 0.0));
                    channel.limits = channel.kind.codes().map(|codes| {
                        let [one, other] = codes.map(|code| code * gain + offset);
                        [one.min(other), one.max(other)]
                    });
                    channels.push(channel);
                    parts.push(Part { dataset: number, field: field.clone(), line: line.clone(), gain, offset });
                }
            }
        }
        self.channels.append(&mut channels);
        self.parts.append(&mut parts);
    }

    /// What attributes say: the dataset's own, or those of a group above it.
    fn describe(&self, dataset: &ForeignDataset, channel: &mut Channel) {
        let above = |levels: usize| {
            self.file
                .groups
                .iter()
                .find(|(path, _)| path[..] == dataset.path[..levels])
                .map(|(_, attributes)| attributes)
        };
        let all: Vec<&Attributes> =
            std::iter::once(&dataset.attributes).chain((0..dataset.path.len()).rev().filter_map(above)).collect();
        channel.unit = all.iter().take(2).find_map(|attributes| text(attributes, &UNITS));
        let one = |attributes: &[(String, AttributeValue)], is_wanted: fn(&str) -> bool| {
            let found = attributes.iter().find(|(name, _)| is_wanted(&name.to_lowercase()));
            match found.map(|(_, value)| value) {
                Some(AttributeValue::Numbers(numbers)) if numbers.len() == 1 && numbers[0] > 0.0 => Some(numbers[0]),
                _ => None,
            }
        };
        channel.rate_hz = all
            .iter()
            .find_map(|attributes| one(attributes, is_rate).or_else(|| one(attributes, is_step).map(f64::recip)));
        channel.start_s = all.iter().find_map(|attributes| numbers(attributes, &STARTS)?.first().copied());
        let shown = |(name, value): &(String, AttributeValue)| match value {
            AttributeValue::Text(text) => (name.clone(), text.clone()),
            AttributeValue::Numbers(numbers) => (name.clone(), format!("{numbers:?}")),
        };
        channel.properties = dataset.attributes.iter().map(shown).collect();
    }
}

impl ChannelFile for Hdf5 {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        checked(&self.shown, &self.channels, channels)?;
        let mut columns = Vec::with_capacity(channels.len());
        for channel in channels {
            let part = self.parts[*channel].clone();
            let dataset = self.file.datasets[part.dataset].clone();
            dataset.check()?;
            // Whole chunks at a time, so that none is unpacked twice.
            let chunk = dataset.chunk(part.line.time).clamp(1, MOST);
            let ahead = BLOCK.next_multiple_of(chunk);
            columns.push(Rows { dataset, part, ahead, next: 0, values: Vec::new(), used: 0 });
        }
        Ok(Box::new(Hdf5Samples(columns)))
    }
}

struct Hdf5Samples(Vec<Rows>);

/// A channel from some place on.
struct Rows {
    dataset: ForeignDataset,
    part: Part,
    /// Samples that are read at a time.
    ahead: usize,
    next: usize,
    values: Vec<f64>,
    used: usize,
}

impl Samples for Hdf5Samples {
    fn next(&mut self, most: usize, columns: &mut [Vec<f64>]) -> Result<usize> {
        let mut longest = 0;
        for (rows, column) in self.0.iter_mut().zip(columns) {
            let before = column.len();
            while column.len() - before < most && rows.fill()? {
                let taken = (most - (column.len() - before)).min(rows.values.len() - rows.used);
                column.extend_from_slice(&rows.values[rows.used..rows.used + taken]);
                rows.used += taken;
            }
            longest = longest.max(column.len() - before);
        }
        Ok(longest)
    }
}

impl Rows {
    /// Reads on where all values were used; false at the end.
    fn fill(&mut self) -> Result<bool> {
        if self.used < self.values.len() {
            return Ok(true);
        }
        let Part { field, line, gain, offset, .. } = &self.part;
        let end = (self.next + self.ahead).min(line.samples as usize);
        if end == self.next {
            return Ok(false);
        }
        let across = self.dataset.shape.iter().enumerate();
        let at: Vec<usize> = across
            .map(|(dimension, extent)| if dimension == line.time || *extent == 1 { 0 } else { line.at as usize })
            .collect();
        self.values = self.dataset.read(field.as_deref(), line.time, &at, self.next..end)?;
        if (*gain, *offset) != (1.0, 0.0) {
            self.values.iter_mut().for_each(|value| *value = *value * gain + offset);
        }
        (self.next, self.used) = (end, 0);
        Ok(!self.values.is_empty())
    }
}

fn kind_of(name: &str) -> Kind {
    match name {
        "u8" => Kind::U8,
        "i8" => Kind::I8,
        "u16" => Kind::U16,
        "i16" => Kind::I16,
        "u32" => Kind::U32,
        "i32" => Kind::I32,
        "u64" => Kind::U64,
        "i64" => Kind::I64,
        "f32" => Kind::F32,
        "bool" => Kind::Bool,
        _ => Kind::F64,
    }
}

fn find<'a>(attributes: &'a [(String, AttributeValue)], names: &[&str]) -> Option<&'a AttributeValue> {
    attributes.iter().find(|(name, _)| names.contains(&name.to_lowercase().as_str())).map(|(_, value)| value)
}

fn numbers(attributes: &[(String, AttributeValue)], names: &[&str]) -> Option<Vec<f64>> {
    match find(attributes, names)? {
        AttributeValue::Numbers(numbers) if numbers.iter().all(|number| number.is_finite()) => Some(numbers.clone()),
        _ => None,
    }
}

fn text(attributes: &[(String, AttributeValue)], names: &[&str]) -> Option<String> {
    match find(attributes, names)? {
        AttributeValue::Text(text) if !text.is_empty() => Some(text.clone()),
        _ => None,
    }
}
