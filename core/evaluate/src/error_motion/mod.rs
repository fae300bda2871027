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
//! Noise of many high orders adds to a range, as it does to values of form: the interval is without it, and a value says by how much it is raised.
//!
//! x and y are those in the plane midway between the sensors, where noise is least.
//!
//! Of an axis that was measured at standing positions, [`StandingMotion`] gives the synchronous values.

mod axial;
mod kind;
mod names;
mod plots;
mod polar;
mod standing;
mod synchronous;
#[cfg(test)]
mod tests;
mod turns;
mod weakened;

pub use kind::MotionKind;
pub use names::{standing_symbols, symbols};
pub use plots::{Spectrum, TurnsPlot};
pub use polar::Centre;
pub use standing::{Fundamental, StandingMotion, weights};
pub use weakened::{behind_low_pass, below_absent};

use crate::Value;
use names::{
    STANDARD, WITH_FUNDAMENTAL, XYZ, chosen_id, described, fundamental_across, id, kind_of, over, place, unit,
};
use polar::{Motion, Synchronous};
use runout_draws::{self as draws, Uncertainty};
use runout_standards::roundness::{Angles, Points, Reference};
use runout_turning::{
    profile::Profile,
    separation::{Quantity, Separation},
    spread::{Direction, Spread},
};
use synchronous::Named;
use turns::{between_setups, bounded, directions, of_all_turns, rms_across, root_mean_square, widest};

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

/// The ends of a range are looked for on so many times the angles of the average: 16 to a wave of its highest order or more, so that a
/// crest between two of them is at most 1 − cos(π/16), 2 %, higher, and one of a tenth of that order 2e-4.
const FINER: usize = 8;

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
            // Setups in which a direction is not observable, as all sensors measure along another one, have no part in it.
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
        let mut points = Points::default();
        let seed = draws::seed(&[self.station, id(direction), centre.symbol()]);
        let seen = plot.seen(centre, self.angles, 2, seed)?;
        let rms = seen.rms.value;
        let (mut all, mut each, mut each_rms) = ((f64::INFINITY, f64::NEG_INFINITY), Vec::new(), Vec::new());
        for spread in spreads {
            let other =
                (spread.angles != self.angles).then(|| plot.seen_on(FINER * spread.angles, centre, &mut points));
            let other = other.map_or(Some(None), |other| other.map(Some))?;
            let (inner, outer) = of_all_turns(other.as_ref().unwrap_or(&seen.finely), spread.in_direction(direction)?);
            all = (all.0.min(inner), all.1.max(outer));
            each.push(outer - inner);
            each_rms.push(rms.hypot(spread.rms(direction)?));
        }
        let (id, described) = (self.id(direction), described(direction, z_mm, XYZ));
        let (kind, what) = kind_of(direction);
        let named = Named { kind, what, id: &id, described: &described, unit: unit(direction), centre };
        let [range, rms] = plot.values(&named, &seen);
        let total = format!("total error motion value without 1/rev, {}", over(spreads));
        let about = |symbol: String, what: &str, value, uncertainty| Value {
            symbol,
            value,
            source: format!("{STANDARD}, {what}, {described}"),
            uncertainty,
            raised_by_noise: None,
            ..range.clone()
        };
        let std = |known: &Option<Uncertainty>, across| {
            known.as_ref().map_or(0.0, |known| known.std).hypot(self.carried(direction, spreads, across))
        };
        let (range_std, rms_std) = (std(&seen.range.known, widest), std(&seen.rms.known, rms_across));
        let total_rms = root_mean_square(&each_rms);
        let totals = [
            about(format!("total-{id}"), &total, all.1 - all.0, bounded(between_setups(&each, range_std), plot.bound)),
            about(
                format!("total-{id}-rms"),
                &format!("{total}, root mean square over angles and turns"),
                total_rms,
                bounded(between_setups(&each_rms, rms_std), 0.5 * plot.bound),
            ),
        ];
        Some([range, rms].into_iter().chain(totals).collect())
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
            band_upr: plot.band,
            lost_orders: plot.lost.clone(),
            uncertainty: bounded(between_setups(&each, self.carried(direction, spreads, widest)), plot.bound),
            ..Value::referred(
                &format!("total-{id}{WITH_FUNDAMENTAL}"),
                all.1 - all.0,
                unit(direction),
                &format!(
                    "{STANDARD}, total error motion value with the part of 1/rev that turns against the spindle, {}, {}",
                    over(spreads),
                    described(direction, z_mm, XYZ)
                ),
                Centre::PolarChart.symbol(),
            )
        })
    }

    /// Standard uncertainty of a range over turns from the form's slope: it is not distinguishable from motion along the sensor. It is
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
        let described = described(direction, z_mm, XYZ);
        let value = |symbol: String, what: &str, value, uncertainty| Value {
            band_upr: [0, spreads.iter().map(|spread| spread.angles.saturating_sub(1) / 2).min().unwrap_or(0)],
            uncertainty,
            ..Value::referred(
                &symbol,
                value,
                unit(direction),
                &format!(
                    "{STANDARD}, asynchronous error motion value, {described}, {what} of {}; with the sensors' noise, \
                     {gain:.3}{gain_unit} times that of one{alone}",
                    over(spreads),
                ),
                "turns at one angle",
            )
        };
        let [std, rms_std] = [widest, rms_across].map(|across| self.carried(direction, spreads, across));
        let largest = value(
            format!("asynchronous-{id}"),
            "largest spread at one angle",
            each.iter().copied().fold(0.0, f64::max),
            between_setups(&each, std),
        );
        let rms = value(
            format!("asynchronous-{id}-rms"),
            "root mean square about the mean at each angle",
            root_mean_square(&each_rms),
            between_setups(&each_rms, rms_std),
        );
        let without_jitter = self.without_jitter(direction, rms.value);
        [largest, rms].map(|mut value| {
            if let (Some(share), Some(known)) = (without_jitter, &mut value.uncertainty) {
                *known = known.clone().with_equivalents(value.value, &[share * value.value]);
            }
            value
        })
    }

    /// Share of radial asynchronous motion that is left without what marks that turn add to [single turns](Profile::jitter_um).
    fn without_jitter(&self, direction: Direction, rms_um: f64) -> Option<f64> {
        let evaluated = self.profiles.iter().filter(|profile| profile.spread.is_some());
        let added_um = evaluated.map(Profile::jitter_um).fold(0.0, f64::max);
        let is_radial = !direction.is_tilt() && !direction.is_axial();
        (is_radial && added_um > 0.0).then(|| (1.0 - (added_um / rms_um).powi(2)).max(0.0).sqrt())
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
        let tilt = quantity != Quantity::X;
        // Eccentricity is no form: at order 1 a declared form adds nothing.
        let known = (std > 0.0).then(|| Uncertainty::of_amplitude(value, std, self.separation.degrees_of_freedom(1)));
        Some(fundamental_across(tilt, value, known, "spindle", &place(z_mm, XYZ)))
    }
}
