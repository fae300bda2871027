//! What is known of one station once it is separated.

use runout_numerics::{Complex64, fourier::Fourier, statistics::f_tail};

use crate::{
    measurement::StationTruth,
    profile::Profile,
    separation::{Quantity, Separation, VarianceFrom},
};

/// The last orders of a form, which say whether it goes on above them, and the chance of so much noise in them.
const LAST_ORDERS: usize = 8;
const BY_CHANCE: f64 = 1e-6;

/// One station, done.
#[derive(Debug, Clone, PartialEq)]
pub struct StationResult {
    /// Its name.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// Equal angles on which form and motion are given.
    pub angles: usize,
    /// Form and motion.
    pub separation: Separation,
    /// The averages that it came from; empty for measured points.
    pub profiles: Vec<Profile>,
    /// What the recording says is true.
    pub truth: Option<StationTruth>,
}

impl StationResult {
    /// The lowest order of which a filter before the averages passes half; `None` without one.
    #[must_use]
    pub fn half_power_upr(&self) -> Option<f64> {
        let of = |profile: &Profile| {
            let speed_rpm = profile.speed_rpm?;
            let orders = profile.responses.iter().map(|response| response.half_power_hz * 60.0 / speed_rpm);
            orders.reduce(f64::min)
        };
        self.profiles.iter().filter_map(of).reduce(f64::min)
    }

    /// Form of a section above the highest order, as far as it shows: root mean square in µm. An edge has all orders: where the last ones that there are
    /// stand out from their noise, as much is above them.
    #[must_use]
    pub fn absent_um(&self, section: usize) -> f64 {
        let of_section = self.separation.sections.get(section).map_or(0.0, |at| at.absent_um);
        let above = self.profiles.iter().map(|profile| profile.absent_um).fold(of_section, f64::max);
        above.max(self.last_orders_um(section).unwrap_or(0.0))
    }

    /// What the last orders of a form have beyond their noise, in µm; `None` where that is no more than chance, or the noise is not known order by order.
    fn last_orders_um(&self, section: usize) -> Option<f64> {
        let separation = &self.separation;
        let unknown = separation.position(Quantity::Form(section))?;
        let known = separation.coefficients(unknown).zip(separation.noise_variance(unknown)).skip(2);
        let known = known.map(|(value, variance)| (value.norm_sqr(), variance));
        let known: Vec<(f64, f64)> = known.filter(|(square, variance)| square.is_finite() && *variance > 0.0).collect();
        let last =
            known.len().checked_sub(LAST_ORDERS).filter(|before| *before > LAST_ORDERS).map(|at| &known[at..])?;
        let [squares, noise] =
            last.iter().fold([0.0; 2], |[squares, noise], (square, of)| [squares + square, noise + of]);
        let freedom = separation.degrees_of_freedom(separation.max_order()) as f64;
        let is_chance = f_tail(squares / noise, 2.0 * LAST_ORDERS as f64, 2.0 * freedom) > BY_CHANCE;
        let of_orders = separation.variance_from == VarianceFrom::OrdersBeside;
        (of_orders && freedom > 0.0 && squares > noise && !is_chance).then(|| (0.5 * (squares - noise)).sqrt())
    }

    /// Share of the amplitude of an order that the filters before the averages pass, in the average where it is least.
    #[must_use]
    pub fn passed(&self, order: usize) -> f64 {
        self.profiles.iter().map(|profile| profile.passed(order)).fold(1.0, f64::min)
    }

    /// Root mean square of a section's form over the observable orders from 2, and its standard uncertainty, in µm.
    ///
    /// rms² = ½ Σ|c|², so that errors δ of no favoured phase give u² = Σ|c|² E|δ|² / (8 rms²); NaN where no variance is known.
    /// `None` where nothing is observable.
    #[must_use]
    pub fn form_rms_um(&self, section: usize) -> Option<(f64, f64)> {
        let separation = &self.separation;
        let unknown = separation.position(Quantity::Form(section)).filter(|unknown| !separation.is_lost(*unknown))?;
        let squares = || separation.coefficients(unknown).skip(2).map(|value| value.norm_sqr());
        let rms = (0.5 * squares().sum::<f64>()).sqrt();
        let variance = (2..).map(|order| separation.variance_of(order * separation.unknowns.len() + unknown));
        let errors = squares().zip(variance).filter(|(square, _)| *square > 0.0);
        let spread: f64 = errors.map(|(square, variance)| square * variance).sum();
        Some((rms, (spread / 8.0).sqrt() / rms))
    }

    /// One unknown on [`angles`](Self::angles) equal angles from 0: form over the part's, motion over the spindle's.
    /// Orders that are not observable are left out; where nothing is known, and of no unknown, values are NaN.
    #[must_use]
    pub fn over_angle(&self, unknown: usize) -> Vec<f64> {
        let known = self.separation.unknowns.get(unknown).filter(|_| !self.separation.is_lost(unknown));
        let Some(quantity) = known else { return vec![f64::NAN; self.angles] };
        let turned = |value: Complex64| if quantity.is_form() { value } else { value.conj() };
        let mut values =
            Fourier::new(self.angles).synthesise(self.separation.coefficients(unknown).map(turned)).to_vec();
        if let Quantity::Form(section) = quantity
            && let Some(section) = self.separation.sections.get(*section)
        {
            section.gaps.blank(&mut values);
        }
        values
    }
}
