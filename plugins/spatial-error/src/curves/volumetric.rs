//! The projection of an error over the volume on the chain of axes, and how much it leaves.

use faer::Mat;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::Basis;
use crate::{
    solve::Solution,
    terms::{Between, Term},
};

/// Eigenvalue of the normal equations, as a share of the largest, below which a direction is none.
const NONE: f64 = 1e-12;

/// A column as the chain of a control has it; `None` of what is no part of the chain.
fn linear(term: Term) -> Option<Term> {
    match term {
        Term::Shift(_) | Term::Turn(_) => Some(term),
        Term::Node { rotates, along, axis, node, nodes, .. } => {
            Some(Term::Node { rotates, along, axis, node, nodes, between: Between::Linear })
        }
        _ => None,
    }
}

/// Least squares of the columns of the chain on the error at places.
pub(super) struct Projection {
    /// Columns that count: placement and nodes.
    terms: Vec<Term>,
    design: Mat<f64>,
    /// Parameters by the errors at the places.
    pub inverse: Mat<f64>,
}

impl Projection {
    pub(super) fn new(basis: &Basis, fitted: &Solution, places: &[[f64; 3]]) -> Option<Self> {
        let terms: Vec<Term> = fitted.terms.iter().filter_map(|term| linear(*term)).collect();
        let count = places.len();
        let design = Mat::from_fn(count * fitted.measured.len(), terms.len(), |row, column| {
            terms[column].at(&basis.volume, places[row % count], 0.0)[fitted.measured[row / count]]
        });
        Self::of(terms, design)
    }

    fn of(terms: Vec<Term>, design: Mat<f64>) -> Option<Self> {
        let normal = design.transpose() * &design;
        let scale = DVector::from_fn(terms.len(), |at, _| normal[(at, at)].max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(terms.len(), terms.len(), |row, column| {
            normal[(row, column)] / (scale[row] * scale[column])
        });
        if scaled.iter().any(|entry| !entry.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::new(scaled);
        let least = NONE * eigen.eigenvalues.max();
        let inverted = eigen.eigenvalues.map(|value| if value > least { 1.0 / value } else { 0.0 });
        let vectors = &eigen.eigenvectors;
        let solved = vectors * DMatrix::from_diagonal(&inverted) * vectors.transpose();
        let solved =
            Mat::from_fn(terms.len(), terms.len(), |row, column| solved[(row, column)] / (scale[row] * scale[column]));
        let inverse = &solved * design.transpose();
        Some(Self { terms, design, inverse })
    }

    /// On the placement alone.
    pub(super) fn rigid(&self) -> Option<Self> {
        let is_placement = |column: &usize| matches!(self.terms[*column], Term::Shift(_) | Term::Turn(_));
        let columns: Vec<usize> = (0..self.terms.len()).filter(is_placement).collect();
        let design = Mat::from_fn(self.design.nrows(), columns.len(), |row, at| self.design[(row, columns[at])]);
        Self::of(columns.iter().map(|column| self.terms[*column]).collect(), design)
    }

    /// Place of each column among others.
    pub(super) fn columns_of(&self, all: &[Term]) -> Vec<Option<usize>> {
        self.terms.iter().map(|term| all.iter().position(|other| linear(*other) == Some(*term))).collect()
    }

    /// What the projection leaves of errors at the places, as a matrix.
    pub(super) fn left(&self) -> Mat<f64> {
        let taken = &self.design * &self.inverse;
        Mat::from_fn(taken.nrows(), taken.nrows(), |row, column| {
            f64::from(u8::from(row == column)) - taken[(row, column)]
        })
    }
}
