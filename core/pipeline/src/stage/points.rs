//! Separation of measured points, of any domain: points in; tables, values and form out.

use super::{Evaluable, EvaluableKind, Form, plan::PointPlan};
use crate::{
    points::{PointColumn, Points},
    summary::Value,
};
use runout_closed_loop::{
    Effect, Settings,
    diagnosis::{Diagnosis, LostOrders},
    linear_terms::{LinearFit, LinearTerms},
};
use runout_consistency::{Check, refuted_by};
use runout_error::Result;
use runout_numerics::number::significant;
use runout_table::{TableRows, TableSpec};
use runout_turning::surface::Surface;

/// χ² per degree of freedom below which, and standard deviations of chance by which, a residual is far below its noise.
const FAR_BELOW: [f64; 2] = [0.5, 5.0];

/// Says that a residual is far below the noise that is stated or was found; nothing where it is not.
#[must_use]
pub fn far_below_noise(chi2_per_dof: f64, dof: usize) -> Option<String> {
    let [share, deviations] = FAR_BELOW;
    let chance = 1.0 - deviations * (2.0 / dof.max(1) as f64).sqrt();
    (dof > 0 && chi2_per_dof < share.min(chance)).then(|| {
        format!(
            "χ² per degree of freedom is {}, far below 1: the residual is {} times the noise. The noise is stated too \
             large, or noise or readings have another unit, or readings were smoothed or copied; standard uncertainties are not valid",
            significant(chi2_per_dof, 2),
            significant(chi2_per_dof.max(0.0).sqrt(), 2)
        )
    })
}

/// Separates measured points as a whole.
pub trait PointSeparator: Send + Sync {
    /// The columns that it needs of the points, and those that it can use.
    fn columns(&self) -> Vec<PointColumn>;

    /// The tables of its result, but for those that follow from form and for the values. A linear model declares [`residual_table`](super::residual_table) here.
    fn tables(&self) -> Vec<TableSpec>;

    /// What the points say.
    ///
    /// # Errors
    /// When they do not hold what the method needs.
    fn separate(&self, points: &Points) -> Result<Outcome>;

    /// What its outcomes may hold that the standards' values are computed from. What is not named here is no part of an outcome.
    fn evaluables(&self) -> Vec<EvaluableKind> {
        Vec::new()
    }

    /// Symbols of its own values, with their units: those that `[[limit]]` may name.
    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        Vec::new()
    }

    /// Whether its form is that of one section, which makes no surface.
    fn is_one_section(&self) -> bool {
        false
    }

    /// Whether areal values are computed where `[evaluate]` lists no values: a height map as it was measured has no others.
    fn is_for_areal_values(&self) -> bool {
        false
    }

    /// Whether [`remarks`](Self::remarks) needs the surface.
    fn needs_surface(&self) -> bool {
        false
    }

    /// What the user should know of the whole, once its surface is there.
    ///
    /// # Errors
    /// When the points do not hold what it needs.
    fn remarks(&self, _points: &Points, _surface: Option<&Surface>) -> Result<Vec<String>> {
        Ok(Vec::new())
    }

    /// What holds whatever the points are: what the method cannot observe.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Orders that its configuration does not separate; nothing where it has no orders.
    fn lost_orders(&self) -> Option<LostOrders> {
        None
    }

    /// What is observable with the layout and how well, and what to add to it: of the points where they are there, else
    /// as the configuration has it. Nothing where there is nothing to plan.
    ///
    /// # Errors
    /// When the points do not hold what the method needs.
    fn plan(&self, _points: Option<&Points>) -> Result<Option<PointPlan>> {
        Ok(None)
    }

    /// Its model for the closed loop, where it has one.
    fn model(&self) -> Option<&dyn PointModel> {
        None
    }
}

/// A model of measured points for the closed loop.
pub trait PointModel: Send + Sync {
    /// What it may lack; where only the points name the targets, without targets.
    fn effects(&self) -> Vec<Effect>;

    /// Whether only the points name the targets of its effects: traces, setups.
    fn points_name_targets(&self) -> bool {
        false
    }

    /// What it may lack with these points, at each target.
    ///
    /// # Errors
    /// When the points do not hold what the model needs.
    fn effects_of(&self, _points: &Points) -> Result<Vec<Effect>> {
        Ok(self.effects())
    }

    /// The linear model that it is, where it is one: effects of a pipeline's own can be added to it.
    fn linear(&self) -> Option<&dyn LinearModel> {
        None
    }

    /// Runs the loop; `settings` count effects as [`effects_of`](Self::effects_of) does.
    ///
    /// # Errors
    /// When the points do not hold what the model needs.
    fn diagnose(&self, points: &Points, settings: &Settings) -> Result<PointDiagnosis>;
}

/// What the closed loop found, with the result of the final model.
#[derive(Debug, Clone, PartialEq)]
pub struct PointDiagnosis {
    /// What was found.
    pub diagnosis: Diagnosis,
    /// The result with the effects added.
    pub after: Outcome,
}

/// What a separator makes of points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// Signs and references of its numbers. With closed profiles, exporters write the convention of form instead.
    pub convention: String,
    /// Rows of its tables.
    pub tables: Vec<TableRows>,
    /// Values.
    pub values: Vec<Value>,
    /// The tests of the points on themselves.
    pub checks: Vec<Check>,
    /// What the standards' values are computed from.
    pub evaluables: Vec<Evaluable>,
    /// Orders that the points do not separate; nothing where the domain has no orders.
    pub lost_orders: Option<LostOrders>,
    /// What the user should know, as something may be wrong.
    pub remarks: Vec<String>,
    /// What the user should know of the result that is as it should be: where its noise is from, what it contains.
    pub notes: Vec<String>,
}

impl Outcome {
    /// Its closed profiles, where it has some.
    #[must_use]
    pub fn form(&self) -> Option<&Form> {
        self.evaluables.iter().find_map(|one| match one {
            Evaluable::ClosedProfiles(form) => Some(form),
            _ => None,
        })
    }

    /// Adds tests of the readings themselves, whatever the method is: a finding refutes all values.
    #[must_use]
    pub(crate) fn tested(mut self, checks: Vec<Check>) -> Self {
        if let Some(refuted) = refuted_by(&checks) {
            self.values.iter_mut().for_each(|value| value.refuted_by = Some(refuted.clone()));
        }
        self.checks.extend(checks);
        self
    }

    /// Marks the values that its own checks refute: of a check of one part, the values of this part, by what they are of or by their symbol;
    /// of a check of the whole, or where no value names the part, all.
    #[must_use]
    pub fn refuted(mut self) -> Self {
        let names = |part: &str, name: &str| {
            part.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with([' ', '/']))
        };
        let is_of = |check: &Check, value: &Value| {
            names(&check.part, &value.symbol) || value.of.as_deref().is_some_and(|of| names(&check.part, of))
        };
        let of_all: Vec<bool> =
            self.checks.iter().map(|check| !self.values.iter().any(|value| is_of(check, value))).collect();
        for value in &mut self.values {
            let own = self.checks.iter().zip(&of_all).filter(|(check, of_all)| **of_all || is_of(check, value));
            let own: Vec<Check> = own.map(|(check, _)| check.clone()).collect();
            value.refuted_by = refuted_by(&own).or_else(|| value.refuted_by.take());
        }
        self
    }
}

/// A domain whose declared model and effects are linear in their parameters.
pub trait LinearModel: Send + Sync {
    /// What it may lack, in the order of the terms; what is usual of a parameter may depend on the points.
    fn candidates(&self) -> Vec<Effect>;

    /// What is declared of these points, and the effects that this may lack.
    ///
    /// # Errors
    /// When the points do not hold what the model needs.
    fn terms(&self, points: &Points) -> Result<LinearTerms>;

    /// What a fit says.
    ///
    /// # Errors
    /// When the points do not hold what it needs.
    fn outcome(&self, points: &Points, fit: &LinearFit) -> Result<Outcome>;
}
