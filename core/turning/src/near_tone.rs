//! Tones so near to a whole order that an average over the turns takes them for synchronous.
//!
//! A tone at n + ν/T, T turns long, leaks into the record's transform at n + k/T by A·e^{−iπν}·sin πν/(π(ν − k)): in all channels together,
//! with the shares 1/(ν − k). From what it leaves at k = ±1, ±2, where nothing synchronous is, follows what it has put into the
//! mean, k = 0. Noise has no such pattern.

use runout_numerics::Complex64;

use crate::neighbours::Neighbours;

/// Distances ν that are looked for, without sign. Nearer tones look like a slow change of the order itself; from farther ones on, the
/// mean holds no more than its neighbours do.
const NEAREST: f64 = 0.4;
const FARTHEST: f64 = 0.85;
const STEPS: usize = 9;
/// Share of the neighbours' power that the pattern explains. Of noise, one order in 10⁴ or fewer has as much: with one channel, and
/// with two or more.
const EXPLAINED: [f64; 2] = [0.97, 0.92];

/// Highest order evaluated: above, spectra are smooth, and noise has more orders to look like a tone.
const HIGHEST: usize = 100;

/// A tone near a whole order.
#[derive(Debug, Clone, PartialEq)]
pub struct NearTone {
    /// The order.
    pub order: usize,
    /// How far it is from the order, in periods over the record.
    pub off: f64,
    /// What it puts into the mean at that order, one coefficient a channel, in µm.
    pub leak: Vec<Complex64>,
}

/// Tones near the orders from 1 that neighbours show.
#[must_use]
pub fn near_tones(neighbours: &Neighbours) -> Vec<NearTone> {
    let channels = neighbours.channels;
    let orders = neighbours.coefficients.first().map_or(0, |side| side.len() / channels.max(1));
    // With neighbours on one place of each side, any two numbers have the pattern.
    if neighbours.coefficients.len() < 4 {
        return Vec::new();
    }
    let limit = EXPLAINED[usize::from(channels > 1)];
    (1..orders.min(HIGHEST + 1)).filter_map(|order| near_tone(neighbours, order, limit)).collect()
}

fn near_tone(neighbours: &Neighbours, order: usize, limit: f64) -> Option<NearTone> {
    let channels = neighbours.channels;
    // Places k and the coefficients there, one a channel.
    let sides: Vec<(f64, &[Complex64])> = (neighbours.coefficients.iter().enumerate())
        .map(|(index, side)| {
            let place = (index / 2 + 1) as f64;
            (if index % 2 == 0 { place } else { -place }, &side[order * channels..(order + 1) * channels])
        })
        .collect();
    let power: f64 = sides.iter().flat_map(|(_, values)| *values).map(Complex64::norm_sqr).sum();
    let largest =
        sides.iter().map(|(_, values)| values.iter().map(Complex64::norm_sqr).sum::<f64>()).fold(0.0, f64::max);
    // Nearly all orders end here: the nearest neighbour has more than half of a tone's power.
    if power <= 0.0 || largest < 0.5 * power {
        return None;
    }
    let mut best: Option<(f64, NearTone)> = None;
    for step in 0..2 * STEPS {
        let size = NEAREST + (FARTHEST - NEAREST) * (step / 2) as f64 / (STEPS - 1) as f64;
        let off = if step % 2 == 0 { size } else { -size };
        let squares: f64 = sides.iter().map(|(place, _)| (off - place).powi(-2)).sum();
        let of_channel = |channel: usize| -> Complex64 {
            sides.iter().map(|(place, values)| values[channel] / (off - place)).sum::<Complex64>() / squares
        };
        let amplitudes: Vec<Complex64> = (0..channels).map(of_channel).collect();
        let explained = squares * amplitudes.iter().map(Complex64::norm_sqr).sum::<f64>() / power;
        if best.as_ref().is_none_or(|(most, _)| explained > *most) {
            let leak = amplitudes.iter().map(|amplitude| amplitude / off).collect();
            best = Some((explained, NearTone { order, off, leak }));
        }
    }
    best.filter(|(explained, _)| *explained > limit).map(|(_, tone)| tone)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::f64::consts::TAU;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const TURNS: usize = 40;
    const ANGLES: usize = 64;

    /// Transform of a record at an order that need not be whole, as coefficient of e^{−iνΦ}.
    fn transform(record: &[f64], order: f64) -> Complex64 {
        let each = record.iter().enumerate();
        let sum: Complex64 =
            each.map(|(sample, value)| value * Complex64::cis(TAU * order * sample as f64 / ANGLES as f64)).sum();
        2.0 * sum / record.len() as f64
    }

    fn neighbours(records: &[Vec<f64>], orders: usize) -> Neighbours {
        let side = |shift: f64| -> Vec<Complex64> {
            let at = |order: usize| records.iter().map(move |record| transform(record, order as f64 + shift));
            (0..orders).flat_map(at).collect()
        };
        let coefficients = [1.0, -1.0, 2.0, -2.0].map(|place| side(place / TURNS as f64));
        Neighbours { period: TURNS, channels: records.len(), angles: ANGLES, coefficients: coefficients.into() }
    }

    fn noise(seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..TURNS * ANGLES).map(|_| 0.05 * Distribution::<f64>::sample(&StandardNormal, &mut random)).collect()
    }

    /// Of a tone in two channels, what it leaks into the mean is found from what is beside.
    #[test]
    fn a_tone_near_an_order_is_found_with_its_leak() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for off in [0.43, -0.5, 0.5, 0.62, -0.78] {
            let phase: f64 = random.random_range(0.0..TAU);
            let tone = |sample: usize, shift: f64| {
                let angle = TAU * sample as f64 / ANGLES as f64;
                ((2.0 + off / TURNS as f64) * angle + phase + shift).cos()
            };
            let record = |(seed, size, shift): (u64, f64, f64)| -> Vec<f64> {
                noise(seed).iter().enumerate().map(|(sample, noise)| noise + size * tone(sample, shift)).collect()
            };
            let (loud, other) = (record((2, 0.2, 0.0)), record((3, 0.1, 1.0)));
            let found = near_tones(&neighbours(&[loud.clone(), other.clone()], 12));
            let [NearTone { order: 2, off: at, leak }] = &found[..] else { panic!("{off}: {found:?}") };
            assert!((at - off).abs() < 0.06, "{off}: {at}");
            for (record, leak) in [loud, other].iter().zip(leak) {
                let mean = transform(record, 2.0);
                // Noise, and steps of the distance.
                assert!((mean - leak).norm() < 0.2 * mean.norm() + 0.005, "{off}: {mean} {leak}");
            }
        }
    }

    /// Noise, a tone at some distance, and an order that grows over the record, are none.
    #[test]
    fn noise_far_tones_and_drifts_are_none() {
        let mut found = 0;
        for seed in 0..40 {
            found += near_tones(&neighbours(&[noise(2 * seed), noise(2 * seed + 1)], 30)).len();
        }
        // 1200 orders.
        assert!(found <= 1, "{found}");
        let with = |value: &dyn Fn(f64) -> f64| {
            let turns = |sample: usize| sample as f64 / ANGLES as f64;
            noise(7).iter().enumerate().map(|(sample, noise)| noise + value(turns(sample))).collect::<Vec<f64>>()
        };
        let far = with(&|turn| 0.2 * (TAU * 3.43 * turn).cos());
        let grows = with(&|turn| 0.02 * turn * (TAU * turn).cos());
        for record in [far, grows] {
            let found = near_tones(&neighbours(&[record.clone(), record], 12));
            assert_eq!(found, []);
        }
    }
}
