//! Kriging with the true covariance, by full matrices: the best linear predictor, and how far a signal shows beside the field.

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};
use runout_spatial_error::simulate::{Field, Scenario, Simulated};

use super::machine::TRAVEL_MM;

/// Distance of the tracker, in mm, for the noise of its angles.
const DISTANCE_MM: f64 = 2000.0;

/// A campaign with its true covariance.
pub struct Known {
    places: Vec<[f64; 3]>,
    field: Field,
    /// Inverse covariance of each component.
    inverse: Vec<DMatrix<f64>>,
    /// Means at the places, of each component.
    mean: Vec<DVector<f64>>,
    trend: DVector<f64>,
    normal_inverse: DMatrix<f64>,
}

impl Known {
    /// Of a scenario with a field; `None` without one, or where its matrices are singular.
    #[must_use]
    pub fn new(scenario: &Scenario, made: &Simulated) -> Option<Self> {
        let field = scenario.field.clone()?;
        let mut places: Vec<[f64; 3]> = Vec::new();
        let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
        for (place, reading) in made.commands_mm.iter().zip(&made.readings_um) {
            // Commands are repeated to the last bit.
            let same = |known: &[f64; 3]| known.iter().zip(place).all(|(a, b)| a.to_bits() == b.to_bits());
            let index = places.iter().position(same).unwrap_or_else(|| {
                places.push(*place);
                sums.push((Vector3::zeros(), 0.0));
                places.len() - 1
            });
            sums[index].0 += Vector3::from(*reading);
            sums[index].1 += 1.0;
        }
        let count = places.len();
        let angular = 1e-3 * DISTANCE_MM * scenario.tracker.angle_urad;
        let noise = scenario.tracker.noise_um.powi(2) + angular * angular;
        let (mut inverse, mut mean) = (Vec::new(), Vec::new());
        let (mut normal, mut right) = (DMatrix::zeros(6, 6), DVector::zeros(6));
        for axis in 0..3 {
            let covariance = DMatrix::from_fn(count, count, |row, column| {
                let own = if row == column { noise / sums[row].1 } else { 0.0 };
                field.std_um[axis].powi(2) * correlation(&field, places[row], places[column]) + own
            });
            let values = DVector::from_fn(count, |row, _| sums[row].0[axis] / sums[row].1);
            let design = DMatrix::from_fn(count, 6, |row, column| rigid(places[row], axis, column));
            let all = Cholesky::new(covariance)?.inverse();
            normal += design.transpose() * &all * &design;
            right += design.transpose() * &all * &values;
            inverse.push(all);
            mean.push(values);
        }
        let normal_inverse = normal.try_inverse()?;
        let trend = &normal_inverse * right;
        Some(Self { places, field, inverse, mean, trend, normal_inverse })
    }

    /// Displacements (µm) and rotations (µrad) of the placement, with standard uncertainty.
    #[must_use]
    pub fn placement(&self) -> [[f64; 2]; 6] {
        [0, 1, 2, 3, 4, 5].map(|index| [self.trend[index], self.normal_inverse[(index, index)].sqrt()])
    }

    /// Predictions, in µm.
    #[must_use]
    pub fn predict(&self, queries: &[[f64; 3]]) -> Vec<Vector3<f64>> {
        let mut all = vec![Vector3::zeros(); queries.len()];
        for axis in 0..3 {
            let of_trend = |place: [f64; 3]| (0..6).map(|at| rigid(place, axis, at) * self.trend[at]).sum::<f64>();
            let left = DVector::from_fn(self.places.len(), |row, _| self.mean[axis][row] - of_trend(self.places[row]));
            let weights = &self.inverse[axis] * left;
            for (out, query) in all.iter_mut().zip(queries) {
                let field: f64 = (self.places.iter().zip(weights.iter()))
                    .map(|(place, weight)| correlation(&self.field, *place, *query) * weight)
                    .sum();
                out[axis] = of_trend(*query) + self.field.std_um[axis].powi(2) * field;
            }
        }
        all
    }

    /// χ² by which a signal at the places raises the likelihood, with the placement free.
    #[must_use]
    pub fn visibility(&self, signal: &dyn Fn([f64; 3]) -> [f64; 3]) -> f64 {
        let mut whole = 0.0;
        let mut across = DVector::zeros(6);
        for axis in 0..3 {
            let values = DVector::from_fn(self.places.len(), |row, _| signal(self.places[row])[axis]);
            let design = DMatrix::from_fn(self.places.len(), 6, |row, column| rigid(self.places[row], axis, column));
            let weighted = &self.inverse[axis] * &values;
            whole += values.dot(&weighted);
            across += design.transpose() * weighted;
        }
        whole - (&self.normal_inverse * &across).dot(&across)
    }
}

/// Columns of a rigid motion about the middle of the travel: three displacements in µm, three rotations in µrad.
#[must_use]
pub fn rigid(place: [f64; 3], axis: usize, column: usize) -> f64 {
    if column < 3 {
        return f64::from(u8::from(column == axis));
    }
    let about = Vector3::from_fn(|at, _| f64::from(u8::from(at == column - 3)));
    1e-3 * about.cross(&Vector3::from_fn(|at, _| place[at] - 0.5 * TRAVEL_MM[at]))[axis]
}

/// Matérn's family by its closed forms, and its limit.
fn correlation(field: &Field, one: [f64; 3], other: [f64; 3]) -> f64 {
    let scaled = [0, 1, 2].map(|axis: usize| (one[axis] - other[axis]) / field.range_mm[axis]);
    let d = Vector3::from(scaled).norm();
    match field.smoothness {
        None => (-0.5 * d * d).exp(),
        Some(nu) if nu < 1.0 => (-d).exp(),
        Some(nu) if nu < 2.0 => (1.0 + 3_f64.sqrt() * d) * (-3_f64.sqrt() * d).exp(),
        Some(_) => (1.0 + 5_f64.sqrt() * d + 5.0 / 3.0 * d * d) * (-5_f64.sqrt() * d).exp(),
    }
}
