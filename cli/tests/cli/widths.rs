//! What the terminal shows at 80 columns and at 120.

use insta::assert_snapshot;

use crate::folder::{self, Folder, Ran};

const SCENARIO: &str = r#"
plugin = "spindle"
output = "shaft.h5"
seed = 3
rig = "rig.toml"

[recording]
revolutions = 8
samples_per_rev = 128
stations = { count = 3, step_mm = 40 }

[form]
rms_um = 2
max_order = 12

[noise]
rms_um = 0.02
"#;

/// A simulated spindle with a limit and a limit that it breaks.
fn spindle() -> Folder {
    let limits = "\n[[limit]]\nsymbol = \"RONt\"\nupper = 30.0\nunit = \"um\"\n\n[[limit]]\nsymbol = \"RONt\"\nupper = 1.0\nunit = \"um\"\n";
    let folder = Folder::with(&[
        ("pipeline.toml", &(folder::pipeline() + limits)),
        ("rig.toml", folder::RIG),
        ("scenario.toml", SCENARIO),
    ]);
    let simulated = folder.run(&["simulate", "scenario.toml"]);
    assert_eq!(simulated.status, 0, "{}", simulated.stderr);
    folder
}

/// What is on stdout, no line wider than so many columns.
fn within(columns: usize, ran: &Ran) -> &str {
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let widest = ran.stdout.lines().max_by_key(|line| line.chars().count()).unwrap_or_default();
    assert!(widest.chars().count() <= columns, "{} columns: {widest}", widest.chars().count());
    &ran.stdout
}

#[test]
fn a_run_at_80_columns() {
    assert_snapshot!(within(80, &spindle().run_within(80, &["run", "pipeline.toml"])));
}

/// Lines stay readable: at most 100 columns.
#[test]
fn a_run_at_120_columns() {
    assert_snapshot!(within(100, &spindle().run_within(120, &["run", "pipeline.toml"])));
}

#[test]
fn a_diagnosis_at_80_columns() {
    assert_snapshot!(within(80, &spindle().run_within(80, &["diagnose", "pipeline.toml"])));
}

#[test]
fn a_diagnosis_at_120_columns() {
    assert_snapshot!(within(100, &spindle().run_within(120, &["diagnose", "pipeline.toml"])));
}
