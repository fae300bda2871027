//! What the tests of separators share: points of columns, and values by symbol.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests; the shares are printed")]

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use runout_core::{
    Result,
    pipeline::{Context, StageConfig},
    points::{Column, Labels, Points},
    stage::{Outcome, Separator},
    summary::Value,
};

pub(crate) struct Chance(ChaCha8Rng);

impl Chance {
    pub(crate) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}

/// Columns of numbers, and one of texts.
#[derive(Default, Clone)]
pub(crate) struct Rows {
    pub names: Vec<&'static str>,
    pub numbers: Vec<Vec<f64>>,
    pub label: &'static str,
    pub texts: Vec<String>,
}

impl Rows {
    pub(crate) fn new(label: &'static str, names: &[&'static str]) -> Self {
        Self { names: names.to_vec(), numbers: vec![Vec::new(); names.len()], label, texts: Vec::new() }
    }

    pub(crate) fn push(&mut self, text: &str, row: &[f64]) {
        assert_eq!(row.len(), self.names.len());
        self.numbers.iter_mut().zip(row).for_each(|(column, one)| column.push(*one));
        self.texts.push(text.to_owned());
    }

    pub(crate) fn points(&self) -> Points {
        let columns = self.names.iter().zip(&self.numbers);
        let labels = Labels { name: self.label.into(), values: self.texts.clone() };
        Points {
            columns: columns.map(|(name, values)| Column { name: (*name).into(), values: values.clone() }).collect(),
            labels: if self.label.is_empty() { Vec::new() } else { vec![labels] },
            ..Points::default()
        }
    }
}

pub(crate) fn separated<C: StageConfig<Stage = Separator>>(config: C, rows: &Rows) -> Result<Outcome> {
    let context = Context { folder: std::path::Path::new("."), rig: None };
    let Separator::Points(separator) = config.check(&context).unwrap() else { panic!("it takes points") };
    let outcome = separator.separate(&rows.points())?;
    // What the values are, was said before the run.
    for value in &outcome.values {
        assert!(separator.symbols().iter().any(|(symbol, _)| *symbol == value.symbol), "{}", value.symbol);
    }
    Ok(outcome)
}

pub(crate) fn value<'a>(outcome: &'a Outcome, symbol: &str, of: &str) -> &'a Value {
    let found = |value: &&Value| value.symbol == symbol && (of.is_empty() || value.of.as_deref() == Some(of));
    outcome.values.iter().find(found).unwrap_or_else(|| panic!("{symbol} of {of}"))
}

/// How often intervals cover the true value, by name.
#[derive(Default)]
pub(crate) struct Held(std::collections::BTreeMap<String, [usize; 2]>);

impl Held {
    pub(crate) fn take(&mut self, name: &str, value: &Value, truth: f64) {
        let [low, high] = value.interval_95().unwrap();
        let [held, all] = self.0.entry(name.to_owned()).or_default();
        *all += 1;
        *held += usize::from((low..=high).contains(&truth));
    }

    /// Prints each, and gives the share of all and the least one.
    pub(crate) fn shares(&self, what: &str) -> [f64; 2] {
        let share = |[held, all]: &[usize; 2]| *held as f64 / *all as f64;
        let each: Vec<String> =
            self.0.iter().map(|(name, one)| format!("{name} {:.0} %", 100.0 * share(one))).collect();
        println!("{what}: {}", each.join(", "));
        let sum = self.0.values().fold([0, 0], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
        [share(&sum), self.0.values().map(share).fold(f64::INFINITY, f64::min)]
    }
}
