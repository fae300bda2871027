//! The table of averaged readings.

use std::iter::repeat_n;

use super::{STATION, angles_deg, std_of};
use runout_numerics::{Complex64, fourier::Fourier};
use runout_table::{ArrayRef, ColumnSpec, Figure, Measure, TableSpec, numbers, stretches};
use runout_turning::reading::{sensor_id, setup_id};
use runout_turning::{
    reading::{coefficients, variances},
    rig::Rig,
    station::StationResult,
};

/// For layouts that separate nothing.
pub(super) fn reading() -> TableSpec {
    TableSpec::new(
        "reading",
        "averaged readings, where the layout separates nothing",
        vec![
            ColumnSpec::name("station", STATION),
            ColumnSpec::name("setup", "id of the setup"),
            ColumnSpec::name("sensor", "id of the sensor"),
            ColumnSpec::number("angle_deg", "deg", "the spindle's angle").repeating(),
            ColumnSpec::number(
                "reading_um",
                "um",
                "averaged reading without its level: form, eccentricity and error motion together",
            ),
            ColumnSpec::number("std_um", "um", std_of("reading_um")).repeating(),
        ],
    )
    .optional()
    .figure(
        Figure::polar("reading", "Averaged reading", "angle_deg", [Measure::new("reading_um").with_std("std_um")])
            .panels(["station"])
            .curves(["setup", "sensor"]),
    )
}

pub(super) fn reading_rows(result: &StationResult, rig: Option<&Rig>) -> Vec<ArrayRef> {
    let angles = result.angles;
    let channels = || {
        result.profiles.iter().flat_map(|profile| {
            profile.sensors.iter().enumerate().map(move |(channel, sensor)| (profile, channel, *sensor))
        })
    };
    let count = channels().count();
    let mut fourier = Fourier::new(angles);
    let mut readings = Vec::with_capacity(count * angles);
    for (profile, channel, _) in channels() {
        let mean = coefficients(profile, channel).into_iter().enumerate();
        let without_level = mean.map(|(order, value)| if order == 0 { Complex64::ZERO } else { value.conj() });
        readings.extend_from_slice(fourier.synthesise(without_level));
    }
    let std = |all: Option<Vec<f64>>| all.map_or(f64::NAN, |all| (0.5 * all.iter().skip(1).sum::<f64>()).sqrt());
    let repeated = |ids: Vec<String>| stretches(ids.iter().map(|id| (id.as_str(), angles)));
    vec![
        stretches([(result.station.as_str(), count * angles)]),
        repeated(channels().map(|(profile, ..)| setup_id(profile, rig)).collect()),
        repeated(channels().map(|(.., sensor)| sensor_id(sensor, rig)).collect()),
        numbers((0..count).flat_map(|_| angles_deg(angles))),
        numbers(readings),
        numbers(channels().flat_map(|(profile, channel, _)| repeat_n(std(variances(profile, channel)), angles))),
    ]
}
