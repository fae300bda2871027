//! From readings to stored numbers.

use hdf5_metno::H5Type;
use runout_core::{Error, Result, measurement::Capture};

use super::samples::{SampleFormat, SampleType, Scale};

/// How readings become stored numbers: (reading · sign − offset) / scale.
pub(super) struct Coding {
    pub(super) kind: SampleType,
    pub(super) scale: Vec<f64>,
    pub(super) offset: Vec<f64>,
    /// Lowest and highest code, where the converter does not use the type's whole range.
    pub(super) limits: Option<[i64; 2]>,
}

impl Coding {
    pub(super) fn new(format: SampleFormat, capture: &Capture, signs: &[f64]) -> Result<Self> {
        let channels = capture.channels();
        let (kind, scale) = match format {
            SampleFormat::F64 => (SampleType::F64, None),
            SampleFormat::F32 => (SampleType::F32, None),
            SampleFormat::I16(scale) => (SampleType::I16, Some(scale)),
            SampleFormat::I32(scale) => (SampleType::I32, Some(scale)),
        };
        let (Some(scale), Some([low, high])) = (scale, kind.code_range()) else {
            return Ok(Self { kind, scale: vec![1.0; channels], offset: vec![0.0; channels], limits: None });
        };
        let limits_um = capture.converter_limits_um.as_deref().filter(|limits| limits.len() == channels);
        match scale {
            Scale::Given { scale_um, offset_um } => {
                if !(scale_um.is_finite() && scale_um != 0.0 && offset_um.is_finite()) {
                    return Err(Error::new("write", &capture.object, "expected a finite scale other than 0"));
                }
                let scale = vec![scale_um; channels];
                let offset = vec![offset_um; channels];
                let limits = limits_um.and_then(|limits_um| limit_codes(limits_um, signs, scale_um, offset_um));
                Ok(Self { kind, scale, offset, limits })
            }
            Scale::ConverterLimits => {
                let limits_um = limits_um.ok_or_else(|| {
                    Error::new("write", &capture.object, format!("{} needs the converter's limits", kind.name()))
                        .help("give the scale, or write f64")
                })?;
                let raw = limits_um.iter().zip(signs).map(|([one, other], sign)| {
                    let (one, other) = (one * sign, other * sign);
                    (one.min(other), one.max(other))
                });
                let (mut scales, mut offsets) = (Vec::with_capacity(channels), Vec::with_capacity(channels));
                for (low_um, high_um) in raw {
                    let scale = (high_um - low_um) / (high - low);
                    if !(scale.is_finite() && scale > 0.0) {
                        let problem = format!("its converter's limits {low_um} and {high_um} µm span no range");
                        return Err(Error::new("write", &capture.object, problem));
                    }
                    scales.push(scale);
                    offsets.push(low_um - low * scale);
                }
                Ok(Self { kind, scale: scales, offset: offsets, limits: None })
            }
        }
    }

    /// The code of a reading with its sensor's own sign, before it is rounded.
    pub(super) fn code(&self, raw_um: f64, channel: usize) -> f64 {
        (raw_um - self.offset[channel]) / self.scale[channel]
    }
}

/// The converter's limits in codes, where all channels have the same.
fn limit_codes(limits_um: &[[f64; 2]], signs: &[f64], scale_um: f64, offset_um: f64) -> Option<[i64; 2]> {
    let codes = |([one, other], sign): (&[f64; 2], &f64)| {
        let [one, other] = [one, other].map(|limit_um| ((limit_um * sign - offset_um) / scale_um).round() as i64);
        [one.min(other), one.max(other)]
    };
    let mut all = limits_um.iter().zip(signs).map(codes);
    let first = all.next()?;
    all.all(|other| other == first).then_some(first)
}

/// A stored number.
pub(super) trait Code: H5Type + Copy {
    /// `None` where the value has none.
    fn of(value: f64) -> Option<Self>;
}

impl Code for f64 {
    fn of(value: f64) -> Option<Self> {
        Some(value)
    }
}

impl Code for f32 {
    fn of(value: f64) -> Option<Self> {
        let near = value as f32;
        (near.is_finite() || !value.is_finite()).then_some(near)
    }
}

impl Code for i16 {
    fn of(value: f64) -> Option<Self> {
        let near = value.round();
        (f64::from(Self::MIN)..=f64::from(Self::MAX)).contains(&near).then_some(near as Self)
    }
}

impl Code for i32 {
    fn of(value: f64) -> Option<Self> {
        let near = value.round();
        (f64::from(Self::MIN)..=f64::from(Self::MAX)).contains(&near).then_some(near as Self)
    }
}
