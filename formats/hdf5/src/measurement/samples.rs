//! How samples are stored: floats in µm, or a converter's codes with scale and offset.

use hdf5_metno::{
    Dataset, Group,
    types::{FloatSize, IntSize, TypeDescriptor},
};
use runout_core::Result;

use super::{SENSORS, orientation::Orientation};
use crate::{
    node::{self, Place},
    type_name::type_name,
};

/// How a file's samples are to be written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SampleFormat {
    /// µm in 64 bits.
    F64,
    /// µm in 32 bits: about 7 digits.
    F32,
    /// Codes of 16 bits.
    I16(Scale),
    /// Codes of 32 bits.
    I32(Scale),
}

/// How a converter's codes become micrometres: code · scale + offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// The recording's own converter limits are the lowest and the highest code.
    ConverterLimits,
    /// Given.
    Given {
        /// µm a code.
        scale_um: f64,
        /// µm at code 0.
        offset_um: f64,
    },
}

/// The type of stored samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SampleType {
    F64,
    F32,
    I16,
    I32,
}

impl SampleType {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
            Self::I16 => "i16",
            Self::I32 => "i32",
        }
    }

    /// Lowest and highest code.
    pub(crate) fn code_range(self) -> Option<[f64; 2]> {
        match self {
            Self::F64 | Self::F32 => None,
            Self::I16 => Some([f64::from(i16::MIN), f64::from(i16::MAX)]),
            Self::I32 => Some([f64::from(i32::MIN), f64::from(i32::MAX)]),
        }
    }

    fn of(descriptor: &TypeDescriptor) -> Option<Self> {
        match descriptor {
            TypeDescriptor::Float(FloatSize::U8) => Some(Self::F64),
            TypeDescriptor::Float(FloatSize::U4) => Some(Self::F32),
            TypeDescriptor::Integer(IntSize::U2) => Some(Self::I16),
            TypeDescriptor::Integer(IntSize::U4) => Some(Self::I32),
            _ => None,
        }
    }
}

/// What a file says of its samples.
#[derive(Debug, Clone)]
pub(crate) struct StoredSamples {
    pub(crate) kind: SampleType,
    pub(crate) samples: usize,
    pub(crate) orientation: Orientation,
    /// Names of the channels.
    pub(crate) sensors: Vec<String>,
    /// µm a code, one a channel.
    pub(crate) scale: Vec<f64>,
    /// µm at code 0, one a channel.
    pub(crate) offset: Vec<f64>,
    /// Lowest and highest code that the converter gives.
    pub(crate) limits: Option<[f64; 2]>,
    pub(crate) sample_rate_hz: Option<f64>,
}

impl StoredSamples {
    /// Reads everything but the samples, and checks that it fits together.
    pub(crate) fn read(group: &Group, dataset: &Dataset, place: &Place) -> Result<Self> {
        let descriptor = node::element_type(dataset, place)?;
        let kind = SampleType::of(&descriptor).ok_or_else(|| {
            place.error(format!("expected samples of f64, f32, i16 or i32, found {}", type_name(&descriptor)))
        })?;
        let shape = node::written_shape(dataset, place)?;
        if shape.len() != 2 {
            return Err(place.error(format!("expected the shape [samples, channels], found {shape:?}")));
        }
        if shape.contains(&0) {
            return Err(place.error(format!("expected samples, found the shape {shape:?}")));
        }
        let sensors = names(group, dataset, place, &shape)?;
        let (samples, orientation) = Orientation::of(&shape, sensors.len()).map_err(|problem| place.error(problem))?;
        let channels = sensors.len();
        let integer = kind.code_range().is_some();
        let per_channel = |name: &str, default: f64| -> Result<Vec<f64>> {
            let values = match node::numbers(dataset, place, name)? {
                None if integer => node::needed(None, place, name)?,
                None => vec![default],
                Some(values) => values,
            };
            match values.as_slice() {
                _ if values.iter().any(|value| !value.is_finite()) => {
                    Err(place.error(format!("attribute `{name}`: expected finite numbers, found {values:?}")))
                }
                [one] => Ok(vec![*one; channels]),
                many if many.len() == channels => Ok(values),
                many => Err(place.error(format!(
                    "attribute `{name}`: expected one number, or one for each of {channels} channels, found {}",
                    many.len()
                ))),
            }
        };
        let scale = per_channel("scale", 1.0)?;
        if scale.contains(&0.0) {
            return Err(place.error("attribute `scale`: expected a number other than 0"));
        }
        let limits = match node::numbers(dataset, place, "converter_limits")?.as_deref() {
            None => kind.code_range(),
            Some([low, high]) if low < high => Some([*low, *high]),
            Some(other) => {
                return Err(place.error(format!(
                    "attribute `converter_limits`: expected the lowest and the highest code, found {other:?}"
                )));
            }
        };
        Ok(Self {
            kind,
            samples,
            orientation,
            sensors,
            scale,
            offset: per_channel("offset", 0.0)?,
            limits,
            sample_rate_hz: node::positive(dataset, place, "sample_rate_hz")?,
        })
    }
}

/// Names of the channels: the attribute of the samples, or a dataset beside them, which more programs can write as texts.
fn names(group: &Group, dataset: &Dataset, place: &Place, shape: &[usize]) -> Result<Vec<String>> {
    let found = match node::texts(dataset, place, SENSORS)? {
        None if group.link_exists(SENSORS) => Some(node::texts_of(group, place, SENSORS)?),
        found => found,
    };
    let names = node::needed(found, place, SENSORS)?;
    // A program that writes one text only may list the names in it.
    Ok(match &names[..] {
        [list] if !shape.contains(&1) => listed(list),
        _ => names,
    })
}

/// The names in a text like "S1, S2" or "S1 S2".
fn listed(list: &str) -> Vec<String> {
    let comma = list.contains([',', ';']);
    let names =
        list.split(|character: char| if comma { [',', ';'].contains(&character) } else { character.is_whitespace() });
    names.map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()).collect()
}
