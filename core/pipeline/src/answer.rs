//! The answer of a result: what a reader wants first, which the terminal, the report and programs show alike.

mod key_values;
mod verdict;

use crate::summary::Summary;
use runout_closed_loop::diagnosis::{Added, Diagnosis};
use runout_numerics::number::{significant, unit_text, with_std};

pub use key_values::{KeyValue, Number};
pub use verdict::{Judgement, Verdict, limit_text};

/// What a result says first.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Answer {
    /// In one sentence.
    pub verdict: Verdict,
    /// The few values that the domain is asked for, at most [`MOST_KEY_VALUES`].
    pub key_values: Vec<KeyValue>,
    /// What the data contradict, each reason once.
    pub contradictions: Vec<String>,
    /// What the closed loop did, in at most three lines; empty without it.
    pub steps: Vec<String>,
}

/// Key values at most.
pub const MOST_KEY_VALUES: usize = 10;
/// Contradictions that are named.
const MOST_CONTRADICTIONS: usize = 3;

impl Answer {
    /// The contradictions that a page names, and how many more there are: all are in the files.
    #[must_use]
    pub fn named_contradictions(&self) -> (&[String], usize) {
        let (named, more) = self.contradictions.split_at(self.contradictions.len().min(MOST_CONTRADICTIONS));
        (named, more.len())
    }

    /// Whether a warning is among the contradictions already.
    #[must_use]
    pub fn says(&self, warning: &str) -> bool {
        self.contradictions.iter().any(|said| said.contains(warning))
    }

    /// Of a result, and of what the closed loop found where the result is that of its final model.
    #[must_use]
    pub fn of(summary: &Summary, diagnosis: Option<&Diagnosis>) -> Self {
        Self {
            verdict: verdict::verdict(summary, diagnosis),
            key_values: key_values::key_values(summary, diagnosis),
            contradictions: contradictions(summary),
            steps: diagnosis.map(steps).unwrap_or_default(),
        }
    }
}

/// What refutes values, each once: what is said of a station alone is left out where the whole says the same, and so is the name of the only one.
fn contradictions(summary: &Summary) -> Vec<String> {
    let (reasons, _) = summary.refuted();
    let of_one = |reason: &str| match &summary.stations[..] {
        [only] => reason.replace(&format!("{}: ", only.station), ""),
        _ => reason.to_owned(),
    };
    let mut said: Vec<String> = Vec::new();
    for reason in reasons.into_iter().map(|(reason, _)| of_one(reason)) {
        if !said.contains(&reason) {
            said.push(reason);
        }
    }
    let all = said.clone();
    said.retain(|reason| !all.iter().any(|other| other != reason && reason.ends_with(&format!(": {other}"))));
    said
}

/// The residual, the effects and the values that moved most: before → after.
fn steps(diagnosis: &Diagnosis) -> Vec<String> {
    if diagnosis.nothing_separated || diagnosis.after.degrees_of_freedom == 0 {
        return Vec::new();
    }
    let unit = unit_text(diagnosis.before.unit.as_deref().unwrap_or("um"));
    let number = |value: f64| significant(value, 3);
    let floor = diagnosis.after.noise_floor_um.map(|floor| format!(", expected from noise {}", number(floor)));
    let floor = floor.unwrap_or_default();
    let (before, after) = (diagnosis.before.residual_rms_um, diagnosis.after.residual_rms_um);
    if diagnosis.added.is_empty() {
        return vec![format!("residual: {} {unit} rms{floor}; no effect is added", number(before))];
    }
    let mut steps = vec![
        format!("residual: {} → {} {unit} rms{floor}", number(before), number(after)),
        format!("added: {}", diagnosis.added.iter().map(effect).collect::<Vec<_>>().join("; ")),
    ];
    let truth = diagnosis.truth.as_ref().map(|truth| truth.form_rms_error_um);
    if let Some((Some(before), Some(after))) = truth.map(|step| (step.before, step.after)) {
        steps.push(format!("true error of form: {} → {} µm rms", significant(before, 2), significant(after, 2)));
    } else if let Some([before, after]) = held_out(diagnosis) {
        steps.push(format!("held-out residual: {} → {} {unit} rms", number(before), number(after)));
    }
    steps
}

fn held_out(diagnosis: &Diagnosis) -> Option<[f64; 2]> {
    Some([diagnosis.before.held_out_rms_um?, diagnosis.after.held_out_rms_um?])
}

/// "reversal-angle b, angle 0.33997 ± 0.00057 °"; of a confounded set its members.
fn effect(added: &Added) -> String {
    if !added.confounded_with.is_empty() {
        return format!("{} (not decided)", added.members());
    }
    let parameters = added.parameters.iter().map(|one| {
        let unit = match &*one.unit {
            "1" => String::new(),
            "deg" => "°".into(),
            other => unit_text(other),
        };
        format!(", {} {} {unit}", one.name, with_std(one.value, one.std)).trim_end().to_owned()
    });
    std::iter::once(added.members()).chain(parameters).collect()
}

#[cfg(test)]
mod tests;
