//! Mistakes in the rig: what is recorded is sound, and the rig as it is stated is not what was there.

use runout_core::{fault::Fault, rig::Rotation};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acts, named_setups, places, sensor_ids, sensors::on_sensors, setup_ids};
use crate::simulate::world::World;

/// Readings have the opposite sign.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorSign {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Ids of the setups in which it is so; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorSign {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let setups = named_setups(world, &self.setups)?;
        on_sensors(world, &self.targets, |sensor| {
            sensor.chain.gain *= if setups.is_empty() { -1.0 } else { 1.0 };
            sensor.gains_in_setups.extend(setups.iter().map(|setup| (*setup, -1.0)));
        })
    }
}

/// Two channels hold each other's signals.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorsSwapped {
    /// Ids of two sensors.
    pub targets: [String; 2],
    /// Ids of the setups in which it is so; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorsSwapped {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let both = pair(&self.targets, &sensor_ids(world), "sensor")?;
        let setups = named_setups(world, &self.setups)?;
        if setups.is_empty() {
            world.sensors.swap(both[0], both[1]);
        }
        for setup in setups {
            world.setups[setup].channels.swap(both[0], both[1]);
        }
        Ok(())
    }
}

/// The second of two channels has the signal of the first, each with its own noise.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorsIdentical {
    /// Ids of two sensors.
    pub targets: [String; 2],
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorsIdentical {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let [first, second] = pair(&self.targets, &sensor_ids(world), "sensor")?;
        world.sensors[second] = world.sensors[first].clone();
        Ok(())
    }
}

/// Two setups hold each other's recordings.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetupsSwapped {
    /// Ids of two setups.
    pub targets: [String; 2],
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SetupsSwapped {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let [first, second] = pair(&self.targets, &setup_ids(world), "setup")?;
        world.setups.swap(first, second);
        Ok(())
    }
}

/// The second of two setups was recorded with part and sensors as in the first.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetupRepeated {
    /// Ids of two setups.
    pub targets: [String; 2],
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SetupRepeated {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let [first, second] = pair(&self.targets, &setup_ids(world), "setup")?;
        world.setups[second] = world.setups[first].clone();
        Ok(())
    }
}

/// The part turns the other way.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotationReversed {
    /// Ids of the setups in which it is so; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for RotationReversed {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let setups = named_setups(world, &self.setups)?;
        if setups.is_empty() {
            world.rig.rotation = match world.rig.rotation {
                Rotation::Ccw => Rotation::Cw,
                Rotation::Cw => Rotation::Ccw,
            };
        }
        for setup in setups {
            world.setups[setup].backwards ^= true;
        }
        Ok(())
    }
}

/// The part's angles count the other way.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartAngleSign {
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for PartAngleSign {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        for setup in &mut world.setups {
            setup.part_rad = -setup.part_rad;
        }
        Ok(())
    }
}

/// Indices of two different ids among the known ones.
fn pair(ids: &[String; 2], known: &[&str], noun: &str) -> Result<[usize; 2], Fault> {
    match places("targets", ids, known, noun)?[..] {
        [first, second] if first != second => Ok([first, second]),
        _ => Err(Fault::at("targets", format!("expected two different {noun}s"))),
    }
}
