//! An effect: the orders and the values of its parameters out, reading over displacement of a channel in.

use std::sync::{Arc, OnceLock};

use runout_core::{
    Complex64, Error, Result,
    closed_loop::Parameter,
    effects::EffectEntry,
    fault::Fault,
    pipeline::{Context, StageConfig},
    table::{ColumnSpec, TableSpec, counts},
};
use runout_spindle::effects::{ChannelEffect, ChannelTransfer, entry};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::{
    answer::Answer,
    config::with_program,
    frame::Frame,
    point_effect::of_points,
    session::Session,
    tables::{Table, encode},
    values::lasting,
};

const COLUMNS: [&str; 3] = ["order", "re", "im"];
/// How far from 1 a transfer may be where all values are 0.
const NEUTRAL: f64 = 1e-9;

with_program! {
    /// `[[effect]] plugin = "external"`.
    pub struct ExternalEffectConfig {
        /// What `[diagnose] effects` and a diagnosis call it: words with `-` between them.
        pub id: String,
        /// What it is, in one line.
        #[serde(default)]
        pub about: Option<String>,
        /// Its parameters, at least one: where all are 0, it changes nothing.
        pub parameters: Vec<EffectParameter>,
        /// Columns of numbers that the program takes of measured points; without it, it changes a channel of turns.
        #[serde(default)]
        pub columns: Option<Vec<String>>,
        /// Columns of texts that it takes of measured points.
        #[serde(default)]
        pub labels: Vec<String>,
    }
}

/// A parameter of an effect.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EffectParameter {
    /// Its name.
    pub name: String,
    /// Its unit; "1" for a number without one.
    pub unit: String,
    /// Its usual size, in its unit: a standard deviation.
    pub usual: f64,
}

impl StageConfig for ExternalEffectConfig {
    type Stage = EffectEntry;

    const NAME: &'static str = "external";
    const ABOUT: &'static str =
        "a linear change of one channel, or of readings at points, by a program in any language";

    fn check(self, context: &Context) -> std::result::Result<EffectEntry, Fault> {
        let is_word =
            |word: &str| !word.is_empty() && word.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit());
        if !self.id.split('-').all(is_word) {
            let fault = Fault::at(
                "id",
                format!("expected small letters and digits with `-` between them, found `{}`", self.id),
            );
            return Err(fault.help("id = \"ac-coupling\""));
        }
        let parameters = parameters(&self.parameters)?;
        let session = Session::new(self.program(context)?);
        let (id, config) = (lasting(&self.id), Value::Object(self.config));
        let about = lasting(self.about.as_deref().unwrap_or("an effect of the pipeline's own"));
        match &self.columns {
            Some(columns) => of_points(session, config, (id, about), parameters, [columns, &self.labels]),
            None if !self.labels.is_empty() => {
                Err(Fault::at("labels", "turns have no columns").help("measured points need `columns` too"))
            }
            None => {
                let transfer = ExternalTransfer {
                    session,
                    config,
                    names: parameters.iter().map(|one| one.name.clone()).collect(),
                    object: format!("the effect {id}"),
                    neutral: OnceLock::new(),
                };
                Ok(entry(Arc::new(ChannelEffect::new(id, about, parameters, transfer))))
            }
        }
    }
}

/// Parameters as an effect has them.
///
/// # Errors
/// When there are none, two have one name, or one has no usual size.
fn parameters(declared: &[EffectParameter]) -> std::result::Result<Vec<Parameter>, Fault> {
    if declared.is_empty() {
        let fault = Fault::at("parameters", "expected at least one parameter, found none");
        return Err(fault.help("parameters = [{ name = \"cut-off\", unit = \"1/rev\", usual = 0.1 }]"));
    }
    for (index, one) in declared.iter().enumerate() {
        let place = |fault: Fault| fault.under_item("parameters", index);
        if one.name.is_empty() || declared[..index].iter().any(|other| other.name == one.name) {
            let problem = format!("names of parameters must differ and not be empty, found `{}`", one.name);
            return Err(place(Fault::at("name", problem)));
        }
        if !(one.usual > 0.0 && one.usual.is_finite()) {
            return Err(place(Fault::at("usual", format!("expected a number above 0, found {}", one.usual))));
        }
    }
    let parameter = |one: &EffectParameter| {
        let EffectParameter { name, unit, usual } = one.clone();
        Parameter { name, unit, tolerance: usual }
    };
    Ok(declared.iter().map(parameter).collect())
}

/// A transfer that a program computes.
struct ExternalTransfer {
    session: Session,
    config: Value,
    /// Of the parameters.
    names: Vec<String>,
    /// For messages.
    object: String,
    /// Whether the transfer without an effect was asked for.
    neutral: OnceLock<()>,
}

impl ExternalTransfer {
    fn request(&self, orders: usize, values: &[f64]) -> Result<Vec<u8>> {
        let column = ColumnSpec::count("order", "1/rev", "undulations per revolution");
        let spec = TableSpec::new("orders", "orders at which the transfer is wanted", vec![column]);
        let values: Map<String, Value> =
            self.names.iter().cloned().zip(values.iter().map(|one| (*one).into())).collect();
        let about = [
            ("stage", "transfer".to_owned()),
            ("config", self.config.to_string()),
            ("values", Value::Object(values).to_string()),
        ];
        let frame = encode(&spec.name, &spec.rows(vec![counts(0..orders)])?, &about);
        let frame = frame.map_err(|error| Error::caused("write", "the table orders", error))?;
        let mut request = Vec::new();
        frame.append_to(&mut request);
        Frame::end().append_to(&mut request);
        Ok(request)
    }

    fn ask(&self, orders: usize, values: &[f64]) -> Result<Vec<Complex64>> {
        self.session.answer(("diagnose", &self.object), self.request(orders, values)?, |answer| {
            let found = transfer(answer, orders)?;
            let is_neutral = values.iter().all(|value| *value == 0.0);
            match found.iter().position(|one| (one - Complex64::ONE).norm() > NEUTRAL).filter(|_| is_neutral) {
                Some(order) => Err(format!(
                    "gave the transfer {} at order {order} where all values are 0: expected 1",
                    found[order]
                )),
                None => Ok(found),
            }
        })
    }
}

impl ChannelTransfer for ExternalTransfer {
    fn transfer(&self, orders: usize, values: &[f64]) -> Option<Vec<Complex64>> {
        // An effect that is there without a size would be found in any data.
        if self.neutral.set(()).is_ok() {
            self.ask(orders, &vec![0.0; self.names.len()]).ok()?;
        }
        self.ask(orders, values).ok()
    }

    fn failure(&self) -> Option<Error> {
        self.session.failure("diagnose", &self.object)
    }
}

/// The transfer of an answer at the orders 0 to `orders` − 1, in any order of rows.
fn transfer(answer: &[Frame], orders: usize) -> std::result::Result<Vec<Complex64>, String> {
    let answer = Answer::of(answer, &["transfer"])?;
    let table = Table::decode(answer.table("transfer").ok_or("gave no table `transfer`")?, &COLUMNS)?;
    let order = table.needed("order", table.counts("order"))?;
    let [re, im] = ["re", "im"].map(|name| table.needed(name, table.numbers(name)));
    let (re, im) = (re?, im?);
    let mut found = vec![None; orders];
    for row in 0..table.count() {
        let Some(order) = order[row].filter(|order| *order < orders) else {
            return Err(format!("gave a transfer at an order that is not one of 0 to {}", orders.saturating_sub(1)));
        };
        let (Some(re), Some(im)) = (re[row], im[row]) else {
            return Err(format!("gave a null as the transfer at order {order}: expected a number"));
        };
        let one = Complex64::new(re, im);
        if one == Complex64::ZERO {
            return Err(format!("gave the transfer 0 at order {order}: what is not read cannot be corrected"));
        }
        if found[order].replace(one).is_some() {
            return Err(format!("gave the transfer at order {order} twice"));
        }
    }
    let missing = found.iter().position(Option::is_none);
    missing.map_or_else(
        || Ok(found.iter().copied().flatten().collect()),
        |order| Err(format!("gave no transfer at order {order}: expected one at each of 0 to {}", orders - 1)),
    )
}
