//! One method's estimates at one station, with how they follow from the readings.

use crate::stage::Station;
use runout_numerics::Complex64;
use runout_turning::{
    profile::{Profile, smooth},
    separation::{Quantity, Sensitivity, Separation, UM_PER_MM_URAD},
};

/// Planes nearer than this are the same, in mm: far below what any sensor's place is known to.
const SAME_PLANE_MM: f64 = 1e-6;

/// Covariance of a station's averaged readings: captures are independent of each other.
pub(super) struct Scatter {
    /// Channels of each capture, and their covariance `[order][channel][channel]` smoothed over orders.
    captures: Vec<(usize, Option<Vec<Complex64>>)>,
}

impl Scatter {
    pub(crate) fn of(station: &Station) -> Self {
        let capture = |profile: &Profile| {
            let channels = profile.channels();
            let mut covariance = profile.covariance.clone();
            if let Some(covariance) = &mut covariance {
                smooth(covariance, channels * channels);
            }
            (channels, covariance)
        };
        Self { captures: station.profiles.iter().map(capture).collect() }
    }

    /// row · Σ · rowᴴ at an order; NaN where a reading that counts has no covariance.
    pub(crate) fn variance(&self, order: usize, row: &[Complex64]) -> f64 {
        let mut rest = row;
        let mut sum = 0.0;
        for (channels, covariance) in &self.captures {
            let (own, others) = rest.split_at((*channels).min(rest.len()));
            rest = others;
            if own.iter().all(|entry| *entry == Complex64::ZERO) {
                continue;
            }
            let size = channels * channels;
            let Some(matrix) = covariance.as_ref().and_then(|all| all.get(order * size..(order + 1) * size)) else {
                return f64::NAN;
            };
            for (left, line) in own.iter().zip(matrix.chunks_exact(*channels)) {
                sum += line.iter().zip(own).map(|(entry, right)| (left * entry * right.conj()).re).sum::<f64>();
            }
        }
        sum.max(0.0)
    }
}

/// Estimates, variances and operators of all orders.
#[derive(Clone)]
pub(super) struct Estimates {
    pub unknowns: Vec<Quantity>,
    /// Where x and y are observable.
    pub motion_z_mm: f64,
    /// `[order][unknown]`, NaN where lost.
    values: Vec<Complex64>,
    variance: Vec<f64>,
    observable: Vec<bool>,
    /// Nothing where it is not known.
    sensitivity: Option<Sensitivity>,
}

impl Estimates {
    pub(crate) fn new(separation: &Separation, sensitivity: Option<Sensitivity>) -> Self {
        Self {
            unknowns: separation.unknowns.clone(),
            motion_z_mm: separation.motion_z_mm,
            values: separation.estimate.clone(),
            variance: (0..separation.estimate.len()).map(|place| separation.variance_of(place)).collect(),
            observable: separation.observable.clone(),
            sensitivity,
        }
    }

    pub(crate) fn max_order(&self) -> usize {
        (self.values.len() / self.unknowns.len().max(1)).saturating_sub(1)
    }

    pub(crate) fn position(&self, quantity: Quantity) -> Option<usize> {
        self.unknowns.iter().position(|unknown| *unknown == quantity)
    }

    /// The estimate and its variance, where the order is observable.
    pub(crate) fn observable_value(&self, order: usize, unknown: usize) -> Option<(Complex64, f64)> {
        let index = order * self.unknowns.len() + unknown;
        (*self.observable.get(index)?).then(|| (self.values[index], self.variance[index]))
    }

    /// How an estimate follows from the readings, where that is known.
    pub(crate) fn row(&self, order: usize, unknown: usize) -> Option<&[Complex64]> {
        let Sensitivity { readings, operator } = self.sensitivity.as_ref()?;
        let start = (order * self.unknowns.len() + unknown) * readings;
        operator.get(start..start + readings)
    }

    pub(crate) fn has_motion(&self) -> bool {
        self.unknowns.iter().any(|unknown| !unknown.is_form())
    }

    pub(crate) fn has_tilt(&self) -> bool {
        self.unknowns.iter().any(|unknown| unknown.is_tilt())
    }

    pub(crate) fn in_plane(&self, z_mm: f64) -> bool {
        (self.motion_z_mm - z_mm).abs() <= SAME_PLANE_MM
    }

    /// The estimates with x and y at another z: x(z) = X + z·E_y, y(z) = Y − z·E_x; lost where the tilt is. `None` where no tilt is observable.
    pub(crate) fn moved_to(&self, z_mm: f64, scatter: &Scatter) -> Option<Self> {
        if self.in_plane(z_mm) {
            return Some(self.clone());
        }
        if !self.has_tilt() {
            return None;
        }
        let distance = (z_mm - self.motion_z_mm) * UM_PER_MM_URAD;
        let mut moved = Self { motion_z_mm: z_mm, ..self.clone() };
        let width = self.unknowns.len();
        for (shift, quantity) in self.unknowns.iter().enumerate() {
            let Some((tilt, factor)) = quantity.moved_by_tilt() else { continue };
            let (tilt, lever) = (self.position(tilt), factor * distance);
            for order in 0..=self.max_order() {
                let index = order * width + shift;
                let turned = tilt.and_then(|tilt| Some((self.observable_value(order, tilt)?.0, self.row(order, tilt))));
                let (Some((value, row)), true) = (turned, self.observable[index]) else {
                    moved.observable[index] = false;
                    continue;
                };
                moved.values[index] += value * lever;
                moved.variance[index] = f64::NAN;
                if let (Some(Sensitivity { readings, operator }), Some(row)) = (&mut moved.sensitivity, row) {
                    let own = &mut operator[index * *readings..(index + 1) * *readings];
                    own.iter_mut().zip(row).for_each(|(entry, tilt)| *entry += tilt * lever);
                    moved.variance[index] = scatter.variance(order, own);
                }
            }
        }
        Some(moved)
    }
}
