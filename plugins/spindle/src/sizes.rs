//! Readings of a size that shows numbers in another unit: a thousand times larger or smaller than those of other channels, beyond
//! the range of displacement sensors, or below their noise.

use runout_core::{
    Complex64,
    consistency::{Check, Test},
    numerics::number::significant,
    points::measured::unlike_units,
    rig::Rig,
};

use crate::solve::Readings;

/// From one unit of length to the next.
const BETWEEN_UNITS: f64 = 1e3;
/// Readings of sensors that look the same way differ by less than this in size.
const USUAL_RATIO: f64 = 3.0;
/// So many others show what is usual.
const FEWEST_OTHERS: usize = 2;
/// Amplitude above the eccentricity of a part that is measured by displacement sensors, in µm. Cams have more.
const LARGEST_UM: f64 = 2000.0;
/// Amplitude below the eccentricity of a part that is centred as well as can be, and below the noise of usual sensors, in µm.
const SMALLEST_UM: f64 = 0.005;

/// Names each sensor whose readings are about a thousand times smaller or larger than the median of the other sensors that look
/// the same way, and setups likewise.
pub(crate) fn mistaken_units(rig: &Rig, readings: &Readings) -> Vec<Check> {
    let sizes = sizes(rig, readings);
    let sensors = rig.sensors.len();
    let near = |ratio: f64| (BETWEEN_UNITS / USUAL_RATIO..BETWEEN_UNITS * USUAL_RATIO).contains(&ratio);
    let looks_along = |sensor: usize| looks_along(rig, sensor);
    let said = |sensor: usize| {
        let others = (0..sensors).filter(|other| *other != sensor && looks_along(*other) == looks_along(sensor));
        let mut others: Vec<f64> = others.map(|other| sizes[other]).collect();
        if others.len() < FEWEST_OTHERS || sizes[sensor] == 0.0 {
            return None;
        }
        others.sort_by(f64::total_cmp);
        let ratio = sizes[sensor] / others[others.len() / 2];
        let id = &rig.sensors[sensor].id;
        if near(1.0 / ratio) {
            Some(format!(
                "the readings of sensor `{id}` are {:.0} times smaller than those of the others: they may be in a larger unit (millimetres \
                 where µm is declared): write `unit = \"mm\"` at the sensor",
                1.0 / ratio
            ))
        } else if near(ratio) {
            Some(format!(
                "the readings of sensor `{id}` are {ratio:.0} times larger than those of the others: they may be in a smaller unit \
                 (nanometres where µm is declared): write `unit = \"nm\"` at the sensor"
            ))
        } else {
            None
        }
    };
    let check =
        |words: String| Check::new(Test::Measured, "units of the sensors", BETWEEN_UNITS, &[], 0.0).finding(|| words);
    (0..sensors).filter_map(said).map(check).chain(unlike_units(&setups(rig, readings))).collect()
}

/// What to ask where all sensors across the axis read millimetres, or all of them a few nanometres.
pub(crate) fn unusual_sizes(rig: &Rig, readings: &Readings) -> Vec<String> {
    let sizes = sizes(rig, readings);
    let across = (0..sizes.len()).filter(|sensor| !looks_along(rig, *sensor));
    let least_um = across.map(|sensor| sizes[sensor]).reduce(f64::min);
    let beyond = least_um.filter(|least_um| *least_um > LARGEST_UM).map(|least_um| {
        format!(
            "all sensors across the axis read more than {:.1} mm over a turn: they may be in a smaller unit than declared: write `unit = \"um\"` or \
             `unit = \"nm\"` at the sensors",
            least_um / 1000.0
        )
    });
    // Setups add up in a size.
    let setups = (readings.count / sizes.len().max(1)).max(1) as f64;
    let most_um = sizes.iter().copied().fold(0.0, f64::max) / setups.sqrt();
    let below = (most_um > 0.0 && most_um < SMALLEST_UM).then(|| {
        format!(
            "the readings of all sensors vary by no more than about {} µm over a turn: they may be in a larger unit than declared \
             (millimetres or metres where µm is declared): write `unit = \"mm\"` at the sensors, or convert them to µm",
            significant(2.0 * most_um, 2)
        )
    });
    beyond.into_iter().chain(below).collect()
}

fn looks_along(rig: &Rig, sensor: usize) -> bool {
    rig.sensors[sensor].axial_radius_mm.is_some()
}

/// Size of the readings of each sensor, over all setups.
fn sizes(rig: &Rig, readings: &Readings) -> Vec<f64> {
    let sensors = rig.sensors.len();
    let size = |sensor: usize| {
        let orders = readings.mean.chunks_exact(readings.count).skip(1);
        orders.flat_map(|order| order.iter().skip(sensor).step_by(sensors)).map(Complex64::norm_sqr).sum::<f64>().sqrt()
    };
    (0..sensors).map(size).collect()
}

/// Size of the readings of each setup without their centring, with its name.
fn setups(rig: &Rig, readings: &Readings) -> Vec<(String, f64)> {
    let sensors = rig.sensors.len();
    let size = |setup: usize| {
        let orders = readings.mean.chunks_exact(readings.count).skip(2);
        let own = orders.flat_map(|order| order.iter().skip(setup * sensors).take(sensors));
        own.map(Complex64::norm_sqr).sum::<f64>().sqrt()
    };
    let named = |setup: usize| {
        (format!("setup `{}`", rig.setups.get(setup).map_or("", |setup| setup.id.as_str())), size(setup))
    };
    (0..readings.count / sensors.max(1)).map(named).collect()
}
