//! What a closed loop found, for people and programs.

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
    /// Values that people look at, before and after.
    pub moved: Vec<Moved>,
    /// What no known effect explains.
    pub unexplained: Vec<Unexplained>,
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
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A diagnosis in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The declared model leaves noise only.
    AtNoiseFloor,
    /// With the effects added, noise only is left.
    Explained,
    /// Something is left that no known effect explains.
    Unexplained,
}

/// How far a model is from its data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Level {
    /// Root mean square of what the fit leaves.
    pub residual_rms_um: f64,
    /// What the noise lets expect of it; null where it is not known.
    pub noise_floor_um: Option<f64>,
    /// Weighted sum of squares per degree of freedom; null where the noise is not known.
    pub chi2_per_dof: Option<f64>,
    /// Root mean square of what it leaves of data that it has not seen.
    pub held_out_rms_um: Option<f64>,
    /// The data's unit, where it is not µm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

/// An effect that was added.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Added {
    /// Its id.
    pub effect: String,
    /// Where it acts; of a confounded set, one representative.
    pub targets: Vec<String>,
    /// What these data cannot tell it from: "effect target".
    pub confounded_with: Vec<String>,
    /// What would tell them apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub told_apart_by: Option<String>,
    /// Its parameters. Of a confounded set: as if this member were all of it.
    pub parameters: Vec<Estimated>,
    /// Residual without and with it.
    pub residual_rms_um: Step,
    /// The same for data left out of the fit.
    pub held_out_rms_um: Step,
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
    /// Its standard uncertainty.
    pub std: f64,
    /// Their unit.
    pub unit: String,
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
}

/// Something that is left and that no known effect explains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unexplained {
    /// Whose readings hold it, where it is one sensor's.
    pub sensor: Option<String>,
    /// In which setup, where it is in one.
    pub setup: Option<String>,
    /// Lowest and highest order that it has.
    pub orders: [usize; 2],
    /// Its size.
    pub rms_um: f64,
    /// Where it is within the turn or in time.
    #[serde(rename = "where")]
    pub place: String,
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

/// Orders that a layout cannot separate.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LostOrders {
    /// Of form, in any section.
    pub form: Vec<usize>,
    /// Of motion.
    pub motion: Vec<usize>,
}

/// Errors against a known truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Truth {
    /// Root mean square error of form, in µm, over all sections.
    pub form_rms_error_um: Step,
}
