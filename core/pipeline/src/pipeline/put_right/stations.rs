//! Stations whose recordings are exchanged in one setup: a mistake that no single station shows, so that it is looked for before the closed loop.
//!
//! The form at a station has to be the same in all setups. Two stations that contradict themselves, and agree once their profiles of one setup are
//! exchanged, were recorded under each other's name.

use runout_closed_loop::diagnosis::Added;
use runout_error::Result;
use runout_numerics::statistics::chi2_tail;
use runout_turning::rig::Rig;

use super::{Left, PutRight, addition};
use crate::stage::{Station, StationSeparator};

/// χ² per degree of freedom from which on a station contradicts itself.
const SUSPICIOUS_CHI2: f64 = 10.0;
/// Two stations are exchanged where that leaves less than this share of χ² at one of them, and no more than before at the other: a third may hold its
/// profile.
const LEFT: f64 = 0.1;
/// Stations that are tried in pairs, those that contradict themselves most: each pair takes two separations a setup.
const MOST_TRIED: usize = 12;
/// Gains that differ by less than this share are the same exchange, seen from the other of two setups.
const SAME: f64 = 1e-3;
pub(super) const ID: &str = "stations-exchanged";

/// Looks for exchanged stations, and puts their profiles right; `left` is what each station leaves.
///
/// # Errors
/// When a station cannot be separated.
pub(super) fn put_right(
    stations: &mut [Station],
    left: &mut [Left],
    rig: &Rig,
    separator: &dyn StationSeparator,
    found: &mut PutRight,
) -> Result<()> {
    let names: Vec<String> = stations.iter().map(|station| station.name.clone()).collect();
    while let Some(best) = best_exchange(stations, left, separator)? {
        let before = Left::of_all(left);
        for (station, after) in best.pair.into_iter().zip(best.after) {
            if found.declared[station].is_none() {
                found.declared[station] = Some(separator.separate(&stations[station])?);
            }
            left[station] = after;
        }
        exchange(stations, best.profile, best.pair);
        let profile = &stations[best.pair[0]].profiles[best.profile];
        let levels = [before, Left::of_all(left)];
        note(found, rig, (profile.setup, best.tried), best.pair.map(|station| names[station].as_str()), levels);
    }
    Ok(())
}

/// What was found of so many exchanges tried.
fn note(found: &mut PutRight, rig: &Rig, (setup, tried): (usize, usize), [one, other]: [&str; 2], levels: [Left; 2]) {
    let setups = || rig.setups.iter().map(|setup| &setup.id);
    let id = &rig.setups[setup].id;
    // Of two setups, each may be the one that is named right.
    let others = setups().filter(|other| *other != id && rig.setups.len() == 2);
    let [before, after] = levels;
    let p_value = (tried as f64 * chi2_tail(before.chi2() - after.chi2(), 1.0)).min(1.0);
    found.added.push(Added {
        confounded_with: others.map(|setup| format!("{ID} {setup} {one} {other}")).collect(),
        distinguished_by: (rig.setups.len() == 2).then(|| "a third setup".into()),
        ..addition(ID, vec![id.clone(), one.into(), other.into()], levels, p_value)
    });
    found.advice.push(format!(
        "stations `{one}` and `{other}` are exchanged in setup `{id}`: exchange the names of the two recordings"
    ));
}

/// Two stations whose profiles of one setup are exchanged, and their residual then.
struct Exchange {
    profile: usize,
    pair: [usize; 2],
    after: [Left; 2],
    /// χ² that it takes away.
    gain: f64,
    /// Exchanges that were tried.
    tried: usize,
}

fn best_exchange(
    stations: &mut [Station],
    left: &[Left],
    separator: &dyn StationSeparator,
) -> Result<Option<Exchange>> {
    let mut tried: Vec<usize> = (0..stations.len()).filter(|one| left[*one].chi2_per_dof > SUSPICIOUS_CHI2).collect();
    tried.sort_by(|a, b| left[*b].chi2_per_dof.total_cmp(&left[*a].chi2_per_dof));
    tried.truncate(MOST_TRIED);
    let mut best: Option<Exchange> = None;
    let mut count = 0;
    for (place, &one) in tried.iter().enumerate() {
        for &other in &tried[..place] {
            let pair = [one.min(other), one.max(other)];
            // Of two setups, the first is taken for the one that is named right.
            for profile in (0..stations[one].profiles.len().min(stations[other].profiles.len())).rev() {
                count += 1;
                exchange(stations, profile, pair);
                let separated = pair.map(|station| separator.separate(&stations[station]));
                exchange(stations, profile, pair);
                let [first, second] = separated;
                let (before, after) = (pair.map(|station| left[station]), [Left::of(&first?), Left::of(&second?)]);
                let [share, other] = [0, 1].map(|at| after[at].chi2_per_dof / before[at].chi2_per_dof);
                let gain = before.iter().map(Left::chi2).sum::<f64>() - after.iter().map(Left::chi2).sum::<f64>();
                let more = best.as_ref().is_none_or(|best| gain > best.gain * (1.0 + SAME));
                if share.min(other) < LEFT && share.max(other) <= 1.0 && more {
                    best = Some(Exchange { profile, pair, after, gain, tried: 0 });
                }
            }
        }
    }
    Ok(best.map(|best| Exchange { tried: count, ..best }))
}

fn exchange(stations: &mut [Station], profile: usize, [one, other]: [usize; 2]) {
    let (before, from) = stations.split_at_mut(other);
    std::mem::swap(&mut before[one].profiles[profile], &mut from[0].profiles[profile]);
}
