//! Whether the turns of a run are steady: levels that creep or step, and noise that is estimated too high.

use crate::summary::StationSummary;
use runout_numerics::number::signed;
use runout_turning::{
    creep::{Creep, Levels, creeps},
    level_step::{LevelStep, level_step},
    profile::Profile,
    rig::Rig,
};

/// χ² per degree of freedom below which the noise is estimated too high: covariances of few turns stay above it.
const INFLATED_CHI2: f64 = 0.2;
/// Orders that the residual has at least for that: χ² of ten orders is as low once in 10⁵ times by chance, of one order in 18 %.
const ORDERS_ENOUGH: usize = 10;
/// Steps that are said one by one, the largest first.
const MOST_STEPS: usize = 4;
/// Of many stations, this share must show a creep: chance has more opportunities there.
const SHARE: f64 = 0.1;

/// What the levels of the turns show, station by station.
#[derive(Debug, Default)]
pub(super) struct Steadiness {
    stations: usize,
    /// Of each sensor of the rig.
    sensors: Vec<SensorCreep>,
    /// Captures and sensors whose level steps, in words, with its size without sign in µm.
    steps: Vec<(f64, String)>,
}

/// Creep of one sensor.
#[derive(Debug, Default, Clone)]
struct SensorCreep {
    /// Stations at which it is certain.
    stations: usize,
    /// The largest over a capture, in µm.
    largest_um: f64,
    place: String,
}

impl Steadiness {
    /// Evaluates the levels of a station's turns.
    pub(crate) fn take(&mut self, station: &str, profiles: &[Profile], rig: &Rig) {
        self.stations += 1;
        self.sensors.resize(rig.sensors.len(), SensorCreep::default());
        let levels = |sensor: usize| -> Vec<Levels> {
            let of = |profile: &Profile| {
                let channel = profile.sensors.iter().position(|known| *known == sensor)?;
                Some(profile.levels.of(channel, profile.channels()))
            };
            profiles.iter().filter_map(of).collect()
        };
        let all: Vec<Vec<Levels>> = (0..rig.sensors.len()).map(levels).collect();
        for (sensor, creep) in creeps(&all).into_iter().enumerate() {
            let steps = self.steps.len();
            for profile in profiles {
                let channel = profile.sensors.iter().position(|known| *known == sensor);
                let step = channel.and_then(|channel| level_step(&profile.levels, channel, profile.channels()));
                let Some(LevelStep { turn, by_um, .. }) = step else { continue };
                let (id, setup) =
                    (&rig.sensors[sensor].id, rig.setups.get(profile.setup).map_or("", |setup| &setup.id));
                let text =
                    format!("{id} steps by {} µm at turn {turn} of the capture {setup}/{station}", signed(by_um, 3));
                self.steps.push((by_um.abs(), text));
            }
            // A straight line through a step is no creep.
            let Some(creep) = creep.filter(|creep| creep.certain && self.steps.len() == steps) else { continue };
            let seen = &mut self.sensors[sensor];
            seen.stations += 1;
            let largest = creep.largest();
            let size_um = creep.over_capture(largest);
            if size_um.abs() > seen.largest_um.abs() {
                seen.largest_um = size_um;
                seen.place = place(&creep, station, profiles.get(largest), rig);
            }
        }
    }

    /// What is to be said of it.
    pub(crate) fn warnings(mut self, rig: &Rig) -> impl Iterator<Item = String> {
        let creeping = self.creeping(rig);
        self.steps.sort_by(|a, b| b.0.total_cmp(&a.0));
        let shown: Vec<&str> = self.steps.iter().take(MOST_STEPS).map(|(_, text)| text.as_str()).collect();
        let more = self.steps.len() - shown.len();
        let more = if more > 0 { format!(", and {more} smaller steps") } else { String::new() };
        let steps = (!shown.is_empty()).then(|| {
            format!(
                "the level changes for good within a capture: {}{more}. The average is of two states, and the turn of the step distorts \
                 it in all orders; the stated uncertainties are not valid. Leave the turns on one side out (`trim`), or measure again",
                shown.join(", ")
            )
        });
        creeping.into_iter().chain(steps)
    }

    fn creeping(&self, rig: &Rig) -> Option<String> {
        let enough = (SHARE * self.stations as f64).max(1.0);
        let creeping = rig.sensors.iter().zip(&self.sensors).filter(|(_, seen)| seen.stations as f64 >= enough);
        let each: Vec<String> = creeping
            .map(|(sensor, seen)| format!("{} by {} µm over {}", sensor.id, signed(seen.largest_um, 3), seen.place))
            .collect();
        (!each.is_empty()).then(|| {
            format!(
                "the levels of the turns creep beyond their noise: {}. A creep leaves a saw-tooth in the averaged turn, in all \
                 orders, and inflates the noise measured over the turns; the stated uncertainties are not valid. \
                 `runout diagnose` takes a drift out",
                each.join(", ")
            )
        })
    }
}

fn place(creep: &Creep, station: &str, profile: Option<&Profile>, rig: &Rig) -> String {
    if creep.shared {
        return "each capture".into();
    }
    let setup = profile.and_then(|profile| rig.setups.get(profile.setup));
    format!("the capture {}/{station}", setup.map_or("", |setup| &setup.id))
}

/// Warns where the residual is far below its value expected from the noise measured over the turns.
pub(super) fn inflated(stations: &[StationSummary]) -> Option<String> {
    let is_low = |station: &&StationSummary| station.chi2_per_dof.is_some_and(|chi2| chi2 < INFLATED_CHI2);
    let has_orders = |station: &&StationSummary| {
        station.residual_orders.is_none_or(|[lowest, highest]| highest + 1 >= lowest + ORDERS_ENOUGH)
    };
    let below: Vec<&StationSummary> = stations.iter().filter(is_low).filter(has_orders).collect();
    let lowest = below.iter().min_by(|a, b| a.chi2_per_dof.unwrap_or(1.0).total_cmp(&b.chi2_per_dof.unwrap_or(1.0)))?;
    Some(format!(
        "at {} of {} stations the residual is far below the noise measured over the turns: χ² per degree of freedom is down to \
         {:.3} ({}), expected 1. Something that changes from turn to turn inflates the noise estimate, for example a drift \
         or asynchronous motion that all sensors see; the stated uncertainties are not valid",
        below.len(),
        stations.len(),
        lowest.chi2_per_dof.unwrap_or(f64::NAN),
        lowest.station,
    ))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

    use super::*;
    use runout_turning::{
        profile::TurnLevels,
        rig::{RigConfig, Rotation, SensorConfig, SetupConfig},
    };

    fn rig() -> Rig {
        let sensor = |id: &str, angle_deg: f64| SensorConfig {
            id: id.into(),
            angle_deg,
            z_mm: 100.0,
            section: "a".into(),
            ..SensorConfig::default()
        };
        let setup = |id: &str, part_deg: f64| SetupConfig { id: id.into(), part_deg, ..SetupConfig::default() };
        let config = RigConfig {
            interruptions: Vec::new(),
            bearings: Vec::new(),
            part_radius_mm: 30.0,
            rotation: Rotation::Ccw,
            sensors: vec![sensor("S1", 0.0), sensor("S2", 90.0)],
            setups: vec![setup("initial", 0.0), setup("turned", 180.0)],
        };
        config.check().unwrap()
    }

    /// Levels of 60 turns that S2 creeps in some setups, beside a wander of 0.05 µm.
    fn profiles(creep_um: [f64; 2]) -> Vec<Profile> {
        let profile = |(setup, creep_um): (usize, f64)| {
            let numbers: Vec<usize> = (0..60).collect();
            let wander = |turn: usize, channel: usize| 0.05 * ((turn * (channel + 2) * (setup + 3)) as f64).sin();
            let of_turn = |turn: &usize| [wander(*turn, 0), wander(*turn, 1) + creep_um * *turn as f64 / 60.0];
            let levels_um = numbers.iter().flat_map(of_turn).collect();
            Profile { setup, sensors: vec![0, 1], levels: TurnLevels { numbers, levels_um }, ..Profile::default() }
        };
        creep_um.into_iter().enumerate().map(profile).collect()
    }

    #[test]
    fn a_creep_is_named_with_its_sensor_and_capture() {
        let rig = rig();
        let warning = |creep_um| {
            let mut steadiness = Steadiness::default();
            steadiness.take("s1", &profiles(creep_um), &rig);
            steadiness.warnings(&rig).next()
        };
        assert_eq!(warning([0.0, 0.0]), None);
        let shared = warning([24.0, 24.0]).unwrap();
        assert!(shared.contains("S2 by +24.0") && shared.contains("over each capture"), "{shared}");
        assert!(!shared.contains("S1"), "{shared}");
        let single = warning([0.0, -24.0]).unwrap();
        assert!(single.contains("S2 by -24.0") && single.contains("over the capture turned/s1"), "{single}");
    }
    #[test]
    fn a_step_is_named_with_its_turn_and_is_no_creep() {
        let rig = rig();
        let mut profiles = profiles([0.0, 0.0]);
        let stepped = profiles[1].levels.levels_um.iter_mut().skip(1).step_by(2).skip(30);
        stepped.for_each(|level| *level += 20.0);
        let mut steadiness = Steadiness::default();
        steadiness.take("s1", &profiles, &rig);
        let warnings: Vec<String> = steadiness.warnings(&rig).collect();
        let [warning] = &warnings[..] else { panic!("{warnings:?}") };
        assert!(warning.contains("S2 steps by +20.") && warning.contains("of the capture turned/s1"), "{warning}");
        assert!(warning.contains("at turn 29") || warning.contains("at turn 30"), "{warning}");
    }
}
