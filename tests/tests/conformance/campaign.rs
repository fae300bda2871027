//! Campaigns of `tests/campaigns`: what a plugin of a kind is tested with, and one run of it.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use runout_core::{
    fault::Fault,
    pipeline::{Context, Pipeline, Plugin, Registry, run::Silent, run::run_alone},
    stage::{Loader, Request, Simulation, Simulator, Source, SourceKind},
    summary::Summary,
    table::{RecordBatch, TableSpec},
};
use schemars::JsonSchema;
use serde::Deserialize;
use tempfile::TempDir;
use toml::{Spanned, Table, Value, de::DeTable};

use crate::{
    changed::{Between, Change, ChangedLoader, Readings, Taken},
    made,
};

/// The repository, which relative paths of campaigns start from.
pub(crate) fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_owned).unwrap_or_default()
}

/// The campaigns of a kind, by plugin.
pub(crate) fn campaigns(kind: &str) -> Table {
    let path = repository().join("tests/campaigns").join(format!("{kind}.toml"));
    fs::read_to_string(&path).unwrap().parse().unwrap()
}

/// The campaign of a plugin, or what to add.
pub(crate) fn campaign_of(campaigns: &Table, kind: &str, plugin: &str) -> Result<Table, String> {
    let found = campaigns.get(plugin).and_then(Value::as_table).cloned();
    found.ok_or_else(|| format!("it has no campaign: add [{plugin}] to tests/campaigns/{kind}.toml"))
}

/// The built-in plugins, and the loader `simulated`.
pub(crate) fn registry() -> Registry {
    let mut registry = runout_cli::builtin::registry();
    let about = "a campaign in memory";
    registry.loaders.add(Plugin::made("simulated", about, |keys: Simulated, context: &Context| {
        Ok(Box::new(keys.simulator(context)?) as Box<dyn Loader>)
    }));
    registry
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Simulated {
    scenario: String,
}

impl Simulated {
    fn simulator(&self, context: &Context) -> Result<InMemory, Fault> {
        simulator(&self.scenario, context).map(|simulator| InMemory(Box::leak(simulator)))
    }
}

/// The simulator of a scenario.
pub(crate) fn simulator(scenario: &str, context: &Context) -> Result<Box<dyn Simulator>, Fault> {
    let table: Spanned<DeTable> = DeTable::parse(scenario).map_err(|error| Fault::here(error.to_string()))?;
    runout_cli::builtin::registry().simulators.build(&table, context)
}

/// A simulator lives as long as the test.
struct InMemory(&'static dyn Simulator);

impl Loader for InMemory {
    fn kind(&self) -> SourceKind {
        SourceKind::Turns
    }

    fn open(&self, _wanted: &Request) -> runout_core::Result<Source> {
        match self.0.simulate()? {
            Simulation::Turns { recording, .. } => Ok(Source::Turns(recording)),
            _ => Err(runout_core::Error::new("simulate", "the campaign", "expected turns")),
        }
    }
}

/// How a separator is tested.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Turns: the rig of the simulated shaft.
    rig: Option<Table>,
    /// Points: the file, of the repository.
    path: Option<String>,
    /// Points: the scenario that makes the file.
    scenario: Option<Table>,
    /// Points: the formula of the suite that makes the file.
    made: Option<String>,
    /// The loader, where it is not `points`.
    load: Option<String>,
    /// Keys of the separator.
    #[serde(default)]
    separate: Table,
    /// Further tables of the pipeline.
    #[serde(default)]
    pipeline: Table,
    /// Columns that are readings.
    #[serde(default)]
    readings: Vec<String>,
    /// The reading that is 0.
    #[serde(default)]
    zero: f64,
    /// Noise that the suite adds to the readings.
    #[serde(default)]
    noise: f64,
    /// Values that are true, by their names; those of data without noise where there are none.
    #[serde(default)]
    truth: BTreeMap<String, f64>,
    /// Symbols of values that are the scatter itself: without noise they are others.
    #[serde(default)]
    scatter: Vec<String>,
    #[serde(default)]
    draws: Option<u64>,
    /// Checks that do not apply, with the reason.
    #[serde(default)]
    exempt: BTreeMap<String, String>,
}

/// A campaign of a separator.
pub(crate) struct Campaign {
    keys: Keys,
    plugin: String,
    folder: TempDir,
    pub(crate) registry: Arc<Registry>,
}

/// What a run gave.
pub(crate) struct Ran {
    pub(crate) summary: Summary,
    pub(crate) tables: Vec<(TableSpec, RecordBatch)>,
}

/// One value of a summary.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Named {
    pub(crate) name: String,
    pub(crate) value: f64,
    pub(crate) std: Option<f64>,
    pub(crate) interval_95: Option<[f64; 2]>,
    pub(crate) unit: String,
}

impl Campaign {
    /// Of a separator's table in `tests/campaigns`.
    pub(crate) fn new(table: Table, plugin: &str, registry: Arc<Registry>) -> Result<Self, String> {
        let keys: Keys = table.try_into().map_err(|error| error.to_string())?;
        let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
        let campaign = Self { keys, plugin: plugin.to_owned(), folder, registry };
        campaign.make().map_err(|error| format!("its data cannot be made: {error}"))?;
        Ok(campaign)
    }

    /// Where its files are.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Whether it is of turns.
    pub(crate) fn is_of_turns(&self) -> bool {
        self.keys.rig.is_some()
    }

    pub(crate) fn exempt(&self, check: &str) -> Option<&String> {
        self.keys.exempt.get(check)
    }

    pub(crate) fn exempt_checks(&self) -> impl Iterator<Item = &String> {
        self.keys.exempt.keys()
    }

    pub(crate) fn truth(&self) -> &BTreeMap<String, f64> {
        &self.keys.truth
    }

    pub(crate) fn is_of_scatter(&self, name: &str) -> bool {
        let own =
            |symbol: &String| name.split(", ").any(|part| part == symbol || part.starts_with(&format!("{symbol} of ")));
        self.keys.scatter.iter().any(own)
    }

    pub(crate) fn draws(&self) -> u64 {
        self.keys.draws.unwrap_or(30)
    }

    /// Whether its data are readings.
    pub(crate) fn has_readings(&self) -> bool {
        self.is_of_turns() || !self.keys.readings.is_empty()
    }

    /// Where its noise comes from the suite, or the simulator of turns.
    pub(crate) fn has_noise(&self) -> bool {
        self.is_of_turns() || self.keys.noise > 0.0
    }

    fn made_file(&self) -> PathBuf {
        let heights = self.keys.load.as_deref() == Some("height-map");
        self.folder.path().join(if heights { "map.h5" } else { "data.csv" })
    }

    fn make(&self) -> Result<(), String> {
        if let Some(scenario) = &self.keys.scenario {
            let file = self.folder.path().join("scenario.toml");
            fs::write(&file, scenario.to_string()).map_err(|error| error.to_string())?;
            let out = self.made_file();
            let words = ["simulate".into(), file.into(), "--out".into(), out.into()];
            let made = runout_cli::documents::of_command(words.into(), &self.registry);
            made.map_err(|_| "the scenario is refused".to_owned())?;
        }
        if let Some(name) = &self.keys.made {
            fs::write(self.made_file(), made::points(name)).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// The text of its pipeline.
    fn text(&self, change: &Change) -> String {
        let mut text = Table::new();
        text.insert("title".into(), "Conformance".into());
        let load: [(&str, String); 2] = if let Some(rig) = &self.keys.rig {
            text.insert("rig".into(), Value::Table(rig.clone()));
            let preprocess = "[[preprocess]]\nplugin = 'synchronous-average'\nsamples_per_rev = 64";
            text.extend(preprocess.parse::<Table>().unwrap());
            [("plugin", "simulated".into()), ("scenario", shaft(rig, change))]
        } else {
            let path = self.keys.path.as_ref().map_or_else(|| self.made_file(), |path| repository().join(path));
            let plugin = self.keys.load.clone().unwrap_or_else(|| "points".into());
            [("plugin", plugin), ("path", path.display().to_string())]
        };
        let load = load.map(|(key, value)| (key.to_owned(), Value::String(value))).into_iter().collect();
        text.insert("load".into(), Value::Table(load));
        let mut separate = self.keys.separate.clone();
        separate.insert("plugin".into(), self.plugin.clone().into());
        text.insert("separate".into(), Value::Table(separate));
        text.extend(self.keys.pipeline.clone());
        text.to_string()
    }

    /// Its pipeline on changed data, with further tables; without exporters.
    pub(crate) fn pipeline(&self, change: &Change, more: &str) -> Result<Pipeline, String> {
        let text = format!("{}\n{more}", self.text(change));
        let pipeline = Pipeline::from_toml(&text, self.folder.path(), &self.registry);
        let mut pipeline = pipeline.map_err(|error| format!("{error:?}"))?;
        let readings = Readings { columns: self.keys.readings.clone(), zero: self.keys.zero, noise: self.keys.noise };
        let nothing =
            Box::new(InMemory(Box::leak(simulator(SMALLEST, &Context { folder: Path::new("."), rig: None }).unwrap())));
        let inner = std::mem::replace(&mut pipeline.loader, nothing);
        pipeline.loader = Box::new(ChangedLoader { inner, change: change.clone(), readings });
        Ok(pipeline)
    }

    /// One run on changed data.
    pub(crate) fn run(&self, change: &Change) -> Result<Ran, String> {
        let mut pipeline = self.pipeline(change, "")?;
        let taken = Taken::default();
        pipeline.exporters =
            vec![Box::new(Between { inner: None, taken: Arc::clone(&taken), piece: None, fails: false })];
        let summary = run_alone(&pipeline, &Silent).map_err(|error| error.to_string())?;
        let tables = taken.lock().unwrap().clone();
        Ok(Ran { summary, tables })
    }
}

impl Ran {
    /// Its values, each with a name that is its own.
    pub(crate) fn values(&self) -> Vec<Named> {
        let placed = self.summary.all_values();
        let named = placed.iter().map(|placed| {
            let name = [placed.station.map(str::to_owned), placed.part(), Some(placed.id().to_string())];
            let (value, name) = (placed.value, name.into_iter().flatten().collect::<Vec<_>>().join(", "));
            let (std, interval_95) = (value.std(), value.interval_95());
            Named { name, value: value.value, std, interval_95, unit: value.unit.clone() }
        });
        named.collect()
    }
}

/// The shaft that all rigs measure: form of orders to 20, error motion without tilt, at three stations.
fn shaft(rig: &Table, change: &Change) -> String {
    let noise_um = 0.05 * change.noise;
    let seed = change.seed;
    let text = format!(
        "plugin = 'spindle'\nseed = {seed}\n\
         recording = {{ speed_rpm = 500, revolutions = 24, samples_per_rev = 64, \
         stations = {{ first_z_mm = 0, step_mm = 5, count = 3 }} }}\n\
         form = {{ rms_um = 2, max_order = 20 }}\nmotion = {{ x_rms_um = 1, y_rms_um = 1 }}\n\
         noise = {{ rms_um = {noise_um} }}\n"
    );
    let mut table: Table = text.parse().unwrap();
    table.insert("rig".into(), Value::Table(rig.clone()));
    table.to_string()
}

/// A scenario that is not run.
const SMALLEST: &str = "plugin = 'spindle'\nrig = { part_radius_mm = 1, sensors = [{ id = 'S', angle_deg = 0 }], setups = [{ id = 'a' }] }";
