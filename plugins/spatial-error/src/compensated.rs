//! The error of the machine before and after compensation, as one number.

use faer::Mat;
use nalgebra::DVector;
use runout_core::{
    numerics::least_squares::{Basis, dot},
    summary::Value,
};

use crate::{
    conclusion::{At, Conclusion},
    whole::{Whole, root_mean_square},
};

/// Places of the query at most that the covariance of the predictions is taken from.
const TOGETHER: usize = 100;

/// A prediction, and what remains of it.
type Known<'a> = (&'a At, [f64; 3]);

impl Conclusion<'_> {
    /// Expected root mean square length of the error at the places of the query, less the declared motion that fits best there: where the
    /// instrument stands is no error of the machine, and far less well known. With the uncertainty of the predictions.
    pub(crate) fn of_compensation(&self, queries: &[At], factors: [f64; 3]) -> [Value; 2] {
        let known: Vec<Known> =
            queries.iter().filter_map(|at| Some((at, at.correction.as_ref()?.remains_um))).collect();
        let some: Vec<Known> = known.iter().step_by(known.len().div_ceil(TOGETHER).max(1)).copied().collect();
        let (placement, of_some) = (self.placement(&known), self.placement(&some));
        let spread = self.spread(&some, &of_some, factors);
        let variance = spread.as_ref().map_or_else(
            || {
                let variances = known.iter().flat_map(|(at, _)| at.predicted).map(|predicted| predicted.variance_um2);
                variances.filter(|variance| variance.is_finite()).sum::<f64>() / known.len() as f64
            },
            |spread| (0..spread.nrows()).map(|at| spread[(at, at)]).sum::<f64>() / some.len() as f64,
        );
        let rms_of = |mean_um: fn(&Known) -> [f64; 3]| {
            let left = |of: &[Known], placement: &Basis| {
                let axes = self.solution.measured.iter();
                let mut all: Vec<f64> = axes.flat_map(|axis| of.iter().map(|one| mean_um(one)[*axis])).collect();
                placement.remove_from(&mut all);
                all
            };
            let all = left(&known, &placement);
            let rms = (dot(&all, &all) / known.len() as f64 + variance).sqrt();
            let std = spread.as_ref().map_or(f64::NAN, |spread| {
                let mean = DVector::from_vec(left(&some, &of_some));
                let [of_some, std] = root_mean_square(&mean, spread, some.len());
                if of_some > 0.0 { std * rms / of_some } else { 0.0 }
            });
            [rms, std]
        };
        let value = |symbol: &str, [number, std]: [f64; 2], about: &str| {
            Value::new(symbol, number, std, "um", about).not_negative().key()
        };
        [
            value(
                "error_rms",
                rms_of(|(at, _)| at.error_um),
                "expected root mean square length of the error at the places of the query, less the declared placement that fits best",
            ),
            value(
                "remains_rms",
                rms_of(|(_, remains_um)| *remains_um),
                "the same after the corrections: what axes cannot take away, what is not smooth, and what is not known of the prediction",
            ),
        ]
    }

    /// What the declared placement can add at places, component by component.
    fn placement(&self, known: &[Known]) -> Basis {
        let column = |term: crate::terms::Term| {
            let axes = self.solution.measured.iter();
            let at = |(at, _): &Known, axis: usize| term.at(&self.campaign.volume, at.place_mm, 0.0)[axis];
            axes.flat_map(|axis| known.iter().map(move |one| at(one, *axis))).collect()
        };
        Basis::of(self.separator.config.declared_terms().into_iter().map(column).collect())
    }

    /// Covariance of predictions beside the placement; predictions from nearest places have none with each other.
    fn spread(&self, known: &[Known], placement: &Basis, factors: [f64; 3]) -> Option<Mat<f64>> {
        let places: Vec<[f64; 3]> = known.iter().map(|(at, _)| at.place_mm).collect();
        if self.solution.neighbours.is_some() || places.is_empty() {
            return None;
        }
        let Whole { covariance, .. } = Whole::new(self.campaign, self.solution, &places, factors);
        // With the variances of the predictions, which know more of measured places and less of the covariance's parameters.
        let axes = self.solution.measured.iter();
        let variances = axes.flat_map(|axis| known.iter().map(|(at, _)| at.predicted[*axis].variance_um2));
        let wider: Vec<f64> = variances
            .enumerate()
            .map(|(row, variance)| (variance / covariance[(row, row)].max(f64::MIN_POSITIVE)).sqrt())
            .collect();
        let covariance = Mat::from_fn(wider.len(), wider.len(), |row, column| {
            wider[row] * wider[column] * covariance[(row, column)]
        });
        let columns = placement.columns();
        let basis = Mat::from_fn(wider.len(), columns.len(), |row, column| columns[column][row]);
        let outside = |all: &Mat<f64>| all - &basis * (basis.transpose() * all);
        let half = outside(&covariance);
        Some(outside(&half.transpose().to_owned()))
    }
}
