//! The tables of values, and of the effects that a result is corrected for.

use serde_json::json;

use crate::summary::Summary;
use runout_closed_loop::correction::Correction;
use runout_consistency::Check;
use runout_draws::Uncertainty;
use runout_error::Result;
use runout_evaluate::Value;
use runout_table::{
    ArrayRef, ColumnSpec, TableRows, TableSpec, counts, counts_or_null, flags, numbers, numbers_or_null, texts,
    texts_or_null,
};

/// The table of values, and that of a domain's own values beside it.
const VALUES: &str = "values";
const NAMED_VALUES: &str = "named_values";

/// Whether the table of this name holds values.
pub(in crate::pipeline) fn holds_values(table: &str) -> bool {
    [VALUES, NAMED_VALUES].contains(&table)
}

/// The table of values that are computed from form and motion.
pub(super) fn values() -> TableSpec {
    let uncertain = |name: &str, about: &str| {
        ColumnSpec::number(name, "the value's", format!("{about}; null where it is not known")).or_null()
    };
    let order = |name: &str, about: &str| ColumnSpec::count(name, "1/rev", about);
    TableSpec::new(
        VALUES,
        "the standards' values of sections, stations and the whole part",
        vec![
            ColumnSpec::name("station", "name of the axial station; null for the whole part").or_null(),
            ColumnSpec::name("section", "id of the section; null for a station or the whole part").or_null(),
            ColumnSpec::number("z_mm", "mm", "place of the section along the axis; null where there is none").or_null(),
            ColumnSpec::text("symbol", "the standard's symbol"),
            ColumnSpec::number("value", "the column unit", "the number"),
            ColumnSpec::text("unit", "its unit; empty for a number without one"),
            ColumnSpec::text("standard", "standard and clause, or paper and equation"),
            order("band_low_upr", "lowest order that it was computed over"),
            order("band_high_upr", "highest order that it was computed over; of a filter, where half passes"),
            ColumnSpec::text(
                "lost_orders",
                "orders of it that are lost and that are not in the value, as JSON; null where none is",
            )
            .or_null(),
            ColumnSpec::number(
                "weakened_above_upr",
                "1/rev",
                "a filter before the average passes less than half above, where the value's filter asks for more; null \
                 where nothing is missing",
            )
            .or_null(),
            order(
                "absent_above_upr",
                "highest order there is, where the value's filter passes 0.1 % or more above it; null where nothing is \
                 missing",
            )
            .or_null(),
            ColumnSpec::text("filter", "the filter applied"),
            ColumnSpec::text("reference", "what the profile was referred to"),
            ColumnSpec::number("coverage", "", "share of the profile or surface that was there"),
            uncertain("std", "standard uncertainty"),
            uncertain("low_95", "lower end of the 95 % interval"),
            uncertain("high_95", "upper end of the 95 % interval"),
            ColumnSpec::text(
                "interval",
                "what the interval contains: coverage, the true value; prediction, the value of another capture; null without one",
            )
            .or_null(),
            ColumnSpec::count("draws", "", "draws of the Monte Carlo; null without uncertainty").or_null(),
            ColumnSpec::text(
                "no_uncertainty",
                "why no uncertainty is stated; null where one is, or where the errors are not known",
            )
            .or_null(),
            uncertain("raised_by_noise", "by how much noise has raised it, where that is more than std"),
            refuted(),
        ],
    )
}

pub(super) fn values_rows(summary: &Summary) -> Vec<ArrayRef> {
    let rows = summary.placed_values();
    let uncertainty =
        |of: fn(&Uncertainty) -> f64| numbers_or_null(rows.iter().map(|row| row.value.uncertainty.as_ref().map(of)));
    let of_value = |of: fn(&Value) -> &str| texts(rows.iter().map(|row| of(row.value)));
    vec![
        texts_or_null(rows.iter().map(|row| row.station)),
        texts_or_null(rows.iter().map(|row| row.section)),
        numbers_or_null(rows.iter().map(|row| row.z_mm)),
        of_value(|value| &value.symbol),
        numbers(rows.iter().map(|row| row.value.value)),
        of_value(|value| &value.unit),
        of_value(|value| &value.source),
        counts(rows.iter().map(|row| row.value.band_upr[0])),
        counts(rows.iter().map(|row| row.value.band_upr[1])),
        texts_or_null(rows.iter().map(|row| {
            let lost = &row.value.lost_orders;
            (!lost.is_empty()).then(|| json!(lost).to_string())
        })),
        numbers_or_null(rows.iter().map(|row| row.value.weakened_above_upr)),
        counts_or_null(rows.iter().map(|row| row.value.absent_above_upr)),
        of_value(|value| value.filter.as_deref().unwrap_or_default()),
        of_value(|value| value.reference.as_deref().unwrap_or_default()),
        numbers(rows.iter().map(|row| row.value.coverage)),
        uncertainty(|uncertainty| uncertainty.std),
        uncertainty(|uncertainty| uncertainty.interval_95[0]),
        uncertainty(|uncertainty| uncertainty.interval_95[1]),
        texts_or_null(rows.iter().map(|row| row.value.uncertainty.as_ref().map(|uncertainty| uncertainty.kind.name()))),
        counts_or_null(rows.iter().map(|row| row.value.uncertainty.as_ref().map(|uncertainty| uncertainty.draws))),
        texts_or_null(rows.iter().map(|row| row.value.no_uncertainty.as_deref())),
        numbers_or_null(rows.iter().map(|row| row.value.raised_by_noise)),
        texts_or_null(rows.iter().map(|row| row.value.refuted_by.as_deref())),
    ]
}

/// The table of a domain's own values; `of_form` where the result has form, whose values are in the table `values`.
#[must_use]
pub(crate) fn named_values(of_form: bool) -> TableSpec {
    let interval = |name: &str, about: &str| {
        ColumnSpec::number(name, "the column unit", format!("{about}; null where it is not known")).or_null()
    };
    TableSpec::new(
        // Beside those that are computed from form.
        if of_form { NAMED_VALUES } else { VALUES },
        "values of the result",
        vec![
            ColumnSpec::text("symbol", "the standard's symbol, or a short name"),
            ColumnSpec::name("of", "what it is of; null where the result has one only").or_null(),
            ColumnSpec::number("value", "the column unit", "the number; null where it is not observable").or_null(),
            ColumnSpec::number("std", "the column unit", "its standard uncertainty; null where it is not known")
                .or_null(),
            ColumnSpec::text("unit", "its unit; empty for a number without one"),
            ColumnSpec::text("about", "what it is, with standard and clause"),
            interval("low_95", "lower end of the 95 % interval"),
            interval("high_95", "upper end of the 95 % interval"),
            ColumnSpec::text("reference", "what it was referred to; null but for a standard's value").or_null(),
            ColumnSpec::text("filter", "the filter applied; null but for a standard's value").or_null(),
            ColumnSpec::text("no_uncertainty", "why no uncertainty is stated of a standard's value; null otherwise")
                .or_null(),
            refuted(),
        ],
    )
}

/// Rows of [`named_values`].
///
/// # Errors
/// Never in practice: the columns are of one length.
pub(crate) fn named_value_rows(values: &[Value], of_form: bool) -> Result<TableRows> {
    let spec = named_values(of_form);
    let rows = spec.rows(vec![
        texts(values.iter().map(|value| &value.symbol)),
        texts_or_null(values.iter().map(|value| value.of.as_ref())),
        numbers_or_null(values.iter().map(Value::number)),
        numbers_or_null(values.iter().map(Value::std)),
        texts(values.iter().map(|value| &value.unit)),
        texts(values.iter().map(|value| &value.source)),
        numbers_or_null(values.iter().map(|value| value.interval_95().map(|[low, _]| low))),
        numbers_or_null(values.iter().map(|value| value.interval_95().map(|[_, high]| high))),
        texts_or_null(values.iter().map(|value| value.reference.as_ref())),
        texts_or_null(values.iter().map(|value| value.filter.as_ref())),
        texts_or_null(values.iter().map(|value| value.no_uncertainty.as_ref())),
        texts_or_null(values.iter().map(|value| value.refuted_by.as_ref())),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}

fn refuted() -> ColumnSpec {
    ColumnSpec::text("refuted_by", "what of its own data refutes it; null where nothing does").or_null()
}

/// The table of the tests of the data on themselves.
#[must_use]
pub(crate) fn consistency() -> TableSpec {
    TableSpec::new(
        "consistency",
        "tests of the data on themselves",
        vec![
            ColumnSpec::name("test", "which test"),
            ColumnSpec::name("part", "part of the data that it is of, as a station; empty for the whole"),
            ColumnSpec::text("of", "what was tested: a value, an effect, an order, a block"),
            ColumnSpec::number(
                "statistic",
                "",
                "the test's statistic: a ratio of variances where nothing else is said",
            ),
            ColumnSpec::number("dof", "", "its degrees of freedom").or_null(),
            ColumnSpec::number("dof_below", "", "those of what it is compared with; null where that is known")
                .or_null(),
            ColumnSpec::number("p", "", "chance of such a statistic on sound data"),
            ColumnSpec::number("factor", "", "factor on the standard uncertainties concerned"),
            ColumnSpec::text("finding", "what it found; empty where nothing"),
            ColumnSpec::name("did", "what was done: nothing, widened, refused, named, verdict"),
        ],
    )
    .optional()
}

/// Rows of [`consistency`]; none where nothing was tested.
///
/// # Errors
/// Never in practice: the columns are of one length.
pub(crate) fn consistency_rows(checks: &[Check]) -> Result<Option<TableRows>> {
    if checks.is_empty() {
        return Ok(None);
    }
    let spec = consistency();
    let rows = spec.rows(vec![
        texts(checks.iter().map(|check| check.test.name())),
        texts(checks.iter().map(|check| &check.part)),
        texts(checks.iter().map(|check| &check.of)),
        numbers(checks.iter().map(|check| check.statistic)),
        numbers_or_null(checks.iter().map(|check| check.dof.first().copied())),
        numbers_or_null(checks.iter().map(|check| check.dof.get(1).copied())),
        numbers(checks.iter().map(|check| check.p)),
        numbers(checks.iter().map(|check| check.factor)),
        texts(checks.iter().map(|check| &check.finding)),
        texts(checks.iter().map(|check| check.did.name())),
    ])?;
    Ok(Some(TableRows { table: spec.name, rows }))
}

/// The table of the effects that a result is corrected for.
#[must_use]
pub(crate) fn corrections() -> TableSpec {
    TableSpec::new(
        "corrections",
        "effects that the results are corrected for, one row a parameter",
        vec![
            ColumnSpec::text("effect", "id of the effect"),
            ColumnSpec::text("targets", "where it acts; of a confounded set, one representative"),
            ColumnSpec::text("confounded_with", "what these data cannot separate it from; empty for nothing"),
            ColumnSpec::flag("known", "whether it was declared with its size"),
            ColumnSpec::text("parameter", "name of the parameter"),
            ColumnSpec::number("value", "the column unit", "its value"),
            ColumnSpec::number("std", "the column unit", "its standard uncertainty; null where it is not known")
                .or_null(),
            ColumnSpec::text("unit", "unit of the parameter"),
        ],
    )
    .optional()
}

/// Rows of [`corrections`]; none where results are corrected for nothing.
///
/// # Errors
/// Never in practice: the columns are of one length.
pub(crate) fn correction_rows(effects: &[Correction]) -> Result<Option<TableRows>> {
    if effects.is_empty() {
        return Ok(None);
    }
    let each = || effects.iter().flat_map(|one| one.parameters.iter().map(move |parameter| (one, parameter)));
    let spec = corrections();
    let rows = spec.rows(vec![
        texts(each().map(|(one, _)| &one.effect)),
        texts(each().map(|(one, _)| one.targets.join(" "))),
        texts(each().map(|(one, _)| one.confounded_with.join("; "))),
        flags(each().map(|(one, _)| one.known)),
        texts(each().map(|(_, parameter)| &parameter.name)),
        numbers(each().map(|(_, parameter)| parameter.value)),
        numbers_or_null(each().map(|(_, parameter)| parameter.std)),
        texts(each().map(|(_, parameter)| &parameter.unit)),
    ])?;
    Ok(Some(TableRows { table: spec.name, rows }))
}
