//! How often the stated 95 % intervals of the standards' values cover the true value: whole pipelines, from recording to values.
//! The true value is that of the same campaign without noise and asynchronous motion, by the same evaluation.

use std::{
    collections::BTreeMap,
    fmt::Write,
    num::NonZeroUsize,
    ops::Range,
    path::Path,
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
};

use runout_core::{
    Error, Result,
    evaluate::Value,
    pipeline::{
        INCLUDE_KEY, Pipeline, Registry,
        document::Sources,
        run::{Silent, run},
    },
    summary::Summary,
};
use runout_hdf5::{WriteOptions, write_measurement};
use runout_spindle::simulate::{SpindleConfig, simulator};

use crate::{blind::draw::Layout, campaign};

/// Where a campaign's form has its orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spectrum {
    /// Amplitudes that fall with 1/order, 2 to 60.
    Falling,
    /// A tenth of the size, equal amplitudes, 2 to 120.
    Flat,
}

impl Spectrum {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Falling, Self::Flat];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Falling => "form 4 µm rms, 1/order to 60",
            Self::Flat => "form 0.4 µm rms, flat to 120",
        }
    }
}

/// The rigs: the first two of the blind benchmark's.
pub const RIGS: [Layout; 2] = [Layout::Four, Layout::Six];

/// What was counted of one value.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Row {
    /// Intervals that cover the true value.
    pub inside: usize,
    /// Intervals with the truth below and above.
    pub beside: [usize; 2],
    /// Values without an interval.
    pub without: usize,
}

impl Row {
    /// Intervals.
    #[must_use]
    pub fn intervals(&self) -> usize {
        self.inside + self.beside[0] + self.beside[1]
    }

    /// Share that covers the true value, in percent.
    #[must_use]
    pub fn percent(&self) -> f64 {
        100.0 * self.inside as f64 / self.intervals().max(1) as f64
    }
}

/// Rows by symbol, reference and filter.
pub type Rows = BTreeMap<String, Row>;

/// The stages of every pipeline.
const STAGES: &str = r#"
[load]
plugin = "hdf5"
path = "NAME.h5"
[[preprocess]]
plugin = "synchronous-average"
samples_per_rev = 512
[separate]
plugin = "harmonic-least-squares"
[evaluate]
values = ["roundness", "harmonics", "texture", "cylindricity", "error-motion"]
references = ["LSCI", "MZCI", "MICI", "MCCI"]
filter_upr = [15, 50]
lambda_c_mm = 8
slope_window_deg = 30
"#;

/// A campaign: 40 turns of 512 samples, eccentricity 8 µm.
fn config(rig: Layout, spectrum: Spectrum, seed: u64) -> SpindleConfig {
    let mut config = campaign::reference(seed, 8.0);
    config.rig = rig.config();
    config.recording.revolutions = 40;
    if spectrum == Spectrum::Flat {
        config.form.rms_um = 0.4;
        config.form.max_order = 120;
        config.form.slope = 0.0;
    }
    config
}

/// The campaign without what differs from turn to turn, noise and asynchronous motion; 10 turns.
fn without_noise(mut config: SpindleConfig) -> SpindleConfig {
    config.noise.rms_um = 0.0;
    config.asynchronous.rms_um = None;
    config.asynchronous.tilt_rms_urad = 0.0;
    config.recording.revolutions = 10;
    config
}

/// Coverage of every value over campaigns (their seeds) of one rig and spectrum, in a folder for the recordings.
///
/// # Errors
/// When a stage fails.
pub fn rows(rig: Layout, spectrum: Spectrum, campaigns: Range<u64>, folder: &Path) -> Result<Rows> {
    let workers = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let (next, total) = (AtomicU64::new(campaigns.start), Mutex::new(Rows::new()));
    let stopped = || Error::new("evaluate", "campaigns", "a thread stopped");
    std::thread::scope(|scope| {
        let work = |worker: usize| -> Result<()> {
            loop {
                let seed = next.fetch_add(1, Ordering::Relaxed);
                if seed >= campaigns.end {
                    return Ok(());
                }
                let config = config(rig, spectrum, seed);
                let found = evaluated(&config, folder, worker)?;
                let truth = evaluated(&without_noise(config), folder, worker)?;
                let mut total = total.lock().map_err(|_| stopped())?;
                count(&found, &truth, &mut total);
            }
        };
        let handles: Vec<_> = (0..workers).map(|worker| scope.spawn(move || work(worker))).collect();
        handles.into_iter().try_for_each(|handle| handle.join().unwrap_or_else(|_| Err(stopped())))
    })?;
    total.into_inner().map_err(|_| stopped())
}

/// A campaign from its recording to its values.
fn evaluated(config: &SpindleConfig, folder: &Path, worker: usize) -> Result<Summary> {
    let mut registry = Registry::default();
    runout_hdf5::register(&mut registry);
    runout_preprocess::register(&mut registry);
    runout_spindle::register(&mut registry);
    let simulator = simulator(config).map_err(|fault| Error::caused("check", "the scenario", fault))?;
    let name = format!("campaign-{worker}");
    let path = folder.join(format!("{name}.h5"));
    let options = WriteOptions::default();
    write_measurement(&simulator.spindle_recording(), simulator.rig(), &path, &options, &mut |_| {})?;
    let rig = toml::to_string(&BTreeMap::from([("rig", &config.rig)]))
        .map_err(|error| Error::caused("write", "the rig", error))?;
    let text = format!("{}\n{rig}", STAGES.replace("NAME", &name));
    let sources = Sources::from_text("pipeline.toml", &text, folder.to_owned(), &[], INCLUDE_KEY)
        .map_err(|error| Error::caused("read", "the pipeline", error))?;
    let pipeline =
        Pipeline::from_sources(&sources, &registry).map_err(|error| Error::caused("check", "the pipeline", error))?;
    run(&pipeline, NonZeroUsize::new(1), &Silent)
}

/// What is beside the spread over the turns has its truth without them.
fn is_synchronous(symbol: &str) -> bool {
    !["asynchronous", "total"].iter().any(|kind| symbol.starts_with(kind))
}

pub(crate) fn count(found: &Summary, truth: &Summary, rows: &mut Rows) {
    // Every section and station in turn: the n-th of a name is that of the other.
    let named = |summary: &Summary| {
        let mut places: BTreeMap<String, Vec<Value>> = BTreeMap::new();
        for placed in summary.placed_values() {
            let value = placed.value;
            let [reference, filter] = [&value.reference, &value.filter].map(|text| text.as_deref().unwrap_or_default());
            let name = format!("{} | {reference} | {filter}", value.symbol);
            places.entry(name).or_default().push(value.clone());
        }
        places
    };
    let truth = named(truth);
    for (name, values) in named(found) {
        let Some(true_values) = truth.get(&name).filter(|_| is_synchronous(&name)) else { continue };
        let row = rows.entry(name).or_default();
        for (value, truth) in values.iter().zip(true_values) {
            let Some(uncertainty) = &value.uncertainty else {
                row.without += 1;
                continue;
            };
            let [low, high] = uncertainty.interval_95;
            if truth.value < low {
                row.beside[0] += 1;
            } else if truth.value > high {
                row.beside[1] += 1;
            } else {
                row.inside += 1;
            }
        }
    }
}

/// The rows as Markdown.
#[must_use]
pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| value | reference | filter | intervals | contain the truth | truth below | truth above | values without an interval |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for (name, row) in rows {
        let share = if row.intervals() == 0 { "-".into() } else { format!("{:.1} %", row.percent()) };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {name} | {} | {share} | {} | {} | {} |",
            row.intervals(),
            row.beside[0],
            row.beside[1],
            row.without
        );
    }
    text
}
