use insta::assert_snapshot;
use runout_core::closed_loop::diagnosis::{BiasPerUnit, LostOrders, Moved, Refused, Truth, Unexplained, Verdict};

use super::*;
use crate::render::wrap::within;

fn level(residual_rms_um: f64, chi2_per_dof: f64) -> Level {
    Level {
        residual_rms_um,
        degrees_of_freedom: 900,
        noise_floor_um: Some(0.0065),
        chi2_per_dof: Some(chi2_per_dof),
        held_out_rms_um: Some(1.01 * residual_rms_um),
        held_out_expected_rms_um: Some(0.0067),
        unit: None,
        orders: None,
    }
}

fn estimate(name: &str, value: f64, std: f64, unit: &str) -> Estimated {
    Estimated { name: name.into(), value, std: Some(std), unit: unit.into() }
}

fn blind(effect: &str, target: &str, value: f64) -> Blind {
    let bias_per_unit = BiasPerUnit { value, unit: "um/mm".into(), on: "form".into() };
    Blind { effect: effect.into(), targets: vec![target.into()], bias_per_unit }
}

fn at_the_floor() -> Diagnosis {
    Diagnosis {
        consistency: Vec::new(),
        verdict: Verdict::AtNoiseFloor,
        before: level(0.0066, 1.02),
        added: vec![],
        after: level(0.0066, 1.02),
        nothing_separated: false,
        moved: vec![],
        unexplained: vec![],
        blind_to: vec![
            blind("sensor-axial-position", "S1", 0.4),
            blind("sensor-axial-position", "S2", 0.42),
            blind("axial-motion", "", 1e-5),
        ],
        refused: vec![],
        lost_orders: Some(LostOrders::of([("form", vec![]), ("motion", vec![1])])),
        truth: None,
        warnings: vec![],
        notes: vec![],
        outputs: vec![],
    }
}

fn diagnosed() -> Diagnosis {
    let step = |before, after| Step { before: Some(before), after: Some(after) };
    let nonlinearity = Added {
        effect: "sensor-nonlinearity".into(),
        targets: vec!["S1".into()],
        confounded_with: vec![],
        distinguished_by: None,
        parameters: vec![estimate("quadratic", 1.712e-3, 2.3e-5, "1/um"), estimate("cubic", -4.04e-7, 3.1e-8, "1/um2")],
        change: Some("sensors.0.quadratic_per_um = 0.001712\nsensors.0.cubic_per_um2 = -4.04e-7".into()),
        residual_rms_um: step(0.0593, 0.0266),
        held_out_rms_um: step(0.0595, 0.0268),
        held_out_expected_rms_um: Some(0.0067),
        delta_bic: -4120.3,
        p_value: 0.0,
    };
    let gain = Added {
        effect: "sensor-gain".into(),
        targets: vec!["S3".into()],
        confounded_with: vec!["sensor-gain S4".into()],
        distinguished_by: Some("a third sensor in section b".into()),
        parameters: vec![Estimated { std: None, ..estimate("gain", 0.0171, 0.0, "") }],
        change: None,
        residual_rms_um: step(0.0266, 0.0102),
        held_out_rms_um: Step { before: Some(0.0268), after: None },
        held_out_expected_rms_um: None,
        delta_bic: -88.2,
        p_value: 3.2e-18,
    };
    let moved = |value: &str, section: Option<&str>, before, after, std| Moved {
        value: value.into(),
        section: section.map(str::to_owned),
        before,
        after,
        std,
        unit: "um".into(),
        reference: (value == "RONt").then(|| "LSCI".into()),
        filter: (value == "RONt").then(|| "none".into()),
        lost_orders: if value == "RONt" { vec![3, 6, 9, 12] } else { vec![] },
    };
    Diagnosis {
        consistency: Vec::new(),
        verdict: Verdict::Unexplained,
        before: level(0.0593, 83.1),
        added: vec![nonlinearity, gain],
        after: level(0.0102, 2.4),
        moved: vec![
            moved("RONt", Some("a"), 21.92, 21.641, Some(0.031)),
            moved("form", Some("b"), 4.012, 4.011, Some(0.004)),
            moved("x", None, 1.5, 1.48, None),
        ],
        unexplained: vec![
            Unexplained {
                station: None,
                sensor: Some("S3".into()),
                setup: Some("k2".into()),
                orders: [3, 9],
                rms_um: 0.0204,
                place: "part angle 118…123°".into(),
            },
            Unexplained {
                station: None,
                sensor: None,
                setup: None,
                orders: [5, 5],
                rms_um: 0.011,
                place: "all turns".into(),
            },
        ],
        refused: vec![Refused {
            effect: "speed-ripple".into(),
            targets: vec![],
            reason: "data that were left out are not predicted better".into(),
        }],
        truth: Some(Truth { form_rms_error_um: step(0.0937, 0.0081) }),
        warnings: vec!["the speed is 3 % off the stated one".into()],
        notes: vec![],
        outputs: vec!["out/diagnosed/form.parquet".into(), "out/diagnosed/diagnosis.json".into()],
        ..at_the_floor()
    }
}

#[test]
fn nothing_to_add() {
    assert_snapshot!(text(&at_the_floor(), &Summary::default(), 100, true));
}

/// The loop in three lines, then tables; without `--verbose`.
#[test]
fn the_answer_comes_first_at_80_and_120_columns() {
    for (terminal, name) in [(80, "answer_at_80_columns"), (120, "answer_at_120_columns")] {
        let width = within(terminal);
        let shown = text(&diagnosed(), &Summary::default(), width, false);
        assert!(shown.lines().all(|line| line.chars().count() <= width), "{shown}");
        assert_snapshot!(name, shown);
    }
}

#[test]
fn found_and_left() {
    assert_snapshot!(text(&diagnosed(), &Summary::default(), 100, true));
}

#[test]
fn noise_that_is_not_known_and_another_unit() {
    let level = |residual| Level {
        noise_floor_um: None,
        chi2_per_dof: None,
        held_out_expected_rms_um: None,
        unit: Some("counts".into()),
        ..level(residual, 0.0)
    };
    let added = Added {
        effect: "offset".into(),
        targets: vec![],
        parameters: vec![estimate("sine", 12.31, 0.04, "counts")],
        held_out_expected_rms_um: None,
        p_value: 0.002,
        ..diagnosed().added.remove(0)
    };
    let diagnosis = Diagnosis {
        consistency: Vec::new(),
        verdict: Verdict::Improved,
        before: level(3.4),
        added: vec![added],
        after: level(0.7),
        blind_to: vec![],
        lost_orders: None,
        ..at_the_floor()
    };
    assert_snapshot!(text(&diagnosis, &Summary::default(), 100, true));
}

#[test]
fn what_acts_on_the_rig_or_on_one_setup_is_distinguished() {
    let bias_per_unit = BiasPerUnit { value: 0.3, unit: "um/deg".into(), on: "form".into() };
    let one = |targets: &[&str]| Blind {
        effect: "speed-ripple".into(),
        targets: targets.iter().map(|target| (*target).to_owned()).collect(),
        bias_per_unit: bias_per_unit.clone(),
    };
    let shown = text(
        &Diagnosis { blind_to: vec![one(&[]), one(&["a"]), one(&["b"])], ..at_the_floor() },
        &Summary::default(),
        100,
        true,
    );
    assert!(shown.contains("the whole rig, a, b"), "{shown}");
}
