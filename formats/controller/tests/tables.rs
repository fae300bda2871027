//! Tables of Heidenhain and FANUC, read by a control that corrects a machine.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::collections::BTreeMap;

use nalgebra::Vector3;
use runout_core::{stage::Outcome, table::TableSpec};

use crate::{
    control::{ENDS_MM, check, measured},
    support::{
        all_of_outcome, exporter, left_out, left_um,
        tables::{Boxes, Heidenhain, Pitch},
    },
};

/// All files, with all errors left out that the dialect cannot hold.
fn files(toml: &str, specs: &[TableSpec], outcome: &Outcome) -> BTreeMap<String, String> {
    match all_of_outcome(toml, specs, outcome) {
        Ok(files) => files,
        Err(error) => all_of_outcome(&format!("{toml}\n{}", left_out(&error)), specs, outcome).unwrap(),
    }
}

/// Why the file is refused once what the dialect cannot hold is left out.
fn refused(toml: &str, specs: &[TableSpec], outcome: &Outcome) -> String {
    let error = all_of_outcome(toml, specs, outcome).unwrap_err();
    all_of_outcome(&format!("{toml}\n{}", left_out(&error)), specs, outcome).unwrap_err().to_string()
}

const COM: &str = "com = { X = \"x.com\", Y = \"y.com\", Z = \"z.com\" }";

#[test]
fn heidenhain_tables_leave_rotations() {
    let (made, outcome, specs) = measured(6);
    for (moves, sign) in [("positive", 1.0), ("negative", -1.0)] {
        let toml = format!(
            "dialect = \"heidenhain\"\npositive_moves = \"{moves}\"\n{COM}\nzero_at = {{ X = 200.0 }}\naxes = {{ X = \"X1\", Y = \"Y1\", Z = \"Z1\" }}"
        );
        let all = files(&toml, &specs, &outcome);
        assert_eq!(
            all.keys().map(String::as_str).collect::<Vec<_>>(),
            ["file.cma", "file.txt", "x.com", "y.com", "z.com"]
        );
        let control = Heidenhain::read(&all, "file.cma", sign);
        check("heidenhain", &all["file.txt"], &made, &|place| control.adds_um(place));
        let wrong = Heidenhain::read(&all, "file.cma", -sign);
        let raw = left_um(&made, ENDS_MM, &|_| Vector3::zeros());
        assert!(left_um(&made, ENDS_MM, &|place| wrong.adds_um(place)) > 1.3 * raw);
    }
    let toml = format!("dialect = \"heidenhain\"\npositive_moves = \"positive\"\n{COM}");
    let error = all_of_outcome(&toml, &specs, &outcome).unwrap_err().to_string();
    assert!(error.contains("cannot hold EAX") && !error.contains("EXX"), "{error}");
    let message = refused(&format!("{toml}\nmost_tables = 5"), &specs, &outcome);
    assert!(message.contains("9 dependencies are needed, and the control has 5"), "{message}");
    let message = refused(&format!("{toml}\nmost_points = 5"), &specs, &outcome);
    assert!(message.contains("the table of X has 6 points, and the control takes 5"), "{message}");
    let message = refused(&toml.replace("Z = \"z.com\"", ""), &specs, &outcome);
    assert!(message.contains("errors by the position of Z"), "{message}");
    let message = refused(&toml.replace("Z = \"z.com\"", "Z = \"z.com\", C = \"c.com\""), &specs, &outcome);
    assert!(message.contains("`com` names a table of C"), "{message}");
}

const PITCH: &str = "dialect = \"fanuc-pitch\"\ndetection_unit = { X = 0.001, Y = 0.001, Z = 0.001 }";
const UNIT_MM: f64 = 0.001;

#[test]
fn fanuc_pitch_errors_correct_each_axis() {
    let (made, outcome, specs) = measured(7);
    let references = [200.0, 0.0, 300.0];
    let places = "zero_at = { X = 200.0, Y = 0.0, Z = 300.0 }";
    for (moves, sign, more) in [
        ("positive", 1.0, "magnification = 3"),
        ("negative", -1.0, "largest_value = 40\nfirst_point = 100"),
        ("positive", 1.0, "largest_value = 40"),
    ] {
        let toml = format!("{PITCH}\npositive_moves = \"{moves}\"\n{places}\n{more}");
        let text = files(&toml, &specs, &outcome).remove("file.cma").unwrap();
        let axes = |sign: f64| {
            [0, 1, 2].map(|axis| Pitch::read(&text, ["X", "Y", "Z"][axis], references[axis], sign * UNIT_MM))
        };
        let (right, wrong) = (axes(sign), axes(-sign));
        let adds = |axes: &[Pitch; 3], place: [f64; 3]| Vector3::from_fn(|axis, _| 1e3 * axes[axis].adds(place[axis]));
        check("fanuc-pitch", &text, &made, &|place| adds(&right, place));
        let raw = left_um(&made, ENDS_MM, &|_| Vector3::zeros());
        assert!(left_um(&made, ENDS_MM, &|place| adds(&wrong, place)) > 1.15 * raw);
    }
    let toml = format!("{PITCH}\npositive_moves = \"positive\"");
    let message = refused(&format!("{toml}\n{places}"), &specs, &outcome);
    assert!(message.contains("and the control takes 7: take a narrower pitch"), "{message}");
    let message = refused(&format!("{toml}\nzero_at = {{ X = 130.0 }}"), &specs, &outcome);
    assert!(message.contains("the reference position of X, 130, is no node"), "{message}");
    let message = refused(&toml.replace(", Z = 0.001", ""), &specs, &outcome);
    assert!(message.contains("the control takes 7") || message.contains("the detection unit of Z"), "{message}");
    let message = refused(&format!("{toml}\n{places}\nmagnification = 5\nfirst_point = 1020"), &specs, &outcome);
    assert!(message.contains("and the control takes 1024"), "{message}");
}

#[test]
fn fanuc_boxes_hold_all_errors_of_linear_axes() {
    let (made, outcome, specs) = measured(8);
    let toml = "dialect = \"fanuc-3d\"\ndetection_unit = { X = 0.001, Y = 0.001, Z = 0.001 }";
    for (moves, sign) in [("positive", 1.0), ("negative", -1.0)] {
        let toml = format!("{toml}\npositive_moves = \"{moves}\"");
        let text = all_of_outcome(&toml, &specs, &outcome).unwrap().remove("file.cma").unwrap();
        let control = Boxes::read(&text, sign * UNIT_MM);
        check("fanuc-3d", &text, &made, &|place| control.adds_um(place));
        let wrong = Boxes::read(&text, -sign * UNIT_MM);
        let raw = left_um(&made, ENDS_MM, &|_| Vector3::zeros());
        assert!(left_um(&made, ENDS_MM, &|place| wrong.adds_um(place)) > 1.8 * raw);
    }
    let message = |more: &str| {
        let toml = format!("{toml}\npositive_moves = \"positive\"\n{more}");
        all_of_outcome(&toml, &specs, &outcome).unwrap_err().to_string()
    };
    assert!(message("largest_value = 5").contains("and the control takes 5"));
    assert!(message("most_points = 100").contains("the grid of vertices has 120 points, and the control takes 100"));
}

#[test]
fn mistakes_in_the_configuration_have_a_place() {
    let folder = tempfile::tempdir().unwrap();
    let fault = |toml: &str| {
        exporter(&format!("plugin = \"controller\"\npath = \"a.cma\"\n{toml}"), folder.path()).err().unwrap()
    };
    assert!(fault("dialect = \"heidenhain\"").contains("needs `positive_moves`"));
    assert!(fault("dialect = \"heidenhain\"\npositive_moves = \"positive\"").contains("needs `com`"));
    let com = |com: &str| fault(&format!("dialect = \"heidenhain\"\npositive_moves = \"positive\"\ncom = {{ {com} }}"));
    assert!(com("X = \"a.com\", Y = \"a.com\"").contains("two files of this export"));
    assert!(com("X = \"a.cma\"").contains("two files of this export"));
    assert!(com("X = \"b/a.com\"").contains("expected the name of a file beside `path`"));
    let fanuc = "dialect = \"fanuc-3d\"\npositive_moves = \"positive\"";
    assert!(fault(fanuc).contains("needs `detection_unit`"));
    assert!(fault(&format!("{fanuc}\ndetection_unit = {{ X = 0.0 }}")).contains("expected a unit above 0 for X"));
    assert!(fault(&format!("{fanuc}\ndetection_unit = {{ X = 0.1 }}\nmagnification = 0")).contains("at least 1"));
}
