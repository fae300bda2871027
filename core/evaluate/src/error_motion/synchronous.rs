//! Synchronous values of a plot about a centre: peak to valley and root mean square, with intervals without what noise adds to them.

use super::{
    Centre, FINER, MotionKind,
    names::STANDARD,
    polar::{Synchronous, seen_from},
    turns::{bounded, rms_about_mean},
};
use crate::Value;
use runout_draws::{self as draws, Draws, Interval, KINDS, Uncertainty, drawn_angles};
use runout_numerics::{Complex64, fourier::Fourier};
use runout_standards::roundness::{Angles, Heights, Points, Sum, ront_lsci_um};

/// Points on a wave where errors are drawn.
const DRAWN_POINTS_A_WAVE: usize = 4;

/// A value of a plot.
pub(super) struct Measured {
    pub value: f64,
    /// Where the variance of the plot's harmonics is known.
    pub known: Option<Uncertainty>,
    pub raised_by_noise: Option<f64>,
}

/// A plot as it is seen from a centre.
pub(super) struct AboutCentre {
    pub range: Measured,
    pub rms: Measured,
    /// On [`FINER`] times the angles.
    pub finely: Vec<f64>,
}

/// What synchronous values are called.
pub(super) struct Named<'a> {
    pub kind: MotionKind,
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
    pub(super) fn seen(&self, centre: Centre, angles: usize, lowest: usize, seed: u64) -> Option<AboutCentre> {
        let mut points = Points::default();
        // Errors raise crests between the given angles too. Draws on angles that show them give the error as well as draws on
        // those where the range is sought, from which it differs by little.
        let count = drawn_angles(DRAWN_POINTS_A_WAVE, self.crest_orders(), self.band[1] + 1);
        let (seen, finely) =
            (self.seen_on(count, centre, &mut points)?, self.seen_on(FINER * angles, centre, &mut points)?);
        let mut fourier = Fourier::new(count);
        let mut harmonics = vec![Complex64::ZERO; self.variance.len().min(fourier.max_order() + 1)];
        fourier.analyse(seen.iter().copied(), &mut harmonics);
        let (variance, squares) = (self.variance[..harmonics.len()].to_vec(), self.freedom.clone());
        let variance_from = draws::VarianceFrom::OrdersBeside;
        let draws = Draws::of_section(&draws::Measured { harmonics, variance, squares, variance_from, lowest }, seed);
        let angles = Angles::shared(count);
        // Without the mean, about which the root mean square is.
        let weight = |order: usize| if order == 0 { Complex64::ZERO } else { Complex64::ONE };
        let profiles = draws.as_ref().map(|draws| draws.profiles(weight, count, |_, _| ()));
        let known = profiles.map_or_else(Vec::new, |profiles| {
            if centre.is_linear() {
                let of_kind = |kind| Heights::new(&profiles.undisturbed_um(kind)[0]);
                let heights: Vec<Heights> = (0..KINDS).map(of_kind).collect();
                let mut sum = Sum::default();
                return profiles.values(|kind, noise, found| {
                    let plot = &heights[kind];
                    let ([low, high], rms) =
                        noise.map_or_else(|| plot.undisturbed(), |noise| plot.with(&noise[0], &mut sum));
                    found.extend([high - low, rms]);
                });
            }
            profiles.values_of_section(|plot, found| {
                let place = centre.of(&angles, plot, &mut points).unwrap_or_default();
                let seen = seen_from(place, &angles, plot);
                found.extend([ront_lsci_um(&seen), rms_about_mean(&seen)]);
            })
        });
        let measured = |index: usize, value: f64| {
            let known = known.get(index);
            let raised_by_noise = known.and_then(Interval::raised_by_noise);
            Measured { value, known: known.and_then(|known| known.at(value)), raised_by_noise }
        };
        let range = measured(0, ront_lsci_um(&finely));
        let rms = measured(1, rms_about_mean(&seen));
        Some(AboutCentre { range, rms, finely })
    }

    /// The plot from a centre, on so many equal angles.
    pub(super) fn seen_on(&self, count: usize, centre: Centre, points: &mut Points) -> Option<Vec<f64>> {
        let angles = Angles::shared(count);
        let drawn = self.over_angle(&angles);
        let place = centre.of(&angles, &drawn, points)?;
        Some(seen_from(place, &angles, &drawn))
    }

    /// Its two values.
    pub(super) fn values(&self, named: &Named, seen: &AboutCentre) -> [Value; 2] {
        let Named { kind, what, id, described, unit, centre } = *named;
        // The root mean square of what lies within a range of B is B/2 at most.
        let range = (format!("{kind}-{id}"), what.to_owned(), &seen.range, self.bound);
        let rms = (
            format!("{kind}-{id}-rms"),
            format!("{what}, root mean square over the angles"),
            &seen.rms,
            0.5 * self.bound,
        );
        [range, rms].map(|(symbol, what, Measured { value, known, raised_by_noise }, bound)| Value {
            band_upr: self.band,
            lost_orders: self.lost.clone(),
            uncertainty: bounded(known.clone(), bound),
            raised_by_noise: *raised_by_noise,
            ..Value::referred(&symbol, *value, unit, &format!("{STANDARD}, {what}, {described}"), centre.symbol())
        })
    }
}
