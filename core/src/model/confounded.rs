//! A confounded set: effects of which the data tell some combinations only.

use super::{
    Effect, Fit, Setting,
    closed_loop::Found,
    fit::{Prior, dot, norm},
};

/// The data decide a combination of a set's parameters when all of it is this many standard deviations.
const DECIDED: f64 = 10.0;
/// Where results hold a set, its members' own sizes hold it this many times more softly.
const SOFT: f64 = 5.0;

/// A set at some values of its parameters. Columns and directions are per size of each parameter.
pub(super) struct ConfoundedSet {
    /// Of each parameter, if its member is all of it.
    sizes: Vec<f64>,
    /// Values over sizes.
    values: Vec<f64>,
    /// Of what is left of the data.
    columns: Vec<Vec<f64>>,
    /// Of the results, and their distance from those without the set.
    moves: Vec<Vec<f64>>,
    distance: Vec<f64>,
}

impl ConfoundedSet {
    pub fn new(found: &Found, effects: &[Effect], settings: &[Setting], fit: &impl Fit, without: &[f64]) -> Self {
        let parameters = found.members.iter().flat_map(|member| &effects[*member].parameters);
        let alone = found.alone.iter().flatten().zip(parameters);
        let sizes: Vec<f64> = alone.map(|(value, known)| value.abs().max(1e-3 * known.tolerance)).collect();
        let scaled = |columns: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            let scaled = columns.into_iter().zip(&sizes);
            scaled.map(|(column, size)| column.into_iter().map(|entry| entry * size).collect()).collect()
        };
        let with = fit.results();
        // Effects may change what can be told at all: then distances say nothing.
        let comparable = with.len() == without.len();
        let moves =
            if comparable { found.members.iter().flat_map(|member| fit.moves(*member)).collect() } else { vec![] };
        let values = settings.iter().flat_map(|setting| &setting.values).zip(&sizes);
        Self {
            columns: scaled(found.members.iter().flat_map(|member| fit.signature(*member)).collect()),
            moves: scaled(moves),
            distance: with.iter().zip(without).map(|(with, without)| with - without).collect(),
            values: values.map(|(value, size)| value / size).collect(),
            sizes,
        }
    }

    /// What holds the parameters, the first of which has this place: `beside` is an orthonormal basis of what else is
    /// fitted.
    pub fn priors(mut self, beside: &[Vec<f64>], first: usize) -> Vec<Prior> {
        for column in &mut self.columns {
            for base in beside {
                let share = dot(base, column);
                column.iter_mut().zip(base).for_each(|(entry, base)| *entry -= share * base);
            }
        }
        let undecided = self.undecided();
        let moved = self.moves.iter().map(|column| norm(column)).fold(0.0, f64::max);
        let mut priors = Vec::new();
        if moved > 0.0 {
            // The distance after a move along what is undecided, [moves | distance] = Q·R: as long as R's rows make it.
            let mut columns = std::mem::take(&mut self.moves);
            columns.push(std::mem::take(&mut self.distance));
            for row in triangle(columns) {
                let (Some(now), weights) = (row.last(), &row[..self.sizes.len()]) else { continue };
                let kept = along(weights, &undecided);
                let offset = now - dot(&kept, &self.values);
                priors.push(self.prior(&kept, offset, moved, first));
            }
        }
        let soft = if moved > 0.0 { SOFT } else { 1.0 };
        priors.extend(undecided.iter().map(|direction| self.prior(direction, 0.0, soft, first)));
        priors
    }

    fn prior(&self, row: &[f64], offset: f64, std: f64, first: usize) -> Prior {
        let weights = row.iter().zip(&self.sizes).enumerate();
        let weights = weights.map(|(place, (entry, size))| (first + place, entry / (size * std)));
        Prior { weights: weights.collect(), offset: offset / std }
    }

    /// Orthonormal directions along which one unit changes χ² by too little to tell.
    fn undecided(&self) -> Vec<Vec<f64>> {
        let count = self.columns.len();
        let product = |row: usize, column: usize| dot(&self.columns[row], &self.columns[column]);
        let eigen = nalgebra::DMatrix::from_fn(count, count, product).symmetric_eigen();
        let directions = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
        let weak = directions.filter(|(value, _)| **value < DECIDED * DECIDED);
        weak.map(|(_, direction)| direction.iter().copied().collect()).collect()
    }
}

/// What a row has along orthonormal directions.
fn along(row: &[f64], directions: &[Vec<f64>]) -> Vec<f64> {
    let mut kept = vec![0.0; row.len()];
    for direction in directions {
        let share = dot(row, direction);
        kept.iter_mut().zip(direction).for_each(|(kept, entry)| *kept += share * entry);
    }
    kept
}

/// R of columns Q·R, `[row][column]`: as long as they are in every combination.
fn triangle(mut columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let count = columns.len();
    let mut upper = vec![vec![0.0; count]; count];
    for row in 0..count {
        let left = norm(&columns[row]);
        if left <= 0.0 {
            continue;
        }
        let base: Vec<f64> = columns[row].iter().map(|entry| entry / left).collect();
        for (column, entry) in columns.iter_mut().zip(&mut upper[row]).skip(row) {
            *entry = dot(&base, column);
            column.iter_mut().zip(&base).for_each(|(value, base)| *value -= *entry * base);
        }
    }
    upper
}
