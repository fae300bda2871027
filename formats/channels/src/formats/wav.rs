//! WAV: RIFF, RIFX and RF64 with whole numbers of 8 to 32 bits or floats of 32 and 64 (Multimedia Programming Interface 1.0;
//! EBU Tech 3306).

use std::sync::Arc;

use runout_core::{Result, input_file::InputFile};

use super::Format;
use crate::{
    bytes::{Bytes, text},
    channel::{Channel, ChannelFile, Kind, Samples, checked},
    strided::{Column, Linear, Run, StridedSamples},
};

pub(super) const FORMAT: Format = Format {
    name: "wav",
    about: "WAV (sound cards, recorders)",
    recognises: |head| {
        matches!(head.get(..4), Some(b"RIFF" | b"RIFX" | b"RF64" | b"BW64")) && head.get(8..12) == Some(b"WAVE")
    },
    open: |input| Wav::open(input).map(|file| Box::new(file) as Box<dyn ChannelFile>),
};

/// Codes of the format chunk (mmreg.h).
const WHOLE: u16 = 1;
const FLOAT: u16 = 3;
const EXTENSIBLE: u16 = 0xFFFE;
/// What a program writes that does not know the length yet.
const UNKNOWN: u64 = 0xFFFF_FFFF;

struct Wav {
    input: InputFile,
    channels: Vec<Channel>,
    runs: Vec<Run>,
    scaling: Option<Linear>,
    remarks: Vec<String>,
}

/// The format chunk.
struct Layout {
    channels: u16,
    rate_hz: u32,
    frame: u16,
    kind: Kind,
    /// Number at full scale.
    scaling: Option<Linear>,
}

impl Wav {
    fn open(input: &InputFile) -> Result<Self> {
        let mut bytes = Bytes::open(&input.into())?;
        let riff = bytes.array::<4>()?;
        bytes.is_big_endian = riff == *b"RIFX";
        bytes.skip(8)?;
        let (mut layout, mut long_data, mut names) = (None, None, Vec::new());
        let (data, length) = loop {
            let (id, stated) = (bytes.array::<4>()?, u64::from(bytes.u32()?));
            let begin = bytes.place();
            match &id {
                b"fmt " => layout = Some(Layout::read(&mut bytes, stated)?),
                b"ds64" => {
                    bytes.skip(8)?;
                    long_data = Some(bytes.u64()?);
                }
                b"LIST" if stated <= 1 << 16 => names = info(&bytes.take(stated.min(bytes.rest()))?),
                b"data" => break (begin, long_data.filter(|_| stated == UNKNOWN).unwrap_or(stated)),
                _ => {}
            }
            // Chunks are padded to an even length.
            bytes.seek(begin.saturating_add(stated + stated % 2))?;
        };
        let layout = layout.ok_or_else(|| bytes.damaged("expected a chunk `fmt ` before the data, found none"))?;
        let present = bytes.length() - data;
        let mut remarks = Vec::new();
        let is_open = length == UNKNOWN || (length == 0 && present > 0);
        if is_open {
            remarks.push(format!(
                "{}: the length of the data is not stated: all to the end are used",
                input.path().display()
            ));
        } else if length > present {
            return Err(bytes.damaged(format!("{length} bytes of samples were declared, the file has {present}")));
        }
        let frames = (if is_open { present } else { length }) / u64::from(layout.frame);
        let width = layout.kind.bytes() as u64;
        let channel = |number: u64| {
            let mut channel = Channel::new("", format!("ch{}", number + 1), layout.kind, frames);
            channel.rate_hz = Some(f64::from(layout.rate_hz));
            channel.limits = layout.scaling.and_then(|scaling| {
                let [low, high] = layout.kind.codes()?;
                Some([low, high].map(|code| code * scaling.gain + scaling.offset))
            });
            channel.properties.clone_from(&names);
            channel
        };
        let run = |number: u64| {
            let offset = data + number * width;
            Run::spaced(offset, frames, layout.frame.into(), layout.kind, bytes.is_big_endian)
        };
        let numbers = 0..u64::from(layout.channels);
        Ok(Self {
            input: input.clone(),
            channels: numbers.clone().map(channel).collect(),
            runs: numbers.map(run).collect(),
            scaling: layout.scaling,
            remarks,
        })
    }
}

impl Layout {
    fn read(bytes: &mut Bytes, length: u64) -> Result<Self> {
        let (tag, channels, rate_hz) = (bytes.u16()?, bytes.u16()?, bytes.u32()?);
        bytes.skip(4)?;
        let (frame, bits) = (bytes.u16()?, bytes.u16()?);
        let tag = if tag == EXTENSIBLE && length >= 40 {
            bytes.skip(8)?;
            bytes.u16()?
        } else {
            tag
        };
        let width = frame.checked_div(channels).unwrap_or(0);
        let kind = match (tag, width) {
            (WHOLE, 1) => Kind::U8,
            (WHOLE, 2) => Kind::I16,
            (WHOLE, 3) => Kind::I24,
            (WHOLE, 4) => Kind::I32,
            (WHOLE, 8) => Kind::I64,
            (FLOAT, 4) => Kind::F32,
            (FLOAT, 8) => Kind::F64,
            _ => {
                let problem = format!(
                    "expected whole numbers of 8 to 64 bits or floats of 32 or 64, found code {tag} with {bits} bits in a frame of {frame} \
                     bytes for {channels} channels"
                );
                return Err(bytes.damaged(problem));
            }
        };
        if frame % channels != 0 || rate_hz == 0 {
            return Err(
                bytes.damaged(format!("expected a rate and whole samples, found {rate_hz} Hz, {frame} bytes a frame"))
            );
        }
        // Full scale is 1, a power of two from the codes: numbers stay exact.
        let scaling = match kind {
            Kind::U8 => Some(Linear { gain: 1.0 / 128.0, offset: -1.0 }),
            Kind::F32 | Kind::F64 => None,
            _ => Some(Linear { gain: 2f64.powi(1 - 8 * i32::from(width)), offset: 0.0 }),
        };
        Ok(Self { channels, rate_hz, frame, kind, scaling })
    }
}

/// Texts of a list chunk: `INFO`, then chunks of four letters, a length and a text.
fn info(bytes: &[u8]) -> Vec<(String, String)> {
    let Some(mut rest) = bytes.strip_prefix(b"INFO") else { return Vec::new() };
    let mut found = Vec::new();
    while let Some((head, behind)) = rest.split_first_chunk::<8>() {
        let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        let value = behind.get(..length.min(behind.len())).unwrap_or_default();
        found.push((text(&head[..4]), text(value)));
        rest = behind.get(length + length % 2..).unwrap_or_default();
    }
    found
}

impl ChannelFile for Wav {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        checked(&self.input.path().display().to_string(), &self.channels, channels)?;
        let scaling = self.scaling.map(|scaling| Arc::new(scaling) as _);
        let column = |channel: &usize| Column { runs: vec![self.runs[*channel]], scaling: scaling.clone() };
        let columns = channels.iter().map(column).collect();
        Ok(Box::new(StridedSamples::open(&(&self.input).into(), columns)?))
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}
