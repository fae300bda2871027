//! What a result warns of, gathered at one place: each text once, those of a station with the station's name.

use std::collections::HashSet;

use super::{
    station_summary::summarise,
    steadiness::{Steadiness, inflated},
    undeclared::Undeclared,
};
use crate::summary::{StationSummary, Summary, misfits};
use runout_consistency::{self as consistency, Check, Test};
use runout_evaluate::EvaluatedStation;
use runout_turning::{
    mains::{self, Sampled},
    profile::Profile,
    rig::Rig,
    station::StationResult,
};

/// What stands before a warning of a run of the same pipeline that the diagnosed result does not give.
const OF_RUN: &str = "`runout run` warns";

/// Warnings and notes of a result, in the order in which they are shown.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    all: Vec<String>,
    notes: Vec<String>,
    known: HashSet<String>,
}

impl Warnings {
    /// Adds texts that say nothing wrong.
    pub(super) fn note(&mut self, texts: impl IntoIterator<Item = String>) {
        for text in texts {
            if self.known.insert(text.clone()) {
                self.notes.push(text.clone());
                self.all.push(text);
            }
        }
    }

    /// Adds warnings.
    pub(super) fn warn(&mut self, texts: impl IntoIterator<Item = String>) {
        for text in texts {
            if self.known.insert(text.clone()) {
                self.all.push(text);
            }
        }
    }

    /// Adds what a run of the same pipeline warns of: its model has no effects that were found.
    pub(super) fn of_run(&mut self, texts: Vec<String>) {
        let others: Vec<String> = texts.into_iter().filter(|text| !self.known.contains(text)).collect();
        self.warn(others.into_iter().map(|text| format!("{OF_RUN}: {text}")));
    }

    /// All of them, and those that are notes.
    pub(super) fn into_parts(self) -> [Vec<String>; 2] {
        [self.all, self.notes]
    }
}

/// What the turns and the forms of all stations show together.
#[derive(Debug, Default)]
pub(super) struct TurnsOfAll {
    steadiness: Steadiness,
    undeclared: Undeclared,
    captures: Vec<Sampled>,
}

impl TurnsOfAll {
    /// Takes a station.
    pub(super) fn take(&mut self, result: &StationResult, rig: &Rig) {
        let sampled = |profile: &Profile| {
            Some(Sampled { speed_rpm: profile.speed_rpm?, turns: profile.turns.used, rate_hz: profile.sample_rate_hz })
        };
        self.steadiness.take(&result.station, &result.profiles, rig);
        self.captures.extend(result.profiles.iter().filter_map(sampled));
        self.undeclared.take(result);
    }

    /// What is as it should be.
    pub(super) fn notes(&self) -> Vec<String> {
        mains::whole_orders(&self.captures)
    }

    /// What may be wrong.
    pub(super) fn warnings(self, rig: &Rig) -> Vec<String> {
        let of_rig = rig.remarks().into_iter();
        of_rig.chain(self.steadiness.warnings(rig)).chain(self.undeclared.warning()).collect()
    }
}

/// What a run warns of at all stations, where the result is another one.
#[derive(Debug, Default)]
pub(super) struct DeclaredStations {
    stations: Vec<StationSummary>,
    checks: Vec<Check>,
    interrupted: bool,
    turns: TurnsOfAll,
}

impl DeclaredStations {
    /// Takes a station as the rig is declared.
    pub(super) fn take(&mut self, station: &EvaluatedStation, rig: &Rig) {
        let result = &station.result;
        self.interrupted |= result.separation.sections.iter().any(|section| !section.gaps.is_empty());
        self.stations.push(summarise(station, Some(rig)));
        let checks = &result.separation.residual.checks;
        self.checks.extend(checks.iter().map(|check| check.clone().within(&result.station)));
        self.turns.take(result, rig);
    }

    /// What a run warns of.
    pub(super) fn warnings(self, rig: &Rig) -> Vec<String> {
        let of_turns = self.turns.warnings(rig).into_iter();
        let of_checks = of_checks(&self.checks, false).into_iter();
        of_turns.chain(of_checks).chain(of_stations(&self.stations, &self.checks, self.interrupted)).collect()
    }
}

/// Warnings of a station with its name: some begin with the place of a capture, `setup/station`.
pub(super) fn of_station<'a>(station: &'a str, warnings: &'a [String]) -> impl Iterator<Item = String> + 'a {
    warnings.iter().map(move |warning| {
        let place = warning.split_once(": ").map_or("", |(place, _)| place);
        let is_named = place.rsplit('/').next() == Some(station);
        if is_named { warning.clone() } else { format!("{station}: {warning}") }
    })
}

/// What the fit at each station and the stations' own warnings say.
pub(super) fn of_stations(stations: &[StationSummary], checks: &[Check], interrupted: bool) -> Vec<String> {
    let each = stations.iter().flat_map(|one| of_station(&one.station, &one.warnings));
    misfit(stations, checks, interrupted).into_iter().chain(inflated(stations)).chain(each).collect()
}

/// What the tests of the data found. Those of whole residuals are said of all stations together.
pub(super) fn of_checks(checks: &[Check], of_points: bool) -> Vec<String> {
    let said: Vec<Check> = checks.iter().filter(|check| of_points || check.test != Test::Residual).cloned().collect();
    consistency::findings(&said)
}

/// The warnings of a summary that are no notes.
pub(super) fn findings(summary: Summary) -> Vec<String> {
    let Summary { warnings, notes, .. } = summary;
    warnings.into_iter().filter(|warning| !notes.contains(warning)).collect()
}

/// What a rig that is not as declared looks like: a residual far above what is expected from noise.
fn misfit(stations: &[StationSummary], checks: &[Check], interrupted: bool) -> Option<String> {
    let beyond = misfits(stations, checks).filter(|station| station.chi2_per_dof.is_some_and(|chi2| chi2 > 1.0));
    let count = beyond.clone().count();
    let worst =
        beyond.max_by(|a, b| a.chi2_per_dof.unwrap_or_default().total_cmp(&b.chi2_per_dof.unwrap_or_default()))?;
    let left = worst.residual_rms_um.unwrap_or(f64::NAN);
    let (chi2, dof) = (worst.chi2_per_dof.unwrap_or(f64::NAN), worst.residual_dof.unwrap_or(0));
    let decimals = if chi2 < 100.0 { 2 } else { 0 };
    let bridged =
        if interrupted { " (or the bridged interruptions disturb readings: declare wider interruptions)" } else { "" };
    Some(format!(
        "at {count} of {} stations the readings contradict each other: χ² per degree of freedom is up to {chi2:.decimals$} ({}, {dof} degrees of \
         freedom), where noise makes 1, and the fit leaves {left:.4} µm rms; something is not as the rig declares it{bridged}, and the \
         stated uncertainties are widened by as much. The closed loop (`runout diagnose`) looks for the cause",
        stations.len(),
        worst.station,
    ))
}

#[cfg(test)]
mod tests {
    use super::{Warnings, of_station};

    #[test]
    fn each_text_is_said_once_and_a_note_stays_one() {
        let texts = |all: &[&str]| all.iter().map(|text| (*text).to_owned()).collect::<Vec<String>>();
        let mut warnings = Warnings::default();
        warnings.note(texts(&["order 1 is lost"]));
        warnings.warn(texts(&["order 1 is lost", "levels creep", "levels creep"]));
        warnings.of_run(texts(&["levels creep", "χ² is 104"]));
        let [all, notes] = warnings.into_parts();
        assert_eq!(all, ["order 1 is lost", "levels creep", "`runout run` warns: χ² is 104"]);
        assert_eq!(notes, ["order 1 is lost"]);
    }

    #[test]
    fn a_station_is_named_once() {
        let warnings = ["few turns: 3".to_owned(), "initial/s 1: a spike".into(), "a/s 10: a spike".into()];
        let named: Vec<String> = of_station("s 1", &warnings).collect();
        assert_eq!(named, ["s 1: few turns: 3", "initial/s 1: a spike", "s 1: a/s 10: a spike"]);
    }
}
