//! The scenario of a simulated surface.

use std::path::PathBuf;

use runout_core::fault::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A surface that a fly cutter leaves, and its truth.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlyCuttingScenario {
    /// Standard deviation of the noise of each height, in nm; the file states it as `std_nm`.
    #[serde(default)]
    pub noise_nm: f64,
    /// What the file states as the standard uncertainty of a height, in nm, where it is not the noise; 0 states nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stated_std_nm: Option<f64>,
    /// Seed of the noise.
    #[serde(default)]
    pub seed: u64,
    /// `motion.parquet` of a spindle run, relative to the scenario: the synchronous error motion, repeated every turn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<PathBuf>,
    /// The station of `motion` to take; the first one without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion_station: Option<String>,
    /// Lines that the closed loop found in a recording of the spindle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spindle: Option<SpindleConfig>,
    /// The cut.
    pub cut: CutConfig,
    /// Where the surface is measured.
    pub grid: GridConfig,
    /// Lines in the motion of the spindle.
    #[serde(default)]
    pub line: Vec<LineConfig>,
    /// Motion of the spindle that repeats with the turn.
    #[serde(default)]
    pub harmonics: Vec<HarmonicConfig>,
    /// What else happens.
    #[serde(default)]
    pub effect: Vec<SimulatedEffect>,
}

/// `[spindle]`: each `asynchronous-line` of a diagnosis moves the tool at its order of this cut's speed.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpindleConfig {
    /// `diagnosis.json` of a spindle's recording, relative to the scenario.
    pub diagnosis: PathBuf,
    /// Height of the tool, in nm, for each µm of the line's amplitude across the axis: a property of the spindle.
    pub axial_nm_per_um: f64,
}

/// `[cut]`.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CutConfig {
    /// Radius of the tool's nose, in mm.
    pub nose_radius_mm: f64,
    /// Feed, in µm per revolution.
    pub feed_um_per_rev: f64,
    /// Distance of the tool from the spindle's axis, in mm.
    pub cutter_radius_mm: f64,
    /// Speed, in revolutions per minute.
    pub speed_rpm: f64,
}

/// `[grid]`: x runs along the feed, and the tool crosses y = 0 at x = 0 at the time 0.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridConfig {
    /// Points along y.
    pub rows: usize,
    /// Points along x.
    pub columns: usize,
    /// Distance of columns, in mm.
    pub step_x_mm: f64,
    /// Distance of rows, in mm.
    pub step_y_mm: f64,
    /// x of the first column, in mm.
    #[serde(default)]
    pub origin_x_mm: f64,
    /// y of the first row, in mm.
    #[serde(default)]
    pub origin_y_mm: f64,
}

/// Which motion of the spindle moves the tool up and down.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// Along the axis: the height of the tool itself.
    #[default]
    Axial,
    /// Tilt about x: its height at the tool is the tilt times r·sin ωt.
    TiltX,
    /// Tilt about y: its height at the tool is the tilt times −r·cos ωt.
    TiltY,
}

/// `[[line]]`: A·cos(2πFt + phase).
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineConfig {
    /// Frequency F, in Hz.
    pub frequency_hz: f64,
    /// Which motion it is of.
    #[serde(default)]
    pub direction: Direction,
    /// Amplitude of an axial line, in nm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude_nm: Option<f64>,
    /// Amplitude of a tilt, in µrad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude_urad: Option<f64>,
    /// Phase at the time 0, in degrees.
    #[serde(default)]
    pub phase_deg: f64,
}

/// `[[harmonics]]`: A·cos(order·ωt + phase).
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HarmonicConfig {
    /// Periods a turn.
    pub order: u32,
    /// Which motion it is of.
    #[serde(default)]
    pub direction: Direction,
    /// Amplitude of an axial harmonic, in nm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude_nm: Option<f64>,
    /// Amplitude of a tilt, in µrad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude_urad: Option<f64>,
    /// Phase at the spindle's angle 0, in degrees.
    #[serde(default)]
    pub phase_deg: f64,
}

/// `[[effect]]`: what happens besides. `declared` says whether the pipeline declares it.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "plugin", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SimulatedEffect {
    /// A line in the motion of the spindle, at a frequency or at a ratio to the speed.
    SpindleLine {
        /// Frequency, in Hz.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        frequency_hz: Option<f64>,
        /// Periods per turn.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        frequency_ratio: Option<f64>,
        /// Which motion it is of.
        #[serde(default)]
        direction: Direction,
        /// Amplitude of an axial line, in nm.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        amplitude_nm: Option<f64>,
        /// Amplitude of a tilt, in µrad.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        amplitude_urad: Option<f64>,
        /// Phase at the time 0, in degrees.
        #[serde(default)]
        phase_deg: f64,
        /// Whether the pipeline declares it.
        #[serde(default)]
        declared: bool,
    },
    /// The map is of a surface that was tilted.
    WorkpieceTilt {
        /// Slope along x, in µrad.
        #[serde(default)]
        x_urad: f64,
        /// Slope along y, in µrad.
        #[serde(default)]
        y_urad: f64,
        /// Whether the pipeline declares it.
        #[serde(default)]
        declared: bool,
    },
    /// The table rises and falls along the feed: a Legendre polynomial over the length of the map.
    TableStraightness {
        /// Order of the polynomial, 2 to 5.
        order: usize,
        /// Height at the end of the map, in nm.
        amplitude_nm: f64,
        /// Whether the pipeline declares it.
        #[serde(default)]
        declared: bool,
    },
    /// The feed is not the declared one.
    FeedScale {
        /// Relative error, in µm/m.
        scale_um_per_m: f64,
        /// Whether the pipeline declares it.
        #[serde(default)]
        declared: bool,
    },
    /// The radius of the nose is not the declared one.
    NoseRadius {
        /// Actual less declared radius, in mm.
        change_mm: f64,
        /// Whether the pipeline declares it.
        #[serde(default)]
        declared: bool,
    },
    /// The map is turned about its normal, by an angle from the machine's x to its own about x = y = 0.
    MapRotation {
        /// The angle, in µrad.
        angle_urad: f64,
        /// Whether the pipeline declares it.
        #[serde(default)]
        declared: bool,
    },
    /// The radius of the cutter is not the declared one.
    CutterRadius {
        /// Actual less declared radius, in mm.
        change_mm: f64,
        /// Whether the pipeline declares it.
        #[serde(default)]
        declared: bool,
    },
    /// A groove along a straight line: no effect of the closed loop.
    Scratch {
        /// Where it begins, in mm.
        from_mm: [f64; 2],
        /// Where it ends, in mm.
        to_mm: [f64; 2],
        /// Its width, in mm.
        width_mm: f64,
        /// Its depth, in nm.
        depth_nm: f64,
    },
    /// A round hole: no effect of the closed loop.
    Pit {
        /// Its middle, in mm.
        at_mm: [f64; 2],
        /// Its radius, in mm.
        radius_mm: f64,
        /// Its depth, in nm.
        depth_nm: f64,
    },
}

/// Orders of table straightness.
const ORDERS: std::ops::RangeInclusive<usize> = 2..=5;

impl FlyCuttingScenario {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub(super) fn checked(&self) -> Result<(), Fault> {
        let CutConfig { nose_radius_mm, feed_um_per_rev, cutter_radius_mm, speed_rpm } = self.cut;
        for (key, unit, value) in [
            ("nose_radius_mm", "mm", nose_radius_mm),
            ("feed_um_per_rev", "µm", feed_um_per_rev),
            ("cutter_radius_mm", "mm", cutter_radius_mm),
            ("speed_rpm", "rpm", speed_rpm),
        ] {
            above_zero(key, unit, value).map_err(|fault| fault.under("cut"))?;
        }
        if 1e-3 * feed_um_per_rev >= nose_radius_mm {
            let problem = format!(
                "a feed of {feed_um_per_rev} µm is not below the nose radius of {nose_radius_mm} mm: passes would leave walls \
                 between them"
            );
            return Err(Fault::at("feed_um_per_rev", problem).under("cut"));
        }
        self.grid.checked(cutter_radius_mm).map_err(|fault| fault.under("grid"))?;
        for (key, value) in [("noise_nm", self.noise_nm), ("stated_std_nm", self.stated_std_nm.unwrap_or(0.0))] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Fault::at(key, format!("expected 0 nm or above, found {value}")));
            }
        }
        for (index, line) in self.line.iter().enumerate() {
            let here = |fault: Fault| fault.under_item("line", index);
            above_zero("frequency_hz", "Hz", line.frequency_hz).map_err(here)?;
            amplitude(line.direction, line.amplitude_nm, line.amplitude_urad).map_err(here)?;
            finite("phase_deg", line.phase_deg).map_err(here)?;
        }
        for (index, one) in self.harmonics.iter().enumerate() {
            let here = |fault: Fault| fault.under_item("harmonics", index);
            amplitude(one.direction, one.amplitude_nm, one.amplitude_urad).map_err(here)?;
            finite("phase_deg", one.phase_deg).map_err(here)?;
        }
        if let Some(spindle) = &self.spindle {
            finite("axial_nm_per_um", spindle.axial_nm_per_um).map_err(|fault| fault.under("spindle"))?;
        }
        if self.motion_station.is_some() && self.motion.is_none() {
            return Err(Fault::at("motion_station", "there is no `motion` that it could be a station of"));
        }
        let effects = self.effect.iter().enumerate();
        effects.into_iter().try_for_each(|(index, effect)| {
            effect.checked(&self.cut, &self.grid).map_err(|fault| fault.under_item("effect", index))
        })
    }
}

impl GridConfig {
    fn checked(&self, cutter_radius_mm: f64) -> Result<(), Fault> {
        for (key, count) in [("rows", self.rows), ("columns", self.columns)] {
            if !(2..=20_000).contains(&count) {
                return Err(Fault::at(key, format!("expected 2 to 20000, found {count}")));
            }
        }
        above_zero("step_x_mm", "mm", self.step_x_mm)?;
        above_zero("step_y_mm", "mm", self.step_y_mm)?;
        finite("origin_x_mm", self.origin_x_mm)?;
        finite("origin_y_mm", self.origin_y_mm)?;
        let last_mm = self.origin_y_mm + self.step_y_mm * (self.rows - 1) as f64;
        if self.origin_y_mm.abs().max(last_mm.abs()) >= cutter_radius_mm {
            let problem = format!(
                "rows from y = {} to {last_mm} mm reach beyond the cutter, whose radius is {cutter_radius_mm} mm",
                self.origin_y_mm
            );
            return Err(Fault::at("origin_y_mm", problem));
        }
        Ok(())
    }
}

impl SimulatedEffect {
    fn checked(&self, cut: &CutConfig, grid: &GridConfig) -> Result<(), Fault> {
        let nose_radius_mm = cut.nose_radius_mm;
        match self {
            Self::SpindleLine {
                frequency_hz,
                frequency_ratio,
                direction,
                amplitude_nm,
                amplitude_urad,
                phase_deg,
                ..
            } => {
                match (frequency_hz, frequency_ratio) {
                    (Some(hertz), None) => above_zero("frequency_hz", "Hz", *hertz)?,
                    (None, Some(ratio)) => above_zero("frequency_ratio", "per turn", *ratio)?,
                    _ => return Err(Fault::at("frequency_hz", "give either `frequency_hz` or `frequency_ratio`")),
                }
                amplitude(*direction, *amplitude_nm, *amplitude_urad)?;
                finite("phase_deg", *phase_deg)
            }
            Self::WorkpieceTilt { x_urad, y_urad, .. } => finite("x_urad", *x_urad).and(finite("y_urad", *y_urad)),
            Self::TableStraightness { order, amplitude_nm, .. } => {
                if !ORDERS.contains(order) {
                    return Err(Fault::at("order", format!("expected an order from 2 to 5, found {order}")));
                }
                finite("amplitude_nm", *amplitude_nm)
            }
            Self::FeedScale { scale_um_per_m, .. } if scale_um_per_m.is_finite() && *scale_um_per_m > -5e5 => Ok(()),
            Self::FeedScale { scale_um_per_m, .. } => {
                Err(Fault::at("scale_um_per_m", format!("expected above −500000 µm/m, found {scale_um_per_m}")))
            }
            Self::NoseRadius { change_mm, .. } if nose_radius_mm + change_mm > 0.0 && change_mm.is_finite() => Ok(()),
            Self::NoseRadius { change_mm, .. } => {
                let problem = format!("a change of {change_mm} mm leaves nothing of a radius of {nose_radius_mm} mm");
                Err(Fault::at("change_mm", problem))
            }
            Self::MapRotation { angle_urad, .. } => finite("angle_urad", *angle_urad),
            Self::CutterRadius { change_mm, .. } => {
                let cutter_radius_mm = cut.cutter_radius_mm + change_mm;
                above_zero("change_mm", "mm", cutter_radius_mm).and(grid.checked(cutter_radius_mm))
            }
            Self::Scratch { width_mm, depth_nm, .. } => {
                above_zero("width_mm", "mm", *width_mm).and(finite("depth_nm", *depth_nm))
            }
            Self::Pit { radius_mm, depth_nm, .. } => {
                above_zero("radius_mm", "mm", *radius_mm).and(finite("depth_nm", *depth_nm))
            }
        }
    }
}

fn above_zero(key: &str, unit: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Fault::at(key, format!("expected a number above 0 {unit}, found {value}")))
}

fn finite(key: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() { Ok(()) } else { Err(Fault::at(key, format!("expected a finite number, found {value}"))) }
}

/// The amplitude in the unit of its direction.
fn amplitude(direction: Direction, nm: Option<f64>, urad: Option<f64>) -> Result<(), Fault> {
    let (key, value, other) = match direction {
        Direction::Axial => ("amplitude_nm", nm, urad),
        Direction::TiltX | Direction::TiltY => ("amplitude_urad", urad, nm),
    };
    match (value, other) {
        (Some(value), None) => finite(key, value),
        _ => Err(Fault::at(key, format!("this direction has its amplitude in `{key}`, and in no other key"))),
    }
}
