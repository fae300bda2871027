//! What a closed loop found, for people and programs.

use std::{collections::BTreeMap, path::PathBuf};

use runout_consistency::{Check, refuted_by};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a closed loop found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Diagnosis {
    /// In one word.
    pub verdict: Verdict,
    /// The declared model.
    pub before: Level,
    /// Effects that the declared model lacks, in the order in which they were found.
    pub added: Vec<Added>,
    /// The model with them.
    pub after: Level,
    /// Whether the layout separates nothing: no order of form is observable, and the residual says nothing of the readings.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub nothing_separated: bool,
    /// Key values before and after.
    pub moved: Vec<Moved>,
    /// What no known effect explains.
    pub unexplained: Vec<Unexplained>,
    /// The tests of the final model on its own data.
    #[serde(default)]
    pub consistency: Vec<Check>,
    /// Effects that these data cannot show at all.
    pub blind_to: Vec<Blind>,
    /// Effects that looked likely and were refused, with the reason.
    pub refused: Vec<Refused>,
    /// Orders that the final model cannot separate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_orders: Option<LostOrders>,
    /// Beside the truth, where the data carry it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<Truth>,
    /// What the user should know: all that a run of the same pipeline warns of among it.
    pub warnings: Vec<String>,
    /// Those of `warnings` that say nothing wrong.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Files written: the results of the final model, and this document.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<PathBuf>,
}

/// Other members of a set that a sentence names.
const MOST_MEMBERS: usize = 3;
const NO_UNCERTAINTY: &str =
    "the parameters of the effects have no ±: something unexplained is left, and what it does to them is not known";

impl Diagnosis {
    /// The warnings that are no notes: `--fail-on-warning` counts them.
    pub fn findings(&self) -> impl Iterator<Item = &String> {
        self.warnings.iter().filter(|warning| !self.notes.contains(warning))
    }

    /// The verdict in one sentence, with what refutes the final model where that is asked for, and the confounded sets that the data do not decide.
    #[must_use]
    pub fn headline(&self, with_findings: bool) -> String {
        let undecided = self.added.iter().filter(|one| !one.confounded_with.is_empty());
        let sets: Vec<String> = undecided.map(Added::some_members).collect();
        let refuted = refuted_by(&self.consistency).filter(|_| with_findings);
        let refuted = refuted.map(|said| format!(": {said}")).unwrap_or_default();
        let verdict = format!("{}{refuted}", self.in_words());
        if sets.is_empty() { verdict } else { format!("{verdict}. Not decided: {}", sets.join("; ")) }
    }

    /// Adds tests of the data themselves: what refutes them is left unexplained, whatever the model.
    pub fn refute(&mut self, checks: &[Check]) {
        self.consistency.extend_from_slice(checks);
        if checks.iter().any(Check::refutes) {
            self.verdict = Verdict::Unexplained;
        }
    }

    /// Takes the uncertainty of effects that were added where something unexplained is left: it is of a model that the data refute.
    pub fn withhold_refuted(&mut self) {
        let parameters = self.added.iter_mut().flat_map(|added| &mut added.parameters);
        let withheld = parameters.filter(|_| self.verdict == Verdict::Unexplained).filter_map(|one| one.std.take());
        if withheld.count() > 0 {
            self.warnings.push(NO_UNCERTAINTY.into());
            self.notes.push(NO_UNCERTAINTY.into());
        }
    }

    fn in_words(&self) -> &'static str {
        match self.verdict {
            _ if self.nothing_separated => {
                "Nothing is separated: each reading is form, eccentricity and error motion together"
            }
            _ if self.after.degrees_of_freedom == 0 => {
                "Nothing found: the residual has no degrees of freedom, so nothing checks the declared model"
            }
            Verdict::AtNoiseFloor => "At the noise floor: the declared model leaves noise only",
            Verdict::Explained => "Explained: with what was added, noise only is left",
            Verdict::Unexplained => "Unexplained: something is left that no known effect explains",
            Verdict::Improved => {
                "Improved: effects were added. The noise level is not known, so the residual may contain more"
            }
            Verdict::NothingFound => {
                "Nothing found: no effect was added. The noise level is not known, so the residual may contain more"
            }
        }
    }
}

/// A diagnosis in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The declared model leaves noise only, at a noise level known from elsewhere than the fit.
    AtNoiseFloor,
    /// With the effects added, noise only is left, at a noise level known from elsewhere than the fit.
    Explained,
    /// More than the known noise is left, and no known effect explains it.
    Unexplained,
    /// Effects were added. The data may contain more: the noise level is not known, or nothing else is redundant.
    Improved,
    /// No effect was added. The data may contain more: the noise level is not known, or the residual has no degrees of freedom.
    NothingFound,
}

impl Verdict {
    /// That of the same final model with something added to the declared one.
    #[must_use]
    pub fn with_addition(self) -> Self {
        match self {
            Self::AtNoiseFloor => Self::Explained,
            Self::NothingFound => Self::Improved,
            other => other,
        }
    }
}

/// How far a model is from its data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Level {
    /// Root mean square of what the fit leaves.
    pub residual_rms_um: f64,
    /// Its degrees of freedom: with none, the residual is 0 whatever the data are.
    pub degrees_of_freedom: usize,
    /// The residual's value expected from noise; null where the noise is not known.
    pub noise_floor_um: Option<f64>,
    /// Weighted sum of squares per degree of freedom; null where the noise is not known.
    pub chi2_per_dof: Option<f64>,
    /// Root mean square of the residual on held-out data.
    pub held_out_rms_um: Option<f64>,
    /// Its value expected from noise: that of the held-out data and that of the data fitted. Null where the noise is not known.
    pub held_out_expected_rms_um: Option<f64>,
    /// The data's unit, where it is not µm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Lowest and highest order at which a reading is redundant, where the model is one of single orders: those that the
    /// residual and chi squared are of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orders: Option<[usize; 2]>,
}

/// An effect that was added.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Added {
    /// Its id.
    pub effect: String,
    /// Where it acts; of a confounded set, one representative.
    pub targets: Vec<String>,
    /// What these data do not distinguish it from: "effect target".
    pub confounded_with: Vec<String>,
    /// What would distinguish them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distinguished_by: Option<String>,
    /// Its parameters. Of a confounded set: as if this member were all of it, without standard uncertainty.
    pub parameters: Vec<Estimated>,
    /// The keys of the rig that would declare it, and the values to put there: lines of TOML, one a key
    /// (`setups.1.part_deg = 100.184`). Nothing where the rig has no key for it, and for a confounded set, of which the data do
    /// not decide the member.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change: Option<String>,
    /// Residual without and with it.
    pub residual_rms_um: Step,
    /// The same for held-out data.
    pub held_out_rms_um: Step,
    /// The latter's value with it, expected from noise; null where the noise is not known.
    pub held_out_expected_rms_um: Option<f64>,
    /// Change of the Bayesian information criterion; evidence is below −10.
    pub delta_bic: f64,
    /// Chance of as much improvement by noise, corrected for the number of candidates.
    pub p_value: f64,
}

/// An estimated parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimated {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard uncertainty; nothing where the data do not give one: for a member of a confounded set, or where the
    /// noise is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// Their unit.
    pub unit: String,
}

impl Added {
    /// All that it may be: "effect target", of a confounded set "effect target or effect target".
    #[must_use]
    pub fn members(&self) -> String {
        let targets = self.targets.iter().map(String::as_str);
        let first = std::iter::once(self.effect.as_str()).chain(targets).collect::<Vec<_>>().join(" ");
        std::iter::once(&first).chain(&self.confounded_with).cloned().collect::<Vec<_>>().join(" or ")
    }

    /// All that it may be, in a sentence: of many members, the first ones.
    fn some_members(&self) -> String {
        let others = self.confounded_with.len();
        if others <= MOST_MEMBERS {
            return self.members();
        }
        let some = Self { confounded_with: self.confounded_with[..MOST_MEMBERS].to_vec(), ..self.clone() };
        format!("{} or {} others", some.members(), others - MOST_MEMBERS)
    }
}

/// A number with at most so many significant digits, as a file takes it.
#[must_use]
pub fn rounded(value: f64, digits: usize) -> f64 {
    // Through decimal text: a product with a power of ten would leave digits of its own.
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

/// Before and after.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Step {
    /// Without.
    pub before: Option<f64>,
    /// With.
    pub after: Option<f64>,
}

/// A value before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Moved {
    /// Its symbol or name.
    pub value: String,
    /// The section, where it has one.
    pub section: Option<String>,
    /// With the declared model.
    pub before: f64,
    /// With the final one.
    pub after: f64,
    /// Standard uncertainty of the latter; null where not known.
    pub std: Option<f64>,
    /// Their unit.
    pub unit: String,
    /// What it is counted from, where it has a reference: "LSCI".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// Its filter, where it has a reference: "none", "gaussian 50".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// Orders that it lacks after, since the layout cannot separate them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lost_orders: Vec<usize>,
}

/// Something that is left and that no known effect explains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unexplained {
    /// The station, where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub station: Option<String>,
    /// The sensor whose readings have it, where it is one.
    pub sensor: Option<String>,
    /// In which setup, where it is in one.
    pub setup: Option<String>,
    /// Lowest and highest order that it has.
    pub orders: [usize; 2],
    /// Its size; 0 of what a test of the data on themselves found.
    pub rms_um: f64,
    /// Where it is within the turn or in time.
    #[serde(rename = "where")]
    pub place: String,
}

impl From<&Check> for Unexplained {
    /// What a test of the data on themselves says against the model.
    fn from(check: &Check) -> Self {
        Self { station: None, sensor: None, setup: None, orders: [0, 0], rms_um: 0.0, place: check.finding.clone() }
    }
}

/// An effect that the data cannot show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Blind {
    /// Its id.
    pub effect: String,
    /// Where it would act.
    pub targets: Vec<String>,
    /// What one unit of it does to the results all the same.
    pub bias_per_unit: BiasPerUnit,
}

/// What one unit of a parameter does to a result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BiasPerUnit {
    /// Root mean square.
    pub value: f64,
    /// Of the result per that of the parameter.
    pub unit: String,
    /// Which result.
    pub on: String,
}

/// An effect that looked likely and was refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Refused {
    /// Its id.
    pub effect: String,
    /// Where it would act.
    pub targets: Vec<String>,
    /// Why.
    pub reason: String,
}

/// Orders that a layout cannot separate, by what they are of: "form" in any section, "motion", "lobing".
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LostOrders(pub BTreeMap<String, Vec<usize>>);

impl LostOrders {
    /// Of several quantities.
    #[must_use]
    pub fn of<const N: usize>(lost: [(&str, Vec<usize>); N]) -> Self {
        Self(lost.into_iter().map(|(quantity, orders)| (quantity.to_owned(), orders)).collect())
    }
}

/// Errors against a known truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Truth {
    /// Root mean square error of form, in µm, over all sections.
    pub form_rms_error_um: Step,
}
