//! Which separators are compared.

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::{
    pipeline::{
        Registry,
        config::candidate::{Candidate, Refusal, plugin_name, with_shared_keys},
        document::{Table, required, tables},
        registry::Context,
    },
    stage::{PointSeparator, Separator},
};
use runout_error::fault::Fault;

/// Those that are wanted, of what is configured and registered.
pub(super) fn choose(
    configured: Vec<Candidate>,
    with: &[String],
    reference: &str,
    registry: &Registry,
    context: &Context,
) -> Vec<Candidate> {
    let default = |name: &str| registry.separators.build_default(name, context);
    if !with.is_empty() {
        let mut chosen = Vec::new();
        let mut rest = configured;
        for name in with {
            let (meant, others): (Vec<_>, Vec<_>) = rest.into_iter().partition(|candidate| candidate.name == *name);
            rest = others;
            if meant.is_empty() {
                chosen.extend(default(name).map(|built| Candidate::new(name, built)));
            }
            chosen.extend(meant);
        }
        return chosen;
    }
    if !configured.is_empty() {
        return configured;
    }
    let others = registry.separators.iter().filter(|plugin| plugin.name != reference);
    others
        .filter_map(|plugin| match default(plugin.name)? {
            Ok(Separator::Points(_)) => None,
            // Keys that it cannot do without: those of other data have such, and nobody asked for it.
            Err(fault) if !fault.unfit => None,
            built => Some(Candidate::new(plugin.name, built)),
        })
        .collect()
}

/// Gives methods of the same name a number from the second on; all names, the reference's first.
pub(super) fn distinct_names<'a>(reference: &str, methods: impl Iterator<Item = &'a mut String>) -> Vec<String> {
    let mut names = vec![reference.to_owned()];
    for name in methods {
        let plugin = name.clone();
        let mut number = 1;
        while names.contains(name) {
            number += 1;
            *name = format!("{plugin} ({number})");
        }
        names.push(name.clone());
    }
    names
}

/// A separator of measured points that is meant to be compared.
pub(super) struct PointCandidate {
    pub name: String,
    /// Whether somebody asked for it.
    pub named: bool,
    pub separator: Result<Box<dyn PointSeparator>, Refusal>,
}

impl PointCandidate {
    fn new(name: &str, named: bool, built: Result<Separator, Fault>) -> Self {
        let separator = match built {
            Ok(Separator::Points(separator)) => Ok(separator),
            Ok(Separator::Stations(_)) => Err(Fault::unfit("takes recorded turns, not measured points")),
            Err(fault) => Err(fault),
        };
        Self { name: name.to_owned(), named, separator: separator.map_err(|fault| Refusal::new(name, fault)) }
    }
}

/// `[separate]` with another plugin, and the keys that this one knows.
fn in_place_of<'t>(name: &str, separate: &Table<'t>, registry: &Registry) -> Table<'t> {
    let mut keys = DeTable::new();
    for (key, value) in separate.get_ref() {
        let shared: &str = key.get_ref();
        if shared == "plugin" {
            keys.insert(key.clone(), Spanned::new(value.span(), DeValue::String(name.to_owned().into())));
        } else if registry.separators.knows(name, shared) {
            keys.insert(key.clone(), value.clone());
        }
    }
    Table::new(separate.span(), keys)
}

/// Those that are wanted for measured points.
///
/// # Errors
/// When a `[[compare]]` table is wrong.
pub(super) fn choose_points(
    root: &Table,
    with: &[String],
    reference: &str,
    registry: &Registry,
    context: &Context,
) -> Result<Vec<PointCandidate>, Fault> {
    let separate = required(root, "separate")?;
    let mut configured = Vec::new();
    for table in tables(root, "compare")? {
        let whole = with_shared_keys(&table, &separate, registry);
        let built = match registry.separators.build(&whole, context) {
            Err(fault) if !fault.unfit => return Err(fault),
            built => built,
        };
        configured.push(PointCandidate::new(&plugin_name(&table), true, built));
    }
    let build = |name: &str| registry.separators.build(&in_place_of(name, &separate, registry), context);
    if !with.is_empty() {
        let mut chosen = Vec::new();
        for name in with {
            let (meant, others): (Vec<_>, Vec<_>) = configured.into_iter().partition(|known| known.name == *name);
            configured = others;
            if meant.is_empty() {
                chosen.push(PointCandidate::new(name, true, build(name)));
            }
            chosen.extend(meant);
        }
        return Ok(chosen);
    }
    if !configured.is_empty() {
        return Ok(configured);
    }
    // Separators that need other keys are of other data, and nobody asked for them.
    let has = |key: &str| separate.get_ref().contains_key(key);
    let alike =
        registry.separators.iter().filter(|plugin| plugin.name != reference && plugin.needs().all(|key| has(&key)));
    let built = alike.map(|plugin| PointCandidate::new(plugin.name, false, build(plugin.name)));
    // Those of turns are no candidates at all.
    Ok(built.filter(|one| one.separator.as_ref().map_or_else(|refusal| !refusal.unfit, |_| true)).collect())
}
