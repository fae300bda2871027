//! What all other places say of a group of places.
//!
//! P = K⁻¹ − K⁻¹X(XᵀK⁻¹X)⁻¹XᵀK⁻¹, of all fields together. With its block of a group, P_gg, the mean readings of the group less their
//! prediction from all other places are P_gg⁻¹(P y)_g, and their covariance P_gg⁻¹ (Dubrule, Math. Geol. 15 (1983) 687).

use faer::Mat;
use nalgebra::{DMatrix, DVector};

use crate::joint::{Joint, inverse};

/// L⁻¹ and K⁻¹X of each field.
pub(crate) struct Projections<'a> {
    joint: &'a Joint,
    fields: Vec<(Mat<f64>, Mat<f64>)>,
}

impl<'a> Projections<'a> {
    /// Of a fit.
    #[must_use]
    pub(crate) fn of(joint: &'a Joint) -> Self {
        let each = joint.fields.iter().map(|field| {
            let mut back = field.white.clone();
            field.factor.transpose().solve_upper_triangular_in_place(back.as_mut());
            (inverse(&field.factor), back)
        });
        Self { joint, fields: each.collect() }
    }

    /// Places of the fit.
    #[must_use]
    pub(crate) fn places(&self) -> usize {
        self.fields.first().map_or(0, |(lower, _)| lower.nrows())
    }

    /// P_gg: field by field, each in the order of the group.
    #[must_use]
    pub(crate) fn block(&self, group: &[usize]) -> DMatrix<f64> {
        let columns = self.joint.trend.len();
        let together = group.len();
        let size = self.fields.len() * together;
        let mut block = DMatrix::<f64>::zeros(size, size);
        let mut back = DMatrix::<f64>::zeros(size, columns);
        for (field, (lower, own)) in self.fields.iter().enumerate() {
            for (index, place) in group.iter().enumerate() {
                let row = field * together + index;
                (0..columns).for_each(|column| back[(row, column)] = own[(*place, column)]);
                for (other, second) in group.iter().enumerate().take(index + 1) {
                    let product = lower.col(*place).transpose() * lower.col(*second);
                    block[(row, field * together + other)] = product;
                    block[(field * together + other, row)] = product;
                }
            }
        }
        block - &back * &self.joint.trend_covariance * back.transpose()
    }

    /// (P y)_g, in the same order.
    #[must_use]
    pub(crate) fn pull(&self, group: &[usize]) -> DVector<f64> {
        let each = self.joint.fields.iter().flat_map(|field| group.iter().map(|place| field.alpha[*place]));
        DVector::from_iterator(self.fields.len() * group.len(), each)
    }
}
