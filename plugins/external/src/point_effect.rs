//! An effect of measured points: points out, what one unit of each parameter adds to their readings in.

use std::{collections::BTreeMap, sync::Arc};

use runout_core::{
    Result,
    closed_loop::{Effect, Parameter},
    effects::{EffectEntry, PointEffect},
    fault::{Fault, known_names},
    points::{Column, PointColumn, Points},
};
use serde_json::Value as Json;

use crate::{
    answer::Answer,
    frame::Frame,
    points::{columns, request},
    session::Session,
    tables::Table,
};

/// The table of an answer, and its columns besides those of the points.
const CHANGE: &str = "change";
const KEYS: [&str; 2] = ["parameter", "row"];

/// An effect that a program, or code of this process, computes.
struct ExternalPointEffect {
    session: Session,
    config: Json,
    effect: Effect,
    columns: Vec<PointColumn>,
}

/// An effect of measured points that takes these columns of numbers and of texts.
///
/// # Errors
/// When there are no columns of numbers, or a name is there twice.
pub(crate) fn of_points(
    session: Session,
    config: Json,
    (id, about): (&'static str, &'static str),
    parameters: Vec<Parameter>,
    names: [&[String]; 2],
) -> std::result::Result<EffectEntry, Fault> {
    let effect = Effect { id: id.into(), targets: Vec::new(), parameters: parameters.clone() };
    let own: Arc<dyn PointEffect> = Arc::new(ExternalPointEffect { session, config, effect, columns: columns(names)? });
    Ok(EffectEntry::new(id, about, parameters, own))
}

impl PointEffect for ExternalPointEffect {
    fn effect(&self) -> Effect {
        self.effect.clone()
    }

    fn columns(&self) -> Vec<PointColumn> {
        self.columns.clone()
    }

    fn partials(&self, points: &Points) -> Result<Vec<Vec<Column>>> {
        let object = format!("the effect {}", self.effect.id);
        let request = request(points, &self.columns, CHANGE, &self.config)?;
        self.session.answer(("diagnose", &object), request, |answer| change(answer, points, &self.effect))
    }
}

/// What an answer says that one unit of each parameter adds: every point once for each parameter, in any order.
fn change(answer: &[Frame], points: &Points, effect: &Effect) -> std::result::Result<Vec<Vec<Column>>, String> {
    let answer = Answer::of(answer, &[CHANGE])?;
    let readings: Vec<&str> = points.columns.iter().map(|column| column.name.as_str()).collect();
    let names: Vec<&str> = KEYS.iter().chain(&readings).copied().collect();
    let table = Table::decode(answer.table(CHANGE).ok_or("gave no table `change`")?, &names)?;
    let parameter = table.needed(KEYS[0], table.texts(KEYS[0]))?;
    let row = table.needed(KEYS[1], table.counts(KEYS[1]))?;
    let count = points.columns.first().map_or(0, |column| column.values.len());
    let mut place = BTreeMap::new();
    for (entry, (name, row)) in parameter.iter().zip(&row).enumerate() {
        let name = name.as_deref().unwrap_or_default();
        let Some(of) = effect.parameters.iter().position(|known| known.name == name) else {
            let known = effect.parameters.iter().map(|known| known.name.as_str());
            return Err(format!("gave the change by `{name}`, which is no parameter: {}", known_names(name, known)));
        };
        let Some(row) = row.filter(|row| *row < count) else {
            return Err(format!("gave a change of a row that is not one of 0 to {}", count.saturating_sub(1)));
        };
        if place.insert((of, row), entry).is_some() {
            return Err(format!("gave the change of row {row} by `{name}` twice"));
        }
    }
    let mut changed = Vec::new();
    for name in readings {
        if let Some(cells) = table.numbers(name)? {
            changed.push((name, cells));
        }
    }
    if changed.is_empty() {
        return Err("gave a table `change` without a column of the points: what does it add to?".into());
    }
    let of_parameter = |(of, parameter): (usize, &Parameter)| {
        let column = |(name, cells): &(&str, Vec<Option<f64>>)| {
            let cell = |row: usize| {
                let entry = place.get(&(of, row)).and_then(|entry| cells[*entry]);
                entry.ok_or_else(|| format!("gave no change of `{name}` in row {row} by `{}`", parameter.name))
            };
            Ok(Column {
                name: (*name).to_owned(),
                values: (0..count).map(cell).collect::<std::result::Result<_, _>>()?,
            })
        };
        changed.iter().map(column).collect()
    };
    effect.parameters.iter().enumerate().map(of_parameter).collect()
}
