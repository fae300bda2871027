//! Synchronous values of a plot about a centre: peak to valley and root mean square, without what noise adds to them.

use std::cell::RefCell;

use super::{
    Centre, FINER, SAID,
    names::STANDARD,
    noise::{Measure, NoiseOf, Orders, without_noise},
    polar::{Synchronous, seen_from},
    turns::{bounded, rms_about_mean},
};
use runout_standards::{
    Value,
    roundness::{Angles, Points, ront_lsci_um},
    uncertainty::{Uncertainty, drawn_angles},
};

/// Points on a wave where errors are drawn.
const DRAWN_POINTS_A_WAVE: usize = 8;

/// A value of a plot.
pub(super) struct Measured {
    /// Without the share of noise.
    pub value: f64,
    /// What noise adds in the mean.
    pub share: f64,
    /// Where the variance of the plot's harmonics is known.
    pub known: Option<Uncertainty>,
}

/// A plot as it is seen from a centre.
pub(super) struct Seen {
    pub range: Measured,
    pub rms: Measured,
    /// On [`FINER`] times the angles.
    pub finely: Vec<f64>,
}

/// What synchronous values are called.
pub(super) struct Named<'a> {
    /// "synchronous", "residual-synchronous".
    pub kind: &'a str,
    /// The kind in words.
    pub what: &'a str,
    /// The direction as symbols name it.
    pub id: &'a str,
    /// The direction in words.
    pub described: &'a str,
    pub unit: &'a str,
    pub centre: Centre,
}

impl Synchronous {
    /// The plot from a centre, with errors of orders from `lowest` on; `None` where the centre is not determined.
    pub(super) fn seen(&self, centre: Centre, angles: usize, lowest: usize, seed: u64, orders: Orders) -> Option<Seen> {
        let points = RefCell::new(Points::default());
        let seen_on = |count: usize| self.seen_on(count, centre, &mut points.borrow_mut());
        // Errors raise crests between the given angles too. Draws on angles that show them tell the error as well as draws on
        // those where the range is sought, from which it differs by little.
        let count = drawn_angles(DRAWN_POINTS_A_WAVE, self.crest_orders(), self.band[1] + 1);
        let (seen, finely) = (seen_on(count)?, seen_on(FINER * angles)?);
        let between = ront_lsci_um(&finely) - ront_lsci_um(&seen);
        let angles = Angles::shared(count);
        let about_moved = |plot: &[f64]| {
            let place = centre.of(&angles, plot, &mut points.borrow_mut()).unwrap_or_default();
            let seen = seen_from(place, &angles, plot);
            [ront_lsci_um(&seen), rms_about_mean(&seen)]
        };
        let values = if centre.is_linear() { Measure::AboutFixedCentre } else { Measure::Of(&about_moved) };
        let found = [ront_lsci_um(&seen), rms_about_mean(&seen)];
        let noise = NoiseOf { variance: &self.variance, freedom: &self.freedom, lowest, seed };
        let known = without_noise(found, &seen, &noise, (&values, orders));
        let [range_known, rms_known] = known.map_or([None, None], |known| known.map(Some));
        let measured = |found: f64, between: f64, known: Option<(f64, Uncertainty)>| match known {
            Some((share, known)) => {
                // An interval from 0 on stays one: it holds a plot without motion.
                let low = known.interval_95[0];
                let mut known = known.moved(between);
                known.interval_95[0] = if low > 0.0 { known.interval_95[0] } else { low };
                Measured { value: (found + between - share).max(0.0), share, known: Some(known) }
            }
            None => Measured { value: found + between, share: 0.0, known: None },
        };
        Some(Seen { range: measured(found[0], between, range_known), rms: measured(found[1], 0.0, rms_known), finely })
    }

    /// The plot from a centre, on so many equal angles.
    pub(super) fn seen_on(&self, count: usize, centre: Centre, points: &mut Points) -> Option<Vec<f64>> {
        let angles = Angles::shared(count);
        let drawn = self.over_angle(&angles);
        let place = centre.of(&angles, &drawn, points)?;
        Some(seen_from(place, &angles, &drawn))
    }

    /// Its two values.
    pub(super) fn values(&self, named: &Named, seen: &Seen) -> [Value; 2] {
        let Named { kind, what, id, described, unit, centre } = *named;
        // The root mean square of what lies within a range of B is B/2 at most.
        let range = (format!("{kind}-{id}"), what.to_owned(), &seen.range, self.bound);
        let rms = (
            format!("{kind}-{id}-rms"),
            format!("{what}, root mean square over the angles"),
            &seen.rms,
            0.5 * self.bound,
        );
        [range, rms].map(|(symbol, what, Measured { value, share, known }, bound)| {
            let noise = match known {
                Some(_) if *share >= SAID => format!(", without {share:.3} {unit} that noise adds to it"),
                _ => String::new(),
            };
            Value {
                symbol,
                unit: unit.to_owned(),
                value: *value,
                source: format!("{STANDARD}, {what}{noise}, {described}"),
                band_upr: self.band,
                lost_orders: self.lost.clone(),
                weakened_above_upr: None,
                absent_above_upr: None,
                no_uncertainty: None,
                filter: "none".into(),
                reference: centre.symbol().into(),
                coverage: 1.0,
                uncertainty: bounded(known.clone(), bound),
                refuted_by: None,
            }
        })
    }
}
