//! A profile that stands for the truth where what noise adds to an extreme is drawn.

use runout_numerics::Complex64;

/// Weights by order of a profile that is to stand for the truth: what noise adds to an extreme can be drawn about the truth
/// only, and about what was found, which has noise already, too little would be drawn.
///
/// An order is weighted by the share of its power that is not noise (Wiener's filter): taken from its own power where that
/// is nine times the noise or more, else from the mean over the orders from 2/3 to 4/3 of it, at least four to each side;
/// mean power that noise alone exceeds in 2 % of all cases counts as noise. Orders below `lowest`, and those without a known
/// variance, keep all.
#[must_use]
pub fn stand_in(harmonics: &[Complex64], variance: &[f64], lowest: usize) -> Vec<f64> {
    let noise = |order: usize| variance.get(order).copied().filter(|variance| *variance > 0.0).unwrap_or(0.0);
    let count = harmonics.len();
    // Sums from an order on, from the highest down: of two of them, the difference is the sum between, and as power falls
    // with the order it loses few digits.
    let mut above = vec![(0.0, 0.0); count + 1];
    for order in (0..count).rev() {
        let (power, noises) = above[order + 1];
        above[order] = (power + harmonics[order].norm_sqr(), noises + noise(order));
    }
    let weight = |order: usize| {
        let (own, own_noise) = (harmonics[order].norm_sqr(), noise(order));
        if order < lowest || own_noise == 0.0 {
            return 1.0;
        }
        let beside = (order / 3).max(4);
        let (from, to) = (order.saturating_sub(beside).max(lowest), (order + beside + 1).min(count));
        let number = (to - from) as f64;
        let power = (above[from].0 - above[to].0) / number;
        let noise = (above[from].1 - above[to].1) / number;
        let signal = power - noise;
        let together = if signal > 2.0 * noise / number.sqrt() { signal / power } else { 0.0 };
        if own > 9.0 * own_noise { together.max(1.0 - own_noise / own) } else { together }
    };
    (0..count).map(weight).collect()
}
