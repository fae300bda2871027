//! Scenarios that cannot be are refused, with their place.

use std::path::Path;

use runout_core::pipeline::{
    Catalogue, Plugin,
    document::{Document, Sources},
};

use super::*;

const RIG: &str = r#"plugin = "spindle"
[rig]
part_radius_mm = 30
sensors = [{ id = "S1", angle_deg = 0, z_mm = 200 }]
setups = [{ id = "initial" }]
"#;

/// Message, help and line of the fault in a scenario whose line 6 is the first of `rest`.
fn fault(rest: &str) -> (String, String, usize) {
    let text = format!("{RIG}{rest}");
    let sources = Sources::from_text("scenario.toml", &text, "".into(), &[], "rig").unwrap();
    let document = Document::parse(&sources).unwrap();
    let mut catalogue = Catalogue::default();
    catalogue.add(Plugin::of::<SpindleConfig>());
    let context = Context { folder: Path::new(""), rig: None };
    let Err(fault) = catalogue.build(document.root(), &context) else { panic!("no fault in\n{rest}") };
    let diagnostic = document.diagnose(fault);
    let line = diagnostic.line_and_column().0;
    (diagnostic.message, diagnostic.help.unwrap_or_default(), line)
}

#[test]
fn the_place_of_a_mistake_is_reported() {
    for (rest, message, help, line) in [
        ("[recording]\nspeed_rpm = 0", "above 0", "", 7),
        ("[recording]\nrevolutions = 0", "expected 1", "", 7),
        ("[recording]\nformat = \"i16\"", "range_um", "range_um = 100", 7),
        ("[recording]\nrange_um = 5", "integer", "i16", 7),
        ("[recording]\nspeed_wobble_percent = 40", "backwards", "", 7),
        ("[recording]\nstations = { count = 0 }", "stations", "", 7),
        ("[form]\nrms_um = 4\nmax_order = 300", "order", "samples_per_rev", 8),
        ("[form]\nmeasured = \"no-such.csv\"", "cannot read no-such.csv", "", 7),
        ("[form]\nrmsum = 4", "unknown key `rmsum`", "`rms_um`", 7),
        ("[form]\nharmonics = [{ order = 1, amplitude_um = 1 }]", "order from 2", "", 7),
        ("[motion]\nx = [{ order = 0, amplitude_um = 1 }]", "order from 1", "", 7),
        ("[asynchronous]\nrms_um = 1\nscale_mm = 1e-4", "twice", "", 8),
        ("[asynchronous]\nrms_um = 1\ngamma = 1.000001", "too many", "larger", 8),
        ("[asynchronous]\nlines = [{ order = 3, amplitude_um = 1 }]", "whole", "[motion]", 7),
        ("[eccentricity]\noffset_um = 4000", "radius of 30000", "tenth", 2),
        ("[[effect]]\nplugin = \"sensor-gian\"", "sensor-gian", "`sensor-gain`", 7),
        ("[[effect]]\nplugin = \"sensor-gain\"\ntargets = [\"S1\"]\ngain = 1", "gain", "", 9),
        ("[[effect]]\nplugin = \"sensor-gain\"\ntargets = [\"S3\"]\nrelative_gain = 1", "no sensor `S3`", "`S1`", 8),
        ("[[effect]]\nplugin = \"dent\"\ndepth_um = 1\npart_angle_deg = 0\nwidth_deg = 2", "is form", "`setups`", 7),
        (
            "[[effect]]\nplugin = \"step\"\ntargets = [\"S1\"]\nsetups = [\"x\"]\nstep_um = 1\nfrom_deg = 0\nto_deg = 9",
            "no setup `x`",
            "`initial`",
            9,
        ),
        ("[[effect]]\nplugin = \"speed-ripple\"\norder = 2\namplitude_deg = 90", "backwards", "", 9),
    ] {
        let (found, advice, at) = fault(rest);
        assert!(found.contains(message), "{rest}\ngave: {found}");
        assert!(advice.contains(help), "{rest}\nadvised: {advice}");
        assert_eq!(at, line, "{rest}\ngave: {found}");
    }
}

#[test]
fn stations_and_setups_that_are_not_there_are_errors() {
    let simulator = simulator(&plain()).unwrap();
    let recording = simulator.spindle_recording();
    assert!(recording.open(1, 0).is_err());
    assert!(recording.open(0, 2).is_err());
    assert!(recording.truth(1).is_err());
}
