//! Roundness (ISO 12181-1) of a profile about its least-squares circle.

/// Peak-to-valley deviation RONt about the least-squares reference circle LSCI (ISO 12181-1), in µm.
///
/// `form_um` lies on equal angles and holds no orders 0 and 1: its least-squares circle is then the nominal circle, up
/// to terms of form²/radius.
#[must_use]
pub fn ront_lsci_um(form_um: &[f64]) -> f64 {
    let (low, high) = form_um
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    if form_um.is_empty() { f64::NAN } else { high - low }
}
