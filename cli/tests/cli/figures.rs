//! Figures of results, drawn from their tables.

use crate::folder::{self, Folder};

const SCENARIO: &str = r#"
plugin = "spindle"
output = "shaft.h5"
seed = 3
rig = "rig.toml"

[recording]
revolutions = 8
samples_per_rev = 128
stations = { count = 5, step_mm = 40 }

[form]
rms_um = 2
max_order = 12

[noise]
rms_um = 0.02
"#;

fn spindle(formats: &str) -> Folder {
    let export = format!("\n[[export]]\nplugin = \"figures\"\npath = \"figures\"\npanels = 4\n{formats}");
    let pipeline = folder::pipeline() + &export;
    let folder = Folder::with(&[("pipeline.toml", &pipeline), ("rig.toml", folder::RIG), ("scenario.toml", SCENARIO)]);
    let simulated = folder.run(&["simulate", "scenario.toml"]);
    assert_eq!(simulated.status, 0, "{}", simulated.stderr);
    folder
}

#[test]
fn a_spindle_has_form_motion_harmonics_and_surface() {
    let folder = spindle("");
    let ran = folder.run(&["run", "pipeline.toml"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    for figure in ["form", "form-harmonics", "motion", "tilt", "surface"] {
        let png = std::fs::read(folder.path().join(format!("figures/{figure}.png"))).unwrap();
        assert!(png.starts_with(b"\x89PNG") && png.len() > 5_000, "{figure}: {} bytes", png.len());
        let svg = std::fs::read_to_string(folder.path().join(format!("figures/{figure}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") | svg.ends_with("</svg>"), "{figure}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{figure}: a place that is no number");
    }
    let form = std::fs::read_to_string(folder.path().join("figures/form.svg")).unwrap();
    // Every second of five stations: at most four panels.
    assert!(form.contains("Form (3 of 5)") && form.contains("µm"), "{}", &form[..2000]);
    assert!(!folder.path().join("figures/reading.svg").exists(), "the layout separates");
}

#[test]
fn only_the_formats_asked_for_are_written() {
    let folder = spindle("formats = [\"svg\"]");
    assert_eq!(folder.run(&["run", "pipeline.toml"]).status, 0);
    assert!(folder.path().join("figures/form.svg").is_file() && !folder.path().join("figures/form.png").exists());
}

#[test]
fn what_cannot_be_drawn_is_refused_before_the_run() {
    for (keys, said) in
        [("formats = []", "expected a format"), ("formats = [\"pdf\"]", "pdf"), ("panels = 0", "panels")]
    {
        let export = format!("\n[[export]]\nplugin = \"figures\"\npath = \"figures\"\n{keys}\n");
        let folder = Folder::with(&[("pipeline.toml", &(folder::pipeline() + &export))]);
        let ran = folder.run(&["check", "pipeline.toml"]);
        assert!(ran.status == 2 && ran.stderr.contains(said), "{keys}: {}", ran.stderr);
    }
}
