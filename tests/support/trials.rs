//! How many trials a statistical test makes: a third of its full study in a usual run, all of it where `RUNOUT_TRIALS=full` is set.

/// Once in so many cases the binomial distribution alone goes below what [`fewest`] asks of a part of a study.
#[allow(dead_code, reason = "not every test takes all")]
const RARE: f64 = 1e-3;

/// Whether the full studies are run.
#[allow(dead_code, reason = "not every test takes all")]
pub(crate) fn is_full() -> bool {
    std::env::var_os("RUNOUT_TRIALS").is_some_and(|value| value == "full")
}

/// All trials of a study where `RUNOUT_TRIALS=full` is set, a third of them otherwise, rounded up and at least one.
#[allow(dead_code, reason = "not every test takes all")]
pub(crate) fn trials(full: usize) -> usize {
    if is_full() { full } else { full.div_ceil(3).max(1) }
}

/// The fewest of `count` trials in which what happens with this chance has to happen, where the full study asks for `least` of `full`: the same
/// share, and of fewer trials no more than the binomial distribution of their number keeps in 999 of 1000 cases.
#[allow(dead_code, reason = "not every test takes all")]
pub(crate) fn fewest(count: usize, [least, full]: [usize; 2], chance: f64) -> usize {
    let same = (count * least).div_ceil(full);
    if count >= full { same } else { same.min(kept(count, chance)) }
}

/// The largest number that a binomial distribution is below in no more than [`RARE`] cases.
#[allow(dead_code, reason = "not every test takes all")]
fn kept(count: usize, chance: f64) -> usize {
    let mut probability = chance.powi(i32::try_from(count).unwrap_or(i32::MAX));
    let (mut number, mut above) = (count, probability);
    while above < 1.0 - RARE && number > 0 {
        // Of n trials, k − 1 happen k (1 − p) / ((n − k + 1) p) times as often as k.
        probability *= number as f64 * (1.0 - chance) / ((count - number + 1) as f64 * chance);
        number -= 1;
        above += probability;
    }
    number
}
