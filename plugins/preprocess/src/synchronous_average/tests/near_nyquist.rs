//! Orders near half of a turn's samples, which interpolation between samples weakens.

use super::*;

/// Amplitudes of 1 µm at orders to 0.86 of Nyquist come out as they are, whether positions lie anywhere between samples, always at one place, or
/// move from one place to the next from turn to turn.
#[test]
fn orders_that_interpolation_weakens_have_their_amplitude() {
    for (length, first) in [(256.31, 30.2), (256.0, 30.4), (256.0, 30.5), (256.02, 30.2), (301.57, 25.9), (97.7, 20.1)]
    {
        let nyquist = 0.5 * length;
        let orders: Vec<usize> = [0.3, 0.55, 0.7, 0.8, 0.86].iter().map(|share| (share * nyquist) as usize).collect();
        let known: Vec<(usize, Complex64)> =
            orders.iter().map(|order| (*order, Complex64::cis(*order as f64))).collect();
        let frames = (40.2 * length) as usize + 60;
        let readings =
            (0..frames).map(|frame| signal(&known, TAU * (frame as f64 - first) / length)).collect::<Vec<f64>>();
        let profile = average(512, stream(&[readings], marks(first, length, 41))).unwrap();
        assert_eq!(profile.responses.len(), 0);
        let error = |order: usize| {
            let expected = known.iter().find(|(known, _)| *known == order).map_or(Complex64::ZERO, |(_, value)| *value);
            (profile.order(order)[0] - expected).norm()
        };
        let worst = (0..=profile.max_order()).map(error).fold(0.0, f64::max);
        println!("{length} samples from {first}: {worst:.5} µm, orders to {}", profile.max_order());
        assert!(worst < 0.02, "{length}: {worst}");
        let said: Vec<&String> = profile.warnings.iter().filter(|said| said.contains("divided by")).collect();
        assert_eq!(said.len(), 1, "{:?}", profile.warnings);
        // Of what passes least, nothing is said to be there.
        assert!(profile.max_order() >= *orders.last().unwrap());
    }
}
