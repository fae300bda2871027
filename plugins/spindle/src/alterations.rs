//! What effects change: where sensors and part truly are, how readings follow from displacements.

use std::{fmt, sync::Arc};

use runout_core::{Complex64, rig};

/// Everything that effects change, at its declared value until one does.
#[derive(Debug, Clone)]
#[allow(clippy::struct_excessive_bools, reason = "each is an effect that is there or not")]
pub struct Alterations {
    /// One entry a sensor.
    pub sensors: Vec<SensorAlteration>,
    /// One entry a setup.
    pub setups: Vec<SetupAlteration>,
    /// Motion along the axis, in µm.
    pub axial_um: Vec<Harmonic>,
    /// What certain readings have besides the part's form.
    pub patterns: Vec<Pattern>,
    /// What channels read of others.
    pub cross_talk: Vec<CrossTalk>,
    /// Lines of the turns' spectrum that are taken out of the averages, by number: of a sensor (the first of those that have it), or of
    /// the axis.
    pub lines: Vec<(usize, Option<usize>)>,
    /// Of each channel, the sensor whose declared place it has.
    pub places: Vec<usize>,
    /// Setups in which alone two channels have each other's declared places.
    pub swapped_in: Vec<(usize, [usize; 2])>,
    /// Of each setup, the one whose declared clamping it has.
    pub clampings: Vec<usize>,
    /// As the rig declares them, one a sensor: ±1.
    pub declared_signs: Vec<f64>,
    /// Declared over true radius of the part, less 1.
    pub curvature: f64,
    /// Whether the part turns the other way than declared.
    pub rotation_reversed: bool,
    /// Whether the part's angles count the other way than declared.
    pub part_angles_reversed: bool,
    /// Whether the sensors' angles do.
    pub sensor_angles_reversed: bool,
    /// Whether motion keeps the sign of even orders, where the separator assumes otherwise.
    pub even_order_motion: bool,
    /// Whether geometry is exact, where the separator leaves it linear.
    pub exact_geometry: bool,
}

/// One sensor.
#[derive(Debug, Clone)]
pub struct SensorAlteration {
    /// −1 where readings have the opposite sign to that declared, else +1.
    pub sign: f64,
    /// Setups in which alone readings have the opposite sign.
    pub reversed_in: Vec<usize>,
    /// Whether it stands half a turn from the declared angle.
    pub opposite: bool,
    /// Whether it looks at the other section.
    pub in_other_section: bool,
    /// Relative gain less 1.
    pub gain: f64,
    /// True less declared angle, in rad.
    pub angle_rad: f64,
    /// True less declared axial position, in mm.
    pub z_mm: f64,
    /// True less declared axial position, as far as the sensor sees another circle of the part there, in mm.
    pub circle_mm: f64,
    /// Share of the spindle's motion with which the sensor's own bracket moves.
    pub bracket_share: f64,
    /// Squared width of the spot over which it averages the form, in mm².
    pub spot_mm2: f64,
    /// Reading = u + quadratic·u² + cubic·u³, in 1/µm.
    pub quadratic_per_um: f64,
    /// In 1/µm².
    pub cubic_per_um2: f64,
    /// Creep over the averaged turn, in µm.
    pub creep_um: f64,
    /// In each setup, creep over the turns at hand, over that which `creep_um` is meant for; 1 without it.
    pub creep_shares: Vec<f64>,
    /// True less declared angle in single setups, besides: index of the setup, and the angle in rad.
    pub angles_in_setups: Vec<(usize, f64)>,
    /// What the channel does besides, order by order.
    pub transfers: Vec<Transfer>,
}

/// cosine·cos(nα) + sine·sin(nα) besides the part's form, in µm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pattern {
    /// n, per turn.
    pub order: usize,
    /// Amplitude of the cosine.
    pub cosine: f64,
    /// Amplitude of the sine.
    pub sine: f64,
    /// Which readings have it.
    pub of: PatternOf,
}

/// Which readings have a pattern, and what it turns with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PatternOf {
    /// All; it turns with the spindle, however the part is clamped.
    Spindle,
    /// Those of a setup; it turns with the part.
    Setup(usize),
    /// Those of a sensor; it turns with the part.
    Sensor(usize),
    /// Those of a sensor; it turns with the spindle.
    SensorOnSpindle(usize),
    /// Those of a setup as a motion of the axis along x, which turns with the spindle.
    MotionX(usize),
    /// Those of a setup as a motion of the axis along y, which turns with the spindle.
    MotionY(usize),
}

impl PatternOf {
    /// Whether it is on the surface of the part.
    #[must_use]
    pub fn is_form(self) -> bool {
        matches!(self, Self::Spindle | Self::Setup(_) | Self::Sensor(_))
    }
}

/// A share of one channel's displacement in the reading of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossTalk {
    /// Index of the sensor that is read.
    pub from: usize,
    /// Index of the sensor whose reading has it.
    pub to: usize,
    /// Relative.
    pub share: f64,
}

/// Reading over displacement at an order, never 0: any linear change of a channel.
#[derive(Clone)]
pub struct Transfer {
    at: Arc<dyn Fn(usize) -> Complex64 + Send + Sync>,
    /// The effect that it is of, and the values of its parameters.
    effect: Option<(&'static str, Vec<f64>)>,
    /// The only setup in which it acts; all without it.
    setup: Option<usize>,
}

impl Transfer {
    /// By a function of the order.
    pub fn new(of: impl Fn(usize) -> Complex64 + Send + Sync + 'static) -> Self {
        Self { at: Arc::new(of), effect: None, setup: None }
    }

    /// Only in one setup, or in all.
    #[must_use]
    pub fn in_setup(self, setup: Option<usize>) -> Self {
        Self { setup, ..self }
    }

    /// Which effect it is of, for partials that depend on the values of its parameters ([`SensorAlteration::applied`]).
    #[must_use]
    pub fn of(self, effect: &'static str, values: &[f64]) -> Self {
        Self { effect: Some((effect, values.to_vec())), ..self }
    }
}

impl fmt::Debug for Transfer {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "Transfer(… {} at order 1 …)", (self.at)(1))
    }
}

/// One setup.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SetupAlteration {
    /// True less declared angle of the part, in rad.
    pub part_rad: f64,
    /// True less declared angle of all sensors, in rad.
    pub sensors_rad: f64,
    /// Whether the sensors were turned with the part where they are declared to stay, or stayed where they are declared to be turned.
    pub sensors_otherwise: bool,
    /// Whether the part turned the other way there than in the other setups: the readings come in the opposite order.
    pub backwards: bool,
    /// Motion over that of the first setup, less 1.
    pub motion: f64,
    /// Uneven speed within the turn.
    pub ripples: Vec<Harmonic>,
}

/// cosine·cos(order·Φ) + sine·sin(order·Φ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Per turn.
    pub order: usize,
    /// Amplitude of the cosine.
    pub cosine: f64,
    /// Amplitude of the sine.
    pub sine: f64,
}

impl Harmonic {
    /// Its value.
    #[must_use]
    pub fn at(&self, angle_rad: f64) -> f64 {
        let (sine, cosine) = (self.order as f64 * angle_rad).sin_cos();
        self.cosine * cosine + self.sine * sine
    }
}

/// Gains that a channel may have over the declared one: a wrong unit (inches for µm) is 25400 times off. The bounds are reciprocal, since the
/// gain of one sensor and the inverse one of its neighbour often explain the same.
pub(crate) const GAINS: std::ops::RangeInclusive<f64> = 1e-5..=1e5;

/// Share of the motion with which a bracket may move: a sensor that sees next to none of the motion says nothing of it.
const LARGEST_SHARE: f64 = 0.95;

/// Squared widths that a spot may have: to 30 mm, and below 0 as far as a fit may go on its way to a small one.
const SPOTS_MM2: std::ops::RangeInclusive<f64> = -1.0..=900.0;

/// Curvatures of the part over the declared one: from mm that are cm to inches that are mm.
const CURVATURES: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// By how much an angle may be off: 45° and a little. Beyond, it is another place.
const FARTHEST_RAD: f64 = 0.8;

impl Alterations {
    /// Whether a sign, a channel, a setup or a way of counting angles is not as declared.
    #[must_use]
    pub fn are_mistakes(&self) -> bool {
        let moved = |places: &[usize]| places.iter().enumerate().any(|(place, declared)| place != *declared);
        self.rotation_reversed
            || self.part_angles_reversed
            || self.sensor_angles_reversed
            || self.sensors.iter().any(SensorAlteration::is_mistaken)
            || self.setups.iter().any(|setup| setup.sensors_otherwise || setup.backwards)
            || !self.swapped_in.is_empty()
            || moved(&self.places)
            || moved(&self.clampings)
    }

    /// The channel whose declared place a channel has in a setup.
    #[must_use]
    pub fn place_in(&self, setup: usize, channel: usize) -> usize {
        let here = self.swapped_in.iter().filter(|(only, _)| *only == setup);
        let swapped = here.fold(channel, |channel, (_, [one, other])| match channel {
            channel if channel == *one => *other,
            channel if channel == *other => *one,
            channel => channel,
        });
        self.places[swapped]
    }

    /// Whether all values are such that readings can be converted to displacements.
    #[must_use]
    pub fn are_possible(&self) -> bool {
        let sensor = |sensor: &SensorAlteration| {
            let turned = sensor.angles_in_setups.iter().map(|(_, angle_rad)| angle_rad.abs()).fold(0.0, f64::max);
            GAINS.contains(&(1.0 + sensor.gain))
                && sensor.angle_rad.abs() + turned < FARTHEST_RAD
                && sensor.bracket_share < LARGEST_SHARE
                && SPOTS_MM2.contains(&sensor.spot_mm2)
        };
        let steepness = |setup: &SetupAlteration| -> f64 {
            setup.ripples.iter().map(|ripple| ripple.order as f64 * ripple.cosine.hypot(ripple.sine)).sum()
        };
        let setup = |setup: &SetupAlteration| {
            let angles = [setup.part_rad, setup.sensors_rad];
            angles.iter().all(|angle| angle.abs() < FARTHEST_RAD) && setup.motion > -0.95 && steepness(setup) < 0.5
        };
        let is_round = CURVATURES.contains(&(1.0 + self.curvature));
        let numbers = self.sensors.iter().flat_map(|s| [s.quadratic_per_um, s.cubic_per_um2, s.creep_um, s.z_mm]);
        is_round
            && self.sensors.iter().all(sensor)
            && self.setups.iter().all(setup)
            && numbers.into_iter().all(f64::is_finite)
    }
}

impl SetupAlteration {
    /// The angle that the recording assumes when the spindle is at this one: φ + ε(φ) = Φ, with ε 0 at the marks.
    pub(crate) fn recorded_at(&self, angle_rad: f64) -> f64 {
        let early = |angle: f64| self.ripples.iter().map(|ripple| ripple.at(angle) - ripple.cosine).sum::<f64>();
        let mut recorded = angle_rad;
        // A contraction by order·amplitude a round: 0.01 or so.
        for _ in 0..6 {
            recorded = angle_rad - early(recorded);
        }
        recorded
    }
}

impl SensorAlteration {
    /// A sensor as declared.
    pub const NONE: Self = Self {
        sign: 1.0,
        reversed_in: Vec::new(),
        opposite: false,
        in_other_section: false,
        gain: 0.0,
        angle_rad: 0.0,
        z_mm: 0.0,
        circle_mm: 0.0,
        bracket_share: 0.0,
        spot_mm2: 0.0,
        quadratic_per_um: 0.0,
        cubic_per_um2: 0.0,
        creep_um: 0.0,
        creep_shares: Vec::new(),
        angles_in_setups: Vec::new(),
        transfers: Vec::new(),
    };

    /// Whether its sign or its place is not as declared.
    fn is_mistaken(&self) -> bool {
        self.sign < 0.0 || !self.reversed_in.is_empty() || self.opposite || self.in_other_section
    }

    /// Reading over displacement in a setup at an order: gain, low-pass and what else the channel does.
    #[must_use]
    pub fn response(&self, setup: usize, order: usize) -> Complex64 {
        let here = self.transfers.iter().filter(|transfer| transfer.setup.is_none_or(|only| only == setup));
        let reversed = self.reversed_in.iter().filter(|only| **only == setup).count();
        let sign = if reversed.is_multiple_of(2) { self.sign } else { -self.sign };
        let gain = Complex64::from(sign * (1.0 + self.gain));
        here.fold(gain, |response, transfer| response * (transfer.at)(order))
    }

    /// The values with which an effect [stated](Transfer::of) its transfer; `None` where it is not applied.
    #[must_use]
    pub fn applied(&self, effect: &str) -> Option<&[f64]> {
        self.applied_in(effect, None)
    }

    /// The values with which an effect [stated](Transfer::of) a transfer that acts in one setup only; `None` where it is not applied.
    #[must_use]
    pub fn applied_in(&self, effect: &str, setup: Option<usize>) -> Option<&[f64]> {
        let stated = self.transfers.iter().filter(|transfer| transfer.setup == setup);
        let found = stated.filter_map(|transfer| transfer.effect.as_ref()).rev().find(|(known, _)| *known == effect);
        found.map(|(_, values)| &values[..])
    }

    /// True less declared angle in a setup, in rad.
    #[must_use]
    pub fn turned_rad(&self, setup: usize) -> f64 {
        let here = self.angles_in_setups.iter().filter(|(only, _)| *only == setup);
        self.angle_rad + here.map(|(_, angle_rad)| angle_rad).sum::<f64>()
    }

    /// Creep in a setup, over that which `creep_um` is meant for.
    #[must_use]
    pub fn creep_share(&self, setup: usize) -> f64 {
        self.creep_shares.get(setup).copied().unwrap_or(1.0)
    }

    /// u from u + quadratic·u² + cubic·u³; the reading itself where that cannot be had.
    pub(crate) fn straightened(&self, reading_um: f64) -> f64 {
        rig::straightened(reading_um, self.quadratic_per_um, self.cubic_per_um2).unwrap_or(reading_um)
    }
}
