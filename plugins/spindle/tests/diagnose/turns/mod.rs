//! Effects that the turns show: asynchronous lines, drifts and pick-up.

use super::*;

#[test]
fn an_asynchronous_line_is_found_in_the_turns() {
    // 0.437, 0.563, 1.437 and 1.563 all go on by the same phase from turn to turn.
    for (seed, order) in [(1, 2.43), (2, 2.43), (3, 2.43), (1, 0.437), (1, 0.563), (1, 1.437), (1, 1.563)] {
        let effect = r#"[{"plugin":"asynchronous-line","order":ORDER,"amplitude_um":0.3,"direction_deg":30}]"#;
        let (found, [before, after]) = diagnosed(&campaign(seed, &effect.replace("ORDER", &order.to_string())));
        let added = &found.diagnosis.added;
        println!("simulated, a line: {added:?}, form error {before:.4} → {after:.4} µm");
        assert_eq!(found.diagnosis.verdict, Verdict::Explained);
        assert_eq!(added.len(), 1);
        assert_eq!(added[0].effect, "asynchronous-line");
        for (name, truth) in [("order", order), ("amplitude", 0.3), ("direction", 30.0)] {
            let found = added[0].parameters.iter().find(|known| known.name == name).unwrap();
            // Five standard uncertainties, as for the other effects.
            assert!((found.value - truth).abs() < 5.0 * found.std.unwrap(), "{name}: {found:?} for {truth}");
        }
        assert!(after < CLEAN_UM, "{after}");
    }
}

/// Several lines at once: as large as each other, small beside large, and such as turns see at the same phase. All are found, as large as
/// they are, and noise is what a campaign without lines has.
#[test]
fn all_of_several_lines_are_found() {
    let quiet = |seed: u64, lines: &[(f64, f64)]| {
        let each = lines.iter().enumerate().map(|(index, (order, amplitude_um))| {
            let direction_deg = 20 + 50 * index;
            format!(
                r#"{{"plugin":"asynchronous-line","order":{order},"amplitude_um":{amplitude_um},"direction_deg":{direction_deg}}}"#
            )
        });
        let mut config = campaign(seed, &format!("[{}]", each.collect::<Vec<_>>().join(",")));
        config.asynchronous.rms_um = None;
        config
    };
    let level = |seed: u64, lines: &[(f64, f64)]| diagnosed(&quiet(seed, lines)).0.diagnosis;
    let mut pulls = Vec::new();
    for (seed, lines) in [
        (1, &[(6.884, 0.1), (3.585, 0.1), (5.415, 0.1)][..]),
        (2, &[(2.43, 1.28), (7.31, 0.1)]),
        (3, &[(3.415, 0.4), (5.415, 0.1), (8.415, 0.02)]),
        (4, &[(0.43, 3.0), (9.21, 0.3), (4.873, 0.03), (12.64, 0.02)]),
        (5, &[(2.51, 0.2), (2.56, 0.2)]),
    ] {
        let (with, without) = (level(seed, lines), level(seed, &[]));
        let value = |added: &Added, name: &str| added.parameters.iter().find(|one| one.name == name).cloned();
        let found: Vec<String> = with.added.iter().map(|added| format!("{:?}", value(added, "order"))).collect();
        let expected = [&with, &without].map(|one| one.after.noise_floor_um.unwrap());
        println!("simulated, lines {lines:?}: noise {expected:.5?} µm, {found:?}");
        assert_eq!((with.verdict, with.added.len()), (Verdict::Explained, lines.len()), "{lines:?}: {:?}", with.added);
        for (index, (order, amplitude_um)) in lines.iter().enumerate() {
            let is = |added: &&Added| value(added, "order").is_some_and(|one| (one.value - order).abs() < 0.01);
            let added = with.added.iter().find(is).unwrap();
            assert_eq!(added.effect, "asynchronous-line");
            let truths = [("order", *order), ("amplitude", *amplitude_um), ("direction", 20.0 + 50.0 * index as f64)];
            pulls.extend(truths.map(|(name, truth)| {
                let found = value(added, name).unwrap();
                (found.value - truth) / found.std.unwrap()
            }));
        }
        // Noise of some ten readings' residuals at 60 orders is known to some percent.
        assert!((expected[0] / expected[1] - 1.0).abs() < 0.15, "{expected:?}");
        let rms = [&with, &without].map(|one| one.after.residual_rms_um);
        assert!((rms[0] / rms[1] - 1.0).abs() < 0.15, "{rms:?}");
    }
    let rms = (pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64).sqrt();
    println!("simulated, several lines: errors are {rms:.2} of their stated uncertainty: {pulls:.1?}");
    // Of some forty values: an uncertainty that is twice too small or too large fails.
    assert!((0.6..1.6).contains(&rms) && pulls.iter().all(|pull| pull.abs() < 5.0), "{rms}: {pulls:?}");
}

/// Of two lines, the one at the published order of a bearing's outer ring has its name; the other one fits nothing.
#[test]
fn a_line_that_fits_a_bearing_has_its_name() {
    let effect = r#"[{"plugin":"asynchronous-line","order":ORDER,"amplitude_um":0.3,"direction_deg":30}]"#;
    let bearing = r#"{"id":"front","rolling_elements":9,"element_diameter_mm":7.94004,"pitch_diameter_mm":39.0398}"#;
    for (order, name) in [("3.5848", Some("BPFO of bearing front (3.585/rev)")), ("3.27", None)] {
        let mut config = campaign(5, &effect.replace("ORDER", order));
        config.rig.bearings = vec![serde_json::from_str(bearing).unwrap()];
        let (found, _) = diagnosed(&config);
        assert_eq!(found.diagnosis.added[0].effect, "asynchronous-line");
        let warnings = &found.diagnosis.warnings;
        println!("simulated, a line at {order}: {warnings:?}");
        let said = warnings.iter().find(|warning| warning.contains("of bearing"));
        assert_eq!(said.is_some(), name.is_some(), "{warnings:?}");
        assert!(name.is_none_or(|name| said.unwrap().contains(&format!("fits {name} within"))), "{said:?}");
    }
}

/// Straight drifts, small to large and of both signs, and one so slow that its time constant stays open: found, sized, taken out of
/// averages and covariances, so that stated uncertainties of form and motion hold.
#[test]
fn straight_drifts_are_found_and_stated_uncertainties_hold() {
    for (seed, rate, tau) in [
        (1, 1.5 / 60.0, None),
        (2, 0.1, None),
        (3, -0.4, None),
        (4, 0.4, Some(1000.0)),
        (5, 100.0 / 60.0, None),
        (6, -1.0, Some(400.0)),
    ] {
        let tau_key = tau.map_or(String::new(), |tau: f64| format!(r#","time_constant_turns":{tau}"#));
        let effect = format!(r#"[{{"plugin":"thermal-drift","targets":["S1"],"rate_um_per_rev":{rate}{tau_key}}}]"#);
        let config = campaign(seed, &effect);
        let (found, truth) = diagnosed_with_truth(None, &config);
        let errors = [&found.before, &found.after].map(|separations| errors_over_stated(&separations[0], &truth));
        let over = tau.map_or(60.0 * rate, |tau: f64| -rate * tau * (-60.0 / tau).exp_m1());
        println!(
            "simulated, {over:+.2} µm over a capture: error over stated {errors:.2?}, {:?}",
            found.diagnosis.added
        );
        let diagnosis = &found.diagnosis;
        assert_eq!(diagnosis.verdict, Verdict::Explained, "{rate}: {:?}", diagnosis.unexplained);
        assert_eq!(diagnosis.added.len(), 1, "{rate}: {:?}", diagnosis.added);
        let added = &diagnosis.added[0];
        assert_eq!((added.effect.as_str(), added.targets[0].as_str()), ("thermal-drift", "S1"));
        let over_capture = added.parameters.iter().find(|known| known.name == "over-capture").unwrap();
        // Four standard uncertainties: six campaigns.
        assert!((over_capture.value - over).abs() < 4.0 * std_of(over_capture), "{over_capture:?} for {over}");
        assert!(tau.is_some() || added.parameters.iter().all(|known| known.name != "time-constant"), "{added:?}");
        for (quantity, [error, stated]) in ["form", "motion"].iter().zip(errors[1]) {
            assert!(error < 2.0 * stated, "{rate}: {quantity} is {error} µm off, {stated} µm stated");
        }
        // What a campaign without a drift has: the covariance is not inflated.
        assert!(errors[1][0][1] < CLEAN_UM, "{rate}: {errors:?}");
    }
}

/// A capture that drifts among others that do not, and captures that drift by different amounts and signs.
#[test]
fn drifts_of_single_captures_are_found_in_them() {
    let drift = |setup: &str, rate: f64| {
        format!(r#"{{"plugin":"thermal-drift","targets":["S2"],"setups":["{setup}"],"rate_um_per_rev":{rate}}}"#)
    };
    for (seed, drifts) in [(1, [0.0, 0.4, 0.0]), (2, [0.3, -0.2, 0.05])] {
        let each: Vec<String> = ["a", "b", "c"].iter().zip(drifts).map(|(setup, rate)| drift(setup, rate)).collect();
        let (found, truth) = diagnosed_with_truth(None, &campaign(seed, &format!("[{}]", each.join(","))));
        let added = &found.diagnosis.added;
        let errors = errors_over_stated(&found.after[0], &truth);
        println!("simulated, captures that drift by themselves: {errors:.4?} {added:?}");
        assert_eq!(found.diagnosis.verdict, Verdict::Explained);
        assert_eq!(added.len(), 1, "{added:?}");
        assert_eq!((added[0].effect.as_str(), added[0].targets[0].as_str()), ("thermal-drift", "S2"));
        for (setup, rate) in ["a", "b", "c"].iter().zip(drifts) {
            let name = format!("over-capture-{setup}");
            let over = added[0].parameters.iter().find(|known| known.name == name).unwrap();
            // Beside a drift, what the axis wanders counts as creep: up to 0.5 µm over a capture.
            assert!((over.value - 60.0 * rate).abs() < 0.5, "{over:?} for {rate}");
        }
        assert!(errors.iter().all(|[error, stated]| *error < 2.0 * stated), "{errors:?}");
    }
}

/// All sensors drift as one displacement: it is said to be one.
#[test]
fn a_displacement_of_the_whole_part_is_said_to_be_one() {
    let drift = |sensor: &str, rate: f64| {
        format!(r#"{{"plugin":"thermal-drift","targets":["{sensor}"],"rate_um_per_rev":{rate}}}"#)
    };
    let all = [("S1", 0.3), ("S2", -0.2), ("S3", 0.3), ("S4", -0.2)].map(|(sensor, rate)| drift(sensor, rate));
    let (found, truth) = diagnosed_with_truth(None, &campaign(7, &format!("[{}]", all.join(","))));
    let errors = errors_over_stated(&found.after[0], &truth);
    println!("simulated, the part drifts: {errors:.4?} {:?}", found.diagnosis.warnings);
    assert_eq!(found.diagnosis.verdict, Verdict::Explained);
    assert_eq!(found.diagnosis.added.len(), 4, "{:?}", found.diagnosis.added);
    assert!(found.diagnosis.warnings.iter().any(|warning| warning.contains("one displacement")));
    assert!(errors.iter().all(|[error, stated]| *error < 2.0 * stated), "{errors:?}");
}

/// Pick-up in one channel is no motion, at a fixed frequency or order, also where the speed wanders.
#[test]
fn pick_up_is_named_by_its_sensor() {
    for (seed, line, order, wobble) in [
        (1, r#""frequency_hz":60"#, 7.2, 0.0),
        (2, r#""frequency_hz":60"#, 7.2, 0.05),
        (3, r#""order":3.37"#, 3.37, 0.0),
        (4, r#""frequency_hz":120"#, 14.4, 0.0),
    ] {
        let effect = format!(r#"[{{"plugin":"sensor-line","targets":["S3"],{line},"amplitude_um":0.3}}]"#);
        let mut config = campaign(seed, &effect);
        config.recording.speed_wobble_percent = wobble;
        let (found, truth) = diagnosed_with_truth(None, &config);
        let (added, warnings) = (&found.diagnosis.added, &found.diagnosis.warnings);
        let errors = errors_over_stated(&found.after[0], &truth);
        println!("simulated, pick-up {line}: {errors:.4?} {added:?} {warnings:?}");
        assert_eq!(found.diagnosis.verdict, Verdict::Explained);
        assert_eq!(added.len(), 1, "{added:?}");
        assert_eq!((added[0].effect.as_str(), added[0].targets[0].as_str()), ("sensor-line", "S3"));
        let hertz = order * config.recording.speed_rpm / 60.0;
        for (name, truth) in [("frequency", hertz), ("amplitude", 0.3)] {
            let found = added[0].parameters.iter().find(|known| known.name == name).unwrap();
            // The wandering speed makes a frequency uncertain by 0.01 Hz at 60 Hz, which no standard uncertainty has.
            assert!((found.value - truth).abs() < 5.0 * std_of(found) + 0.02 * wobble * truth, "{found:?} for {truth}");
        }
        let is_mains = warnings.iter().any(|warning| warning.contains("is mains"));
        assert_eq!(is_mains, line.contains("hz"), "{warnings:?}");
        assert!(errors.iter().all(|[error, stated]| *error < 2.0 * stated), "{errors:?}");
    }
}

/// Pick-up in all channels alike: with sensors at 0° and 90° it looks like a motion along 45°, and is said to be possible; three
/// sensors a section contradict a motion.
#[test]
fn pick_up_common_to_all_channels_is_said_to_be_possible() {
    let effect = |sensors: &str| {
        format!(r#"[{{"plugin":"sensor-line","targets":[{sensors}],"frequency_hz":60,"amplitude_um":0.4}}]"#)
    };
    let (found, _) = diagnosed_with_truth(None, &campaign(1, &effect(r#""S1","S2","S3","S4""#)));
    println!("simulated, common pick-up: {:?} {:?}", found.diagnosis.added, found.diagnosis.warnings);
    assert_eq!(found.diagnosis.added[0].effect, "asynchronous-line");
    assert!(found.diagnosis.warnings.iter().any(|warning| warning.contains("common to all channels")));

    let mut config = campaign(2, &effect(r#""S1","S2","S3","S4","S5","S6""#));
    let angles = [0.0, 99.844, 202.5];
    let (first, last) = (config.rig.sensors[0].clone(), config.rig.sensors[2].clone());
    config.rig.sensors = [first, last]
        .iter()
        .flat_map(|sensor| angles.map(|angle_deg| (sensor.clone(), angle_deg)))
        .enumerate()
        .map(|(index, (sensor, angle_deg))| SensorConfig { id: format!("S{}", index + 1), angle_deg, ..sensor })
        .collect();
    let (found, _) = diagnosed_with_truth(None, &config);
    println!("simulated, common pick-up, six sensors: {:?} {:?}", found.diagnosis.added, found.diagnosis.warnings);
    assert_eq!(found.diagnosis.verdict, Verdict::Explained);
    let added = &found.diagnosis.added;
    assert_eq!((added.len(), added[0].effect.as_str(), added[0].targets.len()), (1, "sensor-line", 6), "{added:?}");
    assert!(found.diagnosis.warnings.iter().any(|warning| warning.contains("common to them")));
}
