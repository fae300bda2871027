//! From the projection to values with their standard uncertainty.
//!
//! References (ISO 230-1): positioning and rotations have mean 0 over the nodes, straightness the least-squares line of the nodes; the
//! angles between these lines are the squareness errors, X the primary and Y the secondary axis. Arms count from the middle of the
//! measured volume.

use faer::Mat;
use nalgebra::DVector;

use super::{Basis, ComponentFit, Unseen, lost, named, volumetric::Projection};
use crate::{
    campaign::Campaign,
    solve::Solution,
    whole::{Whole, root_mean_square},
};

/// Names of the squareness errors.
pub(super) const ANGLES: [&str; 3] = ["EC0Y", "EB0Z", "EA0Z"];

/// Root mean square length of the error over the measured volume, with its standard uncertainty, in µm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Volumetric {
    /// Of the machine, less the rigid motion that fits best.
    pub before: [f64; 2],
    /// After compensation by the curves.
    pub after: [f64; 2],
    /// What no axis can take away.
    pub beyond: [f64; 2],
}

pub(super) fn evaluate(
    basis: &Basis,
    campaign: &Campaign,
    fitted: &Solution,
    places: &[[f64; 3]],
    whole: &Whole,
    unseen: &Unseen,
) -> Option<ComponentFit> {
    let projection = Projection::new(basis, fitted, places)?;
    let combinations = combinations(basis);
    let seen: Vec<bool> = combinations.iter().map(|combination| unseen.shows(combination)).collect();
    let columns = projection.columns_of(&basis.terms);
    let reduced = Mat::from_fn(combinations.len(), columns.len(), |row, column| {
        columns[column].map_or(0.0, |term| if seen[row] { combinations[row][term] } else { 0.0 })
    });
    let by_places = &reduced * &projection.inverse;
    let spread = &by_places * &whole.covariance;
    let value = |row: usize| {
        if !seen[row] {
            return [f64::NAN; 2];
        }
        let each = (0..whole.mean_um.len()).map(|at| by_places[(row, at)]);
        let mean: f64 = each.clone().zip(whole.mean_um.iter()).map(|(weight, mean)| weight * mean).sum();
        let variance: f64 = each.enumerate().map(|(at, weight)| weight * spread[(row, at)]).sum();
        [mean, variance.max(0.0).sqrt()]
    };
    let values: Vec<[f64; 2]> = (0..combinations.len()).map(value).collect();
    let (left, before) = (projection.left(), projection.rigid()?.left());
    let after_mean = apply(&left, &whole.mean_um);
    let spread_by = |matrix: &Mat<f64>| matrix * &whole.covariance * matrix.transpose();
    let volumetric = Volumetric {
        before: root_mean_square(&apply(&before, &whole.mean_um), &spread_by(&before), places.len()),
        after: root_mean_square(&after_mean, &whole.covariance, places.len()),
        beyond: root_mean_square(&after_mean, &spread_by(&left), places.len()),
    };
    let (nodes, location) = named(basis, campaign.volume.chain, &values);
    let missing = lost(&nodes);
    let notes = (!missing.is_empty()).then(|| {
        format!(
            "component curves not observable: {}: they displace no measured point, or not at every node: measure with another tool offset, \
             at more places, or take a wider `curves.pitch_mm`",
            missing.join(", ")
        )
    });
    Some(ComponentFit { nodes, location, volumetric, notes: notes.into_iter().collect() })
}

fn apply(matrix: &Mat<f64>, vector: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(matrix.nrows(), |row, _| (0..vector.len()).map(|at| matrix[(row, at)] * vector[at]).sum())
}

/// Each value as a combination of the columns' parameters: errors of X, Y and Z at their nodes, then the squareness errors.
fn combinations(basis: &Basis) -> Vec<DVector<f64>> {
    let mut all = Vec::new();
    // Displacement along `moved` per mm of `with`, in µrad.
    let zero = || DVector::<f64>::zeros(basis.terms.len());
    let mut turned: [[DVector<f64>; 3]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| zero()));
    for axis in 0..3 {
        let count = basis.counts[axis];
        let at: Vec<f64> =
            (0..count).map(|node| basis.position_mm(axis, node) - basis.volume.middle_mm[axis]).collect();
        let squares: f64 = at.iter().map(|at| at * at).sum();
        for error in 0..6 {
            let unit = |node: usize| {
                let mut one = zero();
                one[basis.column(axis, error, node)] = 1.0;
                one
            };
            let nodes: Vec<DVector<f64>> = (0..count).map(unit).collect();
            let mean = nodes.iter().fold(zero(), |sum, node| sum + node) / count as f64;
            let mut slope = zero();
            if error < 3 && error != axis && squares > 0.0 {
                slope = nodes.iter().zip(&at).fold(zero(), |sum, (node, at)| sum + node * (*at / squares));
                turned[error][axis] += &slope * 1e3;
            }
            if error >= 3 {
                for carried in basis.carried(axis) {
                    let (next, last) = ((error + 1) % 3, (error + 2) % 3);
                    // Right-handed about `error`: y turns to z.
                    if carried == next {
                        turned[last][carried] += &mean;
                    } else if carried == last {
                        turned[next][carried] -= &mean;
                    }
                }
            }
            all.extend(nodes.iter().zip(&at).map(|(node, at)| node - &mean - &slope * *at));
        }
    }
    let angle = |a: usize, b: usize| &turned[a][b] + &turned[b][a];
    all.extend([-angle(0, 1), angle(0, 2), -angle(1, 2)]);
    all
}

impl Basis {
    /// Axes that an axis carries.
    pub(super) fn carried(&self, axis: usize) -> impl Iterator<Item = usize> {
        let chain = self.volume.chain;
        let position = chain.iter().position(|other| *other == axis).unwrap_or(0);
        chain.into_iter().skip(position + 1)
    }
}
