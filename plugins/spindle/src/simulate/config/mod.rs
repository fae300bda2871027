//! The scenario as written in a file.

mod motion;
mod part;

use runout_core::rig::RigConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use motion::{AsynchronousConfig, AxialLineConfig, LineConfig, MotionConfig, MotionHarmonic, Orders, TiltHarmonic};
pub use part::{FaceConfig, FormConfig, FormHarmonic};

/// A campaign on a spindle: what is true, and how it is measured.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, bound(deserialize = "E: Deserialize<'de>"))]
#[schemars(rename = "SpindleConfig", bound = "E: JsonSchema + Serialize")]
pub struct Scenario<E> {
    /// Every random choice follows from it; the same seed gives the same samples.
    #[serde(default)]
    pub seed: u64,
    /// How readings follow from form and displacement.
    #[serde(default)]
    pub geometry: Geometry,
    /// Sensors and setups, as declared.
    pub rig: RigConfig,
    /// Turns, sampling, stations and converter.
    #[serde(default)]
    pub recording: RecordingConfig,
    /// The part.
    #[serde(default)]
    pub form: FormConfig,
    /// Faces of the axial sensors; those that are not named are flat.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub face: Vec<FaceConfig>,
    /// The spindle's synchronous error motion.
    #[serde(default)]
    pub motion: MotionConfig,
    /// How the part is clamped in each setup.
    #[serde(default)]
    pub eccentricity: EccentricityConfig,
    /// Motion of the axis that does not repeat from turn to turn.
    #[serde(default)]
    pub asynchronous: AsynchronousConfig,
    /// Noise of each sensor.
    #[serde(default)]
    pub noise: NoiseConfig,
    /// What else happens, declared to the separation or hidden from it.
    #[serde(default)]
    pub effect: Vec<E>,
}

impl<E> Scenario<E> {
    /// A perfect part on a perfect spindle, 60 turns of 512 samples at one station.
    #[must_use]
    pub fn new(rig: RigConfig) -> Self {
        Self {
            seed: 0,
            geometry: Geometry::default(),
            rig,
            recording: RecordingConfig::default(),
            form: FormConfig::default(),
            face: Vec::new(),
            motion: MotionConfig::default(),
            eccentricity: EccentricityConfig::default(),
            asynchronous: AsynchronousConfig::default(),
            noise: NoiseConfig::default(),
            effect: Vec::new(),
        }
    }
}

/// How readings follow from form and displacement.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    /// The sensor's line meets the displaced part.
    #[default]
    Exact,
    /// Form under the sensor plus displacement along its line, as in the paper's equations.
    Linear,
}

/// `[recording]`
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RecordingConfig {
    /// Whole turns at full speed in each capture.
    pub revolutions: usize,
    /// Samples in one turn at the nominal speed.
    pub samples_per_rev: usize,
    /// Nominal speed, in 1/min.
    pub speed_rpm: f64,
    /// Turns before, in which the speed rises steadily from standstill.
    pub start_up_turns: usize,
    /// Turns after, in which the speed falls steadily to standstill.
    pub run_down_turns: usize,
    /// Slow wandering of the speed: root mean square, in percent of the nominal speed.
    pub speed_wobble_percent: f64,
    /// Samples before the first mark and after the last one, so that no turn lies at the very end.
    pub margin_samples: usize,
    /// How the recording gives the spindle's angle.
    pub phase: Phase,
    /// Type of the samples.
    pub format: SampleFormat,
    /// The converter's range, from −range to +range, in µm; integer samples need it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_um: Option<f64>,
    /// Axial positions of the carriage.
    pub stations: StationsConfig,
}

impl Default for RecordingConfig {
    fn default() -> Self {
        Self {
            revolutions: 60,
            samples_per_rev: 512,
            speed_rpm: 500.0,
            start_up_turns: 0,
            run_down_turns: 0,
            speed_wobble_percent: 0.0,
            margin_samples: 16,
            phase: Phase::default(),
            format: SampleFormat::default(),
            range_um: None,
            stations: StationsConfig::default(),
        }
    }
}

/// How a recording gives the spindle's angle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// A mark once per turn.
    #[default]
    Index,
    /// The true angle of each sample.
    Encoder,
}

/// Type of the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SampleFormat {
    /// Double precision.
    #[default]
    F64,
    /// Single precision.
    F32,
    /// 16-bit converter codes, clipped at the range.
    I16,
    /// 32-bit converter codes, clipped at the range.
    I32,
}

/// Stations `s001`, `s002`, … at equal steps.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StationsConfig {
    /// Carriage position of the first, added to each sensor's z, in mm.
    pub first_z_mm: f64,
    /// From one to the next, in mm.
    pub step_mm: f64,
    /// How many.
    pub count: usize,
}

impl Default for StationsConfig {
    fn default() -> Self {
        Self { first_z_mm: 0.0, step_mm: 1.0, count: 1 }
    }
}

/// `[eccentricity]`: how far the clamped part's axis is from the spindle's, in a random direction for each setup.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EccentricityConfig {
    /// At the first section of the first station, in µm.
    pub offset_um: f64,
    /// Tilt of the part's axis, in µrad: the offset changes along z.
    pub tilt_urad: f64,
}

/// `[noise]`
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct NoiseConfig {
    /// Root mean square of each sensor's own white, normal noise, in µm.
    pub rms_um: f64,
}
