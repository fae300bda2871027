//! Effects between channels, and of single setups.

use runout_core::fault::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acts, places, sensor_ids, sensors::on_sensors, setups::on_setups};
use crate::simulate::{
    check,
    world::{Share, World},
};

/// The channel records what it saw a while ago.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelDelay {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// In µs.
    pub delay_us: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for ChannelDelay {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("delay_us", self.delay_us)?;
        let delay_samples = 1e-6 * self.delay_us * world.sample_rate_hz;
        on_sensors(world, &self.targets, |sensor| sensor.delay_samples += delay_samples)
    }
}

/// A multiplexed converter: each channel records later than the one before it.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelSkew {
    /// From channel to channel, in µs.
    pub delay_us: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for ChannelSkew {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("delay_us", self.delay_us)?;
        let delay_samples = 1e-6 * self.delay_us * world.sample_rate_hz;
        for (channel, sensor) in world.sensors.iter_mut().enumerate() {
            sensor.delay_samples += channel as f64 * delay_samples;
        }
        Ok(())
    }
}

/// A share of one channel's reading is in that of another.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CrossTalk {
    /// Ids of two sensors: the one that is read, and the one whose reading has it.
    pub targets: [String; 2],
    /// Relative.
    pub share: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for CrossTalk {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("share", self.share)?;
        let found = places("targets", &self.targets, &sensor_ids(world), "sensor")?;
        let [from, to] = found[..] else { return Err(Fault::at("targets", "expected two sensors")) };
        world.cross_talk.push(Share { from, to, relative: self.share });
        Ok(())
    }
}

/// The reading of every channel has a share of that of the channel before it.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelGhost {
    /// Relative.
    pub share: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for ChannelGhost {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("share", self.share)?;
        // The last first, so that each has a share of the one before it as that one is without its own.
        let later = (1..world.sensors.len()).rev();
        world.cross_talk.extend(later.map(|to| Share { from: to - 1, to, relative: self.share }));
        Ok(())
    }
}

/// All readings of a setup × (1 + gain).
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetupGain {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// Relative: 0.01 reads 1 % too much.
    pub relative_gain: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SetupGain {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("relative_gain", self.relative_gain)?;
        on_setups(world, &self.targets, |setup| setup.gain *= 1.0 + self.relative_gain)
    }
}

/// The mark of a setup comes at another angle of the spindle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IndexOffset {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// By how much later, in degrees.
    pub angle_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for IndexOffset {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("angle_deg", self.angle_deg)?;
        on_setups(world, &self.targets, |setup| setup.marks.offset_turns += self.angle_deg / 360.0)
    }
}
