//! The blind benchmark of any domain of measured points: a domain draws campaigns, this diagnoses and judges them.

pub mod judge;
pub mod report;

use runout_core::{Result, points::Points, stage::PointSeparator};

use super::{Kind, turn};
use crate::{chance::Chance, each::each};
use judge::Judged;

/// A domain of measured points.
#[derive(Debug, Clone, Copy)]
pub struct Domain {
    /// Its separator's name, as `--domain` takes it.
    pub name: &'static str,
    /// Draws a campaign of a kind; `turn` counts those of its kind, so that each effect and unmodelled disturbance is drawn in turn.
    pub draw: fn(kind: Kind, turn: usize, chance: &mut Chance) -> Result<Campaign>,
}

/// A campaign, and what the loop is to find in it.
pub struct Campaign {
    /// Which layout, in words.
    pub layout: &'static str,
    /// What was measured.
    pub points: Points,
    /// What is declared.
    pub separator: Box<dyn PointSeparator>,
    /// What is wrong; of an unmodelled disturbance only its id counts.
    pub planted: Vec<Planted>,
    /// Ids of effects that the simulated world has by itself, so that naming them is right.
    pub natural: Vec<String>,
    /// True values of results, where the simulation has them.
    pub truth: Vec<True>,
}

/// Something wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Planted {
    /// Row of the report.
    pub id: &'static str,
    /// Names, "effect target", each of which is right; the first is how the simulator made it.
    pub names: Vec<String>,
    /// In words.
    pub size: String,
    /// True values of parameters by the names that the loop gives them; of the first name.
    pub parameters: Vec<(&'static str, f64)>,
    /// Whether it shows, where χ² of the declared model does not say so because a field that is part of the model takes it.
    pub visible: Option<bool>,
}

impl Planted {
    /// An effect with one name.
    #[must_use]
    pub fn effect(id: &'static str, target: &str, size: String, parameters: Vec<(&'static str, f64)>) -> Self {
        let name = if target.is_empty() { id.to_owned() } else { format!("{id} {target}") };
        Self { id, names: vec![name], size, parameters, visible: None }
    }

    /// Something that the loop does not know.
    #[must_use]
    pub fn stranger(id: &'static str, size: String) -> Self {
        Self { id, names: Vec::new(), size, parameters: Vec::new(), visible: None }
    }
}

/// A true value of a result.
#[derive(Debug, Clone, PartialEq)]
pub struct True {
    /// Row of the report: values of one kind together.
    pub row: &'static str,
    /// The value's symbol.
    pub symbol: String,
    /// What it is of, where there are several.
    pub of: Option<String>,
    /// In the value's unit.
    pub value: f64,
}

impl True {
    /// Of a value of which there is one.
    #[must_use]
    pub fn new(row: &'static str, symbol: &str, value: f64) -> Self {
        Self { row, symbol: symbol.into(), of: None, value }
    }
}

/// Draws a campaign; the same seed and index give the same.
///
/// # Errors
/// When it cannot be simulated.
pub fn campaign(domain: &Domain, seed: u64, index: u64) -> Result<(Kind, Campaign)> {
    let (kind, turn) = turn(index);
    Ok((kind, (domain.draw)(kind, turn, &mut Chance::new(seed, index))?))
}

/// Diagnoses the first `count` campaigns of a seed, on as many threads as there are processors.
///
/// # Errors
/// When a campaign cannot be simulated or diagnosed.
pub fn campaigns(domain: &Domain, count: u64, seed: u64) -> Result<Vec<Judged>> {
    each(count, seed, |index| {
        let (kind, campaign) = campaign(domain, seed, index)?;
        judge::judge(index, kind, &campaign)
    })
}
