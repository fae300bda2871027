//! The unknowns of a station, as they are solved for.

use runout_core::Complex64;

/// No result is given of a solution that still moves more than this, rms.
const UNSETTLED_UM: f64 = 5e-4;

/// The unknowns at all orders, motion at the sensors' mean z.
#[derive(Debug, Clone)]
pub(crate) struct Estimate {
    pub width: usize,
    /// First-order unknowns, as [`Layout::first_order_unknowns`] lists them.
    pub first: Vec<Complex64>,
    /// `[order][unknown]` from order 0; order 1 holds the motion that turns against the spindle.
    pub(super) values: Vec<Complex64>,
    /// At order 1, whether that motion is, also where what turns with the spindle is lost in the eccentricity.
    pub(super) observable: Vec<bool>,
    /// What form may be at lost orders, likewise; empty where none is lost.
    pub(super) likely: Vec<Complex64>,
    /// How far the last pass has moved the readings, rms.
    pub moved_um: f64,
}

impl Estimate {
    /// Whether exact geometry does not settle, or gives no number.
    pub(crate) fn is_unsettled(&self) -> bool {
        self.moves_more_than(UNSETTLED_UM)
    }

    /// Whether the last pass has moved the readings by more, or gives no number.
    pub(super) fn moves_more_than(&self, limit_um: f64) -> bool {
        self.moved_um.is_nan() || self.moved_um > limit_um
    }

    /// An unknown at an order, 0 where it is not observable.
    #[must_use]
    pub(crate) fn observable_value(&self, order: usize, unknown: usize) -> Complex64 {
        let index = order * self.width + unknown;
        if self.observable[index] { self.values[index] } else { Complex64::ZERO }
    }

    /// A form at an order; where it is lost, what it may be: for what exact geometry carries into other orders, and for no result.
    #[must_use]
    pub(crate) fn likely_form(&self, order: usize, unknown: usize) -> Complex64 {
        let index = order * self.width + unknown;
        if self.observable[index] { self.values[index] } else { self.likely.get(index).copied().unwrap_or_default() }
    }
}
