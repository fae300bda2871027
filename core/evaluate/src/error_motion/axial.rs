//! Axial and face error motion values.
//!
//! Along the axis the fundamental is error motion: 1/rev of the spindle's z is no matter of clamping, as it is across the axis
//! (ISO 230-7, ASME B89.3.4). *Synchronous* motion has all orders from 1, *residual synchronous* motion those
//! from 2, *fundamental* is twice the amplitude of order 1. All are referred to the centre of the polar chart, since any other
//! centre moves with the fundamental. Order 0 and slow drift are the level of z and no motion.
//!
//! *Face* error motion at a place (ρ, θ) is z − ρ·(tilt towards θ). Of order 1, the part of the tilt that turns with the part is
//! how the face was clamped, and is left out.

use super::{
    ErrorMotion, FINER, MotionKind,
    names::{STANDARD, XYZ, centre_of_chart, described, fundamental_along, over, unit},
    polar::Synchronous,
    synchronous::Named,
    turns::{between_setups, bounded, of_all_turns, rms_about_mean, rms_across, root_mean_square, widest},
};
use crate::Value;
use runout_draws::{self as draws, Uncertainty};
use runout_standards::roundness::Angles;
use runout_turning::spread::{Direction, Spread};

/// Synchronous values along the axis in words, and those without the fundamental.
pub(super) const WHOLE: &str = "synchronous error motion value";
pub(super) const WITHOUT_FUNDAMENTAL: &str = "residual synchronous error motion value, without the fundamental";

impl ErrorMotion<'_> {
    /// Synchronous, total, residual synchronous and fundamental values along the axis; without those of order 1 where it is lost.
    pub(super) fn axial(&self, direction: Direction, z_mm: f64, spreads: &[&Spread]) -> Vec<Value> {
        let Some(first) = spreads.first() else { return Vec::new() };
        let from = |lowest: usize| {
            let plot = Synchronous::from_order(lowest, self.separation, &first.projection, direction, z_mm);
            plot.filter(|plot| !plot.is_lost())
        };
        let mut values = Vec::new();
        if let Some(whole) = from(1).filter(|plot| plot.lost.first() != Some(&1)) {
            values.extend(
                self.synchronous(MotionKind::Synchronous, WHOLE, direction, &whole, z_mm).into_iter().flatten(),
            );
            values.extend(self.total_axial(direction, &whole, spreads, z_mm).into_iter().flatten());
            values.extend(self.fundamental_axial(direction, &whole, z_mm));
        }
        if let Some(residual) = from(2) {
            let kind = MotionKind::ResidualSynchronous;
            values
                .extend(self.synchronous(kind, WITHOUT_FUNDAMENTAL, direction, &residual, z_mm).into_iter().flatten());
        }
        values
    }

    /// Range of what repeats, and its root mean square.
    fn synchronous(
        &self,
        kind: MotionKind,
        what: &str,
        direction: Direction,
        plot: &Synchronous,
        z_mm: f64,
    ) -> Option<[Value; 2]> {
        let id = self.id(direction);
        let seed = draws::seed(&[self.station, &id, kind.name()]);
        let centre = centre_of_chart();
        let seen = plot.seen(centre, self.angles, plot.band[0], seed)?;
        let described = described_within(direction, plot, z_mm);
        let named = Named { kind, what, id: &id, described: &described, unit: unit(direction), centre };
        Some(plot.values(&named, &seen))
    }

    /// Range of all turns, and their root mean square.
    fn total_axial(
        &self,
        direction: Direction,
        plot: &Synchronous,
        spreads: &[&Spread],
        z_mm: f64,
    ) -> Option<[Value; 2]> {
        let (mut all, mut each, mut each_rms) = ((f64::INFINITY, f64::NEG_INFINITY), Vec::new(), Vec::new());
        let rms = rms_about_mean(&plot.over_angle(&Angles::shared(self.angles)));
        for spread in spreads {
            let drawn = plot.over_angle(&Angles::shared(FINER * spread.angles));
            let (inner, outer) = of_all_turns(&drawn, spread.in_direction(direction)?);
            all = (all.0.min(inner), all.1.max(outer));
            each.push(outer - inner);
            each_rms.push(rms.hypot(spread.rms(direction)?));
        }
        let std = (0.5 * plot.variance.iter().sum::<f64>()).sqrt();
        let (id, total) = (self.id(direction), format!("total error motion value, {}", over(spreads)));
        let (across, across_rms) =
            (self.carried(direction, spreads, widest), self.carried(direction, spreads, rms_across));
        let rms_what = format!("{total}, root mean square over angles and turns");
        let range_known = bounded(between_setups(&each, std.hypot(across)), plot.bound);
        let rms_known = bounded(between_setups(&each_rms, std.hypot(across_rms)), 0.5 * plot.bound);
        let total_rms = root_mean_square(&each_rms);
        Some([
            Self::axial_value(&format!("total-{id}"), &total, direction, plot, z_mm, all.1 - all.0, range_known),
            Self::axial_value(&format!("total-{id}-rms"), &rms_what, direction, plot, z_mm, total_rms, rms_known),
        ])
    }

    /// Twice the amplitude of order 1.
    fn fundamental_axial(&self, direction: Direction, plot: &Synchronous, z_mm: f64) -> Option<Value> {
        let value = 2.0 * plot.harmonic(1)?.norm();
        // The part of an error E|δ|² along the phasor is half of it.
        let std = (2.0 * plot.variance.get(1).copied().unwrap_or(0.0)).sqrt();
        let known = (std > 0.0).then(|| Uncertainty::of_amplitude(value, std, self.separation.degrees_of_freedom(1)));
        let described = described_within(direction, plot, z_mm);
        Some(fundamental_along(&self.id(direction), value, bounded(known, plot.bound), &described))
    }

    #[allow(clippy::too_many_arguments, reason = "what differs between the values of one plot")]
    fn axial_value(
        symbol: &str,
        what: &str,
        direction: Direction,
        plot: &Synchronous,
        z_mm: f64,
        value: f64,
        uncertainty: Option<Uncertainty>,
    ) -> Value {
        Value {
            band_upr: plot.band,
            lost_orders: plot.lost.clone(),
            uncertainty,
            ..Value::referred(
                symbol,
                value,
                unit(direction),
                &format!("{STANDARD}, {what}, {}", described_within(direction, plot, z_mm)),
                centre_of_chart().symbol(),
            )
        }
    }
}

/// The direction in words, with what a declared form may add.
fn described_within(direction: Direction, plot: &Synchronous, z_mm: f64) -> String {
    let bound = if plot.bound > 0.0 {
        format!("; the form declared within its bound may add up to {:.3} {}", plot.bound, unit(direction))
    } else {
        String::new()
    };
    format!("{}{bound}", described(direction, z_mm, XYZ))
}
