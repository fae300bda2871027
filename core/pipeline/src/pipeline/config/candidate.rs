//! `[[compare]]`: separators that are meant to be compared with that of `[separate]`.

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
    pub(crate) name: String,
    separator: Result<Box<dyn StationSeparator>, Refusal>,
}

/// A separator that fits the rig.
#[non_exhaustive]
pub struct Method {
    /// Its plugin's name, with a number where there are several.
    pub name: String,
    /// What is observable by it.
    pub assessment: Assessment,
    /// Profiles to form and motion.
    pub separator: Box<dyn StationSeparator>,
}

/// A separator that cannot take the rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct Refusal {
    /// Its plugin's name.
    pub method: String,
    /// What it needs and what there is.
    pub reason: String,
    /// What to do.
    pub help: Option<String>,
    /// Whether it takes another kind of data.
    #[serde(skip)]
    pub(crate) unfit: bool,
}

impl Refusal {
    pub(crate) fn new(method: &str, fault: Fault) -> Self {
        // Faults name the plugin, for the file that they point into.
        let reason = fault.message.strip_prefix(method).map_or(fault.message.as_str(), str::trim_start);
        Self { method: method.to_owned(), reason: reason.to_owned(), help: fault.help, unfit: fault.unfit }
    }
}

impl Candidate {
    pub(crate) fn new(name: &str, built: Result<Separator, Fault>) -> Self {
        let separator = match built {
            Ok(Separator::Stations(separator)) => Ok(separator),
            Ok(_) => Err(Fault::unfit("takes measured points, not recorded turns")),
            Err(fault) => Err(fault),
        };
        Self { name: name.to_owned(), separator: separator.map_err(|fault| Refusal::new(name, fault)) }
    }

    pub(crate) fn assessed(self, max_order: usize) -> Result<Method, Refusal> {
        let separator = self.separator?;
        match separator.assess(max_order) {
            Ok(assessment) => Ok(Method { name: self.name, assessment, separator }),
            Err(fault) => Err(Refusal::new(&self.name, fault)),
        }
    }
}

/// The name in a table whose plugin has been found.
pub(crate) fn plugin_name(table: &Table) -> String {
    table.get_ref().get("plugin").and_then(|name| name.get_ref().as_str()).unwrap_or_default().to_owned()
}

/// Builds the separator of a `[[compare]]` table.
///
/// # Errors
/// Every fault but that the rig does not fit.
pub(crate) fn candidate(table: &Table, registry: &Registry, context: &Context) -> Result<Candidate, Fault> {
    match registry.separators.build(table, context) {
        Err(fault) if !fault.unfit => Err(fault),
        built => Ok(Candidate::new(&plugin_name(table), built)),
    }
}

/// A `[[compare]]` table of measured points with the keys of `[separate]` that its plugin knows and that it does not have.
pub(crate) fn with_shared_keys<'t>(table: &Table<'t>, separate: &Table<'t>, registry: &Registry) -> Table<'t> {
    let name = plugin_name(table);
    let mut keys = table.get_ref().clone();
    for (key, value) in separate.get_ref() {
        let shared: &str = key.get_ref();
        if !keys.contains_key(shared) && registry.separators.knows(&name, shared) {
            keys.insert(key.clone(), value.clone());
        }
    }
    Table::new(table.span(), keys)
}
