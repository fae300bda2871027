//! Campaigns drawn by chance: rigs, what is wrong with them, and how much.

use runout_core::rig::{RigConfig, SensorConfig};
use runout_spindle::simulate::{FormHarmonic, Geometry, Orders, SpindleConfig};

pub use super::Kind;
use super::turn;
use crate::campaign;
use crate::chance::Chance;

/// A campaign, and what the loop is to find in it.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// Its place in the benchmark.
    pub index: u64,
    /// Which layout.
    pub rig: Layout,
    /// What kind of campaign.
    pub kind: Kind,
    /// With what is wrong.
    pub config: SpindleConfig,
    /// The campaign without what is wrong.
    pub sound: SpindleConfig,
    /// What is wrong, as the loop would say it; of an unmodelled disturbance only its name.
    pub planted: Vec<Planted>,
    /// Whether the declared model has the exact geometry.
    pub second_order: bool,
}

/// A layout of sensors and setups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Two sensors in each of two sections, part at 0°, 99.844°, 202.5°, sensors fixed.
    Four,
    /// Three sensors in each of two sections, part at 0° and 180°, sensors fixed.
    Six,
    /// Two sensors in each of two sections, part and sensors reversed.
    Reversed,
    /// Two sensors in each of two sections, part reversed and sensors fixed, motion assumed odd as in the paper.
    Paper,
}

impl Layout {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Four, Self::Six, Self::Reversed, Self::Paper];

    /// As a word of a command line.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Four => "four",
            Self::Six => "six",
            Self::Reversed => "reversed",
            Self::Paper => "paper",
        }
    }

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Four => "four sensors, part at 0/99.844/202.5",
            Self::Six => "six sensors, part at 0/180",
            Self::Reversed => "four sensors, part and sensors at 0/180",
            Self::Paper => "four sensors fixed, part at 0/180, motion assumed odd",
        }
    }

    /// As a rig.
    pub(crate) fn config(self) -> RigConfig {
        match self {
            Self::Four => campaign::four_sensors(&[(0.0, 0.0), (99.844, 0.0), (202.5, 0.0)]),
            Self::Reversed => campaign::four_sensors(&[(0.0, 0.0), (180.0, 180.0)]),
            Self::Paper => campaign::four_sensors(&[(0.0, 0.0), (180.0, 0.0)]),
            Self::Six => {
                let mut rig = campaign::four_sensors(&[(0.0, 0.0), (180.0, 0.0)]);
                let places = [(100.0, "a"), (130.0, "b")]
                    .into_iter()
                    .flat_map(|(z_mm, section)| [0.0, 99.844, 202.5].map(|angle_deg| (angle_deg, z_mm, section)));
                let sensor = |(number, (angle_deg, z_mm, section)): (usize, (f64, f64, &str))| SensorConfig {
                    id: format!("S{number}"),
                    angle_deg,
                    z_mm,
                    section: section.into(),
                    sign: 1,
                    ..SensorConfig::default()
                };
                rig.sensors = (1..).zip(places).map(sensor).collect();
                rig
            }
        }
    }
}

/// Something wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Planted {
    /// Id of the effect.
    pub id: &'static str,
    /// A sensor's or a setup's.
    pub target: Option<String>,
    /// True values by the names that the loop gives them.
    pub parameters: Vec<(&'static str, f64)>,
    /// In words.
    pub size: String,
    /// Names of effects that it is too, in the mean over the turns: a probe that slips stands elsewhere in one setup.
    pub is_also: Vec<String>,
}

/// The effects that are planted: their ids, and those of a single setup.
pub const EFFECTS: [&str; 42] = [
    "sensor-gain",
    "sensor-angle",
    "sensor-axial-position",
    "sensor-nonlinearity",
    "reversal-angle",
    "setup-motion-change",
    "thermal-drift",
    "speed-ripple",
    "even-order-motion",
    "second-order-geometry",
    "filter-attenuation",
    "axial-motion",
    "asynchronous-line",
    "sensor-line",
    "speed-ripple-of-setup",
    "sensors-angle",
    "sensor-sign",
    "sensors-swapped",
    "setups-swapped",
    "rotation-reversed",
    "part-angle-sign",
    "channel-delay",
    "channel-skew",
    "filter-attenuation-2",
    "filter-attenuation-4",
    "sensor-gain-of-setup",
    "sensor-angle-of-setup",
    "setup-gain",
    "index-offset",
    "cross-talk",
    "channel-ghost",
    "probe-spot",
    "bracket-motion",
    "chuck-form",
    "clamping-form",
    "electrical-run-out",
    "sensor-sign-of-setup",
    "sensors-swapped-of-setup",
    "rotation-reversed-of-setup",
    "sensor-unit",
    "lost-samples",
    "turn-ratio",
];
/// Those of which two are planted at a time.
const PAIRED: [&str; 7] = [
    "sensor-gain",
    "sensor-nonlinearity",
    "reversal-angle",
    "setup-motion-change",
    "thermal-drift",
    "sensor-angle",
    "speed-ripple",
];
/// Unmodelled disturbances.
pub const STRANGERS: [&str; 4] = ["dent", "backlash", "step", "slipped-probe"];

/// Draws a campaign, of one layout or any; the same seed and index give the same.
#[must_use]
pub fn campaign(seed: u64, index: u64, only: Option<Layout>) -> Campaign {
    let mut draw = Chance::new(seed, index);
    let (kind, turn) = turn(index);
    let ids: Vec<&str> = match kind {
        Kind::Clean => vec![],
        Kind::Single => vec![EFFECTS[turn % EFFECTS.len()]],
        Kind::Stranger => vec![STRANGERS[turn % STRANGERS.len()]],
        Kind::Pair => {
            let first = draw.below(PAIRED.len());
            let second = (first + 1 + draw.below(PAIRED.len() - 1)) % PAIRED.len();
            vec![PAIRED[first], PAIRED[second]]
        }
    };
    let drawn = match ids[..] {
        ["even-order-motion"] => Layout::Paper,
        // What the paper's layout assumes is the one thing that it is there for.
        [] => Layout::ALL[draw.below(7) % 4],
        _ => Layout::ALL[draw.below(3)],
    };
    let rig = if drawn == Layout::Paper { drawn } else { only.unwrap_or(drawn) };
    let mut sound = draw.sound(rig, index, seed);
    let second_order = !ids.contains(&"second-order-geometry");
    if ids.contains(&"axial-motion") {
        // A part without any slope along z does not show it.
        sound.form.harmonics.push(FormHarmonic {
            order: 2,
            amplitude_um: 15.0,
            phase_deg: draw.between(0.0, 360.0),
            twist_deg_per_mm: 1.5,
        });
    }
    if ids.contains(&"sensor-axial-position") && draw.below(2) == 0 {
        // The same circle at every z: the sensor's lever on tilt is all that changes.
        sound.form.own_share = 0.0;
    }
    let mut config = sound.clone();
    if !second_order {
        sound.geometry = Geometry::Linear;
    }
    let large = kind == Kind::Pair;
    let planted = ids.iter().map(|id| draw.plant(id, large, &mut config)).collect();
    if !second_order {
        sound.eccentricity = config.eccentricity.clone();
    }
    Campaign { index, rig, kind, config, sound, planted, second_order }
}

impl Chance {
    fn sound(&mut self, rig: Layout, index: u64, seed: u64) -> SpindleConfig {
        let mut config = campaign::reference(seed.wrapping_mul(1_000_003).wrapping_add(index) >> 1, 0.0);
        config.rig = rig.config();
        config.form.rms_um = self.size(2.0, 6.0);
        let motion = self.size(0.7, 2.5);
        config.motion.x_rms_um = motion;
        config.motion.y_rms_um = motion * self.between(0.6, 1.4);
        config.motion.tilt_rms_urad = self.size(1.0, 8.0);
        if rig == Layout::Paper {
            config.motion.orders = Orders::Odd;
        }
        config.eccentricity.offset_um = self.size(2.0, 30.0);
        config.eccentricity.tilt_urad = self.between(0.0, 20.0);
        config.asynchronous.rms_um = Some(self.size(0.08, 0.3));
        config.asynchronous.tilt_rms_urad = self.between(0.0, 0.5);
        config.noise.rms_um = self.size(0.02, 0.1);
        config
    }

    pub(super) fn sensor(&mut self, config: &SpindleConfig) -> String {
        let index = self.below(config.rig.sensors.len());
        config.rig.sensors[index].id.clone()
    }

    /// Any but the first: of setups only differences show.
    pub(super) fn later_setup(&mut self, config: &SpindleConfig) -> String {
        let index = 1 + self.below(config.rig.setups.len() - 1);
        config.rig.setups[index].id.clone()
    }
}
