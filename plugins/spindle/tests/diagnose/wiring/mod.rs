//! Mistakes in the rig file, on simulated campaigns: the simulator records what was there, and the rig says something else.

mod one_setup;
mod places;
mod units;

use runout_core::{
    closed_loop::{
        Settings,
        diagnosis::{Added, Verdict},
    },
    rig::RigConfig,
    stage::{Station, StationDiagnosis, StationSeparator},
};
use runout_spindle::{
    diagnose::diagnose,
    effects,
    layout::Layout,
    selection::Selection,
    separators::{HarmonicLeastSquares, Weighting},
    simulate::SpindleConfig,
};

use super::{CLEAN_UM, diagnosed};
use crate::{
    campaigns::{averaged, campaign, two_sections},
    trials::trials,
};

/// A campaign with three sensors in each of two sections: every mistake in one channel shows by itself.
fn six(seed: u64, effects: &str) -> SpindleConfig {
    let mut config = campaign(seed, effects);
    config.rig.sensors = two_sections(&[0.0, 99.844, 202.5]);
    config
}

/// A campaign with the part and all sensors turned round.
fn reversed(seed: u64, effects: &str) -> SpindleConfig {
    let mut config = campaign(seed, effects);
    config.rig.setups.truncate(2);
    (config.rig.setups[1].part_deg, config.rig.setups[1].sensors_deg) = (180.0, 180.0);
    config
}

fn looked_into(rig: &RigConfig, station: &Station) -> StationDiagnosis {
    let rig = rig.clone().check().unwrap();
    let layout = Layout::new(&rig, false);
    diagnose(Selection::whole(&rig), layout, true, effects::all(), std::slice::from_ref(station), &Settings::default())
        .unwrap()
}

/// What `run` warns of, or refuses.
fn warned(rig: &RigConfig, station: &Station) -> Vec<String> {
    let rig = rig.clone().check().unwrap();
    match HarmonicLeastSquares::new(&rig, true, Weighting::TurnCovariance).separate(station) {
        Ok(separated) => {
            let checks = separated.residual.checks.into_iter();
            let is_asked = |finding: &String| finding.contains("have the same") || finding.contains("unit");
            let found = checks.map(|check| check.finding).filter(is_asked);
            separated.warnings.into_iter().chain(found).collect()
        }
        Err(error) => vec![error.to_string(), error.advice().unwrap_or_default().to_owned()],
    }
}

fn name(added: &Added) -> String {
    std::iter::once(&added.effect).chain(&added.targets).cloned().collect::<Vec<_>>().join(" ")
}

/// The mistakes, and nothing else, are named; each by itself or in its set.
fn names(config: &SpindleConfig, mistakes: &[&str], changes: &[&str]) -> (StationDiagnosis, [f64; 2]) {
    let (found, [before, after]) = diagnosed(config);
    let diagnosis = &found.diagnosis;
    let chi2 = [&diagnosis.before, &diagnosis.after].map(|level| level.chi2_per_dof.unwrap());
    let added: Vec<String> = diagnosis.added.iter().map(name).collect();
    let sets: Vec<&Vec<String>> = diagnosis.added.iter().map(|added| &added.confounded_with).collect();
    println!(
        "simulated, {mistakes:?}: {added:?} or {sets:?}, χ² {:.1} → {:.2}, form error {before:.4} → {after:.4} µm",
        chi2[0], chi2[1]
    );
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{mistakes:?}: {added:?}");
    assert_eq!(added.len(), mistakes.len(), "{added:?}");
    for mistake in mistakes {
        let holds = |added: &Added| name(added) == *mistake || added.confounded_with.iter().any(|one| one == mistake);
        assert!(diagnosis.added.iter().any(holds), "{mistake}: {added:?} or {sets:?}");
    }
    let said: Vec<&str> = diagnosis.added.iter().filter_map(|added| added.change.as_deref()).collect();
    for change in changes {
        assert!(said.contains(change), "{change}: {said:?}");
    }
    (found, [before, after])
}

#[test]
fn six_sensors_name_every_mistake() {
    for (effect, mistake, change) in [
        (r#"{"plugin":"sensor-sign","targets":["S2"]}"#, "sensor-sign S2", "sensors.1.sign = -1"),
        (
            r#"{"plugin":"sensors-swapped","targets":["S1","S3"]}"#,
            "sensors-swapped S1 S3",
            "sensors.0.id = \"S3\"\nsensors.2.id = \"S1\"",
        ),
        (
            r#"{"plugin":"sensors-swapped","targets":["S2","S6"]}"#,
            "sensors-swapped S2 S6",
            "sensors.1.id = \"S6\"\nsensors.5.id = \"S2\"",
        ),
        (
            r#"{"plugin":"setups-swapped","targets":["b","c"]}"#,
            "setups-swapped b c",
            "setups.1.id = \"c\"\nsetups.2.id = \"b\"",
        ),
        (r#"{"plugin":"rotation-reversed"}"#, "rotation-reversed", r#"rotation = "cw""#),
        (
            r#"{"plugin":"part-angle-sign"}"#,
            "part-angle-sign",
            "setups.1.part_deg = -99.844\nsetups.2.part_deg = -202.5",
        ),
    ] {
        for seed in 1..=trials(2) as u64 {
            let config = six(seed, &format!("[{effect}]"));
            let (found, [_, after]) = names(&config, &[mistake], &[change]);
            assert!(found.diagnosis.added[0].confounded_with.is_empty(), "{:?}", found.diagnosis.added);
            assert!(after < CLEAN_UM, "{after}");
            let rig = config.rig.clone().check().unwrap();
            let warnings = warned(&config.rig, &averaged(&config, &rig).0);
            let says = |warning: &String| {
                warning.contains(&format!("`{mistake}`")) && warning.contains(&change.replace('\n', "; "))
            };
            assert!(warnings.iter().any(says), "{warnings:?}");
        }
    }
}

/// A sign is named beside an effect of usual kind, and two mistakes at once.
#[test]
fn mistakes_are_named_together_and_beside_effects() {
    let two = r#"[{"plugin":"sensor-sign","targets":["S1"]},{"plugin":"sensor-sign","targets":["S5"]}]"#;
    names(&six(3, two), &["sensor-sign S1", "sensor-sign S5"], &[]);
    let mixed = r#"[{"plugin":"sensor-sign","targets":["S4"]},{"plugin":"setups-swapped","targets":["a","b"]}]"#;
    names(&six(4, mixed), &["sensor-sign S4", "setups-swapped a b"], &[]);
    let beside = r#"[{"plugin":"sensors-swapped","targets":["S1","S2"]},
        {"plugin":"reversal-angle","targets":["b"],"angle_deg":0.34}]"#;
    let (found, [_, after]) = names(&six(5, beside), &["sensors-swapped S1 S2", "reversal-angle b"], &[]);
    assert!(after < CLEAN_UM, "{after}: {:?}", found.diagnosis.added);
}

/// A sensor half a turn from its angle. Two sensors in a section do not distinguish it from another mistake: then both are in the uncertainty.
#[test]
fn a_sensor_on_the_other_side_is_named() {
    for (sensor, change) in [("S2", "sensors.1.angle_deg = -80.156"), ("S4", "sensors.3.angle_deg = 180.0")] {
        let effect = format!(r#"[{{"plugin":"sensor-angle","targets":["{sensor}"],"angle_deg":180.0}}]"#);
        let (found, [_, after]) = names(&six(8, &effect), &[&format!("sensor-opposite {sensor}")], &[change]);
        assert!(found.diagnosis.added[0].confounded_with.is_empty() && after < CLEAN_UM, "{after}");
    }
    let four = campaign(9, r#"[{"plugin":"sensor-angle","targets":["S2"],"angle_deg":180.0}]"#);
    let (found, [_, after]) = names(&four, &["sensor-opposite S2"], &[]);
    let stated = (0..2).map(|section| found.after[0].angle_std(section)).fold(0.0, f64::max);
    assert!(after < CLEAN_UM || after < 3.0 * stated, "{after} {stated}");
}

/// All sensors' angles count clockwise, the part's do not.
#[test]
fn sensors_counted_the_other_way_are_named() {
    let mirrored = |(number, angle_deg): (usize, f64)| {
        format!(r#"{{"plugin":"sensor-angle","targets":["S{number}"],"angle_deg":{}}}"#, -2.0 * angle_deg)
    };
    let effects = [(2, 99.844), (3, 202.5), (5, 99.844), (6, 202.5)].map(mirrored).join(",");
    let changes = ["sensors.1.angle_deg = -99.844\nsensors.2.angle_deg = -202.5\nsensors.4.angle_deg = -99.844\n\
                    sensors.5.angle_deg = -202.5"];
    let (_, [_, after]) = names(&six(10, &format!("[{effects}]")), &["sensor-angles-sign"], &changes);
    assert!(after < CLEAN_UM, "{after}");
}

/// Uncertainties after a sign are those of the rig with that sign.
#[test]
fn a_corrected_sign_has_the_uncertainty_of_a_right_one() {
    let config = six(11, r#"[{"plugin":"sensor-sign","targets":["S2"]}]"#);
    let (found, _) = diagnosed(&config);
    let (right, _) = diagnosed(&six(11, "[]"));
    let stated = |one: &StationDiagnosis| -> Vec<f64> {
        (0..one.after[0].unknowns.len()).map(|unknown| one.after[0].angle_std(unknown)).collect()
    };
    for (found, right) in stated(&found).into_iter().zip(stated(&right)) {
        assert!((found / right - 1.0).abs() < 0.1, "{found} for {right}");
    }
    let chi2 = [&found, &right].map(|one| one.diagnosis.after.chi2_per_dof.unwrap());
    assert!((chi2[0] / chi2[1] - 1.0).abs() < 0.2, "{chi2:?}");
}

/// Three setups one place on: two swaps, and one change of the file.
#[test]
fn setups_in_a_cycle_are_named() {
    let cycle = r#"[{"plugin":"setups-swapped","targets":["a","b"]},{"plugin":"setups-swapped","targets":["b","c"]}]"#;
    let config = six(6, cycle);
    let (found, [_, after]) = diagnosed(&config);
    let added: Vec<&str> = found.diagnosis.added.iter().map(|added| added.effect.as_str()).collect();
    let changes: Vec<&str> = found.diagnosis.added.iter().filter_map(|added| added.change.as_deref()).collect();
    println!("simulated, a cycle of setups: {added:?} {changes:?}, form error {after:.4} µm");
    assert_eq!(added, ["setups-swapped", "setups-swapped"]);
    assert!(after < CLEAN_UM, "{after}");
    // What the file must say, tried on the same recording.
    let rig = config.rig.clone().check().unwrap();
    let (mut station, _) = averaged(&config, &rig);
    let [change] = changes[..] else { panic!("{changes:?}") };
    let mut corrected = config.rig.clone();
    for key in change.lines() {
        let (place, id) = key.strip_prefix("setups.").unwrap().split_once(".id = ").unwrap();
        corrected.setups[place.parse::<usize>().unwrap()].id = id.trim_matches('"').into();
    }
    for profile in &mut station.profiles {
        let id = &config.rig.setups[profile.setup].id;
        profile.setup = corrected.setups.iter().position(|setup| setup.id == *id).unwrap();
    }
    assert_eq!(looked_into(&corrected, &station).diagnosis.verdict, Verdict::AtNoiseFloor);
}

/// Two sensors in a section do not show whose sign is wrong: the form and its negative explain as much, but for the exact
/// geometry. The uncertainty of form holds both.
#[test]
fn what_a_layout_does_not_distinguish_is_in_the_uncertainty() {
    for offset_um in [0.5, 8.0, 40.0] {
        let mut config = campaign(1, r#"[{"plugin":"sensor-sign","targets":["S1"]}]"#);
        config.eccentricity.offset_um = offset_um;
        let (found, [_, after]) = names(&config, &["sensor-sign S1"], &[]);
        let stated = (0..2).map(|section| found.after[0].angle_std(section)).fold(0.0, f64::max);
        println!("simulated, {offset_um} µm off centre: error {after:.4}, stated {stated:.4}");
        assert!(after < 3.0 * stated, "{after} {stated}");
        if found.diagnosis.added[0].confounded_with.is_empty() {
            assert!(after < CLEAN_UM, "{after}");
        }
    }
}

/// What leaves no trace is said, with what it would do: the signs of a section change its form to the negative, 1 µm away from 0.5 µm
/// rms. A large eccentricity shows them by the exact geometry.
#[test]
fn mistakes_without_a_trace_are_said() {
    let unseen = |config: &SpindleConfig| {
        let (found, _) = diagnosed(config);
        assert_eq!(found.diagnosis.verdict, Verdict::AtNoiseFloor, "{:?}", found.diagnosis.added);
        let blind = found.diagnosis.blind_to.into_iter();
        let mistakes = ["sensor-sign", "sensors-swapped", "setups-swapped", "rotation-reversed", "part-angle-sign"];
        blind.filter(|blind| mistakes.contains(&blind.effect.as_str())).collect::<Vec<_>>()
    };
    let mut config = campaign(1, "[]");
    config.form.rms_um = 0.5;
    (config.motion.x_rms_um, config.motion.y_rms_um, config.motion.tilt_rms_urad) = (0.2, 0.2, 0.3);
    config.eccentricity.offset_um = 0.2;
    let said = unseen(&config);
    println!("simulated, 0.2 µm off centre: {said:?}");
    let targets: Vec<&[String]> = said.iter().map(|blind| &blind.targets[..]).collect();
    assert_eq!(targets, [["S1", "S2"], ["S3", "S4"]]);
    for blind in &said {
        assert_eq!((blind.effect.as_str(), blind.bias_per_unit.on.as_str()), ("sensor-sign", "form"));
        assert!((0.6..1.3).contains(&blind.bias_per_unit.value), "{blind:?}");
    }
    config.eccentricity.offset_um = 100.0;
    assert_eq!(unseen(&config), []);
    // Part and sensors reversed: which setup was which changes the sign of motion.
    config.eccentricity.offset_um = 0.2;
    config.rig.setups.truncate(2);
    (config.rig.setups[1].part_deg, config.rig.setups[1].sensors_deg) = (180.0, 180.0);
    let said = unseen(&config);
    println!("simulated, part and sensors reversed: {said:?}");
    assert!(
        said.iter().any(|blind| blind.effect == "setups-swapped" && blind.bias_per_unit.on == "motion"),
        "{said:?}"
    );
}

/// Part and sensors were not moved between two setups, or two channels carry one signal.
#[test]
fn what_was_recorded_twice_is_named() {
    let repeated = r#"[{"plugin":"setup-repeated","targets":["b","c"]}]"#;
    names(&six(1, repeated), &["setup-repeated b c"], &[]);
    let identical = r#"[{"plugin":"sensors-identical","targets":["S1","S2"]}]"#;
    names(&six(2, identical), &["sensors-identical S1 S2"], &[]);
}

/// One file is stored under two names: noise is the same too.
#[test]
fn a_recording_stored_twice_is_said_by_run() {
    let config = six(1, "[]");
    let rig = config.rig.clone().check().unwrap();
    let (mut station, _) = averaged(&config, &rig);
    assert_eq!(warned(&config.rig, &station), Vec::<String>::new());
    station.profiles[2] = station.profiles[1].clone();
    station.profiles[2].setup = 2;
    let warnings = warned(&config.rig, &station);
    assert!(
        warnings.iter().any(|warning| warning.contains("setups `b` and `c` have the same recording")),
        "{warnings:?}"
    );
    let found = looked_into(&config.rig, &station).diagnosis;
    assert!(found.warnings.iter().any(|warning| warning.contains("have the same recording")), "{:?}", found.warnings);
    assert_eq!(found.added.iter().map(name).collect::<Vec<_>>(), ["setup-repeated b c"]);
}

/// All sensors turned by 0.5° in a setup.
#[test]
fn sensors_turned_wrongly_in_a_setup_are_named() {
    let effect = r#"[{"plugin":"sensors-angle","targets":["b"],"angle_deg":0.5}]"#;
    for seed in 1..=2 {
        let (found, [_, after]) = names(&six(seed, effect), &["sensors-angle b"], &[]);
        let angle = &found.diagnosis.added[0].parameters[0];
        assert!((angle.value - 0.5).abs() < 5.0 * angle.std.unwrap(), "{angle:?}");
        assert!(after < CLEAN_UM, "{after}");
    }
}

/// Large effects and unmodelled disturbances are no mistakes in the rig file.
#[test]
fn nothing_else_is_taken_for_a_mistake() {
    for (index, effect) in [
        r#"[{"plugin":"sensor-gain","targets":["S1"],"relative_gain":0.3}]"#,
        r#"[{"plugin":"sensor-angle","targets":["S3"],"angle_deg":5}]"#,
        r#"[{"plugin":"reversal-angle","targets":["b"],"angle_deg":3}]"#,
        r#"[{"plugin":"setup-motion-change","targets":["c"],"ratio":0.4}]"#,
        r#"[{"plugin":"step","targets":["S3"],"setups":["b"],"step_um":5.0,"from_deg":100.0,"to_deg":160.0}]"#,
        r#"[{"plugin":"dent","targets":["S2"],"depth_um":30.0,"part_angle_deg":80.0,"width_deg":5.0}]"#,
    ]
    .into_iter()
    .enumerate()
    {
        let config = if index % 2 == 0 { campaign(6, effect) } else { six(7, effect) };
        let (found, _) = diagnosed(&config);
        let named = |added: &Added| effects::Mistake::ALL.iter().any(|mistake| mistake.id() == added.effect);
        assert!(!found.diagnosis.added.iter().any(named), "{effect}: {:?}", found.diagnosis.added);
    }
}

/// A wrong gain of one sensor, from small to absurd, is no mistake in the rig file to `run` either.
#[test]
fn a_wrong_gain_is_no_mistake_to_a_run() {
    let mut said = Vec::new();
    // Every gain and every sensor.
    for seed in 0..trials(24) as u64 {
        let sensor = 1 + seed % 4;
        let gain = [0.02, -0.05, 0.1, -0.15, 0.25, -0.3][seed as usize % 6];
        let effect = format!(r#"[{{"plugin":"sensor-gain","targets":["S{sensor}"],"relative_gain":{gain}}}]"#);
        for config in [campaign(seed, &effect), six(seed, &effect)] {
            let rig = config.rig.clone().check().unwrap();
            let warnings = warned(&config.rig, &averaged(&config, &rig).0);
            said.extend(warnings.into_iter().filter(|warning| warning.contains("a mistake is likely")));
        }
    }
    assert_eq!(said, Vec::<String>::new());
}

/// Neither is a sensor at another angle or height: setups that differ by the motion alone leave more than noise.
#[test]
fn a_wrong_place_is_no_mistake_to_a_run() {
    let mut said = Vec::new();
    for effect in [
        r#"[{"plugin":"sensor-angle","targets":["S2"],"angle_deg":5}]"#,
        r#"[{"plugin":"sensor-axial-position","targets":["S2"],"shift_mm":20}]"#,
    ] {
        for seed in 1..=4 {
            let config = reversed(seed, effect);
            let rig = config.rig.clone().check().unwrap();
            let warnings = warned(&config.rig, &averaged(&config, &rig).0);
            said.extend(warnings.into_iter().filter(|warning| warning.contains("a mistake is likely")));
        }
    }
    assert_eq!(said, Vec::<String>::new());
}

/// A channel in millimetres where the rig says µm is named by its size, and no mistake of the wiring is looked for.
#[test]
fn a_channel_in_another_unit_is_named() {
    let config = six(3, r#"[{"plugin":"sensor-gain","targets":["S2"],"relative_gain":-0.999}]"#);
    let rig = config.rig.clone().check().unwrap();
    let warnings = warned(&config.rig, &averaged(&config, &rig).0);
    let named = |warning: &String| warning.contains("sensor `S2`") && warning.contains("`unit = \"mm\"`");
    assert!(warnings.iter().any(named), "{warnings:?}");
    assert!(!warnings.iter().any(|warning| warning.contains("a mistake is likely")), "{warnings:?}");
}

/// So is a setup in millimetres beside one in µm, however it is centred.
#[test]
fn a_setup_in_another_unit_is_named() {
    let all = r#"[{"plugin":"sensor-gain","targets":["S1","S2","S3","S4"],"relative_gain":-0.999}]"#;
    let of = |effect: &str| {
        let mut config = reversed(3, effect);
        config.eccentricity.offset_um = 40.0;
        let rig = config.rig.clone().check().unwrap();
        (config.rig.clone(), averaged(&config, &rig).0)
    };
    let ((rig, mut mixed), (_, in_mm)) = (of("[]"), of(all));
    mixed.profiles[1] = in_mm.profiles[1].clone();
    let warnings = warned(&rig, &mixed);
    assert!(warnings.iter().any(|warning| warning.contains("have another unit")), "{warnings:?}");
    let sound = warned(&rig, &of("[]").1);
    assert!(!sound.iter().any(|warning| warning.contains("another unit")), "{sound:?}");
}
