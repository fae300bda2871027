//! Motion at the spindle's reference, from that at the sensors' mean z.

use runout_core::Complex64;

use super::{Layout, UM_PER_MM_URAD};

impl Layout {
    /// Takes motion from the sensors' mean z, now at `mean_z_mm`, to the spindle's reference: x = X − z E_y,
    /// y = Y + z E_x.
    #[must_use]
    pub fn to_reference(&self, mean_z_mm: f64) -> ToReference {
        let lever = mean_z_mm * UM_PER_MM_URAD;
        let pairs = self.shifts_with_tilts().map(|(shift, tilt, factor)| (shift, tilt, -factor * lever)).collect();
        ToReference { width: self.unknowns.len(), pairs }
    }

    /// Places of the displacements and of the tilts that change them along z, where both are unknowns, and the factor.
    pub(super) fn shifts_with_tilts(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.unknowns.iter().enumerate().filter_map(|(shift, quantity)| {
            let (tilt, factor) = quantity.moved_by_tilt()?;
            Some((shift, self.unknowns.iter().position(|unknown| *unknown == tilt)?, factor))
        })
    }
}

/// Moves motion along z: adds a multiple of a tilt to a shift.
#[derive(Debug, Clone)]
pub struct ToReference {
    width: usize,
    /// Shift, tilt, factor.
    pairs: Vec<(usize, usize, f64)>,
}

impl ToReference {
    /// Moves estimates, or the rows (`[unknown][row_length]`) of the operator that makes them.
    pub fn apply(&self, rows: &mut [Complex64]) {
        let length = rows.len() / self.width;
        for (shift, tilt, factor) in &self.pairs {
            for column in 0..length {
                rows[shift * length + column] += rows[tilt * length + column] * *factor;
            }
        }
    }

    /// Moves a covariance, `[unknown][unknown]`: T·C·Tᴴ.
    pub fn apply_about(&self, covariance: &mut [Complex64]) {
        if self.pairs.is_empty() {
            return;
        }
        for _ in 0..2 {
            self.apply(covariance);
            for row in 0..self.width {
                for column in 0..=row {
                    let (below, above) = (row * self.width + column, column * self.width + row);
                    (covariance[below], covariance[above]) = (covariance[above].conj(), covariance[below].conj());
                }
            }
        }
    }

    /// Variances after the move, from the covariance `[unknown][unknown]` before.
    #[must_use]
    pub fn spread(&self, covariance: &[Complex64]) -> Vec<f64> {
        let entry = |row: usize, col: usize| covariance[row * self.width + col].re;
        let mut variances: Vec<f64> = (0..self.width).map(|unknown| entry(unknown, unknown)).collect();
        for (shift, tilt, factor) in &self.pairs {
            variances[*shift] += 2.0 * factor * entry(*shift, *tilt) + factor * factor * entry(*tilt, *tilt);
        }
        variances
    }
}
