//! Marks that do not count the part's turns: single turns show a phase that all orders share and that runs or steps. Their average is nothing that
//! the part has, so that the turns are averaged anew by the marks that they show.

use std::f64::consts::TAU;

use runout_closed_loop::{
    Settings,
    diagnosis::{Added, Estimated, rounded},
};
use runout_consistency::turns::PhaseCourse;
use runout_error::Result;
use runout_turning::{
    profile::{Profile, Recounted},
    rig::Rig,
};

use super::{Left, PutRight, addition, is_looked_for};
use crate::stage::Station;

pub(super) const TURN_RATIO: &str = "turn-ratio";
pub(super) const LOST_SAMPLES: &str = "lost-samples";

/// Times that the marks of a capture are put right at most: samples may be lost at several turns.
const MOST: usize = 4;
/// A phase is put right where that leaves less than this share of it.
const LEFT: f64 = 0.2;
/// Runs of two stations that are within so many standard uncertainties are one.
const ALIKE_STD: f64 = 5.0;
/// Turns from mark to mark are written with so many significant digits.
const DIGITS: usize = 9;

/// Whether marks may be put right that show a phase.
#[must_use]
pub fn is_wanted(phase: &PhaseCourse, settings: &Settings) -> bool {
    is_looked_for(if is_run(phase) { TURN_RATIO } else { LOST_SAMPLES }, settings)
}

/// A profile by marks that count the part's turns; the profile itself where its own do, or where others leave as much. `again` averages the same
/// capture by marks [put right](runout_turning::counted_turns::counted) by each phase after the other, of those that are `wanted`.
pub fn recounted(
    profile: Profile,
    wanted: impl Fn(&PhaseCourse) -> bool,
    again: impl Fn(&[PhaseCourse]) -> Result<Profile>,
) -> Profile {
    let (mut by, mut best, mut is_settled) = (Vec::new(), None::<Profile>, false);
    for _ in 0..MOST {
        let course = &best.as_ref().unwrap_or(&profile).course;
        // Turns that are counted wrongly mix orders: with them counted nearly right, the run is known better.
        let rest =
            course.run.filter(|_| !is_settled && by.last().is_some_and(|last| is_run(last) && last.std_rad > 0.0));
        let Some(phase) = course.phase.or(rest).filter(&wanted) else { break };
        is_settled = course.phase.is_none();
        let tried = together(&by, phase);
        let is_left =
            |left: PhaseCourse| is_run(&left) == is_run(&phase) && left.by_rad.abs() > LEFT * phase.by_rad.abs();
        match again(&tried) {
            Ok(next) if !next.course.phase.is_some_and(is_left) => (by, best) = (tried, Some(next)),
            // Without enough turns, or with as much of the phase, the marks are no better.
            _ => break,
        }
    }
    let Some(mut best) = best else { return profile };
    // The declared angle is that of the first mark: the mean turn is behind it by half of the turns, or by a step in half of them.
    let share = |phase: &PhaseCourse| if is_run(phase) { 0.5 * best.turns.recorded as f64 } else { 0.5 };
    let squares: f64 = by.iter().map(|phase| (share(phase) * phase.std_rad).powi(2)).sum();
    best.course.phase_std_rad = best.course.phase_std_rad.hypot(squares.sqrt());
    best.recounted = Some(Recounted { by, as_marked: Box::new(profile) });
    best
}

fn is_run(phase: &PhaseCourse) -> bool {
    phase.step_at.is_none()
}

/// Phases and one more, which is what the last one left where it has the same shape.
fn together(by: &[PhaseCourse], next: PhaseCourse) -> Vec<PhaseCourse> {
    let is_alike = |last: &PhaseCourse| match (last.step_at, next.step_at) {
        (None, None) => true,
        (Some([one, std]), Some([other, other_std])) => (one - other).abs() <= std + other_std,
        _ => false,
    };
    let mut together = by.to_vec();
    match together.last_mut().filter(|last| is_alike(last)) {
        // As turns are counted by the last one already, a run of these turns is one of less or more than a marked turn.
        Some(last) if is_run(last) => {
            last.by_rad += next.by_rad * (1.0 - last.by_rad / TAU);
            last.std_rad = next.std_rad;
        }
        Some(last) => (last.by_rad, last.std_rad) = (last.by_rad + next.by_rad, next.std_rad),
        None => together.push(next),
    }
    together
}

/// What was recounted: station, place of the profile in it, and how.
pub(super) struct RecountedProfile {
    station: usize,
    profile: usize,
    recounted: Recounted,
}

/// Takes what was recounted out of the profiles.
pub(super) fn take(stations: &mut [Station]) -> Vec<RecountedProfile> {
    let mut found = Vec::new();
    for (station, of_station) in stations.iter_mut().enumerate() {
        for (profile, of_setup) in of_station.profiles.iter_mut().enumerate() {
            found.extend(of_setup.recounted.take().map(|recounted| RecountedProfile { station, profile, recounted }));
        }
    }
    found
}

/// The stations as they are marked, where that differs.
pub(super) fn as_marked<'a>(
    stations: &'a [Station],
    found: &'a [RecountedProfile],
) -> impl Iterator<Item = (usize, Station)> + 'a {
    let of_station = |index: usize| found.iter().filter(move |found| found.station == index);
    let differs = move |(index, _): &(usize, &Station)| of_station(*index).next().is_some();
    stations.iter().enumerate().filter(differs).map(move |(index, station)| {
        let mut marked = station.clone();
        for found in of_station(index) {
            marked.profiles[found.profile] = (*found.recounted.as_marked).clone();
        }
        (index, marked)
    })
}

/// Says what was recounted, setup by setup: one run of all its stations once, everything else by itself.
pub(super) fn say(found: &[RecountedProfile], stations: &[Station], rig: &Rig, levels: [Left; 2], into: &mut PutRight) {
    let several = stations.len() > 1;
    for (setup, declared) in rig.setups.iter().enumerate() {
        let of_setup: Vec<&RecountedProfile> =
            found.iter().filter(|found| found.recounted.as_marked.setup == setup).collect();
        let runs = of_setup.iter().map(|found| match found.recounted.by[..] {
            [phase] if is_run(&phase) => Some(phase),
            _ => None,
        });
        let runs = runs.collect::<Option<Vec<PhaseCourse>>>().filter(|runs| runs.len() == stations.len());
        if let Some(run) = runs.as_deref().and_then(one_run) {
            let p = of_setup.iter().map(|found| chance(found)).fold(1.0, f64::min);
            let turns_per_mark = rounded(declared.turns_per_mark * (1.0 - run.by_rad / TAU), DIGITS);
            let change = Some(format!("setups.{setup}.turns_per_mark = {turns_per_mark:?}"));
            into.added.push(Added { change, ..added(&run, vec![declared.id.clone()], levels, p) });
            let turns = format!("{turns_per_mark} turns of the part from mark to mark");
            into.advice.push(format!("setup `{}`: {turns}: the mark is on another shaft, or slips", declared.id));
            continue;
        }
        for found in of_setup {
            let station = &stations[found.station].name;
            let targets: Vec<String> =
                std::iter::once(&declared.id).chain(several.then_some(station)).cloned().collect();
            for phase in &found.recounted.by {
                into.added.push(added(phase, targets.clone(), levels, chance(found)));
                into.advice.extend(phase.step_at.map(|[turn, _]| {
                    format!(
                        "{}: samples of {:.3}° are lost near turn {turn:.0}, or the part slipped in its clamping by as much: the turns there are left out; count \
                         them by marks of the spindle, and look at the clamping",
                        targets.join(" "),
                        -phase.by_rad.to_degrees()
                    )
                }));
            }
        }
    }
}

/// Chance of what single turns show.
fn chance(found: &RecountedProfile) -> f64 {
    let checks = found.recounted.as_marked.course.checks.iter();
    checks.filter(|check| check.refutes()).map(|check| check.p).fold(1.0, f64::min)
}

/// The weighted mean of runs that agree.
fn one_run(runs: &[PhaseCourse]) -> Option<PhaseCourse> {
    let weight = |run: &PhaseCourse| if run.std_rad > 0.0 { run.std_rad.powi(-2) } else { 1.0 };
    let whole: f64 = runs.iter().map(weight).sum();
    let mean = runs.iter().map(|run| weight(run) * run.by_rad).sum::<f64>() / whole;
    let is_alike = |run: &PhaseCourse| (run.by_rad - mean).abs() <= ALIKE_STD * run.std_rad;
    let is_known = runs.iter().any(|run| run.std_rad > 0.0);
    let std_rad = if is_known { whole.recip().sqrt() } else { 0.0 };
    (!runs.is_empty() && runs.iter().all(is_alike)).then_some(PhaseCourse { by_rad: mean, std_rad, step_at: None })
}

fn added(phase: &PhaseCourse, targets: Vec<String>, levels: [Left; 2], p: f64) -> Added {
    let parameter = |name: &str, unit: &str, value: f64, std: f64| Estimated {
        name: name.into(),
        value,
        std: Some(std),
        unit: unit.into(),
    };
    let (by_deg, std_deg) = (phase.by_rad.to_degrees(), phase.std_rad.to_degrees());
    let of = |effect: &str, parameters: Vec<Estimated>| {
        let plain = addition(effect, targets, levels, p);
        // Single turns are the evidence: the averages may hide in their covariance what turns against the mark.
        let is_estimated = phase.std_rad > 0.0;
        let delta_bic = if is_estimated { (levels[0].dof).ln() - (by_deg / std_deg).powi(2) } else { plain.delta_bic };
        Added { parameters, delta_bic, ..plain }
    };
    match phase.step_at {
        None => of(TURN_RATIO, vec![parameter("turning", "deg/rev", by_deg, std_deg)]),
        Some([turn, std]) => {
            of(LOST_SAMPLES, vec![parameter("lost", "deg", -by_deg, std_deg), parameter("after", "rev", turn, std)])
        }
    }
}
