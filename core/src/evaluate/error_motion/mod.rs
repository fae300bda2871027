//! Error motion values of the axis of rotation (ISO 230-7, ASME B89.3.4), all of them peak to valley.
//!
//! *Synchronous* motion is what was separated: the mean of the turns, free of form. Its value is the distance of two
//! circles about a centre that just contain its polar plot. *Asynchronous* is the largest spread of the turns at one
//! angle. *Total* is the distance of two circles about the same centre that contain all turns: the synchronous plot with
//! the lowest and the highest turn about it. Motion at 1/rev is centring and not in these values, but for the part that
//! turns against the spindle, which no clamping makes: the *fundamental* value is twice its amplitude. In the rotating
//! sensitive direction it is 2/rev of the plot, and in the values.
//!
//! x and y are those in the plane midway between the sensors, where noise is least.

mod polar;
#[cfg(test)]
mod tests;

pub use polar::Centre;

use std::cell::RefCell;

use super::{
    Value,
    roundness::{Angles, Points, Reference, ront_lsci_um},
    uncertainty::{self, Uncertainty, monte_carlo},
};
use crate::{
    profile::Profile,
    separation::{Quantity, Separation},
    spread::{Direction, Spread},
};
use polar::{Motion, Synchronous, seen_from};

/// What error motion is evaluated from: one station.
#[derive(Debug, Clone, Copy)]
pub struct ErrorMotion<'a> {
    /// Its name.
    pub station: &'a str,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// Equal angles on which synchronous motion is evaluated.
    pub angles: usize,
    /// Synchronous motion.
    pub separation: &'a Separation,
    /// The averages; those with a [`Profile::spread`] count.
    pub profiles: &'a [Profile],
    /// The steepest slope of the form along the circumference, µm/µm: a part that moves across a sensor carries it past.
    pub slope: f64,
}

/// The centre where none is named.
pub const CENTRE: Centre = Centre::Plot(Reference::LeastSquares);

const STANDARD: &str = "ISO 230-7:2015";

/// Symbol and unit of every value that there may be.
pub const SYMBOLS: [(&str, &str); 26] = [
    ("synchronous-radial-x", "µm"),
    ("synchronous-radial-y", "µm"),
    ("synchronous-radial-rotating", "µm"),
    ("residual-synchronous-tilt-x", "µrad"),
    ("residual-synchronous-tilt-y", "µrad"),
    ("residual-synchronous-tilt-rotating", "µrad"),
    ("total-radial-x", "µm"),
    ("total-radial-y", "µm"),
    ("total-radial-rotating", "µm"),
    ("total-tilt-x", "µrad"),
    ("total-tilt-y", "µrad"),
    ("total-tilt-rotating", "µrad"),
    ("asynchronous-radial-x", "µm"),
    ("asynchronous-radial-y", "µm"),
    ("asynchronous-radial-rotating", "µm"),
    ("asynchronous-tilt-x", "µrad"),
    ("asynchronous-tilt-y", "µrad"),
    ("asynchronous-tilt-rotating", "µrad"),
    ("fundamental-radial", "µm"),
    ("fundamental-tilt", "µrad"),
    ("synchronous-radial-along", "µm"),
    ("total-radial-along", "µm"),
    ("asynchronous-radial-along", "µm"),
    ("residual-synchronous-tilt-along", "µrad"),
    ("total-tilt-along", "µrad"),
    ("asynchronous-tilt-along", "µrad"),
];
/// Two-sided 95 % quantiles of Student's distribution for 1, 2, 3, … degrees of freedom.
const STUDENT_95: [f64; 10] = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23];
/// The same of the normal distribution.
const NORMAL_95: f64 = 1.96;

impl ErrorMotion<'_> {
    /// All values, about each of these centres; none without a spread over turns.
    #[must_use]
    pub fn values(&self, centres: &[Centre]) -> Vec<Value> {
        let spreads: Vec<&Spread> = self.profiles.iter().filter_map(|profile| profile.spread.as_ref()).collect();
        let Some(first) = spreads.first() else { return Vec::new() };
        let z_mm = first.projection.z_mm + self.z_mm;
        let mut values = Vec::new();
        for direction in directions(&spreads) {
            // Setups that do not tell a direction, as sensors that all look along another one, have no part in it.
            let told: Vec<&Spread> =
                spreads.iter().copied().filter(|spread| spread.in_direction(direction).is_some()).collect();
            let synchronous = Synchronous::new(self.separation, &first.projection, direction, z_mm);
            if let Some(plot) = synchronous.filter(|plot| !plot.is_lost()) {
                for centre in centres {
                    values.extend(self.about(*centre, direction, z_mm, &plot, &told).into_iter().flatten());
                }
            }
            values.push(asynchronous(direction, z_mm, &told, self.carried(direction, &spreads)));
        }
        for (motion, direction) in [(Quantity::X, Direction::Rotating), (Quantity::TiltY, Direction::RotatingTilt)] {
            if spreads.iter().any(|spread| spread.in_direction(direction).is_some()) {
                values.extend(self.fundamental(motion, z_mm));
            }
        }
        values
    }

    /// Synchronous and total value about a centre.
    fn about(
        &self,
        centre: Centre,
        direction: Direction,
        z_mm: f64,
        plot: &Synchronous,
        spreads: &[&Spread],
    ) -> Option<[Value; 2]> {
        let points = RefCell::new(Points::default());
        let angles = Angles::equal(self.angles);
        let drawn = plot.over_angle(&angles);
        let place = centre.of(&angles, &drawn, &mut points.borrow_mut())?;
        let seen = seen_from(place, &angles, &drawn);
        let seed = uncertainty::seed(&[self.station, id(direction), centre.symbol()]);
        let range = |plot: &[f64]| {
            if centre.is_linear() {
                return [ront_lsci_um(plot)];
            }
            let place = centre.of(&angles, plot, &mut points.borrow_mut()).unwrap_or_default();
            [ront_lsci_um(&seen_from(place, &angles, plot))]
        };
        let known = monte_carlo(&seen, &plot.variance, seed, range).map(|[known]| known);
        let (mut all, mut each) = ((f64::INFINITY, f64::NEG_INFINITY), Vec::new());
        for spread in spreads {
            let angles = Angles::equal(spread.angles);
            let drawn = plot.over_angle(&angles);
            let place = centre.of(&angles, &drawn, &mut points.borrow_mut())?;
            let (low, high) = spread.in_direction(direction)?;
            let (mut inner, mut outer) = (f64::INFINITY, f64::NEG_INFINITY);
            for ((value, low), high) in seen_from(place, &angles, &drawn).iter().zip(low).zip(high) {
                (inner, outer) = (inner.min(value + low), outer.max(value + high));
            }
            all = (all.0.min(inner), all.1.max(outer));
            each.push(outer - inner);
        }
        let about = |symbol, what: &str, value, uncertainty| Value {
            symbol,
            unit: unit(direction),
            value,
            source: format!("{STANDARD}, {what}, {}", described(direction, z_mm)),
            band_upr: plot.band,
            lost_orders: plot.lost.clone(),
            weakened_above_upr: None,
            absent_above_upr: None,
            no_uncertainty: None,
            filter: "none".into(),
            reference: centre.symbol().into(),
            coverage: 1.0,
            uncertainty,
        };
        let (kind, synchronous) = if direction.is_tilt() {
            ("residual-synchronous", "residual synchronous error motion value")
        } else {
            ("synchronous", "synchronous error motion value")
        };
        let total = format!("total error motion value without 1/rev, {}", over(spreads));
        let std = known.as_ref().map_or(0.0, |known| known.std).hypot(self.carried(direction, spreads));
        Some([
            about(format!("{kind}-{}", id(direction)), synchronous, ront_lsci_um(&seen), known),
            about(format!("total-{}", id(direction)), &total, all.1 - all.0, between_setups(&each, std)),
        ])
    }

    /// Standard uncertainty of a range over turns from the form's slope: nothing tells it from motion along the sensor. It is
    /// at most the slope times the range across, in every sensor of the combination, and as likely to be anything below.
    fn carried(&self, direction: Direction, spreads: &[&Spread]) -> f64 {
        let radial = directions(spreads).into_iter().filter(|direction| !direction.is_tilt());
        let across = radial.flat_map(|direction| spreads.iter().map(move |spread| widest(spread, direction)));
        let reach = spreads.iter().map(|spread| spread.reach(direction)).fold(0.0, f64::max);
        self.slope * across.fold(0.0, f64::max) * reach / 3.0_f64.sqrt()
    }

    /// Twice the amplitude of what turns against the spindle at 1/rev.
    fn fundamental(&self, quantity: Quantity, z_mm: f64) -> Option<Value> {
        let motion = Motion::new(self.separation, quantity, z_mm)?;
        if motion.lost_orders(self.separation).any(|order| order == 1) {
            return None;
        }
        let value = 2.0 * motion.coefficients(self.separation).get(1)?.norm();
        // The part of an error E|δ|² along the phasor is half of it.
        let std = (2.0 * motion.variance(self.separation, 1, None)).sqrt();
        let direction = if quantity == Quantity::X { Direction::X } else { Direction::TiltY };
        Some(Value {
            symbol: if direction.is_tilt() { "fundamental-tilt".into() } else { "fundamental-radial".into() },
            unit: unit(direction),
            value,
            source: format!(
                "{STANDARD}, fundamental error motion value{}: the part that turns against the spindle, the rest of 1/rev is \
                 centring",
                if direction.is_tilt() { String::new() } else { format!(" at z = {} mm", millimetres(z_mm)) }
            ),
            band_upr: [1, 1],
            lost_orders: Vec::new(),
            weakened_above_upr: None,
            absent_above_upr: None,
            no_uncertainty: None,
            filter: "none".into(),
            reference: "PC".into(),
            coverage: 1.0,
            uncertainty: (std > 0.0).then(|| Uncertainty {
                std,
                interval_95: [(value - NORMAL_95 * std).max(0.0), value + NORMAL_95 * std],
                draws: 0,
            }),
        })
    }
}

/// The directions that some setup gives, each once.
fn directions(spreads: &[&Spread]) -> Vec<Direction> {
    let mut directions: Vec<Direction> = Vec::new();
    for direction in spreads.iter().flat_map(|spread| &spread.directions) {
        if !directions.contains(direction) {
            directions.push(*direction);
        }
    }
    // In the same order, whichever setup gives them.
    directions
        .sort_by_key(|direction| Direction::ALL.iter().position(|known| known == direction).unwrap_or(usize::MAX));
    directions
}

/// The largest spread of a setup's turns at one angle.
fn widest(spread: &Spread, direction: Direction) -> f64 {
    let (low, high) = spread.in_direction(direction).unwrap_or_default();
    low.iter().zip(high).map(|(low, high)| high - low).fold(0.0, f64::max)
}

/// The largest spread of a setup's turns at one angle, in the setup where it is largest; `std` is of what all setups share.
fn asynchronous(direction: Direction, z_mm: f64, spreads: &[&Spread], std: f64) -> Value {
    let each: Vec<f64> = spreads.iter().map(|spread| widest(spread, direction)).collect();
    let gain = spreads.iter().map(|spread| spread.noise_gain(direction)).fold(0.0, f64::max);
    let gain_unit = if direction.is_tilt() { " µrad/µm" } else { "" };
    let alone = if each.len() < 2 { "; one setup leaves its uncertainty unknown" } else { "" };
    Value {
        symbol: format!("asynchronous-{}", id(direction)),
        unit: unit(direction),
        value: each.iter().copied().fold(0.0, f64::max),
        source: format!(
            "{STANDARD}, asynchronous error motion value, {}, largest spread at one angle of {}; with the sensors' noise, {gain:.3}{gain_unit} times that of \
             one{alone}",
            described(direction, z_mm),
            over(spreads),
        ),
        band_upr: [0, spreads.iter().map(|spread| spread.angles.saturating_sub(1) / 2).min().unwrap_or(0)],
        lost_orders: Vec::new(),
        weakened_above_upr: None,
        absent_above_upr: None,
        no_uncertainty: None,
        filter: "none".into(),
        reference: "turns at one angle".into(),
        coverage: 1.0,
        uncertainty: between_setups(&each, std),
    }
}

/// What setups, each a capture of its own, say of a range over turns: the scatter of one of them, and where another one
/// would lie with 95 % probability; `std` is of what they share. `None` of one.
fn between_setups(each: &[f64], std: f64) -> Option<Uncertainty> {
    let freedom = each.len().checked_sub(1).filter(|freedom| *freedom > 0)?;
    let count = each.len() as f64;
    let mean = each.iter().sum::<f64>() / count;
    let scatter = (each.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / freedom as f64).sqrt();
    let student = STUDENT_95.get(freedom - 1).copied().unwrap_or(NORMAL_95);
    let half = (student * scatter * (1.0 + 1.0 / count).sqrt()).hypot(NORMAL_95 * std);
    Some(Uncertainty { std: scatter.hypot(std), interval_95: [(mean - half).max(0.0), mean + half], draws: 0 })
}

/// The turns behind a range.
fn over(spreads: &[&Spread]) -> String {
    let turns = spreads.iter().map(|spread| spread.turns);
    let (fewest, most) = (turns.clone().min().unwrap_or(0), turns.max().unwrap_or(0));
    let turns = if fewest == most { most.to_string() } else { format!("{fewest} to {most}") };
    match spreads.len() {
        1 => format!("{turns} turns"),
        setups => format!("{turns} turns in each of {setups} setups"),
    }
}

fn id(direction: Direction) -> &'static str {
    match direction {
        Direction::X => "radial-x",
        Direction::Y => "radial-y",
        Direction::Rotating => "radial-rotating",
        Direction::TiltX => "tilt-x",
        Direction::TiltY => "tilt-y",
        Direction::RotatingTilt => "tilt-rotating",
        Direction::Along(_) => "radial-along",
        Direction::TiltAlong(_) => "tilt-along",
    }
}

fn unit(direction: Direction) -> String {
    if direction.is_tilt() { "urad".into() } else { "um".into() }
}

fn described(direction: Direction, z_mm: f64) -> String {
    let z_mm = millimetres(z_mm);
    match direction {
        Direction::X => format!("radial, fixed sensitive direction x, at z = {z_mm} mm"),
        Direction::Y => format!("radial, fixed sensitive direction y, at z = {z_mm} mm"),
        Direction::Rotating => format!("radial, rotating sensitive direction, at z = {z_mm} mm"),
        Direction::TiltX => "tilt about x, fixed sensitive direction".into(),
        Direction::TiltY => "tilt about y, fixed sensitive direction".into(),
        Direction::RotatingTilt => "tilt, rotating sensitive direction".into(),
        Direction::Along(azimuth) => {
            format!("radial, fixed sensitive direction at {azimuth} from x towards y, at z = {z_mm} mm")
        }
        Direction::TiltAlong(azimuth) => {
            format!("tilt towards the fixed sensitive direction at {azimuth} from x towards y")
        }
    }
}

/// To a micrometre, without trailing zeros.
fn millimetres(z_mm: f64) -> f64 {
    (1e3 * z_mm).round() / 1e3
}
