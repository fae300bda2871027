//! Lines that a map cannot separate: ratios that differ by a whole number, or lie on both sides of one.
//!
//! They are equal at y = 0. Along y their phases differ by the whole number times θ. Which of them explain the map is decided by refits,
//! as for any confounded set.

use runout_core::closed_loop::{Closed, Fit, Model, Setting, fit::refit};

use crate::{
    effects::{MISSING, SPINDLE_LINE},
    lines::OtherRatio,
    model::{CutFit, CutModel},
};

/// Ratios whose refits differ by less than this in χ² cannot be separated.
const SAME_CHI2: f64 = 10.0;
/// Ratios that promise to be within this are refitted.
const REFITTED_CHI2: f64 = 60.0;
/// Refits of one line at most: of ratios within that limit, and of others. Where passes bury others, promises are not kept.
const MOST_REFITS: [usize; 2] = [8, 2];

/// Other ratios at which a line would explain as much.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Aliases {
    /// The effect.
    pub effect: usize,
    /// Nearest to the data first.
    pub ratios: Vec<f64>,
}

/// Finds them for each line that was added. A ratio that explains more takes the place of the one that was found.
pub(crate) fn find(model: &CutModel, closed: &mut Closed<CutFit>, known: usize, highest: usize) -> Vec<Aliases> {
    let lines: Vec<usize> = (known..closed.settings.len()).filter(|place| is_line(&closed.settings[*place])).collect();
    lines.into_iter().map(|place| of_line(model, closed, known, place, highest)).collect()
}

fn is_line(setting: &Setting) -> bool {
    MISSING.get(setting.effect).is_some_and(|missing| missing.line().is_some())
}

fn of_line(model: &CutModel, closed: &mut Closed<CutFit>, known: usize, place: usize, highest: usize) -> Aliases {
    let Setting { effect, values } = closed.settings[place].clone();
    let mut aliases = Aliases { effect, ratios: Vec::new() };
    let Some(ratio) = values.first().copied() else { return aliases };
    let remainder = closed.after.remainder();
    let level = remainder.chi2_per_dof();
    let unit = if remainder.noise_is_known() { level.max(1.0) } else { level };
    let (mut refits, mut found, mut alike) = ([0, 0], Vec::new(), Vec::new());
    for OtherRatio { ratio, worse, settings } in closed.after.other_ratios(&closed.settings, place, highest) {
        let kind = usize::from(worse > REFITTED_CHI2 * unit);
        if refits[kind] >= MOST_REFITS[kind] {
            if worse < SAME_CHI2 * unit {
                alike.push(ratio);
            }
            continue;
        }
        refits[kind] += 1;
        let Ok(trial) = refit(model.whole(), settings, known) else { continue };
        found.push(trial);
    }
    let best = found.iter().map(|trial| trial.chi2).fold(closed.after.remainder().chi2(), f64::min);
    if closed.after.remainder().chi2() > best
        && let Some(index) = found.iter().position(|trial| trial.chi2 <= best)
    {
        let better = found.swap_remove(index);
        if closed.after.remainder().chi2() - best < SAME_CHI2 * unit {
            aliases.ratios.push(ratio);
        }
        closed.settings = better.settings;
        closed.after = better.fit;
    }
    found.sort_by(|one, other| one.chi2.total_cmp(&other.chi2));
    let refitted = found.iter().filter(|trial| trial.chi2 - best < SAME_CHI2 * unit);
    aliases.ratios.extend(refitted.filter_map(|trial| trial.settings[place].values.first()));
    aliases.ratios.extend(alike);
    aliases
}

/// A ratio in words, as a member of a confounded set.
pub(crate) fn named(ratio: f64) -> String {
    format!("{SPINDLE_LINE} frequency_ratio {ratio:.5}")
}
