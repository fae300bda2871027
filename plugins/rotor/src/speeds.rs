//! The check `rotor-speeds`: whether a rotor has a mode near an order of the speed at which a campaign is measured.

use std::path::PathBuf;

use runout_core::{
    Result,
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::{Check, Planned},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    avoid,
    equations::Equations,
    loader,
    modal::{Modal, Mode, hertz},
    separate::{usual_orders, usual_percent},
    whirl::whirl,
};

/// `[[check]] plugin = "rotor-speeds"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotorSpeedsConfig {
    /// TOML file of the rotor, relative to this one.
    pub path: PathBuf,
    /// Speeds of the campaign, in rpm; without them those of the recording.
    #[serde(default)]
    pub speed_rpm: Vec<f64>,
    /// Multiples of the speed that matter.
    #[serde(default = "usual_orders")]
    pub orders: Vec<f64>,
    /// How near a mode may not be, in percent of order times speed.
    #[serde(default = "usual_percent")]
    pub within_percent: f64,
}

impl StageConfig for RotorSpeedsConfig {
    type Stage = Box<dyn Check>;

    const NAME: &'static str = "rotor-speeds";
    const ABOUT: &'static str = "warns where a rotor has a mode near an order of the speed of the campaign";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if let Some(speed) = self.speed_rpm.iter().find(|speed| !(speed.is_finite() && **speed > 0.0)) {
            return Err(Fault::at("speed_rpm", format!("expected speeds above 0 rpm, found {speed}")));
        }
        avoid::check("orders", &self.orders, "within_percent", self.within_percent)?;
        let rotor = loader::read(&context.path(&self.path)).map_err(|error| {
            let fault = Fault::at("path", error.to_string());
            match error.advice() {
                Some(advice) => fault.help(advice),
                None => fault,
            }
        })?;
        Ok(Box::new(RotorSpeeds { equations: rotor.equations, warnings: rotor.warnings, config: self }))
    }
}

struct RotorSpeeds {
    equations: Equations,
    warnings: Vec<String>,
    config: RotorSpeedsConfig,
}

impl Check for RotorSpeeds {
    fn notes(&self, planned: &Planned) -> Result<Vec<String>> {
        let file = self.config.path.display();
        let mut notes: Vec<String> = self.warnings.iter().map(|warning| format!("{file}: {warning}")).collect();
        let speeds = if self.config.speed_rpm.is_empty() { planned.speeds_rpm } else { &self.config.speed_rpm };
        if speeds.is_empty() {
            notes.push(format!("{file}: no speed is known; give `speed_rpm` in [[check]]"));
            return Ok(notes);
        }
        let modal = Modal::new(&self.equations)?;
        for speed in speeds {
            let modes = modal.at(speed * std::f64::consts::PI / 30.0)?;
            for order in &self.config.orders {
                let line_hz = order * speed / 60.0;
                let share = self.config.within_percent / 100.0;
                let near = |mode: &Mode| (hertz(mode.frequency()) - line_hz).abs() <= share * line_hz;
                for (index, mode) in modes.iter().enumerate().filter(|(_, mode)| near(mode)) {
                    let whirl = whirl(&mode.shape, &self.equations.nodes).name();
                    notes.push(format!(
                        "{file}: at {speed:.0} rpm, order {order} is at {line_hz:.1} Hz and mode {} ({whirl}) at {:.1} Hz, nearer than \
                         {} %: the rotor's vibration enters the error motion at this order; measure at another speed",
                        index + 1,
                        hertz(mode.frequency()),
                        self.config.within_percent,
                    ));
                }
            }
        }
        Ok(notes)
    }
}
