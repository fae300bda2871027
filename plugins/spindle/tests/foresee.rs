//! What a rig would show of each effect before anyone measures, against what is known of the layouts of `physics.md`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod common;

use common::{FOUR_SENSORS, rig};
use runout_core::{model::foresight::Foresight, rig::Rig};
use runout_spindle::plan::{Addition, changes, foresee_rig};

const THREE_PART_ANGLES: [(f64, f64); 3] = [(0.0, 0.0), (99.844, 0.0), (202.5, 0.0)];

fn six_sensors() -> Vec<(f64, f64, &'static str)> {
    let sections = [(100.0, "a"), (130.0, "b")];
    sections.iter().flat_map(|(z, section)| [0.0, 99.844, 202.5].map(|angle| (angle, *z, *section))).collect()
}

fn foreseen(name: &str, rig: &Rig) -> Foresight {
    let start = std::time::Instant::now();
    let foresight = foresee_rig(rig).unwrap();
    println!("{name}: {:?}", start.elapsed());
    for visible in &foresight.visible {
        for parameter in &visible.parameters {
            println!(
                "  {} {:?} {} from {:.3e} of {:.3e} {}",
                visible.effect,
                visible.targets,
                parameter.name,
                parameter.visible_from,
                parameter.tolerance,
                parameter.unit
            );
        }
    }
    for unseen in &foresight.blind_to {
        println!("  blind {} {:?} {:?}", unseen.blind.effect, unseen.blind.targets, unseen.bias);
    }
    println!("  confounded {:?}", foresight.confounded);
    foresight
}

#[test]
fn explore() {
    for (name, rig) in [
        ("four, three part angles", rig(&FOUR_SENSORS, &THREE_PART_ANGLES)),
        ("six, reversed", rig(&six_sensors(), &[(0.0, 0.0), (180.0, 0.0)])),
        ("four, both reversed", rig(&FOUR_SENSORS, &[(0.0, 0.0), (180.0, 180.0)])),
        ("four, fixed", rig(&FOUR_SENSORS, &[(0.0, 0.0), (180.0, 0.0)])),
        ("three-point", rig(&[(0.0, 0.0, "a"), (99.844, 0.0, "a"), (202.5, 0.0, "a")], &[(0.0, 0.0)])),
    ] {
        let foresight = foreseen(name, &rig);
        let start = std::time::Instant::now();
        let changes = changes(&rig, &foresight, &[], 15.0).unwrap();
        println!("{:?}", start.elapsed());
        for change in &changes.found {
            println!("  + {:?}: reveals {:?}, tells apart {:?}", change.addition, change.reveals, change.tells_apart);
        }
        println!("  still {:?} {:?}", changes.still_blind, changes.still_confounded);
    }
    let _ = Addition::Sensor { section: 0, angle_deg: 0.0 };
}
