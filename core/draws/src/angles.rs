//! On how many equal angles errors are drawn.

use std::f64::consts::TAU;

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

/// Between heights at three angles a step apart, a parabola misses the crest of a wave by this times its amplitude and the fourth power of the step, in
/// rad of the wave, at most.
const MISSED: f64 = 0.0242;
/// Share of the errors' standard deviation that it may miss.
const LEAST_SHARE: f64 = 0.1;

/// Angles on which crests by parabolas are right to a tenth of the standard deviation of errors with these variances, of a profile whose orders
/// have this power (squares of amplitudes, by order from 0): crests that are alike compete for the highest, however small the errors are. Orders
/// whose amplitude is below that standard deviation are no matter.
#[must_use]
pub fn angles_for_parabolas(power: impl Iterator<Item = f64>, variance: impl Iterator<Item = f64>) -> usize {
    let std_um = (0.5 * variance.filter(|variance| *variance > 0.0 && variance.is_finite()).sum::<f64>()).sqrt();
    let known = power.enumerate().filter(|(_, power)| *power > std_um * std_um && power.is_finite());
    let fourth: f64 = known.map(|(order, power)| power * (order as f64).powi(8)).sum();
    if std_um > 0.0 && fourth > 0.0 {
        let angles = TAU * (MISSED * fourth.sqrt() / (LEAST_SHARE * std_um)).powf(0.25);
        quick_length(angles.ceil() as usize)
    } else {
        0
    }
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

    /// Heights of a wave of 15 lobes at so many angles, crests at any place between two of them: the worst crest errs by a tenth of the errors.
    #[test]
    fn parabolas_miss_crests_by_no_more_than_a_tenth_of_the_errors() {
        let (amplitude_um, std_um) = (0.75, 3e-4);
        let power = (0..48).map(|order| if order == 15 { amplitude_um * amplitude_um } else { 1e-8 });
        let angles = angles_for_parabolas(power, std::iter::once(2.0 * std_um * std_um));
        let step = TAU * 15.0 / angles as f64;
        let missed = (0..=100).map(|place| {
            let aside = step * (f64::from(place) / 100.0 - 0.5);
            let [before, at, after] = [-step, 0.0, step].map(|angle| amplitude_um * (angle + aside).cos());
            (at + (before - after).powi(2) / (8.0 * (2.0 * at - before - after)) - amplitude_um).abs()
        });
        let worst = missed.fold(0.0, f64::max);
        assert!((0.5..=1.0).contains(&(worst / (0.1 * std_um))), "{angles}: {worst}");
        assert_eq!(angles_for_parabolas([0.0, 1.0].into_iter(), std::iter::empty()), 0);
    }
}
