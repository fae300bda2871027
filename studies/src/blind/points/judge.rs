//! What the loop says of a campaign of points, beside what was planted.

use runout_core::{
    Error, Result,
    closed_loop::{
        Settings,
        diagnosis::{Added, Diagnosis, Verdict},
    },
    stage::PointModel,
    summary::Value,
};

use super::{Campaign, Planted, True};
use crate::blind::{Kind, judge::VISIBLE_CHI2};

/// What became of a campaign.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Its place in the benchmark.
    pub index: u64,
    /// What it was for.
    pub kind: Kind,
    /// Which layout.
    pub layout: &'static str,
    /// What was wrong.
    pub planted: Vec<Planted>,
    /// What the loop says.
    pub diagnosis: Diagnosis,
    /// Of each effect planted, in their order.
    pub effects: Vec<Traced>,
    /// What was named and is not there.
    pub false_alarms: Vec<String>,
    /// Values with a known truth, as the declared model and the final one have them.
    pub values: Vec<Valued>,
}

/// What became of a planted effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Traced {
    /// Whether it raises the residual of the declared model by itself, or shows beside a field.
    pub visible: bool,
    /// Whether it was named: itself, or a set that holds it.
    pub named: bool,
    /// Whether it was named alone.
    pub alone: bool,
    /// Error over standard uncertainty of its parameters, where it was named alone.
    pub parameters: Vec<f64>,
}

/// A value beside its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Valued {
    /// Row of the report.
    pub row: &'static str,
    /// Its symbol.
    pub symbol: String,
    /// Error over standard uncertainty with the declared model; NaN where it is lost.
    pub declared: f64,
    /// Error over standard uncertainty with the final model; NaN where it is lost.
    pub last: f64,
    /// How much farther from the truth the final model has it, in standard uncertainties of the final model.
    pub farther: f64,
}

/// Diagnoses a campaign and compares.
///
/// # Errors
/// When the loop fails.
pub fn judge(index: u64, kind: Kind, campaign: &Campaign) -> Result<Judged> {
    let model = model(campaign)?;
    let settings = Settings { max_added: model.effects_of(&campaign.points)?.len(), ..Settings::default() };
    let found = model.diagnose(&campaign.points, &settings)?;
    let diagnosis = found.diagnosis;
    let visible = diagnosis.before.chi2_per_dof.is_none_or(|chi2| chi2 > VISIBLE_CHI2);
    let effects = campaign.planted.iter().map(|planted| {
        let found = diagnosis.added.iter().find(|added| holds(added, planted));
        let alone = found.filter(|added| added.confounded_with.is_empty());
        Traced {
            visible: planted.visible.unwrap_or(visible),
            named: found.is_some(),
            alone: alone.is_some(),
            parameters: alone.map_or_else(Vec::new, |added| errors(added, planted)),
        }
    });
    let effects = effects.collect();
    let there = |added: &&Added| {
        !campaign.natural.contains(&added.effect) && !campaign.planted.iter().any(|planted| holds(added, planted))
    };
    let false_alarms = diagnosis.added.iter().filter(there).map(name).collect();
    let declared = campaign.separator.separate(&campaign.points)?.values;
    let values = campaign.truth.iter().map(|truth| Valued {
        row: truth.row,
        symbol: truth.symbol.clone(),
        declared: ratio(&declared, truth),
        last: ratio(&found.after.values, truth),
        farther: farther(&declared, &found.after.values, truth),
    });
    Ok(Judged {
        index,
        kind,
        layout: campaign.layout,
        planted: campaign.planted.clone(),
        effects,
        false_alarms,
        values: values.collect(),
        diagnosis,
    })
}

fn model(campaign: &Campaign) -> Result<&dyn PointModel> {
    campaign
        .separator
        .model()
        .ok_or_else(|| Error::new("diagnose", campaign.layout, "the separator has no model for the closed loop"))
}

/// A value and its standard uncertainty; NaN where either is not known.
fn known(values: &[Value], truth: &True) -> [f64; 2] {
    let found = values.iter().find(|value| value.symbol == truth.symbol && value.of == truth.of);
    found.and_then(|value| value.number().zip(value.std())).map_or([f64::NAN; 2], |(value, std)| [value, std])
}

/// Error over standard uncertainty.
fn ratio(values: &[Value], truth: &True) -> f64 {
    let [value, std] = known(values, truth);
    (value - truth.value) / std
}

fn farther(declared: &[Value], last: &[Value], truth: &True) -> f64 {
    let ([before, _], [after, std]) = (known(declared, truth), known(last, truth));
    ((after - truth.value).abs() - (before - truth.value).abs()) / std
}

/// Effect and target as in `confounded_with`.
#[must_use]
pub fn name(added: &Added) -> String {
    std::iter::once(&added.effect).chain(&added.targets).cloned().collect::<Vec<_>>().join(" ")
}

/// Whether what was named is, or could as well be, what was planted.
fn holds(added: &Added, planted: &Planted) -> bool {
    let right = |wanted: &String| {
        (name(added) == *wanted && has_order_of(added, planted)) || added.confounded_with.contains(wanted)
    };
    planted.names.iter().any(right)
}

/// An effect that has orders is right with its own order only.
fn has_order_of(added: &Added, planted: &Planted) -> bool {
    let order = planted.parameters.iter().find(|(name, _)| *name == "order");
    let found = added.parameters.iter().find(|parameter| parameter.name == "order");
    order.zip(found).is_none_or(|((_, order), found)| (order - found.value).abs() < 0.5)
}

/// Errors of parameters over their standard uncertainties, of those that can be compared.
fn errors(added: &Added, planted: &Planted) -> Vec<f64> {
    let mut errors = Vec::new();
    if planted.names.first() != Some(&name(added)) {
        return errors;
    }
    for (parameter, truth) in &planted.parameters {
        let Some(found) = added.parameters.iter().find(|one| one.name == *parameter) else { continue };
        let Some(std) = found.std.filter(|std| *std > 0.0) else { continue };
        errors.push((found.value - truth) / std);
    }
    errors
}

impl Judged {
    /// Whether the loop says that something is left which it does not know.
    #[must_use]
    pub fn is_unexplained(&self) -> bool {
        self.diagnosis.verdict == Verdict::Unexplained
    }

    /// Whether what was planted shows.
    #[must_use]
    pub fn is_visible(&self) -> bool {
        self.effects.iter().any(|traced| traced.visible)
    }

    /// What is not as it should be, in words; nothing where all is well.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        for (planted, traced) in self.planted.iter().zip(&self.effects) {
            if self.kind != Kind::Stranger && traced.visible && !traced.named {
                failures.push(format!("{} missed", planted.id));
            }
        }
        let alarm = if self.kind == Kind::Stranger { "effect added" } else { "false alarm" };
        failures.extend(self.false_alarms.iter().map(|name| format!("{alarm}: {name}")));
        match self.kind {
            Kind::Stranger if self.is_visible() && !self.is_unexplained() => {
                failures.push("not reported as unexplained".into());
            }
            Kind::Stranger => {}
            _ if self.is_unexplained() => failures.push("something reported as unexplained".into()),
            _ => {}
        }
        let noticed = self.kind != Kind::Stranger && self.is_visible() || self.kind == Kind::Clean;
        for value in self.values.iter().filter(|value| noticed && value.last.abs() > 4.0) {
            failures.push(format!("{} is {:.1} standard uncertainties off", value.symbol, value.last));
        }
        failures
    }

    /// What was planted, in words.
    #[must_use]
    pub fn planted(&self) -> String {
        let words = self.planted.iter().map(|planted| {
            let name = planted.names.first().map_or(planted.id, String::as_str);
            format!("{name} {}", planted.size)
        });
        let words: Vec<String> = words.collect();
        if words.is_empty() { "nothing".into() } else { words.join(" and ") }
    }

    /// What was said, in words.
    #[must_use]
    pub fn said(&self) -> String {
        let added = self.diagnosis.added.iter().map(|added| {
            let values: Vec<String> = added
                .parameters
                .iter()
                .map(|one| {
                    let std = one.std.map(|std| format!(" ± {std:.1e}")).unwrap_or_default();
                    format!("{} {:.3e}{std}", one.name, one.value)
                })
                .collect();
            let set = match added.confounded_with.len() {
                0 => String::new(),
                others => format!(" or {others} others"),
            };
            format!("{}{set} ({})", name(added), values.join(", "))
        });
        let mut words: Vec<String> = added.collect();
        let refused = self.diagnosis.refused.iter();
        words.extend(refused.map(|one| format!("refused {} {}: {}", one.effect, one.targets.join(" "), one.reason)));
        if words.is_empty() { "nothing added".into() } else { words.join("; ") }
    }
}
