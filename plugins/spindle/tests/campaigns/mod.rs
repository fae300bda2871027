//! Simulated campaigns: the data come from the time-domain simulator, which shares no formula with the model.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::path::Path;

use runout_core::{
    inspection::Inspection,
    measurement::{Recording, SampleStream, StationTruth},
    pipeline::{Context, StageConfig},
    rig::{Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
    stage::{AverageRequest, Preprocessor, Station},
};
use runout_preprocess::{LowPassConfig, SynchronousAverageConfig};
use runout_spindle::simulate::{self, SpindleConfig};

/// `docs/appendix/physics.md` section 4: sensor noise 0.05 µm, asynchronous motion 0.15 µm, form 4 µm, motion 1.5 µm rms, 8 µm off
/// centre.
pub(crate) fn campaign(seed: u64, effects: &str) -> SpindleConfig {
    let sensor = |id: &str, angle_deg: f64, z_mm: f64, section: &str| SensorConfig {
        id: id.into(),
        angle_deg,
        z_mm,
        section: section.into(),
        sign: 1,
        ..SensorConfig::default()
    };
    let setup = |(id, part_deg): (&str, f64)| SetupConfig { id: id.into(), part_deg, ..SetupConfig::default() };
    let rig = RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Ccw,
        sensors: vec![
            sensor("S1", 0.0, 100.0, "a"),
            sensor("S2", 90.0, 100.0, "a"),
            sensor("S3", 0.0, 130.0, "b"),
            sensor("S4", 90.0, 130.0, "b"),
        ],
        setups: [("a", 0.0), ("b", 99.844), ("c", 202.5)].into_iter().map(setup).collect(),
    };
    let mut config = SpindleConfig::new(rig);
    config.seed = seed;
    config.form.rms_um = 4.0;
    config.motion.x_rms_um = 1.5;
    config.motion.y_rms_um = 1.5;
    config.motion.tilt_rms_urad = 3.0;
    config.eccentricity.offset_um = 8.0;
    config.asynchronous.rms_um = Some(0.15);
    config.noise.rms_um = 0.05;
    config.effect = serde_json::from_str(effects).unwrap();
    config
}

/// Sensors at some angles in each of two sections, 30 mm apart.
pub(crate) fn two_sections(angles_deg: &[f64]) -> Vec<SensorConfig> {
    let places = [(100.0, "a"), (130.0, "b")]
        .into_iter()
        .flat_map(|(z_mm, section)| angles_deg.iter().map(move |angle_deg| (*angle_deg, z_mm, section)));
    let sensor = |(number, (angle_deg, z_mm, section)): (usize, (f64, f64, &str))| SensorConfig {
        id: format!("S{number}"),
        angle_deg,
        z_mm,
        section: section.into(),
        sign: 1,
        ..SensorConfig::default()
    };
    (1..).zip(places).map(sensor).collect()
}

/// The station that a campaign records, a fifth of its turns held out, and its truth.
pub(crate) fn averaged(config: &SpindleConfig, rig: &Rig) -> (Station, StationTruth) {
    averaged_behind(None, config, rig)
}

/// The station of recordings that are changed on their way, a fifth of its turns held out, and its truth.
pub(crate) fn averaged_from(
    config: &SpindleConfig,
    rig: &Rig,
    change: impl FnMut(Box<dyn SampleStream + '_>) -> Box<dyn SampleStream + '_>,
) -> (Station, StationTruth) {
    averaged_through(None, config, rig, change)
}

/// The station of recordings behind a low-pass, a fifth of its turns held out, and its truth.
pub(crate) fn averaged_behind(cutoff_hz: Option<f64>, config: &SpindleConfig, rig: &Rig) -> (Station, StationTruth) {
    averaged_through(cutoff_hz, config, rig, |input| input)
}

fn averaged_through(
    cutoff_hz: Option<f64>,
    config: &SpindleConfig,
    rig: &Rig,
    mut change: impl FnMut(Box<dyn SampleStream + '_>) -> Box<dyn SampleStream + '_>,
) -> (Station, StationTruth) {
    let simulator = simulate::simulator(config).unwrap();
    let recording = simulator.spindle_recording();
    let average = SynchronousAverageConfig {
        samples_per_rev: config.recording.samples_per_rev.min(512),
        min_turns: 2,
        turn_tolerance_percent: 5.0,
        outlier_sigma: None,
        speed_tolerance_percent: 2.0,
    };
    let Preprocessor::Averager(averager) = average.check(&Context { folder: Path::new(""), rig: None }).unwrap() else {
        panic!("no averager");
    };
    let low_pass = cutoff_hz.map(|cutoff_hz| {
        let checked = LowPassConfig { cutoff_hz, order: 4 }.check(&Context { folder: Path::new(""), rig: None });
        let Preprocessor::Conditioner(low_pass) = checked.unwrap() else { panic!("no filter") };
        low_pass
    });
    let profile = |setup| {
        let inspected: Box<dyn SampleStream> = Box::new(Inspection::new(change(recording.open(0, setup).unwrap())));
        let stream = match &low_pass {
            Some(low_pass) => low_pass.attach(inspected).unwrap(),
            None => inspected,
        };
        averager.average_requested(stream, AverageRequest { hold_out: Some(0.2), ..AverageRequest::default() }).unwrap()
    };
    let profiles = (0..rig.setups.len()).map(profile).collect();
    let station = Station { name: "s001".into(), z_mm: 0.0, profiles };
    (station, recording.truth(0).unwrap().unwrap())
}
