//! Readings of a size that shows numbers in another unit: a thousand times larger or smaller than those of other channels, beyond
//! the range of displacement sensors, or below their noise.

use runout_core::{Complex64, numerics::number::significant, rig::Rig};

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
/// the same way, and readings of millimetres in all that look across the axis, or of a few nanometres in all.
pub(crate) fn mistaken_units(rig: &Rig, readings: &Readings) -> Vec<String> {
    let sensors = rig.sensors.len();
    let size = |sensor: usize| {
        let orders = readings.mean.chunks_exact(readings.count).skip(1);
        orders.flat_map(|order| order.iter().skip(sensor).step_by(sensors)).map(Complex64::norm_sqr).sum::<f64>().sqrt()
    };
    let sizes: Vec<f64> = (0..sensors).map(size).collect();
    let near = |ratio: f64| (BETWEEN_UNITS / USUAL_RATIO..BETWEEN_UNITS * USUAL_RATIO).contains(&ratio);
    let looks_along = |sensor: usize| rig.sensors[sensor].axial_radius_mm.is_some();
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
    let least_um = (0..sensors).filter(|sensor| !looks_along(*sensor)).map(|sensor| sizes[sensor]).reduce(f64::min);
    let beyond = least_um.filter(|least_um| *least_um > LARGEST_UM).map(|least_um| {
        format!(
            "all sensors across the axis read more than {:.1} mm over a turn: they may be in a smaller unit than declared: write `unit = \"um\"` or \
             `unit = \"nm\"` at the sensors",
            least_um / 1000.0
        )
    });
    // Setups add up in a size.
    let setups = (readings.count / sensors.max(1)).max(1) as f64;
    let most_um = sizes.iter().copied().fold(0.0, f64::max) / setups.sqrt();
    let below = (most_um > 0.0 && most_um < SMALLEST_UM).then(|| {
        format!(
            "the readings of all sensors vary by no more than about {} µm over a turn: they may be in a larger unit than declared \
             (millimetres or metres where µm is declared): write `unit = \"mm\"` at the sensors, or convert them to µm",
            significant(2.0 * most_um, 2)
        )
    });
    (0..sensors).filter_map(said).chain(beyond).chain(below).chain(unlike_setups(rig, readings, near)).collect()
}

/// A setup whose readings are a thousand times larger than those of another one, without their centring.
fn unlike_setups(rig: &Rig, readings: &Readings, near: impl Fn(f64) -> bool) -> Option<String> {
    let sensors = rig.sensors.len();
    let size = |setup: usize| {
        let orders = readings.mean.chunks_exact(readings.count).skip(2);
        let own = orders.flat_map(|order| order.iter().skip(setup * sensors).take(sensors));
        own.map(Complex64::norm_sqr).sum::<f64>().sqrt()
    };
    let sizes = || (0..readings.count / sensors.max(1)).map(|setup| (size(setup), setup));
    let (small, smallest) = sizes().min_by(|one, other| one.0.total_cmp(&other.0))?;
    let (large, largest) = sizes().max_by(|one, other| one.0.total_cmp(&other.0))?;
    let id = |setup: usize| rig.setups.get(setup).map_or("", |setup| setup.id.as_str());
    near(large / small).then(|| {
        format!(
            "the readings of setup `{}` are {:.0} times larger than those of setup `{}`: one of them may be in another unit (millimetres or \
             nanometres where µm is declared): convert its file",
            id(largest),
            large / small,
            id(smallest)
        )
    })
}
