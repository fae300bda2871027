//! Synchronous error motion values of an axis at standing positions.
//!
//! Positions at equal angles of a full turn determine the orders below half their number. Orders above fold into these, and no position
//! shows it: where what was found does not end below the highest order, values say that orders are missing.

use super::{Evaluate, Group};
use crate::Value;
use crate::error_motion::{Fundamental, StandingMotion, weights};
use crate::evaluable::{AxisMotion, MotionErrors};
use runout_numerics::{Complex64, fourier::Fourier};
use runout_turning::spread::Direction;

/// Share of a step by which positions may be off equal angles: an order n is then off by 2πn/count · this, 1.6 % at the highest.
const EQUAL: f64 = 5e-3;
/// Positions that determine order 2.
const FEWEST: usize = 5;
/// Orders in the upper half of the band that show whether the motion ends below.
const UPPER_ORDERS: usize = 3;
/// Standard deviations of the mean power of noise, above which it is motion: noise exceeds it in about 2 % of all cases.
const CHANCE: f64 = 2.5;

/// Its values, and what they are not.
pub(super) fn values(motion: &AxisMotion, evaluate: &Evaluate) -> (Vec<Value>, Vec<String>) {
    if !evaluate.has(Group::ErrorMotion) {
        return (Vec::new(), Vec::new());
    }
    if motion.motion.len() != motion.angle_deg.len() {
        return (Vec::new(), vec!["no error motion values: positions and motion differ in number".to_owned()]);
    }
    let turn = match Turn::of(&motion.angle_deg) {
        Ok(turn) => turn,
        Err(reason) => return (Vec::new(), vec![format!("no error motion values: {reason}")]),
    };
    let errors = motion.errors.as_ref().map_err(String::as_str);
    let errors = errors.and_then(|errors| known(errors, motion.motion.len()));
    let at = At { motion, turn, errors };
    let mut found = AxisValues::default();
    let lines = evaluate.directions.iter().flat_map(|line| [Direction::Along(*line), Direction::TiltAlong(*line)]);
    let faces = evaluate.faces.iter().copied().map(Direction::Face);
    for direction in [Direction::X, Direction::Y].into_iter().chain([Direction::TiltX, Direction::TiltY]).chain(lines) {
        at.add(direction, evaluate, &mut found);
    }
    for tilt in [false, true] {
        found.values.extend(at.fundamental(tilt));
    }
    for direction in std::iter::once(Direction::Axial).chain(faces) {
        at.add(direction, evaluate, &mut found);
    }
    let reason = errors.err().unwrap_or("its errors are stated as 0, or as no number");
    let without = found.values.iter_mut().filter(|value| value.uncertainty.is_none());
    without.for_each(|value| value.no_uncertainty = Some(reason.to_owned()));
    let remarks = at.remarks(&found);
    (found.values, remarks)
}

/// The errors, where they are there for all positions.
fn known(errors: &MotionErrors, positions: usize) -> Result<&MotionErrors, &'static str> {
    let complete = errors.own.len() == positions && errors.common.iter().all(|change| change.len() == positions);
    if complete { Ok(errors) } else { Err("its errors are not known at every position") }
}

/// Positions at equal angles of a full turn.
struct Turn {
    /// Places of the positions, by rising angle.
    order: Vec<usize>,
    first_rad: f64,
}

impl Turn {
    /// Or why they are not, in words for the user.
    fn of(angle_deg: &[f64]) -> Result<Self, String> {
        let count = angle_deg.len();
        if count < FEWEST {
            return Err(format!("{count} positions are fewer than {FEWEST}, which order 2 needs"));
        }
        let within: Vec<f64> = angle_deg.iter().map(|angle| angle.rem_euclid(360.0)).collect();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| within[*a].total_cmp(&within[*b]));
        let (step, first) = (360.0 / count as f64, within[order[0]]);
        let off = |(place, at): (usize, &usize)| (within[*at] - first - place as f64 * step).abs() / step;
        if order.iter().enumerate().map(off).all(|off| off <= EQUAL) {
            return Ok(Self { order, first_rad: first.to_radians() });
        }
        let next = |place: usize| order.get(place + 1).map_or(first + 360.0, |at| within[*at]);
        let widest = order.iter().enumerate().map(|(place, at)| next(place) - within[*at]).fold(0.0, f64::max);
        Err(format!(
            "the {count} positions are not at equal angles of a full turn, their widest step is {widest:.4}° where {step:.4}° would be equal; \
             over a part of a turn, 1/rev (placement of the axis and of what it carries) is not separable from error motion"
        ))
    }

    fn highest(&self) -> usize {
        (self.order.len() - 1) / 2
    }

    /// Coefficients of Re Σ cₙ e^{inθ} of what is there at each position, by order from 0; θ counts from the axis' zero.
    fn harmonics(&self, at: impl Fn(usize) -> f64) -> Vec<Complex64> {
        let mut fourier = Fourier::new(self.order.len());
        let mut harmonics = vec![Complex64::ZERO; self.highest() + 1];
        fourier.analyse(self.order.iter().map(|place| at(*place)), &mut harmonics);
        for (order, harmonic) in harmonics.iter_mut().enumerate() {
            *harmonic *= Complex64::cis(-(order as f64) * self.first_rad);
        }
        harmonics
    }
}

/// Values, and directions without some of what is asked for.
#[derive(Default)]
struct AxisValues {
    values: Vec<Value>,
    /// Directions that are not observable, with the number of positions.
    lost: Vec<(String, usize)>,
    /// Directions whose motion may go on above the highest order.
    open: Vec<String>,
}

/// What is evaluated.
struct At<'a> {
    motion: &'a AxisMotion,
    turn: Turn,
    errors: Result<&'a MotionErrors, &'a str>,
}

impl At<'_> {
    fn add(&self, direction: Direction, evaluate: &Evaluate, found: &mut AxisValues) {
        let Some(weights) = weights(direction) else { return };
        let harmonics = self.turn.harmonics(|place| sum(&weights, &self.motion.motion[place]));
        let variance = self.variance(&weights);
        let AxisMotion { of, letters, z_mm, .. } = self.motion;
        let standing = StandingMotion {
            of,
            direction,
            letters: *letters,
            z_mm: *z_mm,
            harmonics: &harmonics,
            variance: &variance,
            freedom: self.freedom(),
        };
        let lost = self.motion.motion.iter().filter(|at| sum(&weights, at).is_nan()).count();
        if lost > 0 {
            found.lost.push((standing.id(), lost));
            return;
        }
        let open = goes_on(&harmonics, &variance);
        if open {
            found.open.push(standing.id());
        }
        let of_band = |value: Value| {
            let absent_above_upr = (open && value.band_upr[1] == self.turn.highest()).then(|| self.turn.highest());
            Value { absent_above_upr, ..value }
        };
        found.values.extend(standing.values(&evaluate.centres).into_iter().map(of_band));
    }

    fn freedom(&self) -> f64 {
        self.errors.map_or(0.0, |errors| errors.freedom)
    }

    /// E|δ|² of each harmonic; empty where the errors are not known.
    fn variance(&self, weights: &[f64; 5]) -> Vec<f64> {
        let Ok(errors) = self.errors else { return Vec::new() };
        let own: f64 = errors.own.iter().map(|own| quadratic(weights, own)).sum();
        let count = errors.own.len() as f64;
        let mut variance = vec![4.0 * own / (count * count); self.turn.highest() + 1];
        for change in &errors.common {
            let changed = self.turn.harmonics(|place| sum(weights, &change[place]));
            variance.iter_mut().zip(changed).for_each(|(variance, harmonic)| *variance += harmonic.norm_sqr());
        }
        variance
    }

    /// Of x + iy (or of both tilts) the part that turns against the axis: the mean of (x + iy)·e^{iθ}.
    fn fundamental(&self, tilt: bool) -> Option<Value> {
        let [first, second] = if tilt { [3, 4] } else { [0, 1] };
        let count = self.motion.motion.len() as f64;
        let phasor = |of: &[[f64; 5]]| {
            let places = of.iter().zip(&self.motion.angle_deg);
            let turned =
                places.map(|(at, angle)| Complex64::new(at[first], at[second]) * Complex64::cis(angle.to_radians()));
            turned.sum::<Complex64>() / count
        };
        let variance = self.errors.ok().map(|errors| {
            let own: f64 = errors.own.iter().map(|own| own[first][first] + own[second][second]).sum();
            own / (count * count) + errors.common.iter().map(|change| phasor(change).norm_sqr()).sum::<f64>()
        });
        let amplitude = phasor(&self.motion.motion).norm();
        let found = Fundamental { tilt, amplitude, variance, freedom: self.freedom() };
        amplitude.is_finite().then(|| found.value(self.motion.z_mm, self.motion.letters))
    }

    fn remarks(&self, found: &AxisValues) -> Vec<String> {
        let (count, highest) = (self.motion.motion.len(), self.turn.highest());
        let mut remarks = Vec::new();
        if !found.values.is_empty() {
            remarks.push(format!(
                "standing positions have no turns: no asynchronous and no total values. {count} positions determine orders up to {highest}; \
                 orders above fold into these, and no ± includes it"
            ));
        }
        if !found.open.is_empty() {
            let why = match (self.errors, highest + 1 - (highest.div_ceil(2)).max(2)) {
                (Err(_), _) => "without known errors nothing shows that it ends below",
                (Ok(_), orders) if orders < UPPER_ORDERS => "so few orders do not show that it ends below",
                (Ok(_), _) => "the upper half of the orders has more than noise",
            };
            remarks.push(format!(
                "motion may go on above order {highest} ({why}), and limits are undecided: {}",
                found.open.join(", ")
            ));
        }
        let all: Vec<&str> = found.lost.iter().filter(|(_, lost)| *lost == count).map(|(id, _)| id.as_str()).collect();
        if !all.is_empty() {
            remarks.push(format!("no value of {}: not observable", all.join(", ")));
        }
        for (id, lost) in found.lost.iter().filter(|(_, lost)| *lost < count) {
            remarks.push(format!("no value of {id}: not observable at {lost} of {count} positions"));
        }
        remarks
    }
}

/// What is not observable counts only where it has a weight.
fn sum(weights: &[f64; 5], of: &[f64; 5]) -> f64 {
    weights.iter().zip(of).filter(|(weight, _)| **weight != 0.0).map(|(weight, value)| weight * value).sum()
}

fn quadratic(weights: &[f64; 5], covariance: &[[f64; 5]; 5]) -> f64 {
    sum(weights, &covariance.map(|row| sum(weights, &row)))
}

/// Whether orders above the highest may be there. They would fold into the upper half of the band as likely as into the lower: where
/// the upper half has no more than noise, there are none. Few orders, or errors that are not known, show nothing.
fn goes_on(harmonics: &[Complex64], variance: &[f64]) -> bool {
    let upper = harmonics.len() / 2..harmonics.len();
    let upper = upper.start.max(2)..upper.end;
    if variance.is_empty() || upper.len() < UPPER_ORDERS {
        return true;
    }
    let count = upper.len() as f64;
    let power = upper.map(|order| harmonics[order].norm_sqr() / variance[order]).sum::<f64>() / count;
    power.is_nan() || power > 1.0 + CHANCE / count.sqrt()
}
