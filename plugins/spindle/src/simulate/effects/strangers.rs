//! Unmodelled disturbances: the closed loop must report an unexplained residual and must not attribute it to a known effect.

use runout_core::{Complex64, fault::Fault};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acts, places, sensor_ids, sensors::on_sensors, setup_ids};
use crate::simulate::{
    check,
    strangers::{Kind, Slip, Stranger},
    world::World,
};

/// Reading − depth · e^{−½ (Δα / width)²} around one angle of the part: a dent that only some sensors see, or in some setups.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dent {
    /// Ids of sensors that see it; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<String>,
    /// Ids of setups in which it is there; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// In µm; below 0 a spike.
    pub depth_um: f64,
    /// The part's angle at its middle, in degrees.
    pub part_angle_deg: f64,
    /// Standard deviation of its shape, in degrees.
    pub width_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for Dent {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        if self.targets.is_empty() && self.setups.is_empty() {
            return Err(Fault::at("plugin", "a dent that every sensor reads in every setup is form")
                .help("name `targets` or `setups`"));
        }
        check::finite("depth_um", self.depth_um)?;
        check::finite("part_angle_deg", self.part_angle_deg)?;
        check::positive("width_deg", self.width_deg)?;
        let kind = Kind::Dent {
            depth_um: self.depth_um,
            part_rad: self.part_angle_deg.to_radians(),
            width_rad: self.width_deg.to_radians(),
        };
        let every: Vec<String> = sensor_ids(world).into_iter().map(str::to_owned).collect();
        let targets = if self.targets.is_empty() { &every } else { &self.targets };
        add(world, targets, &self.setups, kind)
    }
}

/// Play between the surface and the reading: it follows only once the surface has moved through it.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Ids of setups in which it is there; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// Between reading the same on the way in and on the way out, in µm.
    pub play_um: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for Backlash {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::not_negative("play_um", self.play_um)?;
        add(world, &self.targets, &self.setups, Kind::Backlash { play_um: self.play_um })
    }
}

/// Reading + step over a part of every turn of the spindle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Ids of setups in which it is there; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// In µm.
    pub step_um: f64,
    /// The spindle's angle where it begins, in degrees.
    pub from_deg: f64,
    /// And where it ends; through 0° where this is below `from_deg`.
    pub to_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for Step {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("step_um", self.step_um)?;
        check::finite("from_deg", self.from_deg)?;
        check::finite("to_deg", self.to_deg)?;
        let (from_turn, to_turn) = (self.from_deg / 360.0, self.to_deg / 360.0);
        add(world, &self.targets, &self.setups, Kind::Step { step_um: self.step_um, from_turn, to_turn })
    }
}

/// From some turn of one setup on, and in the setups after it, a probe sits elsewhere.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlippedProbe {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Id of the setup in which it slips.
    pub setup: String,
    /// After so many turns from the first mark.
    pub after_turns: f64,
    /// Along its line, in µm: added to the reading.
    #[serde(default)]
    pub shift_um: f64,
    /// Along the circumference, in degrees about +z.
    #[serde(default)]
    pub angle_deg: f64,
    /// Relative: 0.01 reads 1 % too much from then on.
    #[serde(default)]
    pub relative_gain: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SlippedProbe {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::not_negative("after_turns", self.after_turns)?;
        check::finite("shift_um", self.shift_um)?;
        check::finite("angle_deg", self.angle_deg)?;
        check::finite("relative_gain", self.relative_gain)?;
        let ids: Vec<String> = setup_ids(world).into_iter().map(str::to_owned).collect();
        let Some(first) = ids.iter().position(|id| *id == self.setup) else {
            return Err(super::unknown("setup", "setup", &self.setup, &setup_ids(world)));
        };
        let slip = |after_turns| Slip {
            after_turns,
            shift_um: self.shift_um,
            gain: 1.0 + self.relative_gain,
            turned: Complex64::cis(self.angle_deg.to_radians()),
        };
        add(world, &self.targets, &ids[first..=first], Kind::Slip { slip: slip(Some(self.after_turns)) })?;
        let after = &ids[first + 1..];
        if after.is_empty() { Ok(()) } else { add(world, &self.targets, after, Kind::Slip { slip: slip(None) }) }
    }
}

/// Adds an unmodelled disturbance to sensors, in the setups named or, where none is, in all.
fn add(world: &mut World, targets: &[String], setups: &[String], kind: Kind) -> Result<(), Fault> {
    let mut there = vec![setups.is_empty(); world.setups.len()];
    if !setups.is_empty() {
        for index in places("setups", setups, &setup_ids(world), "setup")? {
            there[index] = true;
        }
    }
    on_sensors(world, targets, |sensor| sensor.strangers.push(Stranger { setups: there.clone(), kind }))
}
