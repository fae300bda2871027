//! How the time of a diagnosis grows with the stations: four sensors, three setups, 512 × 60 turns a capture.

use std::{fmt::Write, time::Instant};

use runout_core::{Error, Result, closed_loop::Settings, stage::Station};
use runout_spindle::{
    diagnose::diagnose,
    effects,
    layout::Layout,
    selection::Selection,
    simulate::{Effect, ReversalAngle, SpindleConfig, simulator},
};

use crate::campaign;

/// Stations of each campaign.
pub const STATIONS: [usize; 3] = [1, 4, 16];
/// The fastest of so many runs counts.
const RUNS: usize = 3;
/// Share of the turns, at the end, that no fit sees: the default of `[diagnose]`.
const HOLD_OUT: f64 = 0.2;

/// Time over the number of stations.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Stations of the campaign.
    pub stations: usize,
    /// Seconds for a campaign that is as declared.
    pub sound_s: f64,
    /// For one with the part at another angle in one setup.
    pub one_effect_s: f64,
}

/// Times the loop on averaged turns, on one core: without simulating, reading and averaging.
///
/// # Errors
/// When a campaign cannot be made or diagnosed.
pub fn rows() -> Result<Vec<Row>> {
    let effect = Effect::ReversalAngle(ReversalAngle { targets: vec!["k2".into()], angle_deg: 0.34, declared: false });
    let row = |stations: usize| {
        Ok(Row { stations, sound_s: seconds(stations, None)?, one_effect_s: seconds(stations, Some(&effect))? })
    };
    STATIONS.into_iter().map(row).collect()
}

fn seconds(stations: usize, effect: Option<&Effect>) -> Result<f64> {
    let mut config: SpindleConfig = campaign::reference(1, 8.0);
    config.recording.stations.count = stations;
    config.effect.extend(effect.cloned());
    let rig = config.rig.clone().check().map_err(|fault| Error::caused("check", "the rig", fault))?;
    let simulator = simulator(&config).map_err(|fault| Error::caused("check", "the scenario", fault))?;
    let recording = &config.recording;
    let [samples, turns] = [recording.samples_per_rev, recording.revolutions];
    let one = |index| Ok(campaign::station_holding_out(&simulator, &rig, index, [samples, turns], Some(HOLD_OUT))?.0);
    let averaged: Vec<Station> = (0..stations).map(one).collect::<Result<_>>()?;
    let mut fastest = f64::INFINITY;
    for _ in 0..RUNS {
        let (selection, layout) = (Selection::whole(&rig), Layout::new(&rig, false));
        let start = Instant::now();
        diagnose(selection, layout, true, effects::all(), &averaged, &Settings::default())?;
        fastest = fastest.min(start.elapsed().as_secs_f64());
    }
    Ok(fastest)
}

/// The rows as Markdown.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| stations | as declared | a station | one effect | a station |\n| --- | --- | --- | --- | --- |\n",
    );
    for Row { stations, sound_s, one_effect_s } in rows {
        let each = |seconds: &f64| seconds / *stations as f64;
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {stations} | {sound_s:.2} s | {:.2} s | {one_effect_s:.2} s | {:.2} s |",
            each(sound_s),
            each(one_effect_s)
        );
    }
    text
}
