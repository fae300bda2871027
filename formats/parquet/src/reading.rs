//! The table of averaged readings, for layouts that separate nothing.

use std::{iter::repeat_n, sync::Arc};

use arrow_array::{ArrayRef, StringArray};
use arrow_schema::Schema;
use runout_core::{
    Complex64,
    evaluate::reading::{coefficients, variances},
    numerics::fourier::Fourier,
    pipeline::run::StationResult,
    rig::Rig,
};

use crate::columns::{angles_deg, number, numbers, text};

/// Columns of `reading.parquet`.
pub fn schema() -> Schema {
    Schema::new(vec![
        text("station", false, "name of the axial station"),
        text("setup", false, "id of the setup"),
        text("sensor", false, "id of the sensor"),
        number("angle_deg", "deg", "the spindle's angle"),
        number("reading_um", "um", "averaged reading without its level: form, eccentricity and error motion together"),
        number(
            "std_um",
            "um",
            "standard uncertainty of reading_um at any one angle, from the scatter; NaN if not known",
        ),
    ])
}

/// One station's rows of `reading.parquet`.
pub fn rows(result: &StationResult, rig: Option<&Rig>) -> Vec<ArrayRef> {
    let angles = result.angles;
    let channels = || {
        result.profiles.iter().flat_map(|profile| {
            profile.sensors.iter().enumerate().map(move |(channel, sensor)| (profile, channel, *sensor))
        })
    };
    let count = channels().count();
    let setup = |index: usize| rig.and_then(|rig| rig.setups.get(index)).map(|setup| setup.id.clone());
    let sensor = |index: usize| rig.and_then(|rig| rig.sensors.get(index)).map(|sensor| sensor.id.clone());
    let mut fourier = Fourier::new(angles);
    let mut readings = Vec::with_capacity(count * angles);
    for (profile, channel, _) in channels() {
        let mean = coefficients(profile, channel).into_iter().enumerate();
        let without_level = mean.map(|(order, value)| if order == 0 { Complex64::ZERO } else { value.conj() });
        readings.extend_from_slice(fourier.synthesise(without_level));
    }
    let std = |all: Option<Vec<f64>>| all.map_or(f64::NAN, |all| (0.5 * all.iter().skip(1).sum::<f64>()).sqrt());
    let texts = |ids: Vec<String>| -> ArrayRef {
        Arc::new(StringArray::from_iter_values(ids.iter().flat_map(|id| repeat_n(id.as_str(), angles))))
    };
    vec![
        texts(vec![result.station.clone(); count]),
        texts(channels().map(|(profile, ..)| setup(profile.setup).unwrap_or_default()).collect()),
        texts(channels().map(|(.., index)| sensor(index).unwrap_or_default()).collect()),
        numbers((0..count).flat_map(|_| angles_deg(angles))),
        numbers(readings),
        numbers(channels().flat_map(|(profile, channel, _)| repeat_n(std(variances(profile, channel)), angles))),
    ]
}
