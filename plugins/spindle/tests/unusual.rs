//! Sound campaigns of unusual rigs: nothing is named, and nothing is said to be left.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::{
    campaigns::{averaged, campaign, two_sections},
    trials::trials,
};
use runout_core::{
    closed_loop::{Settings, diagnosis::Verdict},
    rig::SetupConfig,
};
use runout_spindle::{diagnose::diagnose, effects, layout::Layout, selection::Selection, simulate::SpindleConfig};

fn unusual(name: &str, seed: u64) -> SpindleConfig {
    let mut config = campaign(seed, "[]");
    match name {
        "a part of 1 mm" => {
            config.rig.part_radius_mm = 1.0;
            config.form.rms_um = 1.0;
            config.eccentricity.offset_um = 2.0;
        }
        "a part of 300 mm" => config.rig.part_radius_mm = 300.0,
        "twelve sensors" => {
            config.rig.sensors = two_sections(&[0.0, 47.0, 99.844, 153.0, 202.5, 290.0]);
            config.rig.setups.truncate(1);
        }
        "eight setups" => {
            let setup = |index: u32| SetupConfig {
                id: format!("k{index}"),
                part_deg: f64::from(45 * index + 3 * index * index % 13),
                ..SetupConfig::default()
            };
            config.rig.setups = (0..8).map(setup).collect();
        }
        "five turns" => config.recording.revolutions = 5,
        "six turns" => config.recording.revolutions = 6,
        "many turns" => {
            config.recording.revolutions = 600;
            config.rig.setups.truncate(2);
        }
        "no noise" => {
            config.noise.rms_um = 0.0;
            config.asynchronous.rms_um = None;
        }
        "noise above the form" => {
            (config.noise.rms_um, config.asynchronous.rms_um, config.form.rms_um) = (5.0, Some(2.0), 1.0);
        }
        _ => (config.recording.speed_rpm, config.asynchronous.rms_um) = (30.0, Some(0.5)),
    }
    config
}

#[test]
fn sound_campaigns_of_unusual_rigs_raise_no_alarm() {
    let (mut doubted, seeds) = (0, trials(3) as u64);
    for name in [
        "a part of 1 mm",
        "a part of 300 mm",
        "twelve sensors",
        "eight setups",
        "five turns",
        "six turns",
        "many turns",
        "no noise",
        "noise above the form",
        "a slow spindle",
    ] {
        for seed in 1..=seeds {
            let config = unusual(name, seed);
            let rig = config.rig.clone().check().unwrap();
            let (station, _) = averaged(&config, &rig);
            let (selection, layout) = (Selection::whole(&rig), Layout::new(&rig, false));
            let found = diagnose(selection, layout, true, effects::all(), &[station], &Settings::default()).unwrap();
            let diagnosis = found.diagnosis;
            println!("simulated, {name}, seed {seed}: {:?} {:?}", diagnosis.verdict, diagnosis.unexplained);
            assert!(diagnosis.added.is_empty(), "{name}: {:?}", diagnosis.added);
            doubted += usize::from(diagnosis.verdict != Verdict::AtNoiseFloor);
        }
    }
    // A test of 1 % among thirty campaigns, or ten.
    assert!(doubted <= 1, "{doubted} of {}", 10 * seeds);
}
