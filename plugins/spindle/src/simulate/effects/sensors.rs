//! Effects of a sensor.

use runout_core::fault::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acts, named_setups, places, sensor_ids, setup_ids};
use crate::simulate::{
    chain::{Drift, LowPass, PickUp, Runs},
    check,
    world::{TrueSensor, World},
};

/// Reading × (1 + gain).
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorGain {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Relative: 0.01 reads 1 % too much.
    pub relative_gain: f64,
    /// Ids of the setups in which it is so; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorGain {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("relative_gain", self.relative_gain)?;
        let (setups, gain) = (named_setups(world, &self.setups)?, 1.0 + self.relative_gain);
        on_sensors(world, &self.targets, |sensor| {
            sensor.chain.gain *= if setups.is_empty() { gain } else { 1.0 };
            sensor.gains_in_setups.extend(setups.iter().map(|setup| (*setup, gain)));
        })
    }
}

/// True angle = stated angle + this.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorAngle {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// In degrees about +z.
    pub angle_deg: f64,
    /// Ids of the setups in which it is so; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorAngle {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("angle_deg", self.angle_deg)?;
        let (setups, angle_rad) = (named_setups(world, &self.setups)?, self.angle_deg.to_radians());
        on_sensors(world, &self.targets, |sensor| {
            sensor.angle_rad += if setups.is_empty() { angle_rad } else { 0.0 };
            sensor.angles_in_setups.extend(setups.iter().map(|setup| (*setup, angle_rad)));
        })
    }
}

/// True z = stated z + this.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorAxialPosition {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// In mm.
    pub shift_mm: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorAxialPosition {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("shift_mm", self.shift_mm)?;
        on_sensors(world, &self.targets, |sensor| sensor.z_mm += self.shift_mm)
    }
}

/// Reading = u + quadratic · u² + cubic · u³, before any gain.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorNonlinearity {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// In 1/µm.
    #[serde(default)]
    pub quadratic_per_um: f64,
    /// In 1/µm².
    #[serde(default)]
    pub cubic_per_um2: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorNonlinearity {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("quadratic_per_um", self.quadratic_per_um)?;
        check::finite("cubic_per_um2", self.cubic_per_um2)?;
        on_sensors(world, &self.targets, |sensor| {
            sensor.chain.quadratic_per_um += self.quadratic_per_um;
            sensor.chain.cubic_per_um2 += self.cubic_per_um2;
        })
    }
}

/// rate · τ · (1 − e^{−t/τ}), or rate · t without τ; t in turns at the nominal speed since the capture began.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThermalDrift {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// At the start, in µm per turn.
    pub rate_um_per_rev: f64,
    /// τ, in turns; without it the drift is a straight line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_constant_turns: Option<f64>,
    /// Ids of the setups in which it drifts; all without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<String>,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for ThermalDrift {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("rate_um_per_rev", self.rate_um_per_rev)?;
        if let Some(turns) = self.time_constant_turns {
            check::positive("time_constant_turns", turns)?;
        }
        let drift = Drift {
            rate_um_per_rev: self.rate_um_per_rev,
            time_constant_turns: self.time_constant_turns,
            setups: in_setups(world, &self.setups)?,
        };
        on_sensors(world, &self.targets, |sensor| sensor.chain.drifts.push(drift.clone()))
    }
}

/// Which of the rig's setups are named; all where none is.
fn in_setups(world: &World, named: &[String]) -> Result<Vec<bool>, Fault> {
    let known = setup_ids(world);
    if named.is_empty() {
        return Ok(vec![true; known.len()]);
    }
    let chosen = places("setups", named, &known, "setup")?;
    Ok((0..known.len()).map(|setup| chosen.contains(&setup)).collect())
}

/// amplitude · cos(2π·f·t + phase) in channels, the phase random in each capture and the same for all of them.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorLine {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// In Hz, as the mains; or `order`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frequency_hz: Option<f64>,
    /// Periods per turn of the spindle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<f64>,
    /// In µm.
    pub amplitude_um: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorLine {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, index: usize) -> Result<(), Fault> {
        check::finite("amplitude_um", self.amplitude_um)?;
        let runs = match (self.frequency_hz, self.order) {
            (Some(hertz), None) => {
                check::positive("frequency_hz", hertz)?;
                Runs::PerSample(hertz / world.sample_rate_hz)
            }
            (None, Some(order)) => {
                check::positive("order", order)?;
                Runs::PerTurn(order)
            }
            _ => {
                return Err(Fault::at("frequency_hz", "a line has either a frequency or an order")
                    .help("give `frequency_hz` or `order`"));
            }
        };
        let pick_up = PickUp { runs, amplitude_um: self.amplitude_um, item: index };
        on_sensors(world, &self.targets, |sensor| sensor.chain.pick_ups.push(pick_up))
    }
}

/// Causal digital Butterworth low-pass, made by the bilinear transform with the cut-off kept.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FilterAttenuation {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// −3 dB, in Hz.
    pub cutoff_hz: f64,
    /// 1 to 8.
    #[serde(default = "first_order")]
    pub order: usize,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

fn first_order() -> usize {
    1
}

impl Acts for FilterAttenuation {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let filter = LowPass::butterworth(self.order, self.cutoff_hz, world.sample_rate_hz)?;
        on_sensors(world, &self.targets, |sensor| sensor.chain.filters.push(filter.clone()))
    }
}

pub(super) fn on_sensors(world: &mut World, targets: &[String], change: impl Fn(&mut TrueSensor)) -> Result<(), Fault> {
    for index in places("targets", targets, &sensor_ids(world), "sensor")? {
        change(&mut world.sensors[index]);
    }
    Ok(())
}
