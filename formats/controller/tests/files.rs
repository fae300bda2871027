//! Golden files of each dialect, read back; and a rotary axis whose control takes them.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{env, fs, path::Path};

use crate::support::{
    all_of_curves, all_of_outcome,
    controls::{Cec, EncComp, Klipper, Points, Volumetric, between, linuxcnc},
    of_curves, of_outcome,
    tables::{Boxes, Heidenhain, Pitch},
};
use nalgebra::{Rotation3, Vector3};
use runout_core::{
    component_curves::{Carries, ComponentCurves, Location, Node},
    stage::PointSeparator,
};
use runout_rotary_axis::{RotaryAxisConfig, simulate::Scenario};

const STD: [f64; 6] = [0.1, 0.1, 0.1, 1.0, 1.0, 1.0];

/// Three linear axes with few nodes.
fn linear() -> ComponentCurves {
    let node = |axis: &str, position: f64, errors: [f64; 6]| {
        let mut at_mm = [100.0, 50.0, 25.0];
        at_mm[["X", "Y", "Z"].iter().position(|letter| *letter == axis).unwrap()] = position;
        Node { axis: axis.into(), carries: Carries::Tool, position, at_mm, errors, std: STD }
    };
    let lost = f64::NAN;
    let nodes = vec![
        node("X", 0.0, [-4.0, 1.0, 2.0, -10.0, 5.0, 0.0]),
        node("X", 100.0, [1.0, -2.0, 0.0, 10.0, 0.0, 20.0]),
        node("X", 200.0, [3.0, 1.0, -2.0, 0.0, -5.0, -20.0]),
        node("Y", 0.0, [0.5, -3.0, 0.0, 0.0, 8.0, lost]),
        node("Y", 100.0, [-0.5, 3.0, 0.0, 0.0, -8.0, lost]),
        node("Z", 0.0, [0.0, 0.0, -1.5, lost, lost, lost]),
        node("Z", 50.0, [0.0, 0.0, 1.5, lost, lost, lost]),
    ];
    let location = |symbol: &str, value: f64| Location { symbol: symbol.into(), value, std: 1.0 };
    let location = vec![location("EC0Y", 30.0), location("EB0Z", -20.0), location("EA0Z", 10.0)];
    ComponentCurves { nodes, location }
}

/// The file is the stored one; `RUNOUT_GOLDEN=1` stores it.
fn is_golden(name: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name);
    if env::var_os("RUNOUT_GOLDEN").is_some() {
        fs::write(&path, text).unwrap();
    }
    assert_eq!(text, fs::read_to_string(&path).unwrap(), "{name}");
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}

#[test]
fn files_are_those_of_the_controls() {
    let curves = linear();
    let angles = "\"EAX\", \"EBX\", \"ECX\", \"EBY\"";
    let squareness = "\"EC0Y\", \"EB0Z\", \"EA0Z\"";
    let text = of_curves(
        &format!(
            "dialect = \"siemens-enc-comp\"\naxes = {{ X = \"X1\" }}\nzero_at = {{ X = 100.0 }}\nleave_out = [{angles}, {squareness}, \"EYX\", \"EZX\", \"EXY\"]"
        ),
        &curves,
        false,
    )
    .unwrap();
    is_golden("eec.ini", &text);
    let enc = EncComp::read(&text);
    // 4 µm too far at 200 mm, beside 1 µm at the place of no correction: 2 µm back.
    near(enc.adds_um([200.0, 50.0, 25.0]).x, -2.0);
    let text = of_curves(
        &format!("dialect = \"siemens-cec\"\npositive_moves = \"positive\"\nleave_out = [{angles}, \"EXX\", \"EYY\", \"EZZ\"]"),
        &curves,
        false,
    )
    .unwrap();
    is_golden("cec.ini", &text);
    let cec = Cec::read(&text, 1.0);
    // EXY is −0.5 µm and Y turns x by −30 µrad · 50 mm at its end.
    near(cec.adds_um([100.0, 100.0, 25.0]).x, 0.5 + 1.5);
    let text = of_curves("dialect = \"isg-csv\"", &curves, false).unwrap();
    is_golden("isg.csv", &text);
    let read = Volumetric::read_csv(&text);
    near(read.constants["C0Y"], 30e-6);
    // EYX of 1 µm at X 200, Y 50, Z 25 with ECX of −20 and EAX of 0 µrad: no arm along x.
    near(read.curves["EYX"][2][1], 1e-3);
    // EXX of 3 µm there is that at Y 50; at Y 0 it is 3 − 20e-3·50 µm: ECX of −20 µrad moves x by +20e-3·y; EBX of −5 by −5e-3·25.
    near(read.curves["EXX"][2][1], 1e-3 * (3.0 - 1.0 + 0.125));
    let text = of_curves("dialect = \"etalon\"", &curves, false).unwrap();
    is_golden("etalon.ini", &text);
    assert_eq!(Volumetric::read_etalon(&text).curves, read.curves);
    let text = of_curves(
        &format!("dialect = \"linuxcnc\"\naxis = \"X\"\nleave_out = [{angles}, {squareness}, \"EYX\", \"EZX\", \"EXY\", \"EYY\", \"EZZ\"]"),
        &curves,
        false,
    )
    .unwrap();
    is_golden("x.comp", &text);
    near(1e3 * between(&linuxcnc(&text)[0], 50.0), 1.5);
    let text = of_curves(
        "dialect = \"klipper\"\nbed_z_mm = 5.0\nleave_out = [\"EXX\", \"EYX\", \"ECX\", \"EXY\", \"EYY\", \"EZZ\"]",
        &curves,
        false,
    )
    .unwrap();
    is_golden("printer.cfg", &text);
    // EZX of −2 µm at 200 mm, no rotation about X there; EBX has no arm along x. EA0Z of 10 µrad moves y by −10e-3·z.
    let adds = Klipper::read(&text).adds_um([200.0, 50.0, 5.0]);
    near(adds.z, 2.0);
    near(adds.y, 0.05);
}

#[test]
fn tables_of_heidenhain_and_fanuc_are_those_of_the_controls() {
    let curves = linear();
    let angles = "\"EAX\", \"EBX\", \"ECX\", \"EBY\"";
    let com = "com = { X = \"x.com\", Y = \"y.com\", Z = \"z.com\" }\naxes = { X = \"X1\" }\nzero_at = { X = 100.0 }";
    let toml = format!("dialect = \"heidenhain\"\npositive_moves = \"positive\"\n{com}\nleave_out = [{angles}]");
    let files = all_of_curves(&toml, &curves, false).unwrap();
    for name in ["file.cma", "x.com", "y.com", "z.com", "file.txt"] {
        is_golden(&format!("heidenhain-{name}"), &files[name]);
    }
    let adds = Heidenhain::read(&files, "file.cma", 1.0).adds_um([200.0, 100.0, 25.0]);
    // EXX of 3 µm beside 1 µm at the place of no correction; EXY of −0.5 µm; Y turns x by −30 µrad · 50 mm.
    near(adds.x, -2.0 + 0.5 + 1.5);
    // EYX of 1 µm and EYY of 3 µm.
    near(adds.y, -1.0 - 3.0);
    let toml = format!(
        "dialect = \"fanuc-pitch\"\npositive_moves = \"positive\"\ndetection_unit = {{ X = 0.001, Y = 0.0005, Z = 0.001 }}
        zero_at = {{ X = 100.0 }}\nlargest_value = 12\nleave_out = [{angles}, \"EC0Y\", \"EB0Z\", \"EA0Z\", \"EYX\", \"EZX\", \"EXY\"]"
    );
    let text = of_curves(&toml, &curves, false).unwrap();
    is_golden("fanuc-pitch.txt", &text);
    let x = Pitch::read(&text, "X", 100.0, 1e-3);
    // EXX is −4, 1, 3 µm at 0, 100, 200 mm: 5 µm ahead of where the reference position is, and 2 µm back.
    for (at, adds) in [(0.0, 5.0), (100.0, 0.0), (150.0, -1.0), (200.0, -2.0)] {
        near(1e3 * x.adds(at), adds);
    }
    // 6 µm over 100 mm.
    near(1e3 * Pitch::read(&text, "Y", 0.0, 0.5e-3).adds(100.0), -6.0);
    let toml = "dialect = \"fanuc-3d\"\npositive_moves = \"positive\"\ndetection_unit = { X = 0.0001, Y = 0.0001, Z = 0.0001 }";
    let text = of_curves(toml, &curves, false).unwrap();
    is_golden("fanuc-3d.csv", &text);
    let adds = Boxes::read(&text, 1e-4).adds_um([200.0, 0.0, 50.0]);
    // EXX of 3 µm; ECX of −20 µrad with 50 mm less of y: −1 µm; EBX of −5 µrad with 25 mm more of z: −0.125 µm; EXY of 0.5 µm;
    // EBY of 8 µrad with 25 mm: 0.2 µm; EC0Y of 30 µrad with 50 mm less of y: 1.5 µm; EB0Z of −20 µrad with 25 mm: −0.5 µm.
    near((adds.x + 3.0 - 1.0 - 0.125 + 0.5 + 0.2 + 1.5 - 0.5).abs().max(0.05), 0.05);
}

const BALLS: &str = "balls = [
    { id = 'P1', x_mm = 120, y_mm = 0, z_mm = 60 },
    { id = 'P2', x_mm = -50, y_mm = 95, z_mm = 110 },
    { id = 'P3', x_mm = -70, y_mm = -80, z_mm = 40 },
]\n";

/// EXC, EYC, EZC and ECC at an angle, as the scenario below has them.
fn axis_errors(at_deg: f64) -> [f64; 4] {
    let at = at_deg.to_radians();
    [6.0 * (2.0 * at).cos(), -5.0 * (3.0 * at).sin(), 4.0 * at.cos(), 40.0 * at.cos() + 15.0 * (2.0 * at).sin()]
}

#[test]
fn a_rotary_axis_and_the_tool_that_follows_it_meet() {
    let scenario: Scenario = toml::from_str(&format!(
        "{BALLS}commands = {{ step_deg = 7.5, count = 48 }}\npasses = 2\nnoise_um = 0.5\nseed = 3
        component = [
            {{ error = 'EXC', order = 2, cosine = 6.0 }},
            {{ error = 'EYC', order = 3, sine = -5.0 }},
            {{ error = 'EZC', order = 1, cosine = 4.0 }},
            {{ error = 'ECC', order = 1, cosine = 40.0 }},
            {{ error = 'ECC', order = 2, sine = 15.0 }},
        ]"
    ))
    .unwrap();
    let config: RotaryAxisConfig = toml::from_str(&format!("{BALLS}curves = {{ pitch_deg = 7.5 }}")).unwrap();
    let separator = config.separator().unwrap();
    let outcome = separator.separate(&scenario.simulate().points()).unwrap();
    let specs = separator.tables();
    let others = "\"EAC\", \"EBC\", \"EX0C\", \"EY0C\", \"EA0C\", \"EB0C\"";
    let enc = format!("dialect = \"siemens-enc-comp\"\nleave_out = [{others}, \"EXC\", \"EYC\", \"EZC\"]");
    let enc = EncComp::read(&of_outcome(&enc, &specs, &outcome).unwrap());
    let cec = format!("dialect = \"siemens-cec\"\npositive_moves = \"negative\"\nleave_out = [{others}, \"ECC\"]");
    let cec = Cec::read(&of_outcome(&cec, &specs, &outcome).unwrap(), -1.0);
    assert!(enc.0["C"].1 && cec.tables.iter().all(|(input, _, _, turns)| input == "C" && *turns));
    // A positive value moves the axis in its negative direction.
    let siemens = |command: f64| -between(&enc.0["C"].0, command);
    let tool = |command: f64| {
        let of = |(_, output, points, _): &(String, String, Points, bool)| (output.clone(), -between(points, command));
        cec.tables.iter().map(of).collect::<Vec<_>>()
    };
    meets("siemens", &siemens, &tool);
    let heidenhain = format!(
        "dialect = \"heidenhain\"\npositive_moves = \"negative\"\ncom = {{ C = \"c.com\" }}\nleave_out = [{others}]"
    );
    let files = all_of_outcome(&heidenhain, &specs, &outcome).unwrap();
    let control = Heidenhain::read(&files, "file.cma", -1.0);
    assert!(control.dependencies.len() == 4 && control.dependencies.iter().all(|(input, ..)| input == "C"));
    let of = |command: f64| -> Vec<(String, f64)> {
        control.dependencies.iter().map(|(_, output, points)| (output.clone(), -between(points, command))).collect()
    };
    let own = |command: f64| of(command).iter().find(|(output, _)| output == "C").unwrap().1;
    let tool = |command: f64| of(command).into_iter().filter(|(output, _)| output != "C").collect();
    meets("heidenhain", &own, &tool);
    let fanuc =
        "dialect = \"fanuc-pitch\"\npositive_moves = \"positive\"\ndetection_unit = { C = 0.0001 }\nlargest_value = 50";
    let text = format!("{fanuc}\nfirst_point = 60\nleave_out = [{others}, \"EXC\", \"EYC\", \"EZC\"]");
    let pitch = Pitch::read(&of_outcome(&text, &specs, &outcome).unwrap(), "C", 0.0, 1e-4);
    assert_eq!(pitch.turn(), 0);
    let zero = between(&enc.0["C"].0, 0.0);
    for command in [0.0, 90.0, 202.5, 355.0] {
        // 0.0001° and half of it.
        let off = pitch.adds(command) - (siemens(command) + zero);
        assert!(off.abs() < 1e-4, "{command}: {off}");
    }
    assert!((pitch.adds(-30.0) - pitch.adds(330.0)).abs() < 1e-9);
}

/// What the tool is off a ball by at all commands, without correction, with it, and with reversed signs.
fn meets(name: &str, axis_deg: &dyn Fn(f64) -> f64, tool_mm: &dyn Fn(f64) -> Vec<(String, f64)>) {
    let ball = Vector3::new(150.0, 30.0, 80.0);
    let left = |sign: f64| -> f64 {
        let squares = (0..180).map(|step| {
            let command = 2.0 * f64::from(step);
            let moved = command + sign * axis_deg(command);
            let [x, y, z, turned] = axis_errors(moved);
            let actual = Rotation3::from_axis_angle(&Vector3::z_axis(), moved.to_radians() + 1e-6 * turned) * ball
                + 1e-3 * Vector3::new(x, y, z);
            let mut tool = Rotation3::from_axis_angle(&Vector3::z_axis(), command.to_radians()) * ball;
            for (output, adds) in tool_mm(command) {
                let along = ["X", "Y", "Z"].iter().position(|letter| *letter == output).unwrap();
                tool[along] += sign * adds;
            }
            1e6 * (actual - tool).norm_squared()
        });
        (squares.sum::<f64>() / 180.0).sqrt()
    };
    let (before, after, reversed) = (left(0.0), left(1.0), left(-1.0));
    println!("{name}: before {before:.2}, after {after:.2}, reversed {reversed:.2} µm");
    assert!(after < 0.12 * before && reversed > 1.8 * before, "{name}: {before} {after} {reversed}");
}
