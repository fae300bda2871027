//! What is observable of the unknowns, and the solution of the linear system with the gauge as conditions.

use nalgebra::{DMatrix, DVector};

use super::{Block, DEPENDS, DETERMINED, Solution, Structure, System, complement};

impl Structure {
    /// Component errors by the unknowns, 6 × count.
    pub(super) fn sensitivity(&self, command: usize, block: &Block, count: usize) -> DMatrix<f64> {
        let mut by = DMatrix::zeros(6, count);
        let common = block.common.ncols();
        by.columns_mut(0, common).copy_from(&-(&block.gain * &block.common));
        let unknown = &self.unknown[command];
        if self.in_gauge[command] && unknown.ncols() > 0 {
            by.columns_mut(self.first[command], unknown.ncols()).copy_from(unknown);
        }
        by
    }

    pub(super) fn all_observable(&self) -> bool {
        self.observable.ncols() == self.count
    }

    /// Whether a value with these derivatives by the unknowns is observable.
    pub(super) fn observes(&self, gradient: &DVector<f64>) -> bool {
        if self.all_observable() {
            return true;
        }
        let inside = &self.observable * self.observable.tr_mul(gradient);
        (gradient - inside).norm() <= DEPENDS * gradient.norm().max(1.0)
    }
}

impl System {
    pub(super) fn solve(&self, structure: &Structure) -> Result<Solution, String> {
        let basis = &structure.observable;
        let common = self.free.ncols();
        let conditions = &self.gauge * basis;
        let svd = conditions.svd(true, true);
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err("the gauge has no decomposition".into()) };
        let most = svd.singular_values.max();
        let kept: Vec<usize> = (0..svd.singular_values.len())
            .filter(|index| most > 0.0 && svd.singular_values[*index] > DETERMINED * most)
            .collect();
        let along = v_t.select_rows(&kept).transpose();
        let mut inverse = along.clone();
        for (column, index) in kept.iter().enumerate() {
            let mut entry = inverse.column_mut(column);
            entry /= svd.singular_values[*index];
        }
        let inverse = inverse * u.select_columns(&kept).transpose();
        let within = complement(&along);
        let rows = &self.free * basis.rows(0, common);
        let free = &rows * &within;
        let rank = free.ncols();
        let count = basis.ncols();
        if rank == 0 {
            let by_gauge = basis * inverse;
            let covariance = &by_gauge * &self.gauge_covariance * by_gauge.transpose();
            let by_rows = DMatrix::zeros(basis.nrows(), 0);
            return Ok(Solution { unknowns: &by_gauge * &self.right, covariance, by_gauge, by_rows, rank });
        }
        if free.nrows() < rank {
            return Err("there are too few readings".into());
        }
        let qr = free.qr();
        let failure = "the readings do not determine the unknowns: their uncertainties differ too much";
        let inverse_r = qr.r().solve_upper_triangular(&DMatrix::identity(rank, rank)).ok_or(failure)?;
        let from_rows = &within * &inverse_r;
        let q_t = qr.q().transpose();
        // v = H⁺f + Z·T⁺(ρ − A·H⁺f)
        let project = DMatrix::identity(count, count) - &from_rows * (&q_t * &rows);
        let by_gauge = basis * (project * inverse);
        let by_rows = basis * from_rows;
        let unknowns = &by_gauge * &self.right + &by_rows * (q_t * &self.left);
        let covariance = &by_gauge * &self.gauge_covariance * by_gauge.transpose() + &by_rows * by_rows.transpose();
        Ok(Solution { unknowns, covariance, by_gauge, by_rows, rank })
    }
}
