//! What is known of one station once it is separated.

use runout_numerics::{Complex64, fourier::Fourier};

use crate::{
    measurement::StationTruth,
    profile::Profile,
    separation::{Quantity, Separation},
};

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

    /// Form of a section above the highest order, as far as it shows: root mean square in µm.
    #[must_use]
    pub fn absent_um(&self, section: usize) -> f64 {
        let of_section = self.separation.sections.get(section).map_or(0.0, |at| at.absent_um);
        self.profiles.iter().map(|profile| profile.absent_um).fold(of_section, f64::max)
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
