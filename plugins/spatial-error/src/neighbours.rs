//! Predictions from the nearest places: for more places than one covariance matrix can hold.
//!
//! Each prediction takes the 192 nearest places (Vecchia, J. R. Statist. Soc. B 50 (1988) 297; Stein, *The screening effect in
//! kriging*, Ann. Statist. 30 (2002) 298). The trend and its covariance come from a fit of places drawn at random.

use std::num::NonZero;

use faer::Mat;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::DVector;

use crate::{
    correlation::Scaled,
    joint::{Covariance, Data, Joint, LeftOut, Observed, Predicted, Query, factor, matrix},
};

/// Places that a prediction takes, and that of a place left out.
pub(crate) const NEAREST: [usize; 2] = [192, 96];

/// Places by nearness, in ranges of each field.
#[derive(Debug, Clone)]
pub(crate) struct Neighbours {
    trees: Vec<ImmutableKdTree<f64, 3>>,
    covariances: Vec<Covariance>,
}

/// A place predicted from some others.
struct Local<'a> {
    data: &'a Data,
    joint: &'a Joint,
    field: usize,
    covariance: &'a Covariance,
}

impl Neighbours {
    /// Of the places of data.
    #[must_use]
    pub(crate) fn new(data: &Data, covariances: &[Covariance]) -> Self {
        let tree = |covariance: &Covariance| {
            let scaled: Vec<[f64; 3]> = data.places.iter().map(|place| scaled(place, covariance)).collect();
            ImmutableKdTree::new_from_slice(&scaled)
        };
        Self { trees: covariances.iter().map(tree).collect(), covariances: covariances.to_vec() }
    }

    fn nearest(&self, field: usize, place: &[f64; 3], count: usize) -> Vec<usize> {
        let Some(count) = NonZero::new(count) else { return Vec::new() };
        let at = scaled(place, &self.covariances[field]);
        let found = self.trees[field].nearest_n::<SquaredEuclidean>(&at, count);
        found.into_iter().map(|one| one.item as usize).collect()
    }

    /// Predicts a field.
    #[must_use]
    pub(crate) fn predict(&self, data: &Data, joint: &Joint, field: usize, query: &Query) -> Vec<Predicted> {
        let local = Local { data, joint, field, covariance: &self.covariances[field] };
        let one = |(row, place): (usize, &[f64; 3])| {
            let columns = query.design.ncols();
            let design = DVector::from_fn(columns, |column, _| query.design[(row, column)]);
            local.predict(&self.nearest(field, place, NEAREST[0]), place, &design, query.nugget_counts)
        };
        query.places.iter().enumerate().map(one).collect()
    }

    /// Each place's mean reading less its prediction from its neighbours, of each field.
    #[must_use]
    pub(crate) fn left_out(&self, data: &Data, joint: &Joint) -> Vec<Vec<LeftOut>> {
        let one = |(index, place): (usize, &[f64; 3])| {
            let of_field = |(field, covariance): (usize, &Covariance)| {
                let local = Local { data, joint, field, covariance };
                let mut near = self.nearest(field, place, NEAREST[1] + 1);
                near.retain(|other| *other != index);
                let design = DVector::from_fn(data.columns(), |column, _| data.design[field][(index, column)]);
                let found = local.predict(&near, place, &design, false);
                let observed = &data.observed[field];
                let own = covariance.nugget_um.powi(2) * observed.share[index] + observed.variance_um2(index);
                LeftOut {
                    residual_um: observed.mean_um[index] - found.mean_um,
                    std_um: (found.variance_um2 + own).sqrt(),
                }
            };
            self.covariances.iter().enumerate().map(of_field).collect()
        };
        data.places.iter().enumerate().map(one).collect()
    }
}

fn scaled(place: &[f64; 3], covariance: &Covariance) -> [f64; 3] {
    [0, 1, 2].map(|axis| place[axis] / covariance.range_mm[axis])
}

impl Local<'_> {
    /// From some places; a matrix that is not positive definite predicts nothing.
    fn predict(&self, near: &[usize], place: &[f64; 3], design: &DVector<f64>, nugget_counts: bool) -> Predicted {
        let places: Vec<[f64; 3]> = near.iter().map(|index| self.data.places[*index]).collect();
        let observed = &self.data.observed[self.field];
        let of = |values: &[f64]| near.iter().map(|index| values[*index]).collect::<Vec<f64>>();
        let part = Observed {
            mean_um: of(&observed.mean_um),
            noise_um2: of(&observed.noise_um2),
            share: of(&observed.share),
            shared: observed.shared.as_ref().map(|shared| shared.some(near)),
        };
        let cloud = Scaled::of(&places, self.covariance.range_mm);
        let Some(lower) = factor(&matrix(self.covariance, &cloud, &part)) else { return Predicted::LOST };
        let columns = design.len();
        let known = &self.data.design[self.field];
        let trend = &self.joint.trend;
        // L⁻¹ of k, of what the trend leaves, and of X.
        let mut white = Mat::<f64>::zeros(near.len(), columns + 2);
        let (sill, nugget) = (self.covariance.sill_um.powi(2), self.covariance.nugget_um.powi(2));
        let mut to_place = vec![0.0; near.len()];
        self.covariance.family.correlations(cloud.from(0), sill, scaled(place, self.covariance), &mut to_place);
        for (row, index) in near.iter().enumerate() {
            let same = nugget_counts && (0..3).all(|axis| (self.data.places[*index][axis] - place[axis]).abs() < 5e-7);
            white[(row, 0)] = to_place[row] + if same { nugget } else { 0.0 };
            let of_trend: f64 = (0..columns).map(|column| known[(*index, column)] * trend[column]).sum();
            white[(row, 1)] = part.mean_um[row] - of_trend;
            for column in 0..columns {
                white[(row, column + 2)] = known[(*index, column)];
            }
        }
        lower.as_ref().solve_lower_triangular_in_place(white.as_mut());
        let product = |a: usize, b: usize| (0..near.len()).map(|row| white[(row, a)] * white[(row, b)]).sum::<f64>();
        let left = DVector::from_fn(columns, |column, _| design[column] - product(0, column + 2));
        let of_trend = if columns == 0 { 0.0 } else { (&self.joint.trend_covariance * &left).dot(&left) };
        let own = sill + if nugget_counts { nugget } else { 0.0 };
        Predicted {
            mean_um: design.dot(trend) + product(0, 1),
            variance_um2: (own - product(0, 0)).max(0.0) + of_trend,
        }
    }
}
