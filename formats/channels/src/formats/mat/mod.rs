//! MAT files of MATLAB: version 5 and 7 (MathWorks, MAT-File Format), version 4, and 7.3, which is HDF5.

mod version4;
mod version5;

use runout_core::{Result, input_file::InputFile};

use super::Format;
use crate::{
    channel::{Channel, ChannelFile, Kind, Samples, checked},
    lines::lines,
    source::Source,
    strided::{Column, Run, StridedSamples},
};

pub(super) const FORMAT: Format = Format {
    name: "mat",
    about: "MAT (MATLAB, PicoScope, Testlab)",
    recognises: |head| head.starts_with(b"MATLAB ") || version5::recognises(head) || version4::recognises(head),
    open,
};

fn open(input: &InputFile) -> Result<Box<dyn ChannelFile>> {
    let mut head = Vec::new();
    let read = std::io::Read::read_to_end(&mut std::io::Read::take(input.open()?, 128), &mut head);
    read.map_err(|error| runout_core::Error::caused("read", input.path().display().to_string(), error))?;
    if head.starts_with(b"MATLAB 7.3") {
        return Ok(Box::new(super::hdf5::open(input)?));
    }
    Ok(Box::new(if version5::recognises(&head) { version5::open(input)? } else { version4::open(input)? }))
}

/// The variables of a file, as channels.
struct Variables {
    source: Source,
    channels: Vec<Channel>,
    runs: Vec<Run>,
    remarks: Vec<String>,
}

/// A matrix of numbers somewhere in the bytes, column by column.
struct Matrix {
    group: String,
    name: String,
    shape: Vec<u64>,
    /// Of the class, which may be stored as a smaller one.
    kind: Kind,
    first: Run,
}

impl Variables {
    fn of(source: Source) -> Self {
        Self { source, channels: Vec::new(), runs: Vec::new(), remarks: Vec::new() }
    }

    fn add(&mut self, matrix: &Matrix) {
        let width = matrix.first.kind.bytes() as u64;
        let mut strides = Vec::with_capacity(matrix.shape.len());
        let mut stride = width;
        for extent in &matrix.shape {
            strides.push(stride);
            stride = stride.saturating_mul(*extent);
        }
        for line in lines(&matrix.shape, &strides).unwrap_or_default() {
            let mut channel =
                Channel::new(&*matrix.group, matrix.name.clone() + &line.suffix, matrix.kind, line.samples);
            channel.limits = matrix.kind.codes();
            self.channels.push(channel);
            let Run { offset, kind, is_big_endian, .. } = matrix.first;
            self.runs.push(Run::spaced(
                offset + line.offset,
                line.samples,
                line.stride.max(width),
                kind,
                is_big_endian,
            ));
        }
    }

    /// A variable that is no numbers.
    fn add_text(&mut self, group: &str, name: &str, text: Option<String>) {
        let kind = if text.is_some() { Kind::Text } else { Kind::Other };
        let mut channel = Channel::new(group, name, kind, 1);
        channel.properties.extend(text.map(|text| (crate::hints::TEXT.to_owned(), text)));
        self.channels.push(channel);
        self.runs.push(Run::dense(0, 0, Kind::U8, false));
    }
}

impl ChannelFile for Variables {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        checked(&self.source.shown(), &self.channels, channels)?;
        let column = |channel: &usize| Column { runs: vec![self.runs[*channel]], scaling: None };
        Ok(Box::new(StridedSamples::open(&self.source, channels.iter().map(column).collect())?))
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// Bytes that a matrix takes; `None` beyond all files.
fn bytes_of(shape: &[u64], width: u64) -> Option<u64> {
    shape.iter().try_fold(width, |product, extent| product.checked_mul(*extent))
}
