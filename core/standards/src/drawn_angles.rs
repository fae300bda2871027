//! On how many equal angles errors are drawn.

use runout_numerics::fourier::quick_length;

/// The order of a spectrum of equal power up to an order that has crests as sharp as one with this power by order from 0; 0 without power.
///
/// A crest of the height h of a random profile has the curvature h·n² in the mean, n the root mean square of the orders (Rice,
/// Bell Syst. Tech. J. 24, 1945, 3.6); equal power up to an order N has n = N/√3. Orders that a low-pass has nearly taken do not count as much as
/// those that are left.
#[must_use]
pub fn crest_order(power: impl Iterator<Item = f64>) -> f64 {
    let known = power.enumerate().filter(|(_, power)| *power > 0.0 && power.is_finite());
    let (sum, curved) =
        known.fold((0.0, 0.0), |(sum, curved), (order, power)| (sum + power, curved + power * (order as f64).powi(2)));
    if sum > 0.0 { (3.0 * curved / sum).sqrt() } else { 0.0 }
}

/// Angles for so many points on a wave of the higher one of these [`crest_order`]s, and more than two on one of the highest order.
#[must_use]
pub fn drawn_angles(points_a_wave: usize, crest_orders: [f64; 2], highest: usize) -> usize {
    let order = (crest_orders[0].max(crest_orders[1]).ceil() as usize).min(highest);
    quick_length((points_a_wave * order).max(2 * highest + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crests_are_as_sharp_as_the_orders_that_have_power() {
        let equal = crest_order((0..=300).map(|order| if order < 2 { 0.0 } else { 4.0 }));
        assert!((equal / 300.0 - 1.0).abs() < 0.01, "{equal}");
        let line = crest_order((0..100).map(|order| if order == 7 { 1.0 } else { 0.0 }));
        assert!((line / (7.0 * 3.0_f64.sqrt()) - 1.0).abs() < 1e-12, "{line}");
        assert!(crest_order([0.0, f64::NAN, f64::INFINITY].into_iter()) == 0.0);
        // As without a low-pass; as few as show all orders; by the sharper of both.
        assert_eq!(drawn_angles(8, [equal, 0.0], 299), 2560);
        assert_eq!(drawn_angles(8, [0.0, 0.0], 299), 640);
        assert_eq!(drawn_angles(8, [100.0, 150.0], 299), 1280);
    }
}
