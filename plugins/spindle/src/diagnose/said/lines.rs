//! What is said of lines: order, frequency, size, and whether it is the mains.

use runout_core::{
    closed_loop::diagnosis::{Diagnosis, Estimated},
    mains,
    rig::{Bearing, bearing_lines_near},
    stage::Station,
};

use crate::{
    diagnose::{
        data::Shared,
        lines::{Line, Source},
    },
    effects::{ActsOn, TurnEvidence},
};

/// Says each line that was found by its order, frequency and amplitude, and what it may be.
pub(crate) fn say(diagnosis: &mut Diagnosis, shared: &Shared, stations: &[Station]) {
    let sensors = &shared.selection.rig.sensors;
    let id = |sensor: &usize| sensors.get(*sensor).map_or_else(String::new, |sensor| sensor.id.clone());
    // The line of the motion, which one that few sensors show may be as well.
    let of_motion = shared.kinds.iter().filter(|kind| kind.line().is_some()).map(|kind| kind.about());
    let of_motion = of_motion.into_iter().find(|about| about.acts_on == ActsOn::Rig).map(|about| about.id.to_owned());
    let mut said: Vec<Option<usize>> = Vec::new();
    let mut remarks = Vec::new();
    for added in &mut diagnosis.added {
        if !matches!(shared.turn_evidence(&added.effect), Some(TurnEvidence::Line(_))) {
            continue;
        }
        let sensor = added.targets.first().and_then(|id| sensors.iter().position(|sensor| sensor.id == *id));
        // Several of one target come in the order of their size.
        let before = said.iter().filter(|known| **known == sensor).count();
        said.push(sensor);
        let is = |line: &&Line| line.row().0 == sensor;
        let known = shared.data.iter().find_map(|station| station.seen.lines.found.iter().filter(is).nth(before));
        let Some(line) = known else { continue };
        added.parameters = line.parameters();
        if let Source::Sensors { channels, motion } = &line.source {
            added.targets = channels.iter().map(id).collect();
            if *motion {
                added.confounded_with.extend(of_motion.clone());
                let by = "a sensor at another angle, which a motion along this one would show in too";
                added.distinguished_by = Some(by.into());
            }
        }
        remarks.extend(remark(line, &added.targets, rate_of(stations)));
        remarks.extend(bearing(line, &shared.selection.rig.bearings));
    }
    diagnosis.warnings.extend(remarks);
    diagnosis.warnings.extend(whole_order(diagnosis, stations));
}

impl Line {
    fn parameters(&self) -> Vec<Estimated> {
        let said = |name: &str, value: f64, std: f64, unit: &str| Estimated {
            name: name.into(),
            value,
            std: std.is_finite().then_some(std),
            unit: unit.into(),
        };
        let mut parameters = vec![said("order", self.order, self.order_std, "1/rev")];
        if let Some(turns_hz) = self.turns_hz {
            parameters.push(said("frequency", self.order * turns_hz, self.order_std * turns_hz, "Hz"));
        }
        match &self.source {
            Source::Sensors { channels, .. } => {
                let [amplitude_um, std] = self.of_sensors(channels);
                parameters.push(said("amplitude", amplitude_um, std, "um"));
            }
            Source::Motion { .. } => {
                let orbit = &self.orbit;
                parameters.push(said("amplitude", orbit.amplitude_um, orbit.std_um, "um"));
                if orbit.is_open() {
                    parameters.push(said("amplitude-across", orbit.across_um, orbit.std_um, "um"));
                }
                if orbit.has_direction() {
                    let [direction_deg, std_deg] = [orbit.direction_rad, orbit.direction_std_rad].map(f64::to_degrees);
                    parameters.push(said("direction", direction_deg, std_deg, "deg"));
                }
            }
        }
        parameters
    }
}

impl Line {
    /// What the record resolves of its order: a quarter of a period over all of its turns.
    fn resolution(&self) -> f64 {
        (3.0 * self.order_std).max(0.25 / self.turns.max(1.0))
    }

    /// "21.63 Hz", or "order 2.587" where the speed is not known.
    fn frequency(&self) -> String {
        let hertz = self.turns_hz.map(|turns_hz| self.order * turns_hz);
        hertz.map_or_else(|| format!("order {:.3}", self.order), |hertz| format!("{hertz:.2} Hz"))
    }
}

/// Which bearing a motion fits.
fn bearing(line: &Line, bearings: &[Bearing]) -> Option<String> {
    let is_motion = matches!(line.source, Source::Motion { .. });
    let near = bearing_lines_near(bearings, line.order, line.resolution());
    let names: Vec<String> = near.iter().filter(|_| is_motion).map(ToString::to_string).collect();
    (!names.is_empty()).then(|| {
        format!(
            "the line at {} ({:.3}/rev) fits {} within {:.3}/rev",
            line.frequency(),
            line.order,
            names.join(" and "),
            line.resolution()
        )
    })
}

/// Whether a line is the mains, and whether all channels may have picked it up.
fn remark(line: &Line, targets: &[String], rate_hz: Option<f64>) -> Option<String> {
    let mains =
        line.turns_hz.and_then(|turns_hz| mains::near(line.order * turns_hz, line.resolution() * turns_hz, rate_hz));
    let frequency = line.frequency();
    let is_mains = mains.map(|mains| format!("is {mains}"));
    match (&line.source, is_mains) {
        (Source::Sensors { channels, .. }, mains) => {
            let several = if channels.len() > 1 {
                "; no displacement and tilt fits the channels that have it: electrical pick-up common to them is possible"
            } else {
                ""
            };
            let what = mains.unwrap_or_else(|| "is no motion of the axis".into());
            Some(format!("the line at {frequency} in {} {what}{several}", targets.join(", ")))
        }
        (Source::Motion { common: true }, mains) => Some(format!(
            "the line at {frequency}{} has the same amplitude and phase in all channels: electrical pick-up common to all channels is possible instead of a motion",
            mains.map_or_else(String::new, |mains| format!(" {mains} and"))
        )),
        (Source::Motion { .. }, Some(mains)) => Some(format!(
            "the line at {frequency} {mains}, and all sensors fit one displacement and tilt: a motion that the mains drives, or pick-up in several channels"
        )),
        (Source::Motion { .. }, None) => None,
    }
}

/// Samples a second of the first capture, where known.
fn rate_of(stations: &[Station]) -> Option<f64> {
    stations.first()?.profiles.first()?.sample_rate_hz
}

/// The residual at an order that is the mains at the spindle's speed, within a part of a period over the record.
fn whole_order(diagnosis: &Diagnosis, stations: &[Station]) -> Option<String> {
    let profile = stations.first()?.profiles.first()?;
    let turns_hz = profile.speed_rpm? / 60.0;
    let resolution_hz = turns_hz / profile.turns.used.max(1) as f64;
    let narrow = diagnosis.unexplained.iter().filter(|left| left.orders[1] - left.orders[0] <= 1);
    let mut orders = narrow.flat_map(|left| left.orders);
    let found =
        orders.find_map(|order| Some((order, mains::near(order as f64 * turns_hz, resolution_hz, rate_of(stations))?)));
    found.map(|(order, mains)| {
        format!(
            "order {order} is {mains} at this speed: pick-up at a whole order cannot be distinguished from what repeats every turn; measure at another speed"
        )
    })
}
