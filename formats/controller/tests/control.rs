//! A machine is measured, its file is written, a control reads it and corrects: the error that is left is the one that the file says.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support;
use std::path::Path;

use crate::support::{
    controls::{Cec, EncComp, Klipper, Volumetric, between, linuxcnc},
    left_out, left_um, number_after, of_outcome,
};
use nalgebra::Vector3;
use runout_core::{
    pipeline::Context,
    stage::{Outcome, PointSeparator},
    table::TableSpec,
};
use runout_spatial_error::{
    SpatialErrorConfig,
    simulate::{Layout, Placement, Scenario, Simulated, SimulatedEffect, Tracker},
};

pub(crate) const ENDS_MM: [f64; 3] = [500.0, 400.0, 300.0];

/// A machine with errors of all kinds, measured by a tracker: what the exporter gets, and the machine.
pub(crate) fn measured(seed: u64) -> (Simulated, Outcome, Vec<TableSpec>) {
    let linear = |target: &str, order: u32, amplitude_um: f64| {
        let targets = [target.to_owned()];
        if target[1..2] == target[2..3] {
            SimulatedEffect::Positioning { targets, order, amplitude_um }
        } else {
            SimulatedEffect::Straightness { targets, order, amplitude_um }
        }
    };
    let turn = |target: &str, order: u32, amplitude_urad: f64| SimulatedEffect::Angular {
        targets: [target.to_owned()],
        order,
        amplitude_urad,
    };
    let scale = |axis: &str, scale_um_per_m: f64| SimulatedEffect::Scale { targets: [axis.to_owned()], scale_um_per_m };
    let square = |axes: &str, angle_urad: f64| SimulatedEffect::Squareness { targets: [axes.to_owned()], angle_urad };
    let effect = vec![
        linear("EXX", 3, 8.0),
        linear("EYY", 2, -6.0),
        linear("EZZ", 2, 5.0),
        linear("EYX", 2, 7.0),
        linear("EZX", 2, -6.0),
        linear("EXY", 2, 5.0),
        linear("EZY", 3, 4.0),
        turn("EAX", 1, 20.0),
        turn("ECX", 2, -25.0),
        turn("EBY", 1, 30.0),
        scale("X", 60.0),
        scale("Y", -40.0),
        scale("Z", 50.0),
        square("XY", 45.0),
        square("XZ", -30.0),
        square("YZ", 25.0),
    ];
    let made = Scenario {
        layout: Layout::Grid { from_mm: [0.0; 3], to_mm: ENDS_MM, counts: [6, 5, 4] },
        passes: 2,
        random_order: true,
        seconds_per_point: 10.0,
        seed,
        chain: "XYZ".into(),
        tool_mm: [0.0; 3],
        tracker: Tracker { at_mm: [-1500.0, 200.0, 300.0], noise_um: 0.8, angle_urad: 0.2 },
        placement: Placement { shift_um: [120.0, -45.0, 310.0], turn_urad: [85.0, -140.0, 60.0] },
        field: None,
        effect,
    }
    .simulate();
    let config: SpatialErrorConfig = toml::from_str("curves = { pitch_mm = [50.0, 50.0, 50.0] }").unwrap();
    // Nodes where places are.
    let config =
        SpatialErrorConfig { curves: Some(runout_spatial_error::Curves { pitch_mm: [100.0, 100.0, 100.0] }), ..config };
    let separator = config.separator(&Context { folder: Path::new("."), rig: None }).unwrap();
    let outcome = separator.separate(&made.points()).unwrap();
    (made, outcome, separator.tables())
}

/// The file, with all left out that the dialect cannot hold.
fn file(toml: &str, specs: &[TableSpec], outcome: &Outcome) -> String {
    match of_outcome(toml, specs, outcome) {
        Ok(text) => text,
        Err(error) => of_outcome(&format!("{toml}\n{}", left_out(&error)), specs, outcome).unwrap(),
    }
}

/// The error that is left is at most 1.15 times the expected one, and more than before where signs are reversed.
pub(crate) fn check(name: &str, text: &str, made: &Simulated, adds_um: &dyn Fn([f64; 3]) -> Vector3<f64>) {
    let (before, expected) = (number_after(text, "before"), number_after(text, "after"));
    let raw = left_um(made, ENDS_MM, &|_| Vector3::zeros());
    let left = left_um(made, ENDS_MM, adds_um);
    let reversed = left_um(made, ENDS_MM, &|place| -adds_um(place));
    println!("{name}: before {raw:.2}, left {left:.2}, expected {expected:.2}, reversed {reversed:.2} µm");
    assert!((raw / before - 1.0).abs() < 0.05, "{name}: {raw} {before}");
    assert!(left < 1.15 * expected && left > 0.8 * expected, "{name}: {left} {expected}");
    assert!(left < raw && reversed > 1.15 * raw && reversed > 1.15 * expected, "{name}: {left} {raw} {reversed}");
}

#[test]
fn volumetric_files_leave_what_no_curve_describes() {
    let (made, outcome, specs) = measured(1);
    for arms in [[0.0; 3], [250.0, 100.0, -50.0]] {
        let toml = format!("dialect = \"isg-csv\"\narms_from_mm = {arms:?}");
        let text = file(&toml, &specs, &outcome);
        let control = Volumetric::read_csv(&text);
        assert!(text.contains("not observable, 0 here: ECY EAZ EBZ ECZ"), "{text}");
        check("isg-csv", &text, &made, &|place| control.adds_um(place, arms));
        assert!(number_after(&text, "after") < 1.2);
        let text = file(&toml.replace("isg-csv", "etalon"), &specs, &outcome);
        let etalon = Volumetric::read_etalon(&text);
        check("etalon", &text, &made, &|place| etalon.adds_um(place, arms));
        assert_eq!((etalon.curves, etalon.constants), (control.curves, control.constants));
    }
}

#[test]
fn siemens_files_leave_rotations() {
    let (made, outcome, specs) = measured(2);
    let enc = file("dialect = \"siemens-enc-comp\"\naxes = { X = \"X1\", Y = \"Y1\", Z = \"Z1\" }", &specs, &outcome);
    let enc_comp = EncComp::read(&enc);
    assert_eq!(enc_comp.0.keys().map(String::as_str).collect::<Vec<_>>(), ["X1", "Y1", "Z1"]);
    check("siemens-enc-comp", &enc, &made, &|place| enc_comp.adds_um(place));
    for (moves, sign) in [("positive", 1.0), ("negative", -1.0)] {
        let toml = format!("dialect = \"siemens-cec\"\npositive_moves = \"{moves}\"\nfirst_table = 2");
        let text = file(&toml, &specs, &outcome);
        let cec = Cec::read(&text, sign);
        assert_eq!(cec.tables.len(), 6);
        check("siemens-cec", &text, &made, &|place| cec.adds_um(place));
        let both = left_um(&made, ENDS_MM, &|place| enc_comp.adds_um(place) + cec.adds_um(place));
        let alone = left_um(&made, ENDS_MM, &|place| cec.adds_um(place));
        println!("both: {both:.2} µm");
        assert!(both < 0.8 * alone, "{both} {alone}");
        let wrong = Cec::read(&text, -sign);
        assert!(left_um(&made, ENDS_MM, &|place| wrong.adds_um(place)) > 1.3 * alone);
    }
    let error = of_outcome(
        "dialect = \"siemens-cec\"\npositive_moves = \"positive\"\nmost_tables = 4\nleave_out = [\"EXX\"]",
        &specs,
        &outcome,
    );
    assert!(error.unwrap_err().to_string().contains("cannot hold EAX"));
    let text = "dialect = \"siemens-enc-comp\"\nmost_points = 5";
    let error = of_outcome(
        &format!("{text}\n{}", left_out(&of_outcome(text, &specs, &outcome).unwrap_err())),
        &specs,
        &outcome,
    );
    assert!(error.unwrap_err().to_string().contains("X has 6 points, and the control takes 5"));
}

#[test]
fn linuxcnc_files_correct_their_joint() {
    let (made, outcome, specs) = measured(3);
    let mut joints = Vec::new();
    for (index, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
        let toml = format!("dialect = \"linuxcnc\"\naxis = \"{axis}\"\nzero_at = {{ {axis} = 0.0 }}");
        let text = file(&toml, &specs, &outcome);
        let [forward, reverse] = linuxcnc(&text);
        assert_eq!(forward, reverse);
        assert!(forward[0][1].abs() < 1e-9, "{forward:?}");
        let adds = |place: [f64; 3]| {
            let mut adds = Vector3::zeros();
            adds[index] = 1e3 * between(&forward, place[index]);
            adds
        };
        check(&format!("linuxcnc {axis}"), &text, &made, &adds);
        joints.push(forward.clone());
    }
    let all = |place: [f64; 3]| Vector3::from_fn(|axis, _| 1e3 * between(&joints[axis], place[axis]));
    let enc = file("dialect = \"siemens-enc-comp\"", &specs, &outcome);
    let left = left_um(&made, ENDS_MM, &all);
    assert!(left < 1.15 * number_after(&enc, "after"), "{left}");
}

#[test]
fn klipper_files_correct_skew_and_the_bed() {
    let (made, outcome, specs) = measured(4);
    let text = file("dialect = \"klipper\"\nbed_z_mm = 0.0", &specs, &outcome);
    let control = Klipper::read(&text);
    check("klipper", &text, &made, &|place| control.adds_um(place));
}

#[test]
fn mistakes_are_refused() {
    let (_, outcome, specs) = measured(5);
    let message = |toml: &str| of_outcome(toml, &specs, &outcome).unwrap_err().to_string();
    assert!(message("dialect = \"isg-csv\"\nleave_out = [\"EXQ\"]").contains("`leave_out` names EXQ"));
    let folder = tempfile::tempdir().unwrap();
    let fault = |toml: &str| {
        support::exporter(&format!("plugin = \"controller\"\npath = \"a.txt\"\n{toml}"), folder.path()).err().unwrap()
    };
    assert!(fault("dialect = \"linuxcnc\"").contains("needs `axis`"));
    assert!(fault("dialect = \"siemens-cec\"").contains("needs `positive_moves`"));
    assert!(fault("dialect = \"klipper\"").contains("needs `bed_z_mm`"));
    let exporter = support::exporter("plugin = \"controller\"\npath = \"a.txt\"\ndialect = \"isg-csv\"", folder.path());
    let (needed, help) = exporter.unwrap().needs().unwrap();
    assert!(needed == "component_curves" && help.contains("curves ="));
    // A result with an empty table, and one with nodes between places.
    let none = Outcome { tables: vec![outcome.tables[0].clone()], ..Outcome::default() };
    let error = of_outcome("dialect = \"isg-csv\"", &specs, &none).unwrap_err();
    assert!(error.to_string().contains("no component curves"), "{error}");
}
