//! What can be simulated, as written in a file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A scenario: `plugin = "touch-probe"`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TouchProbeScenario {
    /// Seed of the noise and of the random form of the ring.
    pub seed: u64,
    /// Radius of the ring, in mm.
    pub ring_radius_mm: f64,
    /// Touches of a pass, evenly all around.
    pub directions: usize,
    /// Directions that are left out of each pass, from this one in degrees to that one.
    pub gap_deg: Option<[f64; 2]>,
    /// Passes in each setup.
    pub repeats: usize,
    /// Standard deviation of a touch, in µm.
    pub std_um: f64,
    /// Time from touch to touch, in s.
    pub interval_s: f64,
    /// The probe.
    pub probe: Probe,
    /// The form of the ring.
    pub ring: Ring,
    /// Setups in the order in which they are measured.
    pub setups: Vec<Placed>,
    /// Errors of the machine.
    pub machine: Machine,
    /// Drift over the whole measurement.
    pub drift: Drift,
    /// Disturbances that no effect models.
    pub strangers: Strangers,
}

impl Default for TouchProbeScenario {
    fn default() -> Self {
        Self {
            seed: 1,
            ring_radius_mm: 25.0,
            directions: 60,
            gap_deg: None,
            repeats: 3,
            std_um: 0.9,
            interval_s: 5.0,
            probe: Probe::default(),
            ring: Ring::default(),
            setups: vec![Placed::default()],
            machine: Machine::default(),
            drift: Drift::default(),
            strangers: Strangers::default(),
        }
    }
}

/// A kinematic probe.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Probe {
    /// Angles of the seats in the probe, in degrees.
    pub seats_deg: [f64; 3],
    /// Radius of the seats, in mm.
    pub seat_radius_mm: f64,
    /// Preload, in N.
    pub preload_n: f64,
    /// Where the preload acts, from the axis, in mm.
    pub preload_at_mm: [f64; 2],
    /// Length of the stylus, in mm.
    pub stylus_mm: f64,
    /// Force that bends the stylus by 1 µm, in N.
    pub stiffness_n_per_um: f64,
    /// Resistance at which it triggers, over that without a force.
    pub trigger_ratio: f64,
    /// Lobing beside that of the seats: order, amplitude in µm, phase in degrees.
    pub extra_lobing: Vec<Wave>,
}

impl Default for Probe {
    fn default() -> Self {
        Self {
            seats_deg: [90.0, 210.5, 329.0],
            seat_radius_mm: 6.0,
            preload_n: 1.2,
            preload_at_mm: [0.15, 0.1],
            stylus_mm: 50.0,
            stiffness_n_per_um: 0.003,
            trigger_ratio: 1.25,
            extra_lobing: Vec::new(),
        }
    }
}

/// A cosine over an angle.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wave {
    /// Undulations per revolution.
    pub order: u32,
    /// Amplitude, in µm.
    pub amplitude_um: f64,
    /// Phase, in degrees: A cos(n angle + phase).
    #[serde(default)]
    pub phase_deg: f64,
}

/// The wall of the ring.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Ring {
    /// Single orders.
    pub waves: Vec<Wave>,
    /// Random form of orders 2 to 12, amplitudes falling as 1/n, in µm rms.
    pub random_rms_um: f64,
}

/// A setup.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Placed {
    /// Its id.
    pub id: String,
    /// Angle of the ring, in degrees.
    pub ring_deg: f64,
    /// Angle of the probe, in degrees.
    pub probe_deg: f64,
    /// Centre of the ring, in µm.
    pub centre_um: [f64; 2],
}

impl Default for Placed {
    fn default() -> Self {
        Self { id: "r0".into(), ring_deg: 0.0, probe_deg: 0.0, centre_um: [4.0, -7.0] }
    }
}

/// Errors of the machine.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Machine {
    /// Scale of X, in µm/m.
    pub scale_x: f64,
    /// Scale of Y, in µm/m.
    pub scale_y: f64,
    /// Squareness: x grows by this times y, in µrad.
    pub squareness_urad: f64,
    /// Lost motion of X and Y, in µm.
    pub reversal_um: [f64; 2],
}

/// Drift, from the first touch to the last.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Drift {
    /// Of the centre, in µm.
    pub centre_um: [f64; 2],
    /// Of the radius, in µm.
    pub radius_um: f64,
    /// Time constant over the duration; 0 for a straight line.
    pub time_constant: f64,
}

/// Disturbances that no effect models.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Strangers {
    /// A chip on the wall: angle on the ring in degrees, width in degrees, height in µm.
    pub chip: Option<[f64; 3]>,
    /// In which setup the chip is; all without it.
    pub chip_in: Option<usize>,
    /// A ring that is bent in one setup: number of the setup, and the wave.
    pub bent: Option<(usize, Wave)>,
    /// A ring that slips in one setup: number of the setup, the pass from which on, and the angle in degrees.
    pub slipped: Option<(usize, usize, f64)>,
}
