//! Readings of a size that shows numbers in another unit: a thousand times larger or smaller than those of other channels, beyond
//! the range of displacement sensors, or below their noise.

use runout_core::{
    Complex64, consistency::Check, numerics::number::significant, points::measured::unlike_units, rig::Rig,
};

use crate::solve::Readings;

/// Amplitude above the eccentricity of a part that is measured by displacement sensors, in µm. Cams have more.
const LARGEST_UM: f64 = 2000.0;
/// Amplitude below the eccentricity of a part that is centred as well as can be, and below the noise of usual sensors, in µm.
const SMALLEST_UM: f64 = 0.005;
/// Below this amplitude they may be, where single samples scatter by less than any displacement sensor.
const SMALL_UM: f64 = 0.5;
const LEAST_NOISE_UM: f64 = 5e-5;

/// Sensors that look the same way, and setups, of which some are about a thousand times smaller or larger than the others.
pub(crate) fn mistaken_units(rig: &Rig, readings: &Readings) -> Vec<Check> {
    let sizes = sizes(rig, readings);
    let sensors = [false, true].map(|along| {
        let alike = (0..sizes.len()).filter(|sensor| looks_along(rig, *sensor) == along);
        let named = alike.map(|sensor| (format!("sensor `{}`", rig.sensors[sensor].id), sizes[sensor]));
        unlike_units(&named.collect::<Vec<_>>(), "write `unit = \"mm\"` or `unit = \"nm\"` at these sensors")
    });
    sensors.into_iter().chain([unlike_units(&setups(rig, readings), "convert their file")]).flatten().collect()
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
    let is_quiet = || readings.sample_noise_um().is_some_and(|noise_um| noise_um > 0.0 && noise_um < LEAST_NOISE_UM);
    let below = (most_um > 0.0 && (most_um < SMALLEST_UM || (most_um < SMALL_UM && is_quiet()))).then(|| {
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
