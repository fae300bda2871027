//! TDMS of LabVIEW, DAQmx, FlexLogger and DIAdem: segments of metadata and raw data (National Instruments, TDMS File Format Internal
//! Structure).

mod metadata;
mod scale;
mod segments;

use std::{collections::HashMap, sync::Arc};

use runout_core::{Result, input_file::InputFile};

use self::{metadata::Value, scale::Chain, segments::Segments};
use super::Format;
use crate::{
    channel::{Channel, ChannelFile, Kind, Samples, checked},
    strided::{Column, Run, StridedSamples},
};

pub(super) const FORMAT: Format = Format {
    name: "tdms",
    about: "TDMS (LabVIEW, DAQmx, FlexLogger, DIAdem)",
    recognises: |head| head.starts_with(b"TDSm"),
    open: |input| Tdms::open(input).map(|file| Box::new(file) as Box<dyn ChannelFile>),
};

/// Properties of a group or a channel.
type Properties = HashMap<String, Value>;

struct Tdms {
    input: InputFile,
    channels: Vec<Channel>,
    /// Of each channel.
    data: Vec<Data>,
    remarks: Vec<String>,
}

/// Where the numbers of a channel are.
struct Data {
    runs: Vec<Run>,
    scaling: Option<Chain>,
}

impl Tdms {
    fn open(input: &InputFile) -> Result<Self> {
        let Segments { objects, remarks, .. } = Segments::read(input)?;
        let mut file = Self { input: input.clone(), channels: Vec::new(), data: Vec::new(), remarks };
        let empty = Properties::new();
        let above: HashMap<String, &Properties> =
            objects.iter().map(|object| (object.path.clone(), &object.properties)).collect();
        for object in &objects {
            let names = names_of(&object.path);
            let [group, name] = &names[..] else { continue };
            let of_group = above.get(&format!("/{}", quoted(group))).copied().unwrap_or(&empty);
            let of_file = above.get("/").copied().unwrap_or(&empty);
            let mut channel = Channel::new(group, name, object.kind, object.samples());
            let property = |name: &str| object.properties.get(name);
            let number = |name: &str| property(name).and_then(Value::number);
            let unit =
                ["unit_string", "NI_UnitDescription"].iter().find_map(|name| property(name).and_then(Value::text));
            channel.unit = unit.filter(|unit| !unit.is_empty());
            channel.rate_hz = number("wf_increment").filter(|step| *step > 0.0 && step.is_finite()).map(f64::recip);
            channel.start_s = number("wf_start_offset");
            channel.properties = listed(&object.properties);
            let scaling = match Chain::of([&object.properties, of_group, of_file], &object.scalers) {
                Ok(scaling) => scaling,
                Err(problem) => {
                    file.remarks.push(format!("{}: {problem}: its numbers are those of the converter", channel.path()));
                    channel.unit = None;
                    None
                }
            };
            channel.limits = object.runs.first().and_then(|run| run.kind.codes()).and_then(|codes| {
                let mut limits = codes.to_vec();
                if let Some(scaling) = &scaling {
                    crate::strided::Scaling::apply(scaling, &mut limits);
                }
                let [low, high] = [limits[0].min(limits[1]), limits[0].max(limits[1])];
                (low.is_finite() && high.is_finite()).then_some([low, high])
            });
            let scaling = scaling.filter(|_| channel.kind != Kind::Text);
            file.data.push(Data { runs: object.runs.clone(), scaling });
            file.channels.push(channel);
        }
        Ok(file)
    }
}

impl ChannelFile for Tdms {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        checked(&self.input.path().display().to_string(), &self.channels, channels)?;
        let column = |channel: &usize| {
            let Data { runs, scaling } = &self.data[*channel];
            Column { runs: runs.clone(), scaling: scaling.clone().map(|chain| Arc::new(chain) as _) }
        };
        Ok(Box::new(StridedSamples::open(&(&self.input).into(), channels.iter().map(column).collect())?))
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// The names in a path like `/'Group'/'It''s a channel'`.
fn names_of(path: &str) -> Vec<String> {
    let (mut names, mut rest) = (Vec::new(), path);
    while let Some(behind) = rest.strip_prefix("/'") {
        let (mut name, mut from) = (String::new(), behind);
        rest = loop {
            let Some((before, after)) = from.split_once('\'') else {
                name.push_str(from);
                break "";
            };
            name.push_str(before);
            match after.strip_prefix('\'') {
                Some(after) => {
                    name.push('\'');
                    from = after;
                }
                None => break after,
            }
        };
        names.push(name);
    }
    names
}

fn quoted(name: &str) -> String {
    format!("'{}'", name.replace('\'', "''"))
}

/// Properties for people, but those of scales, which are applied.
fn listed(properties: &Properties) -> Vec<(String, String)> {
    let shown = properties.iter().filter(|(name, _)| !name.starts_with("NI_Scale"));
    let mut listed: Vec<(String, String)> = shown.map(|(name, value)| (name.clone(), value.to_string())).collect();
    listed.sort();
    listed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_hold_quoted_names() {
        assert_eq!(names_of("/'Run 0'/'It''s / here'"), ["Run 0", "It's / here"]);
        assert_eq!(names_of("/"), Vec::<String>::new());
        assert_eq!(names_of("/'a"), ["a"]);
        assert_eq!(quoted("It's"), "'It''s'");
    }
}
