//! `[evaluate]` and `[[limit]]`: what is computed of a result, by the standards and by evaluators, and what of it is limited.

use runout_error::fault::Fault;
use runout_evaluate::{Evaluate, EvaluateConfig};
use runout_turning::{rig::Rig, separation::Assessment};

use super::Route;
use crate::{
    pipeline::document::{self, Table, checked, table, tables},
    stage::{Evaluator, PointSeparator},
    summary::Limit,
};

/// What is evaluated of a result, and the limits of it.
pub(super) fn evaluate(
    root: &Table,
    route: &Route,
    rig: Option<&Rig>,
    assessment: Option<&Assessment>,
    evaluators: &[Box<dyn Evaluator>],
) -> Result<Evaluate, Fault> {
    let configured = table(root, "evaluate")?;
    let limits = tables(root, "limit")?;
    let given = route.evaluables();
    let mut own = route.point_separator().map(PointSeparator::symbols).unwrap_or_default();
    let limited = limits.first().filter(|_| own.is_empty() && evaluators.is_empty());
    if let (true, Some(table)) = (given.is_empty(), configured.as_ref().or(limited)) {
        let fault = Fault::span(
            table.span(),
            "there is no form here, nor another profile, height map or motion of an axis, whose values could be chosen or limited",
        );
        return Err(fault.help("leave it out; the values are those of the separator"));
    }
    let measures = rig.filter(|_| matches!(route, Route::Turns { .. }));
    let mut lists_values = false;
    let check = |config: EvaluateConfig| {
        lists_values = config.values.is_some();
        // Sections of measured points are those of their files.
        measures.map_or(Ok(()), |rig| config.check_datum(rig))?;
        config.check_given(&given)?;
        config.check()
    };
    let configured = configured.map(|table| checked::<EvaluateConfig, _>(&table, check)).transpose()?;
    let mut evaluate = configured.unwrap_or_default();
    if !lists_values && route.point_separator().is_some_and(PointSeparator::is_for_areal_values) {
        evaluate.add_areal();
    }
    if !lists_values && assessment.is_some_and(Assessment::has_no_observable_form) {
        evaluate.add_run_out();
    }
    evaluate.keep_given(&given);
    if let Some(rig) = measures {
        evaluate.add_faces(rig);
    }
    let standard = evaluate.known_values();
    for (evaluator, table) in evaluators.iter().zip(tables(root, "evaluator")?) {
        let symbols = evaluator.symbols();
        let is_known = |symbol: &str| {
            own.iter().any(|(known, _)| *known == symbol) || standard.iter().any(|known| known.symbol == symbol)
        };
        if let Some((symbol, _)) = symbols.iter().find(|(symbol, _)| is_known(symbol)) {
            let fault = Fault::here(format!("the value `{symbol}` is computed already")).help("give it another symbol");
            return Err(document::resolve(fault, &table));
        }
        own.extend(symbols);
    }
    for table in limits {
        let limit = checked::<Limit, _>(&table, |limit| {
            limit.orders.into_iter().for_each(|orders| evaluate.add_amplitudes(orders));
            limit.check(&evaluate, &own, rig)
        })?;
        evaluate.add_limit(limit);
    }
    Ok(evaluate)
}
