//! What is said of drifts: over the capture, their rate and time constant, and whether they are one.

use runout_core::{
    closed_loop::diagnosis::{Added, Diagnosis, Estimated},
    numerics::number::signed,
    rig::{Sensor, Setup},
};

use crate::{
    diagnose::{
        data::{Shared, StationData},
        drift::Creeping,
    },
    effects::TurnEvidence,
};

/// Drifts are one displacement where it leaves less than this share of them.
const ONE_DISPLACEMENT: f64 = 0.1;

/// Says a drift that was found by what it is over the capture, its rate, and its time constant where that is determined.
pub(crate) fn say(diagnosis: &mut Diagnosis, shared: &Shared) {
    let rig = &shared.selection.rig;
    let mut drifts = vec![0.0; rig.sensors.len()];
    let creeps = |added: &&mut Added| shared.turn_evidence(&added.effect) == Some(TurnEvidence::Levels);
    for added in diagnosis.added.iter_mut().filter(creeps) {
        let sensor = added.targets.first().and_then(|id| rig.sensors.iter().position(|sensor| sensor.id == *id));
        let creeping = sensor.and_then(|sensor| {
            let of_station = |station: &StationData| station.seen.creeping.get(sensor)?.clone();
            let all = shared.data.iter().filter_map(of_station);
            // Where captures differ, the station that has the largest.
            let has_largest = |one: &Creeping| one.creep.shared || one.captures().contains(&one.creep.largest());
            all.into_iter().find(has_largest)
        });
        let (Some(sensor), Some(creeping)) = (sensor, creeping) else { continue };
        let creep = &creeping.creep;
        let said = |name: String, value: f64, std: f64, unit: &str| {
            let std = std.is_finite().then_some(std);
            Estimated { name, value, std, unit: unit.into() }
        };
        added.parameters = if creep.shared {
            drifts[sensor] = creep.over_capture(0);
            vec![
                said("over-capture".into(), creep.over_capture(0), creep.over_capture_std, "um"),
                said("rate".into(), creep.rates[0], creep.rate_std, "um/rev"),
            ]
        } else {
            let setups = rig.setups.iter().zip(creeping.captures());
            let over = |(setup, capture): (&Setup, usize)| {
                let over_um = creep.over_capture(capture);
                said(format!("over-capture-{}", setup.id), over_um, creep.over_capture_std, "um")
            };
            setups.map(over).collect()
        };
        if let Some([tau, std]) = creep.time_constant {
            added.parameters.push(said("time-constant".into(), tau, std, "rev"));
        }
    }
    diagnosis.warnings.extend(one_displacement(&drifts, shared));
}

/// Drifts of several sensors that are one displacement of the part beside all sensors.
fn one_displacement(drifts: &[f64], shared: &Shared) -> Option<String> {
    let sensors = &shared.selection.rig.sensors;
    let (mut cc, mut cs, mut ss, mut c, mut s) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let across = || sensors.iter().zip(drifts).filter(|(sensor, _)| sensor.axial_radius_mm.is_none());
    if across().filter(|(_, drift)| **drift != 0.0).count() < 3 {
        return None;
    }
    for (sensor, drift) in across() {
        let (sine, cosine) = sensor.angle_rad.sin_cos();
        (cc, cs, ss) = (cc + cosine * cosine, cs + cosine * sine, ss + sine * sine);
        (c, s) = (c + drift * cosine, s + drift * sine);
    }
    let determinant = cc * ss - cs * cs;
    if determinant < 1e-6 {
        return None;
    }
    let (x, y) = ((c * ss - s * cs) / determinant, (s * cc - c * cs) / determinant);
    let left =
        |(sensor, drift): (&Sensor, &f64)| (drift - x * sensor.angle_rad.cos() - y * sensor.angle_rad.sin()).powi(2);
    let left: f64 = across().map(left).sum();
    let all: f64 = across().map(|(_, drift)| drift * drift).sum();
    (left < ONE_DISPLACEMENT * ONE_DISPLACEMENT * all).then(|| {
        format!(
            "the drifts of the sensors fit one displacement of the part beside all of them, x {} µm and y {} µm over each \
             capture: the part, the spindle or the holder of all sensors moves",
            signed(x, 3),
            signed(y, 3)
        )
    })
}
