//! Uncertainty of values that depend on a profile non-linearly, by Monte Carlo (GUM supplement 1, JCGM 101:2008).
//!
//! Errors of a separated form are normal, favour no phase, and do not couple orders: over the angle they are a stationary
//! process, so that one drawn profile, turned by any angle, is another draw. Each transform thus gives several draws.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Complex64, numerics::fourier::Fourier};

/// Draws for each value: the 95 % interval's ends are then known to about a tenth of a standard uncertainty.
pub const DRAWS: usize = 400;
/// Draws from one transform, turned by equal steps from a random start.
const TURNS_OF_A_DRAW: usize = 16;
/// Share of the draws below the interval, and above it.
const TAIL: f64 = 0.025;

/// What is known of a value's error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Uncertainty {
    /// Standard uncertainty, in the value's unit.
    pub std: f64,
    /// Where the truth lies with 95 % probability. A peak-to-valley grows with noise; the interval takes that back, and so
    /// need not lie evenly about the value.
    pub interval_95: [f64; 2],
    /// Draws of the Monte Carlo.
    pub draws: usize,
}

/// The uncertainty of values of a profile, from the variance E|δ|² of its harmonics by order from 0; orders without a
/// known variance, and those below 2, are taken as exact. `None` where no variance is known.
///
/// `form_um` lies on equal angles; `values` computes sizes (none below 0) from such a profile. The interval is 2v − (the draws' 97.5 % point)
/// to 2v − (their 2.5 % point) for a value v: the error of v about the truth is that of a draw about v.
#[must_use]
pub fn monte_carlo<const N: usize>(
    form_um: &[f64],
    variance: &[f64],
    seed: u64,
    values: impl Fn(&[f64]) -> [f64; N],
) -> Option<[Uncertainty; N]> {
    let known = |variance: &f64| variance.is_finite() && *variance > 0.0;
    let amplitudes: Vec<f64> = variance
        .iter()
        .enumerate()
        .map(|(order, variance)| if order >= 2 && known(variance) { (0.5 * variance).sqrt() } else { 0.0 })
        .collect();
    if form_um.is_empty() || amplitudes.iter().all(|amplitude| *amplitude == 0.0) {
        return None;
    }
    let length = form_um.len();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut fourier = Fourier::new(length);
    let mut drawn = vec![0.0; length];
    let mut results: [Vec<f64>; N] = std::array::from_fn(|_| Vec::with_capacity(DRAWS));
    for _ in 0..DRAWS / TURNS_OF_A_DRAW {
        let mut part = |amplitude: f64| -> f64 {
            let normal: f64 = StandardNormal.sample(&mut random);
            amplitude * normal
        };
        let harmonics: Vec<Complex64> =
            amplitudes.iter().map(|amplitude| Complex64::new(part(*amplitude), part(*amplitude))).collect();
        let errors = fourier.synthesise(harmonics);
        let start = random.random_range(0..length);
        for turn in 0..TURNS_OF_A_DRAW {
            let shift = (start + turn * length / TURNS_OF_A_DRAW) % length;
            let (head, tail) = errors.split_at(shift);
            let turned = tail.iter().chain(head);
            drawn.iter_mut().zip(form_um).zip(turned).for_each(|((drawn, form), error)| *drawn = form + error);
            results.iter_mut().zip(values(&drawn)).for_each(|(all, value)| all.push(value));
        }
    }
    let found = values(form_um);
    let mut results = results.into_iter().zip(found);
    Some(std::array::from_fn(|_| {
        let (mut draws, value) = results.next().unwrap_or_default();
        summed_up(&mut draws, value)
    }))
}

fn summed_up(draws: &mut [f64], value: f64) -> Uncertainty {
    draws.sort_by(f64::total_cmp);
    let count = draws.len().max(1) as f64;
    let mean = draws.iter().sum::<f64>() / count;
    let squares: f64 = draws.iter().map(|draw| (draw - mean).powi(2)).sum();
    let point = |share: f64| {
        let position = share * (draws.len().saturating_sub(1)) as f64;
        let below = position.floor() as usize;
        let [low, high] = [below, below + 1].map(|index| draws.get(index).copied().unwrap_or(value));
        low + (high - low) * position.fract()
    };
    Uncertainty {
        std: (squares / (count - 1.0).max(1.0)).sqrt(),
        interval_95: [(2.0 * value - point(1.0 - TAIL)).max(0.0), 2.0 * value - point(TAIL)],
        draws: draws.len(),
    }
}

/// A seed that depends on names only, so that it is the same however the work is shared.
#[must_use]
pub fn seed(names: &[&str]) -> u64 {
    let mut hash = blake3::Hasher::new();
    for name in names {
        hash.update(name.as_bytes());
        hash.update(&[0]);
    }
    let bytes = hash.finalize();
    bytes.as_bytes()[..8].iter().fold(0, |seed, byte| (seed << 8) | u64::from(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear value, the profile at one angle, has the standard uncertainty √(½ Σ E|δₙ|²) and a symmetric interval.
    #[test]
    fn a_linear_value_has_its_closed_form() {
        let variance: Vec<f64> = (0..60).map(|order| 1e-4 / (1.0 + f64::from(order))).collect();
        let expected = (0.5 * variance.iter().skip(2).sum::<f64>()).sqrt();
        let form = vec![1.0; 512];
        let [found] = monte_carlo(&form, &variance, 7, |profile| [profile[100]]).unwrap();
        // 400 draws, of which those from one transform depend on each other a little: 15 % is four of their errors.
        assert!((found.std / expected - 1.0).abs() < 0.15, "{} for {expected}", found.std);
        for (end, sign) in found.interval_95.iter().zip([-1.0, 1.0]) {
            assert!((end - (1.0 + sign * 1.96 * expected)).abs() < 0.5 * expected, "{:?}", found.interval_95);
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_numbers_and_no_variance_none() {
        let form: Vec<f64> = (0..64).map(|step| (f64::from(step) * 0.3).sin()).collect();
        let peak = |profile: &[f64]| [profile.iter().copied().fold(f64::MIN, f64::max)];
        let first = monte_carlo(&form, &[0.01; 20], 3, peak);
        assert_eq!(first, monte_carlo(&form, &[0.01; 20], 3, peak));
        assert_ne!(first, monte_carlo(&form, &[0.01; 20], 4, peak));
        assert_eq!(monte_carlo(&form, &[f64::NAN; 20], 3, peak), None);
        assert_ne!(seed(&["a", "b"]), seed(&["ab"]));
    }
}
