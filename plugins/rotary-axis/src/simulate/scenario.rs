//! What can be simulated, as written in a file.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{axis::Axis, config::Ball};

/// An R-test of a rotary axis, and its truth.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The rotary axis.
    #[serde(default)]
    pub axis: Axis,
    /// Nominal places at command 0.
    pub balls: Vec<Ball>,
    /// Commands of a pass.
    pub commands: Commands,
    /// Passes of each ball, one ball after the other; every second one runs back where `back_and_forth` is set.
    #[serde(default = "one")]
    pub passes: usize,
    /// Whether every second pass runs back.
    #[serde(default)]
    pub back_and_forth: bool,
    /// Whether all balls are measured in one pass before the next begins, instead of all passes of one ball.
    #[serde(default)]
    pub ball_by_ball: bool,
    /// Time between rows, in s.
    #[serde(default = "ten")]
    pub seconds_per_point: f64,
    /// Standard deviation of one coordinate, in µm.
    pub noise_um: f64,
    /// Seed of the noise.
    #[serde(default)]
    pub seed: u64,
    /// Location errors by their ISO symbols: µm and µrad.
    #[serde(default)]
    pub location: BTreeMap<String, f64>,
    /// Component errors: sums of harmonics of the command.
    #[serde(default)]
    pub component: Vec<Harmonic>,
    /// Standard deviation of random component errors at each command, in µm and µrad.
    #[serde(default)]
    pub random_component: f64,
    /// How balls were placed, in µm by their ids.
    #[serde(default)]
    pub placement: BTreeMap<String, [f64; 3]>,
    /// What else happens.
    #[serde(default)]
    pub effect: Vec<SimulatedEffect>,
}

fn one() -> usize {
    1
}

fn ten() -> f64 {
    10.0
}

/// Commands of a pass.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Commands {
    /// First command.
    #[serde(default)]
    pub from_deg: f64,
    /// Distance of commands.
    pub step_deg: f64,
    /// How many.
    pub count: usize,
}

/// A harmonic of a component error: cosine·cos(order·φ) + sine·sin(order·φ).
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Harmonic {
    /// ISO symbol: EXC.
    pub error: String,
    /// Periods a turn.
    pub order: u32,
    /// In µm or µrad.
    #[serde(default)]
    pub cosine: f64,
    /// In µm or µrad.
    #[serde(default)]
    pub sine: f64,
}

/// What happens besides.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "plugin", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SimulatedEffect {
    /// A linear axis that measures has a scale error.
    LinearAxisScale {
        /// X, Y or Z.
        targets: [String; 1],
        /// Error per length, in µm/m.
        scale_um_per_m: f64,
    },
    /// Two linear axes that measure are not square to each other.
    LinearAxisSquareness {
        /// XY, XZ or YZ.
        targets: [String; 1],
        /// Angle, in µrad.
        angle_urad: f64,
    },
    /// Readings drift along a coordinate.
    ThermalDrift {
        /// x, y or z.
        targets: [String; 1],
        /// At the end of the campaign (linear), or long after (exponential), in µm.
        drift_um: f64,
        /// Time constant as a share of the campaign; linear without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        time_constant: Option<f64>,
    },
    /// The rotary axis loses motion where its direction reverses.
    Backlash {
        /// In µrad.
        lost_motion_urad: f64,
    },
    /// A cable pulls the nest of sensors one way or the other, by the direction of approach.
    NestByDirection {
        /// x, y or z.
        targets: [String; 1],
        /// Between the two directions, in µm.
        shift_um: f64,
    },
    /// The nest of sensors is displaced at one time.
    NestStep {
        /// x, y or z.
        targets: [String; 1],
        /// In µm.
        step_um: f64,
        /// Share of the campaign that is before it.
        at: f64,
    },
    /// A ball slips on the table: no effect of the closed loop.
    SlippedBall {
        /// Row from which it is elsewhere.
        row: usize,
        /// Displacement on the table, in µm.
        by_um: [f64; 3],
    },
    /// One bad reading: no effect of the closed loop.
    BadReading {
        /// The row.
        row: usize,
        /// In µm.
        by_um: [f64; 3],
    },
}
