//! What the loop must not say: an axis for the nest, noise beside a warning, nothing of copies and of too little scatter.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::common::{COMPONENTS, LOCATION, PLACEMENT, THREE_BALLS, scenario, separator};
use runout_core::{
    closed_loop::{Settings, diagnosis::Verdict},
    stage::{PointDiagnosis, PointSeparator},
};

const CONFIG: &str = "std_um = 1.0";
const PASSES: &str = "passes = 2\nball_by_ball = true\n";

fn column<'a>(points: &'a mut runout_core::points::Points, name: &str) -> &'a mut Vec<f64> {
    &mut points.columns.iter_mut().find(|column| column.name == name).unwrap().values
}

fn of_points(points: &runout_core::points::Points) -> PointDiagnosis {
    let settings = Settings { max_added: 40, ..Settings::default() };
    separator(&format!("{THREE_BALLS}{CONFIG}")).model().unwrap().diagnose(points, &settings).unwrap()
}

fn made(more: &str) -> runout_core::points::Points {
    let text = format!(
        "{THREE_BALLS}{COMPONENTS}{LOCATION}{PLACEMENT}commands = {{ step_deg = 10, count = 36 }}\nnoise_um = 1.0\n{more}"
    );
    scenario(&text).simulate().points()
}

#[test]
fn a_gain_of_the_nest_is_not_taken_for_an_axis_alone() {
    let mut points = made(PASSES);
    column(&mut points, "dx_mm").iter_mut().for_each(|value| *value *= 1.1);
    let found = of_points(&points).diagnosis;
    println!("{:?}", found.added);
    for added in &found.added {
        let nest = added.confounded_with.iter().any(|other| other.starts_with("nest-gain"));
        assert!(nest && added.parameters.iter().all(|parameter| parameter.std.is_none()), "{added:?}");
    }
    // Where nothing was added, the report says what a gain would do.
    let clean = of_points(&made(PASSES)).diagnosis;
    let nest = clean.blind_to.iter().find(|blind| blind.effect == "nest-gain").unwrap();
    assert!((nest.bias_per_unit.value - 0.237).abs() < 0.03, "{nest:?}");
    // A scale that no plausible gain makes stays one of the axes.
    let scaled = of_points(&made(&format!(
        "{PASSES}effect = [{{ plugin = 'linear-axis-scale', targets = ['X'], scale_um_per_m = 400 }}]"
    )));
    assert!(scaled.diagnosis.added[0].confounded_with.iter().all(|other| !other.starts_with("nest")));
}

#[test]
fn the_verdict_does_not_contradict_the_warning_of_a_small_slip() {
    let mut said = 0;
    for size in [3, 5, 7, 9] {
        let found = of_points(&made(&format!(
            "{PASSES}seed = 3\neffect = [{{ plugin = 'slipped-ball', row = 130, by_um = [{size}, -{size}, 0] }}]"
        )));
        let warned = found.diagnosis.warnings.iter().any(|warning| warning.contains("leaves more than the noise"));
        println!("{size}: {:?} {warned}", found.diagnosis.verdict);
        said += usize::from(warned);
        assert!(!warned || found.diagnosis.verdict == Verdict::Unexplained, "{size} {:?}", found.diagnosis.verdict);
    }
    assert!(said > 0);
}

#[test]
fn copies_and_too_little_scatter_are_remarked() {
    let mut twice = made(PASSES);
    for column in &mut twice.columns {
        column.values = column.values.iter().flat_map(|value| [*value, *value]).collect();
    }
    for labels in &mut twice.labels {
        labels.values = labels.values.iter().flat_map(|id| [id.clone(), id.clone()]).collect();
    }
    let warned = |points, text: &str| of_points(points).diagnosis.warnings.iter().any(|warning| warning.contains(text));
    assert!(warned(&twice, "are they copies?"));
    let quiet = made(PASSES);
    assert!(!warned(&quiet, "far below 1") && !warned(&quiet, "are they copies?"));
    let separator = separator(&format!("{THREE_BALLS}std_um = 50.0"));
    let outcome = separator.separate(&quiet).unwrap();
    assert!(outcome.remarks.iter().any(|remark| remark.contains("far below 1")), "{:?}", outcome.remarks);
}
