//! Steps of a sensor's level within a capture: a probe that slips, a range that is switched. From one turn on, the mean level of the
//! turns is another one.

use runout_numerics::statistics::median;

use crate::profile::TurnLevels;

/// Turns on each side of a step that its size is taken from; those nearer to the ends show none.
const SIDE: usize = 4;
/// A level steps where it changes this many times the scatter of its other changes (from their median absolute deviation).
const CERTAIN: f64 = 8.0;
/// Changes beside the step are below this share of it: a drift that settles within a few turns is no step.
const SUDDEN: f64 = 0.3;
/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL: f64 = 1.4826;

/// A step of a level.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct LevelStep {
    /// The turn within which the level changes, by its number in the capture.
    pub turn: usize,
    /// By how much, in µm.
    pub by_um: f64,
}

/// The largest step of one of so many channels that is certain.
#[must_use]
pub fn level_step(levels: &TurnLevels, channel: usize, channels: usize) -> Option<LevelStep> {
    let values: Vec<f64> = levels.levels_um.iter().skip(channel).step_by(channels.max(1)).copied().collect();
    if values.len() < 3 * SIDE || values.len() != levels.numbers.len() {
        return None;
    }
    let number = |index: usize| levels.numbers[index] as f64;
    // Over two turns: the turn within which a level steps has a level between both. Turns that were left out make the distance longer.
    let changes: Vec<[f64; 2]> =
        (2..values.len()).map(|at| [values[at] - values[at - 2], number(at) - number(at - 2)]).collect();
    let rate = median(changes.iter().map(|[change, turns]| change / turns));
    let off: Vec<f64> = changes.iter().map(|[change, turns]| (change - rate * turns).abs()).collect();
    let scatter = NORMAL * median(off.iter().copied());
    let inner = SIDE..values.len() - SIDE;
    let turn = inner.max_by(|a, b| off[a - 1].total_cmp(&off[b - 1]))?;
    let side =
        |range: std::ops::Range<usize>| [median(values[range.clone()].iter().copied()), median(range.map(number))];
    let ([before, from], [after, to]) = (side(turn - SIDE..turn), side(turn + 1..turn + 1 + SIDE));
    // A steady drift between the middles of both sides is none of the step.
    let by_um = after - before - rate * (to - from);
    let beside = [turn - 3, turn + 1].into_iter().map(|at| off[at]).fold(0.0, f64::max);
    let is_step = off[turn - 1] > CERTAIN * scatter && by_um.abs() > CERTAIN * scatter && beside < SUDDEN * by_um.abs();
    is_step.then(|| LevelStep { turn: levels.numbers[turn], by_um })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Levels of two channels over 40 turns with scatter: the second has a course besides.
    fn levels(seed: u64, course: impl Fn(usize) -> f64) -> TurnLevels {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut noise = || 0.05 * Distribution::<f64>::sample(&StandardNormal, &mut random);
        let numbers: Vec<usize> = (0..40).filter(|turn| *turn != 7).collect();
        let levels_um = numbers.iter().flat_map(|turn| [noise(), noise() + course(*turn)]).collect();
        TurnLevels { numbers, levels_um }
    }

    #[test]
    fn a_step_is_found_with_its_turn_and_size() {
        for (seed, size_um) in [(1, 2.0), (2, -20.0), (3, 1.3)] {
            // Within turn 20, and on a drift.
            let step = |turn: usize| size_um * (turn as f64 - 19.6).clamp(0.0, 1.0) + 0.02 * turn as f64;
            let found = level_step(&levels(seed, step), 1, 2).unwrap();
            assert!((19..=21).contains(&found.turn), "{found:?}");
            // Five standard deviations of a difference of medians of four.
            assert!((found.by_um - size_um).abs() < 0.25, "{found:?}");
            assert_eq!(level_step(&levels(seed, step), 0, 2), None);
        }
    }

    #[test]
    fn noise_drifts_outliers_and_settling_are_no_step() {
        for seed in 0..500 {
            assert_eq!(level_step(&levels(seed, |_| 0.0), 1, 2), None, "{seed}");
        }
        assert_eq!(level_step(&levels(1, |turn| turn as f64), 1, 2), None);
        assert_eq!(level_step(&levels(1, |turn| if turn == 20 { 5.0 } else { 0.0 }), 1, 2), None);
        for tau in [1.0, 2.0, 5.0, 20.0] {
            let settling = level_step(&levels(2, |turn| 20.0 * (-(turn as f64) / tau).exp()), 1, 2);
            assert_eq!(settling, None, "{tau}");
        }
        let few = TurnLevels { numbers: (0..5).collect(), levels_um: vec![0.0, 0.0, 9.0, 9.0, 9.0] };
        assert_eq!(level_step(&few, 0, 1), None);
        assert_eq!(level_step(&few, 3, 0), None);
    }
}
