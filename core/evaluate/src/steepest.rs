//! The steepest slope of one section.

use super::{Filter, NumberFound, roundness::angles_to_draw, section::Form};
use runout_draws::KINDS;
use runout_numerics::Complex64;
use runout_standards::{
    roundness::{Heights, Sum},
    slope::steepest_um_per_rad,
};

/// Points on a wave where errors are drawn: slopes are those of the highest orders.
const DRAWN_POINTS_A_WAVE: usize = 6;

impl Form {
    /// The steepest slope, µm/°, from the harmonics; its error by draws of slopes.
    pub(super) fn steepest(&self, filter: &Filter) -> NumberFound {
        let harmonics = filter.harmonics(&self.harmonics);
        let value = steepest_um_per_rad(&harmonics, &self.at.gaps).to_radians();
        let um_per_deg = |order: usize| Complex64::I * (order as f64).to_radians();
        let slopes: Vec<Complex64> =
            harmonics.iter().enumerate().map(|(order, value)| um_per_deg(order) * value).collect();
        let of_errors = filter.variance(&self.variance).into_iter().enumerate();
        let of_errors: Vec<f64> = of_errors.map(|(order, of)| of * um_per_deg(order).norm_sqr()).collect();
        let waves = filter.highest(self.held.highest).max(2);
        let angles = angles_to_draw(DRAWN_POINTS_A_WAVE, &slopes, &of_errors, waves);
        let weight = |order: usize| filter.weight(order) * um_per_deg(order);
        let Some(draws) = self.draws() else { return NumberFound::from((value, None)) };
        let profiles = draws.profiles(weight, angles, |_, slopes| self.at.gaps.blank(slopes));
        let heights: Vec<Heights> = (0..KINDS).map(|kind| Heights::new(&profiles.undisturbed_um(kind)[0])).collect();
        let mut sum = Sum::default();
        let found = profiles.values(|kind, noise, found| {
            let slopes = &heights[kind];
            let ([low, high], _) = noise.map_or_else(|| slopes.undisturbed(), |noise| slopes.with(&noise[0], &mut sum));
            found.push(high.max(-low));
        });
        NumberFound::of(value, found.first())
    }
}
