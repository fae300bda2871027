//! What single sensors see of form and motion, and what is on the part besides its form.

use runout_core::{Complex64, fault::Fault};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acts, sensors::on_sensors, setups::on_setups};
use crate::simulate::{check, series, world::World};

/// A sensor averages the form over an arc.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeSpot {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Length of the arc on the part, in mm.
    pub width_mm: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for ProbeSpot {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::not_negative("width_mm", self.width_mm)?;
        on_sensors(world, &self.targets, |sensor| sensor.spot_mm = self.width_mm)
    }
}

/// A sensor's bracket moves by a share of the spindle's motion.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BracketMotion {
    /// Ids of sensors.
    pub targets: Vec<String>,
    /// Relative: at 0.02 the sensor reads 98 % of the motion.
    pub share: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for BracketMotion {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("share", self.share)?;
        on_sensors(world, &self.targets, |sensor| sensor.bracket_share = self.share)
    }
}

/// amplitude · cos(order · angle − phase) besides the form.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lobes {
    /// Ids of the setups (`clamping-form`) or sensors (`electrical-run-out`) that have it; a `chuck-form` is in all of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<String>,
    /// Per turn, from 2.
    pub order: usize,
    /// In µm.
    pub amplitude_um: f64,
    /// In degrees.
    #[serde(default)]
    pub phase_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Lobes {
    /// c of Re c·e^{i·order·angle}.
    fn harmonic(&self, world: &World) -> Result<Complex64, Fault> {
        check::order("order", self.order, 2, world.orders())?;
        check::finite("amplitude_um", self.amplitude_um)?;
        check::finite("phase_deg", self.phase_deg)?;
        Ok(Complex64::from_polar(self.amplitude_um, -self.phase_deg.to_radians()))
    }
}

/// A form that turns with the spindle and not with the part; its angle counts from the spindle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct ChuckForm(pub Lobes);

/// The part has another form as it is clamped in a setup; its angle counts from the part.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct ClampingForm(pub Lobes);

/// A sensor sees a pattern of the part's material that is no form; its angle counts from the part.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct ElectricalRunOut(pub Lobes);

impl Acts for ChuckForm {
    fn declared(&self) -> bool {
        self.0.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        if !self.0.targets.is_empty() {
            return Err(Fault::at("targets", "a chuck's form is in all setups and sensors").help("leave it out"));
        }
        let value = self.0.harmonic(world)?;
        series::add(&mut world.chuck_um, self.0.order, value);
        Ok(())
    }
}

impl Acts for ClampingForm {
    fn declared(&self) -> bool {
        self.0.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let value = self.0.harmonic(world)?;
        on_setups(world, &self.0.targets, |setup| series::add(&mut setup.clamping_form_um, self.0.order, value))
    }
}

impl Acts for ElectricalRunOut {
    fn declared(&self) -> bool {
        self.0.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        let value = self.0.harmonic(world)?;
        on_sensors(world, &self.0.targets, |sensor| series::add(&mut sensor.run_out_um, self.0.order, value))
    }
}
