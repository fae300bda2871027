//! The keys of a rig that would declare what effects change, as lines of TOML.

use runout_core::closed_loop::diagnosis::rounded;

use crate::{
    effects::{Alterations, RigKey},
    selection::Selection,
};

/// Angles are written to so many decimals of a degree: 2·10⁻⁸ rad move no form by a picometre.
const ANGLE_DECIMALS: i32 = 6;
/// Other values are written with so many significant digits, far more than any is known to.
const DIGITS: usize = 9;

/// Lines `setups.1.part_deg = 100.184` for one of the keys; `target` is the index of a sensor or a setup of the selection.
pub(crate) fn lines(selection: &Selection, alterations: &Alterations, key: RigKey, target: usize) -> Vec<String> {
    let rig = &selection.rig;
    // Where channels or setups are swapped, their ids are to be exchanged, and the entry is the one of the true place.
    let sensor = || format!("sensors.{}", selection.sensors[alterations.places[target]]);
    let setup = || format!("setups.{}", selection.setups[alterations.clampings[target]]);
    match key {
        RigKey::PartAngle => {
            let declared_rad = rig.setups[alterations.clampings[target]].part_rad;
            let declared_rad = if alterations.part_angles_reversed { -declared_rad } else { declared_rad };
            vec![line(&setup(), "part_deg", degrees(declared_rad + alterations.setups[target].part_rad))]
        }
        RigKey::SensorsAngle => {
            let declared_rad = rig.setups[alterations.clampings[target]].sensors_rad;
            vec![line(&setup(), "sensors_deg", degrees(declared_rad + alterations.setups[target].sensors_rad))]
        }
        RigKey::SensorAngle => {
            let angle_rad = rig.sensors[alterations.places[target]].angle_rad + alterations.sensors[target].angle_rad;
            vec![line(&sensor(), "angle_deg", degrees(angle_rad))]
        }
        RigKey::SensorGain | RigKey::SensorCharacteristic => {
            let (declared, found) = (rig.sensors[target].calibration, &alterations.sensors[target]);
            let corrected = declared.corrected(found.gain, found.quadratic_per_um, found.cubic_per_um2);
            let gain = line(&sensor(), "gain", rounded(corrected.gain, DIGITS));
            // A gain changes a declared characteristic too, which counts from displacements.
            let bent = [("quadratic_per_um", corrected.quadratic_per_um), ("cubic_per_um2", corrected.cubic_per_um2)];
            let bent = bent.map(|(key, value)| line(&sensor(), key, rounded(value, DIGITS)));
            match (key, declared.is_straight()) {
                (RigKey::SensorGain, true) => vec![gain],
                (RigKey::SensorGain, false) => std::iter::once(gain).chain(bent).collect(),
                _ => bent.into(),
            }
        }
        RigKey::PartRadius => {
            let radius_mm = rounded(rig.part_radius_mm / (1.0 + alterations.curvature), DIGITS);
            vec![format!("part_radius_mm = {radius_mm:?}")]
        }
    }
}

fn line(table: &str, key: &str, value: f64) -> String {
    // TOML distinguishes 100 from 100.0.
    format!("{table}.{key} = {value:?}")
}

fn degrees(angle_rad: f64) -> f64 {
    let scale = 10_f64.powi(ANGLE_DECIMALS);
    (angle_rad.to_degrees() * scale).round() / scale
}
