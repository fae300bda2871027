//! The table of what the fit leaves of the averaged readings.

use super::STATION;
use runout_numerics::Complex64;
use runout_table::{ArrayRef, ColumnSpec, TableSpec, counts, numbers, stretches};
use runout_turning::reading::{sensor_id, setup_id};
use runout_turning::{profile::Profile, reading::variances, rig::Rig, station::StationResult};

/// Where readings are redundant.
pub(super) fn residual() -> TableSpec {
    TableSpec::new(
        "residual_harmonics",
        "what the fit leaves of each averaged reading, coefficients c by order: Re Σ c e^{−inΦ}",
        vec![
            ColumnSpec::name("station", STATION),
            ColumnSpec::name("setup", "id of the setup"),
            ColumnSpec::name("sensor", "id of the sensor"),
            ColumnSpec::count("order", "1/rev", "undulations per revolution; those at which readings are redundant"),
            ColumnSpec::number("re_um", "um", "real part of c"),
            ColumnSpec::number("im_um", "um", "imaginary part of c"),
            ColumnSpec::number(
                "reading_std_um",
                "um",
                "sqrt(E|delta|^2) of the error delta of the averaged reading's coefficient; NaN where it is not known",
            ),
        ],
    )
    .optional()
}

pub(super) fn residual_rows(result: &StationResult, rig: Option<&Rig>) -> Vec<ArrayRef> {
    let channels: Vec<(&Profile, usize)> = result
        .profiles
        .iter()
        .flat_map(|profile| (0..profile.sensors.len()).map(move |channel| (profile, channel)))
        .collect();
    let left: Vec<_> =
        result.separation.residual.by_reading.iter().filter(|left| left.place < channels.len()).collect();
    let count: usize = left.iter().map(|left| left.harmonics.len()).sum();
    let mut ids = [Vec::with_capacity(left.len()), Vec::with_capacity(left.len())];
    let mut stds = Vec::with_capacity(count);
    for left in &left {
        let (profile, channel) = channels[left.place];
        ids[0].push(setup_id(profile, rig));
        ids[1].push(sensor_id(profile.sensors[channel], rig));
        let variances = variances(profile, channel);
        let std = |order: usize| variances.as_ref().and_then(|all| all.get(order)).map_or(f64::NAN, |one| one.sqrt());
        stds.extend(left.harmonics.iter().map(|(order, _)| std(*order)));
    }
    let repeated =
        |ids: &[String]| stretches(ids.iter().zip(&left).map(|(id, left)| (id.as_str(), left.harmonics.len())));
    let part = |of: fn(&Complex64) -> f64| {
        let mut column = Vec::with_capacity(count);
        for left in &left {
            column.extend(left.harmonics.iter().map(|(_, value)| of(value)));
        }
        numbers(column)
    };
    vec![
        stretches([(result.station.as_str(), count)]),
        repeated(&ids[0]),
        repeated(&ids[1]),
        counts(left.iter().flat_map(|left| left.harmonics.iter().map(|(order, _)| *order))),
        part(|value| value.re),
        part(|value| value.im),
        numbers(stds),
    ]
}
