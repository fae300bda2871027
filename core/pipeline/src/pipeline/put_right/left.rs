//! What a separation leaves of its readings.

use runout_turning::separation::Separation;

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Left {
    pub rms_um: f64,
    pub chi2_per_dof: f64,
    pub dof: f64,
}

impl Left {
    pub(super) fn of(separation: &Separation) -> Self {
        let residual = &separation.residual;
        Self { rms_um: residual.rms_um, chi2_per_dof: residual.chi2_per_dof, dof: residual.dof as f64 }
    }

    /// Over all stations.
    pub(super) fn of_all(all: &[Self]) -> Self {
        let dof: f64 = all.iter().map(|left| left.dof).sum();
        let squares: f64 = all.iter().map(|left| left.rms_um.powi(2)).sum();
        let chi2: f64 = all.iter().map(Self::chi2).sum();
        Self { rms_um: (squares / all.len() as f64).sqrt(), chi2_per_dof: chi2 / dof, dof }
    }

    pub(super) fn chi2(&self) -> f64 {
        self.chi2_per_dof * self.dof
    }
}
