//! What a fit leaves of the averaged readings.

use runout_consistency::Check;
use runout_numerics::Complex64;

/// What a fit leaves of the averaged readings.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Residual {
    /// Root mean square over all readings and angles, in µm; NaN where nothing is redundant.
    pub rms_um: f64,
    /// Its value expected from the covariance of the averages, in µm; NaN without a covariance.
    pub expected_rms_um: f64,
    /// Weighted sum of squares per degree of freedom; NaN where not known.
    pub chi2_per_dof: f64,
    /// Real degrees of freedom.
    pub dof: usize,
    /// Lowest and highest order at which a reading is redundant; `None` where the fit is not one of single orders, and where
    /// none is.
    pub orders: Option<[usize; 2]>,
    /// The residual at each redundant order, beside what noise leaves; none where the fit is not one of single orders, and where the
    /// noise is not known.
    pub by_order: Vec<OrderResidual>,
    /// The residual of each reading at the redundant orders; none where the fit is not one of single orders.
    pub by_reading: Vec<ReadingResidual>,
    /// The tests of the readings on themselves.
    pub checks: Vec<Check>,
}

/// What a fit leaves at one order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderResidual {
    /// The order.
    pub order: usize,
    /// Weighted sum of squares, in the weights' units.
    pub squares: f64,
    /// Its value expected from the covariance of the averages.
    pub expected: f64,
    /// Real degrees of freedom.
    pub dof: usize,
}

impl OrderResidual {
    /// χ² per degree of freedom.
    #[must_use]
    pub fn chi2_per_dof(&self) -> f64 {
        self.squares / self.expected
    }
}

/// What a fit leaves of one averaged reading.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadingResidual {
    /// Place of the reading among the channels of all profiles of the station.
    pub place: usize,
    /// Order and coefficient c in µm, Re Σ c e^{−inΦ} over the spindle's angle Φ.
    pub harmonics: Vec<(usize, Complex64)>,
}
