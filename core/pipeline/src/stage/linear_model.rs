//! Domains whose model is linear: the loop, and the result of the declared model, by what they say of their observations.

use std::sync::Arc;

use super::{LinearModel, Outcome, PointDiagnosis, PointModel};
use crate::{
    effects::PointEffect,
    points::{Column, Points},
};
use runout_closed_loop::{
    Effect, Fit, Model, Settings, diagnose,
    linear_terms::{LinearFit, LinearTerms},
};
use runout_error::{Error, Result};
use runout_table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, numbers, texts};

impl<M: LinearModel> PointModel for M {
    fn effects(&self) -> Vec<Effect> {
        self.candidates()
    }

    fn linear(&self) -> Option<&dyn LinearModel> {
        Some(self)
    }

    fn diagnose(&self, points: &Points, settings: &Settings) -> Result<PointDiagnosis> {
        diagnose_linear(self, points, &[], settings)
    }
}

/// Runs the loop on a linear model and effects of a pipeline's own, which `settings` count behind those of the model.
///
/// # Errors
/// When the points do not hold what the model or an effect needs.
pub fn diagnose_linear(
    model: &dyn LinearModel,
    points: &Points,
    own: &[Arc<dyn PointEffect>],
    settings: &Settings,
) -> Result<PointDiagnosis> {
    let terms = own.iter().try_fold(model.terms(points)?, |terms, effect| with_effect(model, points, terms, &**effect));
    let terms = terms?.with_known(&settings.known).considering(settings.effects.as_deref());
    let closed = diagnose(&terms, settings)?;
    let mut after = model.outcome(points, &closed.after)?;
    after.checks.extend(closed.diagnosis.consistency.iter().cloned());
    after.tables.push(residual_rows(&terms, &closed.before, &closed.after)?);
    after.remarks.extend(hardly_tested(&closed.before));
    let mut diagnosis = closed.diagnosis;
    diagnosis.warnings.append(&mut after.remarks);
    Ok(PointDiagnosis { diagnosis, after: after.refuted() })
}

/// Share of the usual size of a parameter over which its effect on the observations is a difference.
const STEP: f64 = 1e-3;

/// Terms with an effect of a pipeline's own: what a step of each parameter does to what the model makes of the readings.
fn with_effect(
    model: &dyn LinearModel,
    points: &Points,
    terms: LinearTerms,
    own: &dyn PointEffect,
) -> Result<LinearTerms> {
    let effect = own.effect();
    let partials = own.partials(points)?;
    let moved = |step: f64, columns: &[Column]| {
        let mut moved = points.clone();
        for Column { name, values } in columns {
            let readings = moved.columns.iter_mut().find(|column| column.name == *name);
            let readings = readings.ok_or_else(|| Error::new("find the column", name, "the points have none"))?;
            readings.values.iter_mut().zip(values).for_each(|(reading, partial)| *reading += step * partial);
        }
        model.terms(&moved)
    };
    let steps = effect.parameters.iter().zip(&partials).map(|(parameter, columns)| {
        let step = STEP * parameter.tolerance;
        Ok((step, [moved(-0.5 * step, columns)?, moved(0.5 * step, columns)?]))
    });
    let steps = steps.collect::<Result<Vec<_>>>()?;
    terms.adding(effect, &steps)
}

/// Degrees of freedom below which readings hardly test what is said of them.
const FEW_FREEDOM: usize = 5;

/// Says that hardly anything tests a fit; nothing where something does.
fn hardly_tested(fit: &LinearFit) -> Option<String> {
    let dof = fit.remainder().dof;
    let degrees = if dof == 1 { "degree" } else { "degrees" };
    (dof < FEW_FREEDOM).then(|| {
        format!("{dof} {degrees} of freedom beside what is fitted hardly test it: a drift or an offset as large as the values would not be seen")
    })
}

/// The result of a linear model as it is declared, with the rows of [`residual_table`], which the separator's `tables` must declare.
///
/// # Errors
/// When the points do not hold what the model needs.
pub fn separate_declared(model: &dyn LinearModel, points: &Points) -> Result<Outcome> {
    let terms = model.terms(points)?;
    let fit = terms.fit(&[])?;
    let mut outcome = model.outcome(points, &fit)?;
    outcome.checks.extend(fit.consistency());
    outcome.tables.push(residual_rows(&terms, &fit, &fit)?);
    outcome.remarks.extend(hardly_tested(&fit));
    Ok(outcome.refuted())
}

/// The residual of a linear model, reading by reading.
#[must_use]
pub fn residual_table(unit: &str) -> TableSpec {
    let residual = |name: &str, of: &str| ColumnSpec::number(name, unit, format!("reading less {of}"));
    TableSpec::new(
        "residual",
        "residual of each reading",
        vec![
            ColumnSpec::count("reading", "", "number of the reading, from 0"),
            ColumnSpec::name("group", "what is held out together"),
            ColumnSpec::number("value", unit, "the reading"),
            residual("before", "the declared model"),
            residual("after", "the final model; that of a run is the declared one"),
        ],
    )
    .figure(Figure::lines("residual", "Residual", "reading", ["before", "after"].map(Measure::new)))
}

fn residual_rows(terms: &LinearTerms, before: &LinearFit, after: &LinearFit) -> Result<TableRows> {
    let observations = terms.observations();
    // Rows are in the order in which they were measured.
    let mut order: Vec<usize> = (0..observations.values.len()).collect();
    order.sort_unstable_by_key(|index| terms.places()[*index]);
    let column = |values: &[f64]| numbers(order.iter().map(|index| values[*index]));
    let groups = order.iter().map(|index| observations.group[*index]);
    let spec = residual_table(&observations.unit);
    let rows = spec.rows(vec![
        counts(0..order.len()),
        texts(groups.map(|group| observations.groups.get(group).map_or("", String::as_str))),
        column(&observations.values),
        column(&before.residual()),
        column(&after.residual()),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}
