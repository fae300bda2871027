//! What a fit knows of many places together.

use faer::{Mat, MatRef};

use super::{Joint, Query};
use crate::correlation::Scaled;

/// A field at places: means, and what is not known of them, own + by_trend·C·by_trendᵀ with C the covariance of the trend.
pub(crate) struct Posterior {
    /// Trend and field, in µm.
    pub mean_um: Vec<f64>,
    /// Covariance beside that of the trend, in µm².
    pub own: Mat<f64>,
    /// What one unit of each column of the trend adds, the readings given.
    pub by_trend: Mat<f64>,
}

impl Joint {
    /// A field at places that were not measured (Rasmussen, Williams (2006), equations 2.41, 2.42).
    pub(crate) fn posterior(&self, field: usize, query: &Query) -> Posterior {
        let known = &self.fields[field];
        let covariance = &known.covariance;
        let sill = covariance.sill_um.powi(2);
        let nugget = if query.nugget_counts { covariance.nugget_um.powi(2) } else { 0.0 };
        let asked = Scaled::of(query.places, covariance.range_mm);
        let (count, width, columns) = (known.cloud.len(), asked.len(), self.trend.len());
        let correlated = |cloud: &Scaled, rows: usize| {
            let mut all = Mat::<f64>::zeros(rows, width);
            for column in 0..width {
                if let Some(out) = all.as_mut().col_mut(column).try_as_col_major_mut() {
                    covariance.family.correlations(cloud.from(0), sill, asked.at(column), out.as_slice_mut());
                }
            }
            all
        };
        let mut white = correlated(&known.cloud, count);
        let field_um = |column: usize| (0..count).map(|row| white[(row, column)] * known.alpha[row]).sum::<f64>();
        let trend_um = |row: usize| (0..columns).map(|at| query.design[(row, at)] * self.trend[at]).sum::<f64>();
        let mean_um = (0..width).map(|place| trend_um(place) + field_um(place)).collect();
        known.factor.as_ref().solve_lower_triangular_in_place(white.as_mut());
        let mut own = correlated(&asked, width) - white.transpose() * &white;
        (0..width).for_each(|place| own[(place, place)] += nugget);
        let design: MatRef<f64> = query.design;
        let by_trend = design.to_owned() - white.transpose() * &known.white;
        Posterior { mean_um, own, by_trend }
    }
}
