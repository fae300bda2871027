//! The scenario as it stands in a file.

use std::path::PathBuf;

use runout_core::rig::RigConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::effects::Effect;

/// A campaign on a spindle: what is true, and how it is measured.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpindleConfig {
    /// Every random choice follows from it; the same seed gives the same samples.
    #[serde(default)]
    pub seed: u64,
    /// How readings follow from form and displacement.
    #[serde(default)]
    pub geometry: Geometry,
    /// Sensors and setups, as they are believed to be.
    pub rig: RigConfig,
    /// Turns, sampling, stations and converter.
    #[serde(default)]
    pub recording: RecordingConfig,
    /// The part.
    #[serde(default)]
    pub form: FormConfig,
    /// Faces that axial sensors look at; those that are not named are flat.
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
    pub effect: Vec<Effect>,
}

impl SpindleConfig {
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
    /// How the recording tells the spindle's angle.
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

/// How a recording tells the spindle's angle.
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

/// `[form]`: deviation of the part from a perfect cylinder, one function of angle and z.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FormConfig {
    /// Root mean square of the random form over all sections that are measured, in µm.
    pub rms_um: f64,
    /// The random form has orders 2 to this one.
    pub max_order: usize,
    /// Amplitudes fall with order^-slope.
    pub slope: f64,
    /// Part of the mean square that changes along z, 0 to 1; the rest is shared by all sections.
    pub own_share: f64,
    /// Wavelength of the changes along z, in mm.
    pub wavelength_mm: f64,
    /// Harmonics in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub harmonics: Vec<FormHarmonic>,
    /// A measured profile in addition, the same at every z: a CSV file with columns `angle_deg` and `form_um`, relative to
    /// the scenario. Its orders 2 to `max_order` are taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<PathBuf>,
    /// Grooves along the part.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub keyways: Vec<Keyway>,
}

impl Default for FormConfig {
    fn default() -> Self {
        Self {
            rms_um: 0.0,
            max_order: 60,
            slope: 1.0,
            own_share: 0.3,
            wavelength_mm: 200.0,
            harmonics: Vec::new(),
            measured: None,
            keyways: Vec::new(),
        }
    }
}

/// A groove along the whole part: readings are lower by its depth while a sensor's line lies in it.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Keyway {
    /// The part's own angle at which it begins, in degrees.
    pub from_deg: f64,
    /// The angle at which it ends, in degrees; with `from_deg` above, it passes through 0.
    pub to_deg: f64,
    /// In µm.
    pub depth_um: f64,
}

/// amplitude · cos(order·α + phase + twist·z), α the part's angle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FormHarmonic {
    /// Undulations per turn, 2 or more.
    pub order: usize,
    /// In µm.
    pub amplitude_um: f64,
    /// In degrees.
    #[serde(default)]
    pub phase_deg: f64,
    /// How fast the phase advances along z, in degrees per mm.
    #[serde(default)]
    pub twist_deg_per_mm: f64,
}

/// `[[face]]`: deviation of a face from a plane square to the part's axis, along the circle under its axial sensors, positive
/// towards +z. On the axis it is what the spot there adds over a turn, which each clamping turns by an angle of its own.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceConfig {
    /// Id of its section in the rig.
    pub section: String,
    /// Root mean square of the random form, in µm.
    #[serde(default)]
    pub rms_um: f64,
    /// The random form has orders 2 to this one.
    #[serde(default = "usual_face_orders")]
    pub max_order: usize,
    /// Amplitudes fall with order^-slope.
    #[serde(default = "usual_slope")]
    pub slope: f64,
    /// Harmonics in addition, amplitude · cos(order·α + phase), α the part's angle; order 1 on the axis only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub harmonics: Vec<MotionHarmonic>,
}

impl Default for FaceConfig {
    fn default() -> Self {
        let (max_order, slope) = (usual_face_orders(), usual_slope());
        Self { section: String::new(), rms_um: 0.0, max_order, slope, harmonics: Vec::new() }
    }
}

fn usual_face_orders() -> usize {
    20
}

fn usual_slope() -> f64 {
    1.0
}

/// `[motion]`: synchronous error motion, the same in every setup and at every station.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MotionConfig {
    /// Root mean square of the random motion along x, in µm.
    pub x_rms_um: f64,
    /// Along y, in µm.
    pub y_rms_um: f64,
    /// Along the axis, in µm.
    #[serde(skip_serializing_if = "is_zero")]
    pub z_rms_um: f64,
    /// Root mean square of the random tilt about x and about y, in µrad each.
    pub tilt_rms_urad: f64,
    /// The random motion has orders 2 to this one.
    pub max_order: usize,
    /// Amplitudes fall with order^-slope.
    pub slope: f64,
    /// Which orders the random motion has.
    pub orders: Orders,
    /// Harmonics of x in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub x: Vec<MotionHarmonic>,
    /// Harmonics of y in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub y: Vec<MotionHarmonic>,
    /// Harmonics of z in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub z: Vec<MotionHarmonic>,
    /// Harmonics of the tilt about x in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tilt_x: Vec<TiltHarmonic>,
    /// Harmonics of the tilt about y in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tilt_y: Vec<TiltHarmonic>,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            x_rms_um: 0.0,
            y_rms_um: 0.0,
            z_rms_um: 0.0,
            tilt_rms_urad: 0.0,
            max_order: 20,
            slope: 1.0,
            orders: Orders::default(),
            x: Vec::new(),
            y: Vec::new(),
            z: Vec::new(),
            tilt_x: Vec::new(),
            tilt_y: Vec::new(),
        }
    }
}

/// A choice of orders.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Orders {
    /// Every order.
    #[default]
    All,
    /// Odd orders only: motion that half a turn of the spindle reverses.
    Odd,
    /// Even orders only.
    Even,
}

/// amplitude · cos(order·Φ − phase), Φ the spindle's angle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionHarmonic {
    /// Per turn, 1 or more. Of order 1 only what turns against the spindle counts as error motion across the axis; the rest is
    /// clamping. Along the axis all of it counts.
    pub order: usize,
    /// In µm.
    pub amplitude_um: f64,
    /// In degrees.
    #[serde(default)]
    pub phase_deg: f64,
}

/// amplitude · cos(order·Φ − phase), Φ the spindle's angle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TiltHarmonic {
    /// Per turn, 1 or more.
    pub order: usize,
    /// In µrad.
    pub amplitude_urad: f64,
    /// In degrees.
    #[serde(default)]
    pub phase_deg: f64,
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

/// `[asynchronous]`: a Weierstrass-Mandelbrot function of time,
/// z(t) = G^(D−1) Σ γ^((D−2)n) cos(2π γⁿ t + φₙ), γ^n₁ = 1/L, with random phases for each direction and capture.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AsynchronousConfig {
    /// Root mean square along x and along y, in µm each.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_um: Option<f64>,
    /// Instead of `rms_um`: the scale G, with z in mm and t in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_mm: Option<f64>,
    /// Fractal dimension D, between 1 and 2.
    pub dimension: f64,
    /// Ratio γ of neighbouring frequencies, above 1.
    pub gamma: f64,
    /// Period L of the slowest term, in s; without it the length of the capture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_period_s: Option<f64>,
    /// No term is faster, in Hz; without it half the sampling rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_frequency_hz: Option<f64>,
    /// Root mean square of the same kind of tilt about x and about y, in µrad each.
    pub tilt_rms_urad: f64,
    /// Root mean square of the same kind of motion along the axis, in µm.
    #[serde(skip_serializing_if = "is_zero")]
    pub z_rms_um: f64,
    /// Single lines in addition, at orders that are not whole.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<LineConfig>,
    /// The same along the axis.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub z_lines: Vec<AxialLineConfig>,
}

impl Default for AsynchronousConfig {
    fn default() -> Self {
        Self {
            rms_um: None,
            scale_mm: None,
            dimension: 1.5,
            gamma: 1.5,
            longest_period_s: None,
            max_frequency_hz: None,
            tilt_rms_urad: 0.0,
            z_rms_um: 0.0,
            lines: Vec::new(),
            z_lines: Vec::new(),
        }
    }
}

/// A bearing cage, a belt, mains hum: motion to and fro at an order that is not whole, its phase random in each capture.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineConfig {
    /// Periods per turn, not a whole number.
    pub order: f64,
    /// In µm.
    pub amplitude_um: f64,
    /// Direction of the motion about +z from x, in degrees.
    #[serde(default)]
    pub direction_deg: f64,
}

/// Motion to and fro along the axis at an order that is not whole, its phase random in each capture.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxialLineConfig {
    /// Periods per turn, not a whole number.
    pub order: f64,
    /// In µm.
    pub amplitude_um: f64,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// `[noise]`
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct NoiseConfig {
    /// Root mean square of each sensor's own white, normal noise, in µm.
    pub rms_um: f64,
}
