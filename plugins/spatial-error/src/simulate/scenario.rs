//! What is simulated, and its check.

use nalgebra::Vector3;
use runout_core::{
    fault::{Fault, known_names},
    pipeline::{Context, StageConfig},
    stage::Simulator,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Field, SpatialErrorSimulator};

/// A campaign over the travel of a machine, and its truth.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Where is measured.
    pub layout: Layout,
    /// Times that all places are measured.
    #[serde(default = "one")]
    pub passes: usize,
    /// Whether each pass takes the places in an order of its own; row by row of the grid without it.
    #[serde(default)]
    pub random_order: bool,
    /// Time between rows, in s.
    #[serde(default = "ten")]
    pub seconds_per_point: f64,
    /// Seed of field and noise.
    #[serde(default)]
    pub seed: u64,
    /// Linear axes from the base to the tool: "XYZ".
    #[serde(default = "xyz")]
    pub chain: String,
    /// Offset of the measured point from the last axis, in mm.
    #[serde(default)]
    pub tool_mm: [f64; 3],
    /// The tracker's noise.
    pub tracker: Tracker,
    /// Placement of the tracker.
    #[serde(default)]
    pub placement: Placement,
    /// Smooth random error field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<Field>,
    /// Errors of the axes, and what else happens.
    #[serde(default)]
    pub effect: Vec<SimulatedEffect>,
}

/// Where is measured.
#[derive(Debug, Clone, Copy, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Layout {
    /// A grid, x first.
    Grid {
        /// First place.
        from_mm: [f64; 3],
        /// Last place.
        to_mm: [f64; 3],
        /// Places along each axis.
        counts: [usize; 3],
    },
    /// Places at random.
    Scattered {
        /// One corner of the volume.
        from_mm: [f64; 3],
        /// The opposite one.
        to_mm: [f64; 3],
        /// How many.
        count: usize,
    },
}

/// The tracker.
#[derive(Debug, Clone, Copy, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tracker {
    /// Where it stands, in mm.
    #[serde(default)]
    pub at_mm: [f64; 3],
    /// Standard deviation of the range, and of the target in each direction, in µm.
    pub noise_um: f64,
    /// Standard deviation of its angles, in µrad.
    #[serde(default)]
    pub angle_urad: f64,
}

/// A displacement and a rotation of the tracker's frame, about the middle of the travel.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    /// In µm.
    #[serde(default)]
    pub shift_um: [f64; 3],
    /// Rotation vector, in µrad.
    #[serde(default)]
    pub turn_urad: [f64; 3],
}

/// An error of an axis, or what else happens.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "plugin", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SimulatedEffect {
    /// Length error of X, Y or Z.
    Scale {
        /// The axis.
        targets: [String; 1],
        /// In µm/m.
        scale_um_per_m: f64,
    },
    /// XY, XZ, YZ: the first moves with the second.
    Squareness {
        /// The axes.
        targets: [String; 1],
        /// In µrad.
        angle_urad: f64,
    },
    /// EXX, EYY, EZZ: a Legendre polynomial over the travel.
    Positioning {
        /// The error.
        targets: [String; 1],
        /// Of the polynomial.
        order: u32,
        /// In µm.
        amplitude_um: f64,
    },
    /// EYX, EZX, …: a Legendre polynomial over the travel.
    Straightness {
        /// The error.
        targets: [String; 1],
        /// Of the polynomial.
        order: u32,
        /// In µm.
        amplitude_um: f64,
    },
    /// EAX, EBX, …: a Legendre polynomial over the travel.
    Angular {
        /// The error.
        targets: [String; 1],
        /// Of the polynomial.
        order: u32,
        /// In µrad.
        amplitude_urad: f64,
    },
    /// Readings drift along x, y or z.
    ThermalDrift {
        /// The direction.
        targets: [String; 1],
        /// At the end of the campaign (linear), or long after (exponential), in µm.
        drift_um: f64,
        /// Time constant as a share of the campaign; linear without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        time_constant: Option<f64>,
    },
    /// The screw of X, Y or Z is eccentric, or its scale has a period.
    AxisPitch {
        /// The axis.
        targets: [String; 1],
        /// In mm.
        period_mm: f64,
        /// In µm.
        amplitude_um: f64,
        /// Where the axis is at 0 mm.
        #[serde(default)]
        phase_deg: f64,
    },
    /// The tracker or the datum of the machine is displaced from a time on.
    TrackerStep {
        /// Share of the campaign before it.
        at: f64,
        /// By which later readings are displaced, in µm.
        by_um: [f64; 3],
    },
    /// The readings of two passes are exchanged in the file, row by row; of one, given twice, they are in reverse order: a mistake of the file.
    PassSwapped {
        /// Numbers of the passes, from 1.
        passes: [usize; 2],
    },
    /// A step across a plane: no effect of the closed loop.
    Step {
        /// X, Y or Z, across which the plane is.
        axis: String,
        /// Where, in mm.
        at_mm: f64,
        /// By which places above it are displaced, in µm.
        by_um: [f64; 3],
    },
    /// A box that is displaced: no effect of the closed loop.
    DisplacedBox {
        /// Its lowest corner, in mm.
        from_mm: [f64; 3],
        /// Its highest corner, in mm.
        to_mm: [f64; 3],
        /// In µm.
        by_um: [f64; 3],
    },
    /// One bad reading: no effect of the closed loop.
    BadReading {
        /// The row, from 0.
        row: usize,
        /// In µm.
        by_um: [f64; 3],
    },
}

fn one() -> usize {
    1
}

fn ten() -> f64 {
    10.0
}

fn xyz() -> String {
    "XYZ".into()
}

/// Rows at most.
const MOST: usize = 1_000_000;

impl Layout {
    pub(super) fn ends(&self) -> (Vector3<f64>, Vector3<f64>) {
        let (Self::Grid { from_mm, to_mm, .. } | Self::Scattered { from_mm, to_mm, .. }) = self;
        (Vector3::from(*from_mm), Vector3::from(*to_mm))
    }

    fn count(&self) -> usize {
        match self {
            Self::Grid { counts, .. } => counts.iter().product(),
            Self::Scattered { count, .. } => *count,
        }
    }
}

impl StageConfig for Scenario {
    type Stage = Box<dyn Simulator>;

    const NAME: &'static str = "spatial-error";
    const ABOUT: &'static str = "a machine with errors of its axes and a random field, read by a tracker";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Box::new(self.checked()?))
    }
}

impl Scenario {
    pub(super) fn chain_letters(&self) -> Vec<char> {
        self.chain.chars().collect()
    }

    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn checked(self) -> std::result::Result<SpatialErrorSimulator, Fault> {
        if i64::try_from(self.seed).is_err() {
            return Err(Fault::at("seed", format!("expected a seed up to {}, found {}", i64::MAX, self.seed)));
        }
        let rows = self.layout.count().saturating_mul(self.passes);
        if !(1..=MOST).contains(&rows) {
            return Err(Fault::at("layout", format!("expected 1 to {MOST} rows in all passes, found {rows}")));
        }
        let (from, to) = self.layout.ends();
        if !(0..3).all(|axis| from[axis] <= to[axis] && from[axis].is_finite() && to[axis].is_finite()) {
            return Err(Fault::at("layout", "`to_mm` is not above `from_mm` along each axis"));
        }
        let mut letters = self.chain_letters();
        letters.sort_unstable();
        if letters != ['X', 'Y', 'Z'] {
            return Err(Fault::at("chain", format!("expected X, Y and Z, each once, found `{}`", self.chain)));
        }
        for (key, value) in [("noise_um", self.tracker.noise_um), ("angle_urad", self.tracker.angle_urad)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Fault::at(key, format!("expected 0 or above, found {value}")).under("tracker"));
            }
        }
        if let Some(field) = &self.field {
            let wrong = |key: &str, problem: &str| Err(Fault::at(key, problem).under("field"));
            if field.range_mm.iter().any(|range| !(range.is_finite() && *range > 0.0)) {
                return wrong("range_mm", "ranges are above 0 mm");
            }
            if field.std_um.iter().any(|std| !(std.is_finite() && *std >= 0.0)) {
                return wrong("std_um", "standard deviations are 0 µm or above");
            }
            if field.smoothness.is_some_and(|nu| !(nu.is_finite() && nu > 0.0)) {
                return wrong("smoothness", "the smoothness is above 0");
            }
        }
        for (index, effect) in self.effect.iter().enumerate() {
            effect.check().map_err(|fault| fault.under_item("effect", index))?;
        }
        let text = toml::to_string(&self)
            .map_err(|error| Fault::here(format!("the scenario cannot be written as text: {error}")))?;
        Ok(SpatialErrorSimulator { text: format!("plugin = \"{}\"\n{text}", Self::NAME), scenario: self })
    }
}

impl SimulatedEffect {
    fn check(&self) -> std::result::Result<(), Fault> {
        let (key, target, known): (&str, &str, &[&str]) = match self {
            Self::AxisPitch { period_mm, .. } if !(period_mm.is_finite() && *period_mm > 0.0) => {
                return Err(Fault::at("period_mm", format!("expected a period above 0 mm, found {period_mm}")));
            }
            Self::Scale { targets, .. } | Self::AxisPitch { targets, .. } => ("targets", &targets[0], &["X", "Y", "Z"]),
            Self::Squareness { targets, .. } => ("targets", &targets[0], &["XY", "XZ", "YZ"]),
            Self::Positioning { targets, .. } => ("targets", &targets[0], &["EXX", "EYY", "EZZ"]),
            Self::Straightness { targets, .. } => ("targets", &targets[0], &["EYX", "EZX", "EXY", "EZY", "EXZ", "EYZ"]),
            Self::Angular { targets, .. } => {
                ("targets", &targets[0], &["EAX", "EBX", "ECX", "EAY", "EBY", "ECY", "EAZ", "EBZ", "ECZ"])
            }
            Self::ThermalDrift { targets, .. } => ("targets", &targets[0], &["x", "y", "z"]),
            Self::Step { axis, .. } => ("axis", axis, &["X", "Y", "Z"]),
            Self::TrackerStep { .. }
            | Self::PassSwapped { .. }
            | Self::DisplacedBox { .. }
            | Self::BadReading { .. } => return Ok(()),
        };
        if known.contains(&target) {
            return Ok(());
        }
        let help = known_names(target, known.iter().copied());
        Err(Fault::at(key, format!("the effect cannot act at `{target}`")).help(help))
    }
}
