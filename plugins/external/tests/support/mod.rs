//! A small simulated campaign, and Python where it is there.

#![allow(dead_code, clippy::unwrap_used, reason = "tests; each uses a part of it")]

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use runout_core::{
    Result,
    fault::Fault,
    pipeline::{Context, Pipeline, Plugin, Registry, StageConfig, document::Sources},
    rig::RigConfig,
    stage::{Loader, Request, Source, SourceKind},
};
use runout_spindle::simulate::{Effect, SpindleConfig, SpindleSimulator, simulator};
use schemars::JsonSchema;
use serde::Deserialize;

/// Three sensors around one section and three angles of the part, which determine more than is wanted.
pub(crate) const MULTI_STEP_RIG: &str = r#"{ part_radius_mm = 30, sensors = [{ id = "S1", angle_deg = 0, z_mm = 100 },
    { id = "S2", angle_deg = 99.844, z_mm = 100 }, { id = "S3", angle_deg = 202.5, z_mm = 100 }],
    setups = [{ id = "a" }, { id = "b", part_deg = 99.844 }, { id = "c", part_deg = 202.5 }] }"#;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Simulated {
    seed: u64,
    rig: RigConfig,
    #[serde(default)]
    effect: Vec<Effect>,
}

struct SimulatedRecording(&'static SpindleSimulator);

impl Loader for SimulatedRecording {
    fn kind(&self) -> SourceKind {
        SourceKind::Turns
    }

    fn open(&self, _wanted: &Request) -> Result<Source> {
        Ok(Source::Turns(Box::new(self.0.spindle_recording())))
    }
}

impl StageConfig for Simulated {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "simulated";
    const ABOUT: &'static str = "a campaign in memory";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let mut config = SpindleConfig::new(self.rig);
        config.seed = self.seed;
        config.recording.samples_per_rev = 128;
        config.recording.revolutions = 30;
        config.recording.stations.count = 3;
        config.recording.stations.step_mm = 2.0;
        config.form.rms_um = 4.0;
        config.form.max_order = 25;
        config.motion.x_rms_um = 1.5;
        config.motion.y_rms_um = 1.5;
        config.eccentricity.offset_um = 4.0;
        config.noise.rms_um = 0.05;
        config.effect = self.effect;
        Ok(Box::new(SimulatedRecording(Box::leak(Box::new(simulator(&config)?)))))
    }
}

/// What is registered: a simulator in memory, and what a run needs.
pub(crate) fn registry() -> Registry {
    let mut registry = Registry::default();
    registry.loaders.add(Plugin::of::<Simulated>());
    runout_points::register(&mut registry);
    runout_flatness::register(&mut registry);
    runout_touch_probe::register(&mut registry);
    runout_preprocess::register(&mut registry);
    runout_spindle::register(&mut registry);
    runout_parquet::register(&mut registry);
    runout_external::register(&mut registry);
    registry
}

/// Three sensors around one section.
pub(crate) fn rig(rotation: &str) -> String {
    format!(
        r#"{{ part_radius_mm = 30, rotation = "{rotation}", sensors = [{{ id = "S1", angle_deg = 0, z_mm = 100 }},
        {{ id = "S2", angle_deg = 99.844, z_mm = 100 }}, {{ id = "S3", angle_deg = 202.5, z_mm = 100 }}],
        setups = [{{ id = "initial", part_deg = 20, sensors_deg = 5 }}] }}"#
    )
}

/// A pipeline on the simulated campaign.
pub(crate) fn pipeline(folder: &Path, rig: &str, stages: &str) -> Pipeline {
    let text = format!(
        "rig = {rig}\n[load]\nplugin = \"simulated\"\nseed = 7\nrig = {rig}\n\
         [[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = 128\n{stages}"
    );
    let sources = Sources::from_text("test", &text, folder.to_owned(), &[], "none").unwrap();
    Pipeline::from_sources(&sources, &registry()).map_err(|error| error.to_string()).unwrap()
}

/// Python with NumPy and pyarrow; says so where it is missing.
pub(crate) fn python() -> Option<String> {
    let python = std::env::var("RUNOUT_PYTHON").unwrap_or_else(|_| "python3".into());
    let required = std::env::var("RUNOUT_REQUIRE_FOREIGN").is_ok_and(|value| value == "1");
    let there = Command::new(&python).args(["-c", "import numpy, pyarrow"]).output();
    let there = there.is_ok_and(|output| output.status.success());
    assert!(there || !required, "{python} cannot import numpy and pyarrow, and RUNOUT_REQUIRE_FOREIGN is 1");
    if !there {
        println!("skipped: {python} cannot import numpy and pyarrow; RUNOUT_PYTHON may name one that can");
    }
    there.then_some(python)
}

/// A folder or file of the repository.
pub(crate) fn of_repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path).canonicalize().unwrap()
}
