//! Which separators are compared.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    pipeline::{Registry, document::Table, registry::Context},
    stage::{Separator, StationSeparator},
};
use runout_error::fault::Fault;
use runout_turning::separation::Assessment;

/// A separator that is meant to be compared; the rig may refuse it.
pub struct Candidate {
    name: String,
    separator: Result<Box<dyn StationSeparator>, Refusal>,
}

/// A separator that fits the rig.
pub struct Method {
    /// Its plugin's name, with a number where there are several.
    pub name: String,
    /// What it can tell.
    pub assessment: Assessment,
    /// Profiles to form and motion.
    pub separator: Box<dyn StationSeparator>,
}

/// A separator that cannot take the rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Refusal {
    /// Its plugin's name.
    pub method: String,
    /// What it needs and what there is.
    pub reason: String,
    /// What to do.
    pub help: Option<String>,
}

impl Refusal {
    fn new(method: &str, fault: Fault) -> Self {
        // Faults name the plugin, for the file that they point into.
        let reason = fault.message.strip_prefix(method).map_or(fault.message.as_str(), str::trim_start);
        Self { method: method.to_owned(), reason: reason.to_owned(), help: fault.help }
    }
}

impl Candidate {
    fn new(name: &str, built: Result<Separator, Fault>) -> Self {
        let separator = match built {
            Ok(Separator::Stations(separator)) => Ok(separator),
            Ok(_) => Err(Fault::unfit("takes measured points, not recorded turns")),
            Err(fault) => Err(fault),
        };
        Self { name: name.to_owned(), separator: separator.map_err(|fault| Refusal::new(name, fault)) }
    }

    pub(super) fn assessed(self, max_order: usize) -> Result<Method, Refusal> {
        let separator = self.separator?;
        match separator.assess(max_order) {
            Ok(assessment) => Ok(Method { name: self.name, assessment, separator }),
            Err(fault) => Err(Refusal::new(&self.name, fault)),
        }
    }
}

/// The name in a table whose plugin has been found.
pub fn plugin_name(table: &Table) -> String {
    table.get_ref().get("plugin").and_then(|name| name.get_ref().as_str()).unwrap_or_default().to_owned()
}

/// Builds the separator of a `[[compare]]` table.
///
/// # Errors
/// Every fault but that the rig does not fit.
pub fn candidate(table: &Table, registry: &Registry, context: &Context) -> Result<Candidate, Fault> {
    match registry.separators.build(table, context) {
        Err(fault) if !fault.unfit => Err(fault),
        built => Ok(Candidate::new(&plugin_name(table), built)),
    }
}

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
pub(super) fn told_apart(reference: &str, methods: &mut [Method]) -> Vec<String> {
    let mut names = vec![reference.to_owned()];
    for method in methods {
        let plugin = method.name.clone();
        let mut number = 1;
        while names.contains(&method.name) {
            number += 1;
            method.name = format!("{plugin} ({number})");
        }
        names.push(method.name.clone());
    }
    names
}
