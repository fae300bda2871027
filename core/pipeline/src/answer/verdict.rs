//! The verdict in one sentence.

use crate::summary::{Decision, Limit, LimitSummary, LimitValue, Summary};
use runout_closed_loop::diagnosis::{self, Diagnosis};
use runout_consistency::Test;
use runout_numerics::number::{significant, spread, unit_text};

/// A sentence, and how good what it says is.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Verdict {
    /// The sentence, with its full stop.
    pub sentence: String,
    /// How good it is.
    pub judgement: Judgement,
}

/// How good what a verdict says is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Judgement {
    /// Proven: limits are kept, or the model leaves noise only.
    Good,
    /// Something is not decided.
    Open,
    /// A limit is broken, or the data contradict what is said of them.
    Bad,
}

/// Limits first, then what the closed loop or the tests of the data say.
pub(super) fn verdict(summary: &Summary, diagnosis: Option<&Diagnosis>) -> Verdict {
    let (found, judgement) = diagnosis.map_or_else(|| of_data(summary), |diagnosis| of_loop(diagnosis, summary));
    let contradicted = judgement == Judgement::Bad;
    match of_limits(summary) {
        Some((limits, of_limits)) => {
            let judgement = if contradicted { Judgement::Bad } else { of_limits };
            Verdict { sentence: format!("{limits}; {}.", lower_first(&found)), judgement }
        }
        None => Verdict { sentence: format!("{found}."), judgement },
    }
}

fn lower_first(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
}

fn of_loop(diagnosis: &Diagnosis, summary: &Summary) -> (String, Judgement) {
    let judgement = match diagnosis.verdict {
        // Effects between which the data do not decide leave the result open.
        diagnosis::Verdict::Explained if diagnosis.added.iter().any(|added| !added.confounded_with.is_empty()) => {
            Judgement::Open
        }
        diagnosis::Verdict::AtNoiseFloor | diagnosis::Verdict::Explained => Judgement::Good,
        diagnosis::Verdict::Unexplained => Judgement::Bad,
        diagnosis::Verdict::Improved | diagnosis::Verdict::NothingFound => Judgement::Open,
    };
    // What refutes values is said of them.
    let is_said = !summary.refuted().0.is_empty();
    (diagnosis.headline(!is_said), judgement)
}

/// What the tests of the data on themselves say.
fn of_data(summary: &Summary) -> (String, Judgement) {
    let (refuted, values) = summary.refuted();
    let count: usize = refuted.iter().map(|(_, count)| count).sum();
    if count > 0 {
        let all = if count == values { "all".to_owned() } else { format!("{count} of") };
        return (format!("The data contradict the ± of {all} {values} values"), Judgement::Bad);
    }
    let stations = &summary.stations;
    let misfits = summary.misfits().count();
    if misfits > 0 {
        let of = format!("{misfits} of {} stations", stations.len());
        return (
            format!("The residual exceeds the measured noise at {of}: the declared rig may be wrong"),
            Judgement::Bad,
        );
    }
    if !stations.is_empty() && stations.iter().all(|station| !station.readings.is_empty()) {
        return (
            "Nothing is separated: each reading is form, eccentricity and error motion together".into(),
            Judgement::Open,
        );
    }
    match spread(stations.iter().filter_map(|station| station.chi2_per_dof)) {
        Some([low, _, high]) => {
            let [low, high] = [low, high].map(|chi2| significant(chi2, 2));
            let range = if low == high { low } else { format!("{low} to {high}") };
            let unlike =
                summary.consistency.iter().any(|check| check.test == Test::Residual && !check.finding.is_empty());
            if unlike {
                (
                    format!("The residual is less than the measured noise: χ² per degree of freedom {range}"),
                    Judgement::Open,
                )
            } else {
                (
                    format!("The residual agrees with the measured noise: χ² per degree of freedom {range}"),
                    Judgement::Good,
                )
            }
        }
        None if summary.consistency.iter().any(|check| check.dof.iter().any(|dof| *dof > 0.0)) => {
            let findings = summary.consistency.iter().filter(|check| !check.finding.is_empty()).count();
            let warnings = match summary.findings().count() {
                0 => String::new(),
                1 => "; one warning is below".into(),
                many => format!("; {many} warnings are below"),
            };
            let judgement = if warnings.is_empty() && findings == 0 { Judgement::Good } else { Judgement::Open };
            let found = match findings {
                0 => "The tests of the data on themselves find nothing".to_owned(),
                1 => "One test of the data on themselves has a finding".into(),
                many => format!("{many} tests of the data on themselves have a finding"),
            };
            (found + &warnings, judgement)
        }
        None => ("Nothing in the data tests the result".into(), Judgement::Open),
    }
}

fn of_limits(summary: &Summary) -> Option<(String, Judgement)> {
    let named = |decision| -> Vec<String> {
        let limits = summary.limits.iter().filter(|limit| limit.decision == decision);
        let order =
            |limit: &LimitSummary| limit.deciding().and_then(LimitValue::order).filter(|_| limit.values.len() > 1);
        let worst =
            |limit: &LimitSummary| order(limit).map(|order| format!(", worst at order {order}")).unwrap_or_default();
        limits.map(|limit| limit_text(&limit.limit) + &worst(limit)).collect()
    };
    let (broken, undecided) = (named(Decision::DoesNotConform), named(Decision::Undecided));
    let all = summary.limits.len();
    match (broken.len(), undecided.len()) {
        _ if all == 0 => None,
        (0, 0) if all == 1 => Some(("The limit is kept".into(), Judgement::Good)),
        (0, 0) => Some((format!("All {all} limits are kept"), Judgement::Good)),
        (0, 1) if all == 1 => Some((format!("The limit is undecided: {}", undecided.join(", ")), Judgement::Open)),
        (1, _) if all == 1 => Some((format!("The limit is broken: {}", broken.join(", ")), Judgement::Bad)),
        (0, open) => Some((format!("{open} of {all} limits are undecided: {}", undecided.join(", ")), Judgement::Open)),
        (count, _) => Some((format!("{count} of {all} limits are broken: {}", broken.join(", ")), Judgement::Bad)),
    }
}

/// "RONt of section a ≤ 5 µm".
#[must_use]
pub fn limit_text(limit: &Limit) -> String {
    let name = limit.name();
    name.strip_suffix(&limit.unit).map_or(name.clone(), |rest| format!("{rest}{}", unit_text(&limit.unit)))
}
