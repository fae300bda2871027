//! Error motion values of the axis of rotation (ISO 230-7, ASME B89.3.4), peak to valley and root mean square.
//!
//! *Synchronous* motion is what was separated: the mean of the turns, free of form. Its value is the distance of two circles
//! about a centre that just contain its polar plot. *Asynchronous* is the largest spread of the turns at one angle. *Total*
//! is the distance of two circles about the same centre that contain all turns: the synchronous plot with the lowest and the
//! highest turn about it. Motion at 1/rev is centring and not in these values, but for the part that turns against the
//! spindle, which no clamping makes: the *fundamental* value is twice its amplitude. In the rotating radial sensitive
//! direction it is 2/rev of the plot, and in the values; residual synchronous tilt leaves it out. *Total with the
//! fundamental* is the range of all turns with it, about the centre of the polar chart.
//!
//! Noise of many high orders adds to a range. Its share is taken out of synchronous values, each of which says how much it
//! is.
//!
//! x and y are those in the plane midway between the sensors, where noise is least.

mod axial;
mod plots;
mod polar;
#[cfg(test)]
mod tests;

pub use plots::{Spectrum, TurnsPlot};
pub use polar::Centre;

use std::cell::RefCell;

use crate::{
    azimuth::{Azimuth, FacePlace},
    profile::Profile,
    separation::{Quantity, Separation},
    spread::{Direction, Spread},
};
use axial::bounded;
use polar::{Motion, Synchronous, seen_from};
use runout_numerics::{Complex64, fourier::Fourier};
use runout_standards::{
    Value,
    roundness::{self, Angles, FixedCentre, Points, Reference, ront_lsci_um},
    uncertainty::{self, DRAWS, Errors, NORMAL_95, Uncertainty, extreme, stand_in, student_95},
};

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

/// Directions as symbols name them, but for those that are chosen.
const DIRECTIONS: [&str; 8] =
    ["radial-x", "radial-y", "radial-rotating", "radial-along", "tilt-x", "tilt-y", "tilt-rotating", "tilt-along"];

/// Symbol and unit of every value that there may be, with those in chosen directions.
#[must_use]
pub fn symbols(lines: &[Azimuth], faces: &[FacePlace]) -> Vec<(String, &'static str)> {
    let chosen = lines.iter().flat_map(|line| [Direction::Along(*line), Direction::TiltAlong(*line)]).map(chosen_id);
    let mut symbols = Vec::new();
    for id in DIRECTIONS.into_iter().map(str::to_owned).chain(chosen) {
        let tilt = id.starts_with("tilt");
        let unit = if tilt { "µrad" } else { "µm" };
        for kind in [if tilt { RESIDUAL } else { "synchronous" }, "total", "asynchronous"] {
            symbols.extend([format!("{kind}-{id}"), format!("{kind}-{id}-rms")].map(|symbol| (symbol, unit)));
        }
        symbols.push((format!("total-{id}{WITH_FUNDAMENTAL}"), unit));
    }
    let axial = std::iter::once(Direction::Axial).chain(faces.iter().copied().map(Direction::Face));
    for id in axial.map(chosen_id) {
        for kind in ["synchronous", RESIDUAL, "total", "asynchronous"] {
            symbols.extend([format!("{kind}-{id}"), format!("{kind}-{id}-rms")].map(|symbol| (symbol, "µm")));
        }
        symbols.push((format!("fundamental-{id}"), "µm"));
    }
    symbols.extend([("fundamental-radial".to_owned(), "µm"), ("fundamental-tilt".to_owned(), "µrad")]);
    symbols
}

/// Kind of the synchronous values of tilt.
const RESIDUAL: &str = "residual-synchronous";
/// End of the symbols of total values with 1/rev. Their centre is that of the polar chart: any other moves with 1/rev.
pub const WITH_FUNDAMENTAL: &str = "-with-fundamental";

/// The ends of a range are looked for on so many times the angles of the average: 16 to a wave of its highest order or more, so that a
/// crest between two of them is at most 1 − cos(π/16), 2 %, higher, and one of a tenth of that order 2e-4.
const FINER: usize = 8;

/// Shares of noise below this, in µm or µrad, are not said: they would be written as 0.
const SAID: f64 = 5e-4;

impl ErrorMotion<'_> {
    /// All values, about each of these centres; none without a spread over turns. Where the data do not decide between separations,
    /// those of their mean, with an uncertainty that reaches as far as those of each.
    #[must_use]
    pub fn values(&self, centres: &[Centre]) -> Vec<Value> {
        if self.separation.equivalents.is_empty() {
            return self.decided_values(centres);
        }
        let (own, equivalents) = self.separation.decided();
        let of = |separation| ErrorMotion { separation, ..*self }.decided_values(centres);
        let equivalents: Vec<Vec<Value>> = equivalents.iter().map(of).collect();
        let mut values = of(&own);
        for value in &mut values {
            let same = |other: &&Value| other.symbol == value.symbol && other.reference == value.reference;
            let others = equivalents.iter().filter_map(|all| all.iter().find(same));
            let others: Vec<f64> = others.map(|other| other.value).collect();
            value.uncertainty = value.uncertainty.take().map(|known| known.with_equivalents(value.value, &others));
        }
        values
    }

    fn decided_values(&self, centres: &[Centre]) -> Vec<Value> {
        let spreads: Vec<&Spread> = self.profiles.iter().filter_map(|profile| profile.spread.as_ref()).collect();
        let Some(first) = spreads.first() else { return Vec::new() };
        let z_mm = first.projection.z_mm + self.z_mm;
        let mut values = Vec::new();
        for direction in directions(&spreads) {
            // Setups that do not tell a direction, as sensors that all look along another one, have no part in it.
            let told: Vec<&Spread> =
                spreads.iter().copied().filter(|spread| spread.in_direction(direction).is_some()).collect();
            if direction.is_axial() {
                values.extend(self.axial(direction, z_mm, &told));
                values.extend(self.asynchronous(direction, z_mm, &told));
                continue;
            }
            let synchronous = Synchronous::new(self.separation, &first.projection, direction, z_mm);
            if let Some(plot) = synchronous.filter(|plot| !plot.is_lost()) {
                for centre in centres {
                    values.extend(self.about(*centre, direction, z_mm, &plot, &told).into_iter().flatten());
                }
                let whole = Synchronous::from_order(1, self.separation, &first.projection, direction, z_mm);
                let whole = whole.filter(|plot| plot.lost.first() != Some(&1));
                values.extend(whole.and_then(|plot| self.with_fundamental(direction, z_mm, &plot, &told)));
            }
            values.extend(self.asynchronous(direction, z_mm, &told));
        }
        for (motion, direction) in [(Quantity::X, Direction::Rotating), (Quantity::TiltY, Direction::RotatingTilt)] {
            if spreads.iter().any(|spread| spread.in_direction(direction).is_some()) {
                values.extend(self.fundamental(motion, z_mm));
            }
        }
        values
    }

    /// Synchronous and total values about a centre, peak to valley and rms.
    fn about(
        &self,
        centre: Centre,
        direction: Direction,
        z_mm: f64,
        plot: &Synchronous,
        spreads: &[&Spread],
    ) -> Option<Vec<Value>> {
        let points = RefCell::new(Points::default());
        let seen_on = |count: usize| {
            let angles = Angles::shared(count);
            let drawn = plot.over_angle(&angles);
            let place = centre.of(&angles, &drawn, &mut points.borrow_mut())?;
            Some(seen_from(place, &angles, &drawn))
        };
        let angles = Angles::shared(self.angles);
        let (seen, finely) = (seen_on(self.angles)?, seen_on(FINER * self.angles)?);
        // Draws on fewer angles tell the error as well, not the range: its ends lie between those angles.
        let between = ront_lsci_um(&finely) - ront_lsci_um(&seen);
        let seed = uncertainty::seed(&[self.station, id(direction), centre.symbol()]);
        let about_moved = |plot: &[f64]| {
            let place = centre.of(&angles, plot, &mut points.borrow_mut()).unwrap_or_default();
            let seen = seen_from(place, &angles, plot);
            [ront_lsci_um(&seen), rms_about_mean(&seen)]
        };
        let values = if centre.is_linear() { Measure::AboutFixedCentre } else { Measure::Of(&about_moved) };
        let found = [ront_lsci_um(&seen), rms_about_mean(&seen)];
        let [(range, range_share, range_known), (rms, rms_share, rms_known)] =
            match without_noise(found, &seen, &plot.variance, 2, seed, &values) {
                Some(known) => {
                    let mut found = found.into_iter();
                    known
                        .map(|(share, known)| ((found.next().unwrap_or(f64::NAN) - share).max(0.0), share, Some(known)))
                }
                None => found.map(|found| (found, 0.0, None)),
            };
        let range = range + between;
        let range_known = range_known.map(|known| known.moved(between));
        let (mut all, mut each, mut each_rms) = ((f64::INFINITY, f64::NEG_INFINITY), Vec::new(), Vec::new());
        for spread in spreads {
            let other = if spread.angles == self.angles { None } else { Some(seen_on(FINER * spread.angles)?) };
            let (inner, outer) = of_all_turns(other.as_ref().unwrap_or(&finely), spread.in_direction(direction)?);
            all = (all.0.min(inner), all.1.max(outer));
            each.push(outer - inner);
            each_rms.push(rms.hypot(spread.rms(direction)?));
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
            (RESIDUAL, "residual synchronous error motion value")
        } else {
            ("synchronous", "synchronous error motion value")
        };
        let said = |what: &str, share: f64, known: &Option<Uncertainty>| match known {
            Some(_) if share >= SAID => format!("{what}, without {share:.3} {} that noise adds to it", unit(direction)),
            _ => what.to_owned(),
        };
        let total = format!("total error motion value without 1/rev, {}", over(spreads));
        let id = self.id(direction);
        let std = |known: &Option<Uncertainty>, across| {
            known.as_ref().map_or(0.0, |known| known.std).hypot(self.carried(direction, spreads, across))
        };
        let (range_std, rms_std) = (std(&range_known, widest), std(&rms_known, rms_across));
        let (range_said, rms_said) = (
            said(synchronous, range_share, &range_known),
            said(&format!("{synchronous}, root mean square over the angles"), rms_share, &rms_known),
        );
        let total_rms = root_mean_square(&each_rms);
        Some(vec![
            about(format!("{kind}-{id}"), &range_said, range, bounded(range_known, plot.bound)),
            about(format!("{kind}-{id}-rms"), &rms_said, rms, bounded(rms_known, 0.5 * plot.bound)),
            about(format!("total-{id}"), &total, all.1 - all.0, bounded(between_setups(&each, range_std), plot.bound)),
            about(
                format!("total-{id}-rms"),
                &format!("{total}, root mean square over angles and turns"),
                total_rms,
                bounded(between_setups(&each_rms, rms_std), 0.5 * plot.bound),
            ),
        ])
    }

    /// The range of all turns with the part of 1/rev that turns against the spindle, about the centre of the polar chart.
    fn with_fundamental(
        &self,
        direction: Direction,
        z_mm: f64,
        plot: &Synchronous,
        spreads: &[&Spread],
    ) -> Option<Value> {
        let (mut all, mut each) = ((f64::INFINITY, f64::NEG_INFINITY), Vec::new());
        for spread in spreads {
            let drawn = plot.over_angle(&Angles::shared(FINER * spread.angles));
            let (inner, outer) = of_all_turns(&drawn, spread.in_direction(direction)?);
            all = (all.0.min(inner), all.1.max(outer));
            each.push(outer - inner);
        }
        let id = self.id(direction);
        Some(Value {
            symbol: format!("total-{id}{WITH_FUNDAMENTAL}"),
            unit: unit(direction),
            value: all.1 - all.0,
            source: format!(
                "{STANDARD}, total error motion value with the part of 1/rev that turns against the spindle, {}, {}",
                over(spreads),
                described(direction, z_mm)
            ),
            band_upr: plot.band,
            lost_orders: plot.lost.clone(),
            weakened_above_upr: None,
            absent_above_upr: None,
            no_uncertainty: None,
            filter: "none".into(),
            reference: Centre::PolarChart.symbol().into(),
            coverage: 1.0,
            uncertainty: bounded(between_setups(&each, self.carried(direction, spreads, widest)), plot.bound),
        })
    }

    /// Standard uncertainty of a range over turns from the form's slope: nothing tells it from motion along the sensor. It is
    /// at most the slope times what `across` is of motion across, in every sensor of the combination, and as likely to be
    /// anything below.
    fn carried(&self, direction: Direction, spreads: &[&Spread], across: fn(&Spread, Direction) -> f64) -> f64 {
        // The form that an axial sensor sees is that of the face: no slope around the part carries it.
        if direction.is_axial() {
            return 0.0;
        }
        let radial = directions(spreads).into_iter().filter(|direction| !direction.is_tilt() && !direction.is_axial());
        let across = radial.flat_map(|direction| spreads.iter().map(move |spread| across(spread, direction)));
        let reach = spreads.iter().map(|spread| spread.reach(direction)).fold(0.0, f64::max);
        self.slope * across.fold(0.0, f64::max) * reach / 3.0_f64.sqrt()
    }

    /// The largest spread of a setup's turns at one angle, in the setup where it is largest; and the root mean square of all
    /// setups' turns about their mean.
    fn asynchronous(&self, direction: Direction, z_mm: f64, spreads: &[&Spread]) -> [Value; 2] {
        let each: Vec<f64> = spreads.iter().map(|spread| widest(spread, direction)).collect();
        let each_rms: Vec<f64> = spreads.iter().map(|spread| rms_across(spread, direction)).collect();
        let gain = spreads.iter().map(|spread| spread.noise_gain(direction)).fold(0.0, f64::max);
        let gain_unit = if direction.is_tilt() { " µrad/µm" } else { "" };
        let alone = if each.len() < 2 { "; one setup leaves its uncertainty unknown" } else { "" };
        let id = self.id(direction);
        let described = described(direction, z_mm);
        let value = |symbol, what: &str, value, uncertainty| Value {
            symbol,
            unit: unit(direction),
            value,
            source: format!(
                "{STANDARD}, asynchronous error motion value, {described}, {what} of {}; with the sensors' noise, \
                 {gain:.3}{gain_unit} times that of one{alone}",
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
            uncertainty,
        };
        let [std, rms_std] = [widest, rms_across].map(|across| self.carried(direction, spreads, across));
        [
            value(
                format!("asynchronous-{id}"),
                "largest spread at one angle",
                each.iter().copied().fold(0.0, f64::max),
                between_setups(&each, std),
            ),
            value(
                format!("asynchronous-{id}-rms"),
                "root mean square about the mean at each angle",
                root_mean_square(&each_rms),
                between_setups(&each_rms, rms_std),
            ),
        ]
    }

    /// A direction as symbols name it.
    fn id(&self, direction: Direction) -> String {
        let separated = |quantity| self.separation.position(quantity).is_some();
        match direction {
            Direction::Along(line) if !separated(Quantity::Along(line)) => chosen_id(direction),
            Direction::TiltAlong(line) if !separated(Quantity::Along(line)) => chosen_id(direction),
            Direction::Face(_) => chosen_id(direction),
            _ => id(direction).to_owned(),
        }
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
            // Eccentricity is no form: at order 1 a declared form adds nothing.
            uncertainty: (std > 0.0)
                .then(|| Uncertainty::of_amplitude(value, std, self.separation.degrees_of_freedom(1))),
        })
    }
}

/// How two values of a plot are found.
enum Measure<'a> {
    /// Peak to valley and root mean square, which errors change without moving the centre.
    AboutFixedCentre,
    /// By this.
    Of(&'a dyn Fn(&[f64]) -> [f64; 2]),
}

/// What noise adds to two values of a plot in the mean, and the uncertainty of each without it; `None` where no variance is
/// known. Tilt has noise of all orders and little motion above the low ones, so that noise adds up.
fn without_noise(
    found: [f64; 2],
    plot: &[f64],
    variance: &[f64],
    lowest: usize,
    seed: u64,
    measure: &Measure,
) -> Option<[(f64, Uncertainty); 2]> {
    if plot.len() < 2 {
        return None;
    }
    let mut errors = Errors::new(variance, lowest, seed)?;
    let mut fourier = Fourier::new(plot.len());
    let mut harmonics = vec![Complex64::ZERO; variance.len().min(fourier.max_order() + 1)];
    fourier.analyse(plot.iter().copied(), &mut harmonics);
    let weights = stand_in(&harmonics, variance, lowest);
    // What is above the orders with a known variance stays.
    let noise: Vec<Complex64> = harmonics.iter().zip(weights).map(|(value, weight)| value * (1.0 - weight)).collect();
    let mut likely = plot.to_vec();
    likely.iter_mut().zip(fourier.synthesise(noise)).for_each(|(value, noise)| *value -= noise);
    let (about, drawn): ([f64; 2], Vec<[f64; 2]>) = match measure {
        Measure::AboutFixedCentre => {
            // Errors of orders from 1 on leave the mean.
            let mean = likely.iter().sum::<f64>() / likely.len() as f64;
            likely.iter_mut().for_each(|value| *value -= mean);
            let plot = FixedCentre::new(likely);
            let both = |values: roundness::Values| [values.ront_um, values.ronq_um];
            (both(plot.about()), (0..DRAWS).map(|_| both(plot.values(&errors.turned(&mut fourier)))).collect())
        }
        Measure::Of(values) => {
            let mut drawn = likely.clone();
            let mut next = || {
                errors.draw(&mut fourier, &likely, &mut drawn);
                values(&drawn)
            };
            let all = (0..DRAWS).map(|_| next()).collect();
            (values(&likely), all)
        }
    };
    let (first, second) = drawn.into_iter().map(|[first, second]| (first, second)).unzip();
    Some([extreme(found[0], about[0], first)?, extreme(found[1], about[1], second)?])
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

/// Lowest and highest of all turns about a plot, from the lowest and the highest turn less the mean: on as many angles as the plot or
/// on fewer, and then straight from one angle to the next.
fn of_all_turns(plot: &[f64], (low, high): (&[f64], &[f64])) -> (f64, f64) {
    let finer = plot.len() / low.len().max(1);
    let (mut inner, mut outer) = (f64::INFINITY, f64::NEG_INFINITY);
    for (index, plot) in plot.chunks_exact(finer.max(1)).take(low.len()).enumerate() {
        let next = (index + 1) % low.len();
        let step = |turns: &[f64]| (turns[next] - turns[index]) / finer as f64;
        let (low_step, high_step) = (step(low), step(high));
        let (mut lowest, mut highest) = (low[index], high[index]);
        for value in plot {
            inner = inner.min(value + lowest);
            outer = outer.max(value + highest);
            (lowest, highest) = (lowest + low_step, highest + high_step);
        }
    }
    (inner, outer)
}

/// Root mean square of a setup's turns about their mean; 0 where it is not known.
fn rms_across(spread: &Spread, direction: Direction) -> f64 {
    spread.rms(direction).unwrap_or(0.0)
}

/// Root mean square about the mean: that of a polar plot about the circle of its mean radius.
fn rms_about_mean(plot: &[f64]) -> f64 {
    let count = plot.len().max(1) as f64;
    let mean = plot.iter().sum::<f64>() / count;
    (plot.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// What setups, each a capture of its own, say of a range over turns: the scatter of one of them, and where another one
/// would lie with 95 % probability; `std` is of what they share. `None` of one.
fn between_setups(each: &[f64], std: f64) -> Option<Uncertainty> {
    let freedom = each.len().checked_sub(1).filter(|freedom| *freedom > 0)?;
    let count = each.len() as f64;
    let mean = each.iter().sum::<f64>() / count;
    let scatter = (each.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / freedom as f64).sqrt();
    let student = student_95(freedom as f64);
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

/// "radial-at-45deg": a direction that was chosen.
fn chosen_id(direction: Direction) -> String {
    match direction {
        Direction::Along(line) => format!("radial-at-{}deg", line.degrees()),
        Direction::TiltAlong(line) => format!("tilt-at-{}deg", line.degrees()),
        Direction::Face(place) => format!("face-at-{place}"),
        _ => id(direction).to_owned(),
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
        Direction::Axial => "axial",
        Direction::Face(_) => "face",
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
        Direction::Axial => "axial, fixed sensitive direction".into(),
        Direction::Face(place) => format!(
            "face, fixed sensitive direction, {} mm from the axis at {}° from x towards y",
            place.radius_mm(),
            place.degrees()
        ),
    }
}

/// What axial values are referred to.
fn centre_of_chart() -> &'static str {
    Centre::PolarChart.symbol()
}

/// To a micrometre, without trailing zeros.
fn millimetres(z_mm: f64) -> f64 {
    (1e3 * z_mm).round() / 1e3
}
