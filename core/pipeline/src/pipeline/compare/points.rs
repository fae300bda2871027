//! Several separators on the same measured points: values side by side, and columns of tables that both have.
//!
//! E_n = |a − b| / (2·√(u_a² + u_b²)) (ISO 13528:2022, 9.7, with expanded uncertainties of k = 2). The methods share readings: the
//! difference scatters less than independent results would, and scatter alone keeps E_n below 1 all the more.

use runout_consistency::refuted_by;
use runout_error::fault::Fault;
use runout_evaluate::Evaluated;
use std::{collections::BTreeSet, path::PathBuf};

use super::{
    Comparison, MethodSummary, Refusal,
    methods::{self, distinct_names},
    report::{ColumnComparison, ColumnDifference, ValueComparison, ValueDifference, ValueOf},
};
use crate::{
    pipeline::{
        Pipeline, Registry,
        config::{Route, exports::spare_inputs},
        document::{Document, Sources},
        registry::Context,
        warnings::of_station,
    },
    points::PointColumn,
    stage::{Outcome, PointSeparator, Request, Source},
    summary::{LostOrders, Value},
};
use runout_error::{Error, Result};
use runout_table::{Array, Float64Array, TableRows};
use runout_turning::provenance::{Provenance, VERSION};

/// A separator of points that takes the pipeline's.
pub struct PointMethod {
    /// Its plugin's name, with a number where there are several.
    pub name: String,
    separator: Box<dyn PointSeparator>,
}

/// A pipeline of measured points with the separators that it is to compare.
pub struct ComparingPoints<'a> {
    pipeline: &'a Pipeline,
    reference: &'a dyn PointSeparator,
    /// What is compared with the pipeline's own separator.
    pub methods: Vec<PointMethod>,
    /// Separators that cannot take these points.
    pub refused: Vec<Refusal>,
    names: Vec<String>,
}

impl<'a> ComparingPoints<'a> {
    /// Chooses the separators: those of `with`, else those of all `[[compare]]` tables, else every other one that takes these
    /// columns. A key of `[separate]` that a separator knows, and that its own table does not have, is its own.
    ///
    /// # Errors
    /// When a key is wrong, or nothing is left to compare with.
    pub fn new(
        pipeline: &'a Pipeline,
        with: &[String],
        registry: &Registry,
        sources: &Sources,
    ) -> std::result::Result<Self, Fault> {
        let Route::Points { separator, .. } = &pipeline.route else {
            return Err(Fault::at("load", "[load] gives recorded turns, not measured points"));
        };
        let document = Document::parse(sources).map_err(|error| Fault::here(error.to_string()))?;
        let context = Context { folder: sources.folder(), rig: None };
        let candidates = methods::choose_points(document.root(), with, &pipeline.separator, registry, &context)?;
        let taken: BTreeSet<&str> = separator.columns().iter().map(|column| column.name).collect();
        let mut refused = Vec::new();
        let mut methods = Vec::new();
        for candidate in candidates {
            let named = candidate.named;
            match candidate.separator {
                Ok(separator) => {
                    let lacks: Vec<&str> = separator
                        .columns()
                        .iter()
                        .filter(|column| !column.optional && !taken.contains(column.name))
                        .map(|column| column.name)
                        .collect();
                    if lacks.is_empty() || named {
                        methods.push(PointMethod { name: candidate.name, separator });
                    }
                }
                Err(refusal) => refused.push(refusal),
            }
        }
        if methods.is_empty() {
            let reasons: Vec<String> =
                refused.iter().map(|refusal| format!("{}: {}", refusal.method, refusal.reason)).collect();
            let fault = Fault::at("separate", "no other separator takes these points: there is nothing to compare");
            let help = "name one with --with, or give its keys in a table [[compare]]";
            return Err(fault.help(if reasons.is_empty() { help.to_owned() } else { reasons.join("; ") }));
        }
        let names = distinct_names(&pipeline.separator, methods.iter_mut().map(|method| &mut method.name));
        Ok(Self { pipeline, reference: &**separator, methods, refused, names })
    }

    /// Separates the points with every method. A method that fails on them is refused, unless it is the pipeline's own.
    ///
    /// # Errors
    /// When the data fail, or an output is what is read.
    pub fn run(&self, outputs: Vec<PathBuf>) -> Result<Comparison> {
        let pipeline = self.pipeline;
        let columns = self.columns();
        let Source::Points(points) = pipeline.loader.open(&Request { rig: None, columns: &columns })? else {
            return Err(Error::new("compare", &pipeline.title, "the loader gave what it did not declare"));
        };
        spare_inputs(&outputs, std::slice::from_ref(&points.input))?;
        let separate = |separator: &dyn PointSeparator| {
            let mut outcome = separator.separate(&points)?;
            let evaluated =
                Evaluated::of(&outcome.evaluables, &pipeline.evaluate, refuted_by(&outcome.checks).as_deref())?;
            outcome.values = evaluated.values.into_iter().chain(outcome.values).collect();
            Ok::<Outcome, Error>(outcome)
        };
        let mut outcomes = vec![(self.names[0].clone(), self.reference, separate(self.reference)?)];
        let mut refused = self.refused.clone();
        for (name, method) in self.names[1..].iter().zip(&self.methods) {
            match separate(&*method.separator) {
                Ok(outcome) => outcomes.push((name.clone(), &*method.separator, outcome)),
                Err(error) => refused.push(Refusal {
                    method: name.clone(),
                    reason: error.to_string(),
                    help: error.advice().map(str::to_owned),
                    unfit: false,
                }),
            }
        }
        let methods = outcomes.iter().map(|(name, separator, outcome)| MethodSummary {
            method: name.clone(),
            unused: Vec::new(),
            lost_orders: LostOrders::default(),
            notes: separator.notes().iter().chain(&outcome.notes).cloned().collect(),
        });
        let of_methods = outcomes.iter().flat_map(|(name, _, outcome)| of_station(name, &outcome.remarks));
        let warnings = points.remarks.iter().cloned().chain(of_methods).collect();
        let of: Vec<(&str, &Outcome)> = outcomes.iter().map(|(name, _, outcome)| (name.as_str(), outcome)).collect();
        Ok(Comparison {
            title: pipeline.title.clone(),
            provenance: Provenance {
                program: format!("runout {VERSION}"),
                configuration: pipeline.configuration.clone(),
                inputs: points.provenance()?,
            },
            reference: pipeline.separator.clone(),
            methods: methods.collect(),
            refused,
            stations: Vec::new(),
            values: values(&of),
            columns: self::columns(&of),
            outputs,
            warnings,
        })
    }

    /// The columns that any method takes; needed where one of them needs it.
    fn columns(&self) -> Vec<PointColumn> {
        let mut all: Vec<PointColumn> = self.reference.columns();
        for column in self.methods.iter().flat_map(|method| method.separator.columns()) {
            match all.iter_mut().find(|known| known.name == column.name) {
                Some(known) => known.optional &= column.optional,
                None => all.push(column),
            }
        }
        all
    }
}

/// Difference over 2·√(u_a² + u_b²).
fn normalised(difference: f64, stds: [Option<f64>; 2]) -> Option<f64> {
    let [Some(one), Some(other)] = stds else { return None };
    let expected = one.hypot(other);
    (expected > 0.0).then(|| difference.abs() / (2.0 * expected))
}

/// Every value that any method gives, in the order of the first that gives it.
fn values(outcomes: &[(&str, &Outcome)]) -> Vec<ValueComparison> {
    let same = |one: &Value, other: &Value| one.id() == other.id();
    let mut kinds: Vec<&Value> = Vec::new();
    for value in outcomes.iter().flat_map(|(_, outcome)| &outcome.values) {
        if !kinds.iter().any(|known| same(known, value)) {
            kinds.push(value);
        }
    }
    let compared = |kind: &Value| {
        let by = |outcome: &Outcome| {
            outcome.values.iter().find(|value| same(value, kind) && value.unit == kind.unit).cloned()
        };
        let all: Vec<(&str, Value)> =
            outcomes.iter().filter_map(|(name, outcome)| Some((*name, by(outcome)?))).collect();
        let reference = outcomes.first().and_then(|(_, outcome)| by(outcome));
        let differences = reference.iter().flat_map(|reference| {
            all.iter().skip(1).filter_map(|(method, value)| {
                let difference = value.number()? - reference.number()?;
                let ratio = value.std().zip(reference.std()).filter(|(_, own)| *own > 0.0);
                Some(ValueDifference {
                    method: (*method).to_owned(),
                    difference,
                    e_n: normalised(difference, [value.std(), reference.std()]),
                    std_ratio: ratio.map(|(std, own)| std / own),
                })
            })
        });
        ValueComparison {
            symbol: kind.symbol.clone(),
            of: kind.of.clone(),
            unit: kind.unit.clone(),
            about: kind.source.clone(),
            reference: kind.reference.clone(),
            filter: kind.filter.clone(),
            differences: differences.collect(),
            values: all
                .iter()
                .map(|(method, value)| ValueOf {
                    method: (*method).to_owned(),
                    value: value.number(),
                    std: value.std(),
                })
                .collect(),
        }
    };
    kinds.into_iter().map(compared).collect()
}

/// Columns with standard uncertainties that both have, where the other cells of a table are the same.
fn columns(outcomes: &[(&str, &Outcome)]) -> Vec<ColumnComparison> {
    let Some(((_, reference), others)) = outcomes.split_first() else { return Vec::new() };
    let mut found = Vec::new();
    for table in &reference.tables {
        for name in with_std(table) {
            let differences: Vec<ColumnDifference> = others
                .iter()
                .filter_map(|(method, outcome)| {
                    let other = outcome.tables.iter().find(|other| other.table == table.table)?;
                    column(method, table, other, &name)
                })
                .collect();
            if !differences.is_empty() {
                found.push(ColumnComparison { table: table.table.clone(), column: name, differences });
            }
        }
    }
    found
}

/// Columns of which there is a standard uncertainty.
fn with_std(table: &TableRows) -> Vec<String> {
    let names: Vec<&String> = table.rows.schema_ref().fields().iter().map(|field| field.name()).collect();
    names.iter().filter(|name| names.contains(&&format!("std_{name}"))).map(|name| (*name).clone()).collect()
}

fn numbers(table: &TableRows, name: &str) -> Option<Vec<f64>> {
    let array = table.rows.column_by_name(name)?.as_any().downcast_ref::<Float64Array>()?.clone();
    Some((0..array.len()).map(|row| if array.is_null(row) { f64::NAN } else { array.value(row) }).collect())
}

/// A column of two tables whose rows are of the same.
fn column(method: &str, table: &TableRows, other: &TableRows, name: &str) -> Option<ColumnDifference> {
    let results = with_std(table);
    let is_key = |column: &str| {
        let base = column.strip_prefix("std_").unwrap_or(column);
        !results.iter().any(|result| result == base)
    };
    // Rows are of the same where what leads to the first result is the same.
    let fields = table.rows.schema_ref().fields();
    let keys = fields.iter().map(|field| field.name().as_str()).take_while(|column| is_key(column));
    for key in keys {
        if table.rows.column_by_name(key)?.to_data() != other.rows.column_by_name(key)?.to_data() {
            return None;
        }
    }
    let std = format!("std_{name}");
    let [own, own_std, others, others_std] =
        [(table, name), (table, &*std), (other, name), (other, &*std)].map(|(table, name)| numbers(table, name));
    let (own, own_std, others, others_std) = (own?, own_std?, others?, others_std?);
    let (mut squares, mut count, mut all) = (0.0, 0, Vec::new());
    let (mut ratios, mut largest) = ([0.0; 2], 0.0_f64);
    for row in 0..own.len().min(others.len()) {
        let difference = others[row] - own[row];
        if !difference.is_finite() {
            continue;
        }
        (squares, count, largest) = (squares + difference * difference, count + 1, largest.max(difference.abs()));
        let known = |std: f64| std.is_finite().then_some(std);
        if let Some(e_n) = normalised(difference, [known(others_std[row]), known(own_std[row])]) {
            all.push(e_n);
            ratios = [ratios[0] + others_std[row].powi(2), ratios[1] + own_std[row].powi(2)];
        }
    }
    let within = all.iter().filter(|e_n| **e_n <= 1.0).count();
    (count > 0).then(|| ColumnDifference {
        method: method.to_owned(),
        rows: count,
        rms: (squares / count as f64).sqrt(),
        largest,
        std_ratio: (ratios[1] > 0.0).then(|| (ratios[0] / ratios[1]).sqrt()),
        share_within: (!all.is_empty()).then(|| within as f64 / all.len() as f64),
        worst_e_n: all.iter().copied().max_by(f64::total_cmp),
    })
}
