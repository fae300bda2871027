//! Campaigns in the time domain with a declared truth.
//!
//! At each sample the spindle has an angle Φ; its axis is displaced by synchronous motion(Φ) and asynchronous
//! motion(t), the part's axis stands off it by how the part is clamped, and each sensor's line meets the part's surface
//! at a point whose distance is the reading: the geometry itself, solved for that point, not an expansion of it. Nothing
//! here is shared with the separators, so that one checks the other. Sections stay planes z = const: a tilt also
//! moves the point under a sensor along z, by 0.3 µm at 10 µrad and a radius of 30 mm; times the part's slope along z
//! that is 1e-4 µm at most, and left out.
//!
//! Readings in double precision are those of the scenario to about 1e-11 µm, set by the rounding of angles (1e-15 rad)
//! on the steepest form.

mod asynchronous;
mod chain;
mod check;
mod config;
mod effects;
mod face;
mod form;
mod geometry;
mod measured;
mod motion;
mod profile;
mod random;
mod recording;
mod series;
mod spin;
mod strangers;
mod world;

#[cfg(test)]
mod tests;

use runout_core::{
    Result,
    fault::Fault,
    pipeline::{Context, StageConfig},
    rig::Rig,
    stage::{Simulation, Simulator},
};

pub use config::{
    AsynchronousConfig, AxialLineConfig, EccentricityConfig, FaceConfig, FormConfig, FormHarmonic, Geometry,
    LineConfig, MotionConfig, MotionHarmonic, NoiseConfig, Orders, Phase, RecordingConfig, SampleFormat, Scenario,
    StationsConfig, TiltHarmonic,
};
pub use effects::{
    AsynchronousLine, AxialMotion, Backlash, BracketMotion, ChannelDelay, ChannelGhost, ChannelSkew, ChuckForm,
    ClampingForm, CrossTalk, Dent, Effect, ElectricalRunOut, EvenOrderMotion, FilterAttenuation, IndexOffset, Lobes,
    LostSamples, PartAngleSign, PartEccentricity, PartRadius, ProbeSpot, ReversalAngle, RotationReversed,
    SecondOrderGeometry, SensorAngle, SensorAxialPosition, SensorGain, SensorLine, SensorNonlinearity, SensorSign,
    SensorsAngle, SensorsIdentical, SensorsSwapped, SetupGain, SetupMotionChange, SetupRepeated, SetupsSwapped,
    SlippedProbe, SpeedRipple, Step, ThermalDrift, TurnRatio,
};
pub use recording::SpindleRecording;

use world::World;

/// `plugin = "spindle"` of a scenario.
pub type SpindleConfig = Scenario<Effect>;

/// Computes recordings of a turned part on a spindle.
#[derive(Debug)]
pub struct SpindleSimulator {
    world: World,
    scenario: String,
}

/// Checks a scenario.
///
/// # Errors
/// The first value that cannot be, with its key.
pub fn simulator(config: &SpindleConfig) -> std::result::Result<SpindleSimulator, Fault> {
    if i64::try_from(config.seed).is_err() {
        return Err(Fault::at("seed", format!("expected a seed up to {}, found {}", i64::MAX, config.seed)));
    }
    let mut world = World::new(config)?;
    for (index, effect) in config.effect.iter().enumerate() {
        effect.apply(&mut world, index).map_err(|fault| fault.under_item("effect", index))?;
    }
    let world = world.completed()?;
    let text = toml::to_string(config)
        .map_err(|error| Fault::here(format!("the scenario cannot be written as text: {error}")))?;
    Ok(SpindleSimulator { world, scenario: format!("plugin = \"{}\"\n{text}", SpindleConfig::NAME) })
}

impl SpindleSimulator {
    /// The rig that it simulates.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        &self.world.rig
    }

    /// The recording, computed as it is read.
    #[must_use]
    pub fn spindle_recording(&self) -> SpindleRecording<'_> {
        self.recording_in_blocks(recording::BLOCK_SAMPLES)
    }

    /// The recording with another number of samples in each block: the samples are the same.
    #[must_use]
    pub fn recording_in_blocks(&self, block_samples: usize) -> SpindleRecording<'_> {
        SpindleRecording { world: &self.world, block_samples }
    }
}

impl Simulator for SpindleSimulator {
    fn simulate(&self) -> Result<Simulation<'_>> {
        Ok(Simulation::Turns { rig: self.rig(), recording: Box::new(self.spindle_recording()) })
    }

    fn scenario(&self) -> &str {
        &self.scenario
    }
}

impl StageConfig for SpindleConfig {
    type Stage = Box<dyn Simulator>;

    const NAME: &'static str = "spindle";
    const ABOUT: &'static str =
        "a turned part on a spindle: form, error motion, and what goes wrong while measuring them";

    fn check(mut self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        // As harmonics: the recording then holds the whole truth without the file.
        if let Some(path) = self.form.measured.take() {
            let harmonics = measured::harmonics(&context.path(&path), self.form.max_order)
                .map_err(|problem| Fault::at("measured", problem).under("form"))?;
            self.form.harmonics.extend(harmonics);
        }
        Ok(Box::new(simulator(&self)?))
    }
}
