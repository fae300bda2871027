//! Error motion against the speed of the recordings, and where the axis is at each speed (ISO 230-7: axis shift).
//!
//! The shift follows from the mean readings of sensors that stay where they are: Δ = x·cos θ + y·sin θ for a sensor at θ, by least squares
//! over those of one section, relative to the slowest recording.

use std::collections::HashMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::{
    names::{columns_of, label, names_at, texts_of},
    trend::{RECORDING, recording_column},
};
use crate::summary::Summary;
use runout_error::Result;
use runout_evaluate::error_motion::MotionKind;
use runout_numerics::statistics::student_95;
use runout_table::{
    Array, ColumnSpec, Figure, Float64Array, Measure, RecordBatch, TableSpec, numbers, numbers_or_null, texts,
};
use runout_turning::{profile::NEIGHBOURS, rig::Rig};

/// Speeds that differ by less, as a share, are one.
const VARIED: f64 = 0.02;
/// Determinant of the directions of unit vectors below which they are one line.
const ONE_LINE: f64 = 1e-3;

/// The table of values against speed.
#[must_use]
pub(crate) fn table() -> TableSpec {
    let value =
        |name: &str, about: &str| ColumnSpec::number(name, "", format!("{about}, in the unit of the series")).or_null();
    TableSpec::new(
        "speed",
        "error motion of the recordings against their speed, and the shift of the axis since the slowest (ISO 230-7)",
        vec![
            recording_column(),
            ColumnSpec::number("speed_rpm", "rpm", "mean speed of the recording"),
            ColumnSpec::name("series", "the value: symbol, reference, filter, where, unit"),
            value("value", "the value; null where it is not known"),
            value("std", "its standard uncertainty; null where it is not known"),
            value("low_95", "lower end of the 95 % interval; null where it is not known"),
            value("high_95", "upper end of the 95 % interval; null where it is not known"),
        ],
    )
    .optional()
    .figure(
        Figure::points("speed", "Against the speed", "speed_rpm", [Measure::new("value").with_std("std")])
            .quantities(["series"]),
    )
}

/// Mean reading of a sensor in a setup, at a station.
#[derive(Debug, Clone, PartialEq)]
struct Level {
    station: String,
    setup: String,
    sensor: String,
    mean_um: f64,
    std_um: Option<f64>,
}

/// What a batch keeps of one recording: its speed and its levels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AtSpeed {
    recording: String,
    speed_rpm: f64,
    levels: Vec<Level>,
}

impl AtSpeed {
    /// Of a recording; nothing where its speed is not known.
    pub(super) fn of(recording: &str, summary: &Summary) -> Option<Self> {
        let captures =
            || summary.stations.iter().flat_map(|station| station.captures.iter().map(move |one| (station, one)));
        let speeds: Vec<f64> = captures().filter_map(|(_, capture)| capture.speed_rpm).collect();
        let speed_rpm = speeds.iter().sum::<f64>() / speeds.len() as f64;
        let levels = captures().flat_map(|(station, capture)| {
            capture.levels.iter().map(|level| Level {
                station: station.station.clone(),
                setup: capture.setup.clone(),
                sensor: level.sensor.clone(),
                mean_um: level.mean_um,
                std_um: level.std_um,
            })
        });
        speed_rpm.is_finite().then(|| Self { recording: recording.to_owned(), speed_rpm, levels: levels.collect() })
    }
}

/// A value over the speeds.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SpeedSeries {
    /// The value: symbol, reference, filter, where, unit.
    pub series: String,
    /// Recordings in which it is known.
    pub count: usize,
    /// Lowest speed, in rpm, and the value there.
    pub slowest: [f64; 2],
    /// Highest speed, and the value there.
    pub fastest: [f64; 2],
    /// The speed at which the value is largest, without its sign, and the value there.
    pub largest: [f64; 2],
}

/// Values against speed, of recordings whose speeds differ.
pub(super) struct Speeds {
    recordings: Vec<AtSpeed>,
    rpm: HashMap<String, f64>,
    series: Vec<SpeedSeries>,
    known: HashMap<String, usize>,
}

/// A value at a speed.
struct Row {
    recording: String,
    speed_rpm: f64,
    series: String,
    value: f64,
    std: Option<f64>,
    interval_95: Option<[f64; 2]>,
}

impl Speeds {
    /// Of these recordings; nothing where they have one speed.
    pub(super) fn of(recordings: Vec<AtSpeed>) -> Option<Self> {
        let speeds = || recordings.iter().map(|one| one.speed_rpm);
        let (low, high) = (speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max));
        let rpm = recordings.iter().map(|one| (one.recording.clone(), one.speed_rpm)).collect();
        (high > (1.0 + VARIED) * low).then(|| Self { recordings, rpm, series: Vec::new(), known: HashMap::new() })
    }

    /// The rows of error motion among rows of values.
    ///
    /// # Errors
    /// Never in practice: the columns are of one length.
    pub(super) fn rows(&mut self, values: &RecordBatch) -> Result<RecordBatch> {
        let number =
            |name: &str| values.column_by_name(name).and_then(|column| column.as_any().downcast_ref::<Float64Array>());
        let (symbols, recordings) = (texts_of(values, "symbol"), texts_of(values, RECORDING));
        let names = columns_of(values);
        let column = number("value");
        let known = ["std", "low_95", "high_95"].map(number);
        let mut rows = Vec::new();
        for place in 0..values.num_rows() {
            let (Some(symbols), Some(recordings), Some(column)) = (symbols, recordings, column) else { break };
            if MotionKind::split(symbols.value(place)).is_none() || column.is_null(place) {
                continue;
            }
            let recording = recordings.value(place).to_owned();
            let Some(speed_rpm) = self.rpm.get(&recording).copied() else { continue };
            let [std, low, high] =
                known.map(|column| column.filter(|column| column.is_valid(place)).map(|column| column.value(place)));
            let series = label(&names_at(&names, place), 1);
            let interval_95 = low.zip(high).map(|(low, high)| [low, high]);
            rows.push(Row { recording, speed_rpm, series, value: column.value(place), std, interval_95 });
        }
        self.table_of(&rows)
    }

    /// The rows of the shift of the axis.
    ///
    /// # Errors
    /// Never in practice: the columns are of one length.
    pub(super) fn shifts(&mut self, rig: Option<&Rig>) -> Result<RecordBatch> {
        let slowest = self.recordings.iter().min_by(|a, b| a.speed_rpm.total_cmp(&b.speed_rpm));
        let rows: Vec<Row> = match (rig, slowest) {
            (Some(rig), Some(slowest)) => self.recordings.iter().flat_map(|one| shifts_of(one, slowest, rig)).collect(),
            _ => Vec::new(),
        };
        self.table_of(&rows)
    }

    fn table_of(&mut self, rows: &[Row]) -> Result<RecordBatch> {
        for row in rows {
            self.count(row);
        }
        table().rows(vec![
            texts(rows.iter().map(|row| row.recording.as_str())),
            numbers(rows.iter().map(|row| row.speed_rpm)),
            texts(rows.iter().map(|row| row.series.as_str())),
            numbers_or_null(rows.iter().map(|row| Some(row.value).filter(|value| value.is_finite()))),
            numbers_or_null(rows.iter().map(|row| row.std)),
            numbers_or_null(rows.iter().map(|row| row.interval_95.map(|[low, _]| low))),
            numbers_or_null(rows.iter().map(|row| row.interval_95.map(|[_, high]| high))),
        ])
    }

    fn count(&mut self, row: &Row) {
        if !row.value.is_finite() {
            return;
        }
        let here = [row.speed_rpm, row.value];
        let next = self.series.len();
        let place = *self.known.entry(row.series.clone()).or_insert(next);
        if place == next {
            let series = row.series.clone();
            self.series.push(SpeedSeries { series, count: 0, slowest: here, fastest: here, largest: here });
        }
        let series = &mut self.series[place];
        series.count += 1;
        if here[0] < series.slowest[0] {
            series.slowest = here;
        }
        if here[0] > series.fastest[0] {
            series.fastest = here;
        }
        if here[1].abs() > series.largest[1].abs() {
            series.largest = here;
        }
    }

    /// What was found.
    pub(super) fn into_series(self) -> Vec<SpeedSeries> {
        self.series
    }
}

/// Degrees of freedom of a level's variance: that of a mean is known from frequencies beside it, which a real signal has twice.
const OF_A_LEVEL: f64 = (2 * NEIGHBOURS) as f64;

/// A sensor's mean reading less that of the slowest recording, with the standard uncertainties of both.
struct Change {
    direction: [f64; 2],
    um: f64,
    std_um: Option<[f64; 2]>,
}

/// Standard uncertainty of a shift, and the degrees of freedom that it is known from.
#[derive(Debug, Clone, Copy)]
struct Known {
    std_um: f64,
    freedom: f64,
}

/// Where the axis of a recording is, relative to the slowest: of each station, setup and section.
fn shifts_of(one: &AtSpeed, slowest: &AtSpeed, rig: &Rig) -> Vec<Row> {
    let mut places: Vec<(&str, &str, usize)> = Vec::new();
    let mut changes: Vec<Vec<Change>> = Vec::new();
    for level in &one.levels {
        let same = |other: &&Level| {
            (&other.station, &other.setup, &other.sensor) == (&level.station, &level.setup, &level.sensor)
        };
        let (Some(before), Some(sensor), Some(setup)) =
            (slowest.levels.iter().find(same), rig.sensor(&level.sensor), rig.setup(&level.setup))
        else {
            continue;
        };
        let sensor = &rig.sensors[sensor];
        if sensor.axial_radius_mm.is_some() {
            continue;
        }
        let (sin, cos) = (sensor.angle_rad + rig.setups[setup].sensors_rad).sin_cos();
        let place = (level.station.as_str(), level.setup.as_str(), sensor.section);
        let index = places.iter().position(|known| *known == place).unwrap_or_else(|| {
            places.push(place);
            changes.push(Vec::new());
            places.len() - 1
        });
        let std_um = before.std_um.zip(level.std_um).map(|(before, after)| [before, after]);
        changes[index].push(Change { direction: [cos, sin], um: level.mean_um - before.mean_um, std_um });
    }
    let mut rows = Vec::new();
    for ((station, setup, section), changes) in places.into_iter().zip(&changes) {
        let Some(shift) = shift(changes) else { continue };
        for (axis, (value, known)) in ["x", "y"].into_iter().zip(shift) {
            let series = format!("axis-shift-{axis}, section {}, setup {setup}, {station} / um", rig.sections[section]);
            // The slowest is what the others are counted from.
            let known = known.filter(|_| one.recording != slowest.recording);
            let interval_95 = known.map(|Known { std_um, freedom }| {
                let reach = student_95(freedom) * std_um;
                [value - reach, value + reach]
            });
            let std = known.map(|known| known.std_um);
            let (recording, speed_rpm) = (one.recording.clone(), one.speed_rpm);
            rows.push(Row { recording, speed_rpm, series, value, std, interval_95 });
        }
    }
    rows
}

/// x and y by least squares, each with its standard uncertainty and the degrees of freedom that it is known from (Welch, Satterthwaite); nothing of
/// sensors along one line.
///
/// What a sensor's level is uncertain by is its own noise, or motion of the axis that all sensors see, each its component. Levels do not distinguish
/// them: the larger of both counts.
fn shift(changes: &[Change]) -> Option<[(f64, Option<Known>); 2]> {
    let sum = |of: &dyn Fn(&Change) -> f64| changes.iter().map(of).sum::<f64>();
    let [xx, xy, yy] = [
        sum(&|one| one.direction[0] * one.direction[0]),
        sum(&|one| one.direction[0] * one.direction[1]),
        sum(&|one| one.direction[1] * one.direction[1]),
    ];
    let determinant = xx * yy - xy * xy;
    let rows = [[yy / determinant, -xy / determinant], [-xy / determinant, xx / determinant]];
    (determinant > ONE_LINE).then(|| {
        rows.map(|[first, second]| {
            let weight = |one: &Change| first * one.direction[0] + second * one.direction[1];
            let of = |recording: usize| -> Option<f64> {
                let error = |one: &Change| Some((weight(one) * one.std_um?[recording], one.direction));
                let errors: Vec<(f64, [f64; 2])> = changes.iter().map(error).collect::<Option<_>>()?;
                let own = errors.iter().map(|(error, _)| error * error).sum::<f64>();
                let along = |axis: usize| errors.iter().map(|(error, direction)| error * direction[axis]).sum::<f64>();
                Some(own.max(along(0).powi(2) + along(1).powi(2)))
            };
            let known = of(0).zip(of(1)).map(|(before, after)| {
                let variance = before + after;
                let freedom = OF_A_LEVEL * variance * variance / (before * before + after * after);
                Known { std_um: variance.sqrt(), freedom }
            });
            (sum(&|one| weight(one) * one.um), known)
        })
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn change(angle_deg: f64, um: f64) -> Change {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        Change { direction: [cos, sin], um, std_um: Some([0.16, 0.12]) }
    }

    /// Three sensors at 0°, 120° and 240° that the axis comes nearer to by 3 µm along 0°: by cos 120° of it at the others.
    #[test]
    fn a_shift_is_what_all_sensors_show_together() {
        let [(x, x_std), (y, y_std)] = shift(&[change(0.0, 3.0), change(120.0, -1.5), change(240.0, -1.5)]).unwrap();
        assert!((x - 3.0).abs() < 1e-12 && y.abs() < 1e-12, "{x} {y}");
        // Motion that all of them see is that of the axis; of noise of their own it would be 0.2/√1.5.
        let [Known { std_um: x_std, freedom }, Known { std_um: y_std, .. }] = [x_std.unwrap(), y_std.unwrap()];
        assert!((x_std - 0.2).abs() < 1e-12 && (y_std - x_std).abs() < 1e-12);
        // 0.16² and 0.12² from four degrees of freedom each.
        assert!((freedom - 4.0 * 0.04_f64.powi(2) / (0.16_f64.powi(4) + 0.12_f64.powi(4))).abs() < 1e-9, "{freedom}");
        assert!(shift(&[change(0.0, 3.0), change(180.0, -3.0)]).is_none(), "one line");
        let [(x, _), (y, _)] = shift(&[change(0.0, 1.0), change(90.0, -2.0)]).unwrap();
        assert!((x - 1.0).abs() < 1e-12 && (y + 2.0).abs() < 1e-12);
    }

    #[test]
    fn one_speed_makes_no_table() {
        let at = |rpm: f64| AtSpeed { recording: format!("{rpm}"), speed_rpm: rpm, levels: Vec::new() };
        assert!(Speeds::of(vec![at(1000.0), at(1005.0)]).is_none());
        assert!(Speeds::of(Vec::new()).is_none());
        assert!(Speeds::of(vec![at(1000.0), at(2000.0)]).is_some());
    }
}
