//! What is registered: explicit lists, filled by the program that uses the core.

use runout_error::fault::{Fault, known_names};
use std::path::{Path, PathBuf};

use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use serde_json::Value;
use toml::{Spanned, de::DeTable};

use super::document::{self, Table, inline};
use crate::{
    effects::{EffectCatalogue, EffectEntry},
    stage::{Check, Evaluator, Exporter, Loader, Preprocessor, Separator, Simulator},
};
use runout_turning::rig::Rig;

/// Every plugin by stage, and every effect.
#[derive(Default)]
#[non_exhaustive]
pub struct Registry {
    /// From files to recordings.
    pub loaders: Catalogue<Box<dyn Loader>>,
    /// From samples to profiles.
    pub preprocessors: Catalogue<Preprocessor>,
    /// From profiles or points to form and motion.
    pub separators: Catalogue<Separator>,
    /// From the tables of a result to values.
    pub evaluators: Catalogue<Box<dyn Evaluator>>,
    /// From results to files.
    pub exporters: Catalogue<Box<dyn Exporter>>,
    /// From scenarios to recordings.
    pub simulators: Catalogue<Box<dyn Simulator>>,
    /// What `check` compares a pipeline with.
    pub checks: Catalogue<Box<dyn Check>>,
    /// What models may lack.
    pub effects: EffectCatalogue,
    /// What makes effects of a pipeline's own, which its models may lack too.
    pub own_effects: Catalogue<EffectEntry>,
}

/// The plugins of one stage.
pub struct Catalogue<S> {
    plugins: Vec<Plugin<S>>,
}

impl<S> Default for Catalogue<S> {
    fn default() -> Self {
        Self { plugins: Vec::new() }
    }
}

/// A plugin: its name, what it does, its configuration's schema, and how it is built.
pub struct Plugin<S> {
    /// Kebab-case name in TOML.
    pub name: &'static str,
    /// One line for lists.
    pub about: &'static str,
    former: bool,
    schema: fn() -> Schema,
    build: Build<S>,
}

/// From a stage's table to the stage.
type Build<S> = Box<dyn Fn(&Table, &Context) -> Result<S, Fault> + Send + Sync>;

/// What a stage's check may use besides its own keys.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a> {
    /// The folder that relative paths start from.
    pub folder: &'a Path,
    /// The rig, where the pipeline has one.
    pub rig: Option<&'a Rig>,
}

impl Context<'_> {
    /// Resolves a path of the configuration.
    #[must_use]
    pub fn path(&self, configured: &Path) -> PathBuf {
        self.folder.join(configured)
    }
}

/// A stage's raw configuration: what may stand in its table, and the check that makes the stage of it.
///
/// Implement it on a struct with `#[derive(Deserialize, JsonSchema)]` and `#[serde(deny_unknown_fields)]`; its doc
/// comments become the schema's and the help's descriptions.
pub trait StageConfig: DeserializeOwned + JsonSchema + 'static {
    /// What the check makes: a boxed stage trait, or [`Preprocessor`] or [`Separator`].
    type Stage;

    /// Kebab-case name in TOML.
    const NAME: &'static str;
    /// One line for lists.
    const ABOUT: &'static str;

    /// Checks the values and builds the stage, which can then only be valid.
    ///
    /// # Errors
    /// The first value that cannot be, with its key.
    fn check(self, context: &Context) -> Result<Self::Stage, Fault>;
}

impl<S> Plugin<S> {
    /// The plugin with this configuration.
    #[must_use]
    pub fn of<C: StageConfig<Stage = S>>() -> Self {
        Self::made(C::NAME, C::ABOUT, C::check)
    }

    /// A plugin that a program makes while it runs: with keys of type `C`, which `check` makes the stage of.
    #[must_use]
    pub fn made<C: DeserializeOwned + JsonSchema + 'static>(
        name: &'static str,
        about: &'static str,
        check: impl Fn(C, &Context) -> Result<S, Fault> + Send + Sync + 'static,
    ) -> Self {
        let build =
            move |table: &Table, context: &Context| check(document::read_besides::<C>(table, &["plugin"])?, context);
        Self { name, about, former: false, schema: inline::<C>, build: Box::new(build) }
    }

    /// A plugin under a name that it had before: it is found by that name and is in no list.
    #[must_use]
    pub fn former<C: StageConfig<Stage = S>>(name: &'static str) -> Self {
        Self { name, former: true, ..Self::of::<C>() }
    }

    /// JSON Schema of the plugin's own keys.
    #[must_use]
    pub fn schema(&self) -> Schema {
        (self.schema)()
    }

    /// The keys that it cannot do without.
    pub fn needs(&self) -> impl Iterator<Item = String> {
        let keys = self.schema().get("required").and_then(Value::as_array).cloned().unwrap_or_default();
        keys.into_iter().filter_map(|key| key.as_str().map(str::to_owned))
    }
}

impl<S> Catalogue<S> {
    /// Adds a plugin; later ones of the same name are not found.
    pub fn add(&mut self, plugin: Plugin<S>) {
        self.plugins.push(plugin);
    }

    /// All plugins in the order added, under the names that they have.
    pub fn iter(&self) -> impl Iterator<Item = &Plugin<S>> {
        self.plugins.iter().filter(|plugin| !plugin.former)
    }

    /// Builds the stage that a table names by `plugin = "…"`.
    ///
    /// # Errors
    /// When the name is missing or unknown, or the plugin refuses its configuration. Places are resolved.
    pub fn build(&self, table: &Table, context: &Context) -> Result<S, Fault> {
        let mut keys: DeTable = table.get_ref().clone();
        let known = || self.iter().map(|plugin| plugin.name);
        let Some(name) = keys.remove("plugin") else {
            let fault = Fault::here("missing key `plugin`").help(known_names("", known()));
            return Err(document::resolve(fault, table));
        };
        let Some(text) = name.get_ref().as_str() else {
            return Err(Fault::span(name.span(), "expected the name of a plugin, in quotes"));
        };
        let Some(plugin) = self.plugins.iter().find(|plugin| plugin.name == text) else {
            let fault = Fault::span(name.span(), format!("unknown plugin `{text}`"));
            return Err(fault.help(known_names(text, known())));
        };
        (plugin.build)(&Spanned::new(table.span(), keys), context).map_err(|fault| document::resolve(fault, table))
    }

    /// Whether the plugin of a name has a key.
    #[must_use]
    pub fn knows(&self, name: &str, key: &str) -> bool {
        let Some(plugin) = self.plugins.iter().find(|plugin| plugin.name == name) else { return false };
        plugin.schema().get("properties").is_some_and(|properties| properties.get(key).is_some())
    }

    /// Builds the plugin of a name without any keys of its own; `None` where there is none.
    #[must_use]
    pub fn build_default(&self, name: &str, context: &Context) -> Option<Result<S, Fault>> {
        let plugin = self.plugins.iter().find(|plugin| plugin.name == name)?;
        Some((plugin.build)(&Spanned::new(0..0, DeTable::new()), context))
    }
}
