//! Sensors and parts that are elsewhere: turned with the part, in the other section, far off.

use runout_core::closed_loop::diagnosis::Verdict;

use super::{CLEAN_UM, diagnosed, name, names, six};

#[test]
fn sensors_that_were_turned_with_the_part_are_found() {
    let turned = r#"[{"plugin":"sensors-angle","targets":["b"],"angle_deg":99.844}]"#;
    let [_, after] = names(&six(1, turned), &["sensors-turned b"], &["setups.1.sensors_deg = 99.844"]).1;
    assert!(after < CLEAN_UM, "{after}");
    // And the other way: they stayed, and are declared to have been turned with the part.
    let mut stayed = six(2, r#"[{"plugin":"sensors-angle","targets":["c"],"angle_deg":-202.5}]"#);
    stayed.rig.setups[2].sensors_deg = 202.5;
    let [_, after] = names(&stayed, &["sensors-turned c"], &["setups.2.sensors_deg = 0.0"]).1;
    assert!(after < CLEAN_UM, "{after}");
}

#[test]
fn a_sensor_in_the_other_section_is_found() {
    // 30 mm lower, at an angle at which no other sensor stands.
    let mut config = six(3, r#"[{"plugin":"sensor-axial-position","targets":["S6"],"shift_mm":-30.0}]"#);
    config.rig.sensors[5].angle_deg = 260.0;
    let (_, [before, after]) =
        names(&config, &["sensor-in-other-section S6"], &["sensors.5.section = \"a\"\nsensors.5.z_mm = 100.0"]);
    assert!(after < CLEAN_UM && before > 10.0 * after, "{before} {after}");
}

/// 12 to 40° off: high orders are turned by whole periods, so that no small step leads there.
#[test]
fn angles_that_are_far_off_are_found() {
    for (seed, plugin, target, angle_deg) in [
        (1, "reversal-angle", "b", 12.0),
        (2, "reversal-angle", "c", -25.0),
        (3, "reversal-angle", "b", 40.0),
        (4, "sensor-angle", "S5", 15.0),
        (5, "sensors-angle", "c", -20.0),
    ] {
        let effect = format!(r#"[{{"plugin":"{plugin}","targets":["{target}"],"angle_deg":{angle_deg}}}]"#);
        let (found, [before, after]) = diagnosed(&six(seed, &effect));
        println!("simulated, {effect}: form error {before:.4} → {after:.4} µm, {:?}", found.diagnosis.added);
        let [added] = &found.diagnosis.added[..] else { panic!("{effect}: {:?}", found.diagnosis.added) };
        assert_eq!(name(added), format!("{plugin} {target}"));
        assert!((added.parameters[0].value - angle_deg).abs() < 0.01, "{effect}: {added:?}");
        assert!(found.diagnosis.verdict == Verdict::Explained && after < CLEAN_UM, "{effect}: {before} → {after}");
    }
}
