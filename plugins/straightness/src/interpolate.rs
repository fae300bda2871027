//! Cubic interpolation between readings at uneven positions.

/// Knots of a cubic.
const KNOTS: usize = 4;
/// Above this ratio of neighbouring spacings a cubic would amplify the readings' noise. Up to it, noise grows by 1.04
/// at most between two knots of four, and by 1.84 in a trace's first and last interval (1.09 where they are even).
const UNEVEN: f64 = 2.0;

/// The value at `at`, which lies within the ascending `z_mm`, of which there are four or more: of the cubic through the
/// four knots around it (Lagrange's form), or of the straight line between two of them where their spacings are too
/// uneven for a cubic.
///
/// It is linear in the readings: an offset and a slope go through unchanged. Of a wave of length λ read every h the
/// cubic leaves up to (3/128)·(2πh/λ)⁴ of its amplitude.
pub(crate) fn cubic(z_mm: &[f64], readings_um: &[f64], at: f64) -> f64 {
    let (first, count) = around(z_mm, at);
    let knots = || z_mm.iter().enumerate().skip(first).take(count);
    let weight = |own: usize, z: f64| -> f64 {
        knots().filter(|(other, _)| *other != own).map(|(_, other)| (at - other) / (z - other)).product()
    };
    knots().zip(readings_um.iter().skip(first)).map(|((own, z), reading)| weight(own, *z) * reading).sum()
}

/// The derivative of [`cubic`] by `at`.
pub(crate) fn cubic_slope(z_mm: &[f64], readings_um: &[f64], at: f64) -> f64 {
    let (first, count) = around(z_mm, at);
    let knots = || z_mm.iter().enumerate().skip(first).take(count);
    let others = |own: usize| knots().filter(move |(other, _)| *other != own);
    let weight = |own: usize, z: f64| -> f64 {
        let without = |left: usize| -> f64 {
            others(own).filter(|(other, _)| *other != left).map(|(_, other)| (at - other) / (z - other)).product()
        };
        others(own).map(|(left, other)| without(left) / (z - other)).sum()
    };
    knots().zip(readings_um.iter().skip(first)).map(|((own, z), reading)| weight(own, *z) * reading).sum()
}

/// The first of the knots that a place is interpolated between, and their number.
fn around(z_mm: &[f64], at: f64) -> (usize, usize) {
    let interval = z_mm.partition_point(|z| *z <= at).saturating_sub(1).min(z_mm.len().saturating_sub(2));
    let around = interval.saturating_sub(1).min(z_mm.len().saturating_sub(KNOTS));
    let spacings = z_mm.iter().skip(around).take(KNOTS).zip(z_mm.iter().skip(around + 1).take(KNOTS - 1));
    let (least, most) = spacings
        .map(|(lower, upper)| upper - lower)
        .fold((f64::INFINITY, 0.0_f64), |(least, most), spacing| (least.min(spacing), most.max(spacing)));
    if most <= UNEVEN * least { (around, KNOTS) } else { (interval, 2) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp, reason = "a knot's value is its own")]

    use super::*;

    #[test]
    fn a_cubic_is_met_and_a_knot_exactly() {
        let z = [0.0, 1.0, 2.5, 3.3, 4.4, 6.0];
        let readings = z.map(|z: f64| 2.0 - z + 0.5 * z * z - 0.1 * z.powi(3));
        for at in [0.3, 1.7, 2.9, 4.0, 5.9] {
            let expected = 2.0 - at + 0.5 * at * at - 0.1 * f64::powi(at, 3);
            // 1e-13: rounding of terms near 20.
            assert!((cubic(&z, &readings, at) - expected).abs() < 1e-13, "{at}");
        }
        for at in [0.3, 1.7, 2.9, 4.0, 5.9] {
            let expected = -1.0 + at - 0.3 * f64::powi(at, 2);
            assert!((cubic_slope(&z, &readings, at) - expected).abs() < 1e-12, "{at}");
        }
        for (z_mm, reading) in z.iter().zip(readings) {
            assert_eq!(cubic(&z, &readings, *z_mm), reading);
        }
    }

    #[test]
    fn beside_a_gap_and_between_near_knots_it_is_a_line() {
        // A cubic through 0.001 mm of noise would swing by hundreds at 1.5.
        let z = [0.0, 1.0, 1.001, 2.0, 3.0];
        let readings = [0.0, 0.0, 1.0, 0.0, 0.0];
        let at = 1.5;
        assert!((cubic(&z, &readings, at) - (2.0 - at) / (2.0 - 1.001)).abs() < 1e-12);
    }

    #[test]
    fn noise_hardly_grows() {
        let mut worst = [0.0_f64; 2];
        for spacings in [[1.0, 2.0, 1.0], [2.0, 1.0, 2.0], [1.0, 1.0, 2.0], [2.0, 2.0, 1.0], [2.0, 1.0, 1.0]] {
            let z = [0.0, spacings[0], spacings[0] + spacings[1], spacings.iter().sum()];
            for step in 0..=1000 {
                let at = z[3] * f64::from(step) / 1000.0;
                let unit = |own: usize| std::array::from_fn(|index| f64::from(u8::from(index == own)));
                let gain = (0..4).map(|own| cubic(&z, &unit(own) as &[f64; 4], at).powi(2)).sum::<f64>().sqrt();
                let place = usize::from(at < z[1] || at > z[2]);
                worst[place] = worst[place].max(gain);
            }
        }
        // The cubics of the worst spacings reach these; a ratio of 3 would give 1.21 and 3.05.
        assert!((worst[0] - 1.037).abs() < 1e-3 && (worst[1] - 1.838).abs() < 1e-3, "{worst:?}");
    }
}
