//! Component errors at nodes: against the harmonics of a simulated axis.

#![allow(clippy::unwrap_used, reason = "tests")]

use crate::common::{COMPONENTS, LOCATION, PLACEMENT, THREE_BALLS, scenario, separated, separator};
use runout_core::{
    component_curves::{Carries, ComponentCurves},
    stage::{Outcome, PointSeparator},
};

fn curves(outcome: &Outcome) -> ComponentCurves {
    let mut all = ComponentCurves::default();
    outcome.tables.iter().for_each(|table| all.take(&table.table, &table.rows).unwrap());
    all
}

/// EXC … ECC of `COMPONENTS` at an angle in °.
fn truth(at_deg: f64) -> [f64; 6] {
    let of = |order: f64, cosine: f64, sine: f64| {
        let phase = (order * at_deg).to_radians();
        cosine * phase.cos() + sine * phase.sin()
    };
    [
        of(2.0, 2.0, 1.0),
        of(3.0, -1.5, 0.0),
        of(1.0, 1.0, 2.0),
        of(1.0, 8.0, 3.0),
        of(1.0, 3.0, -8.0) + of(2.0, 0.0, 6.0),
        of(1.0, 10.0, 0.0) + of(4.0, 0.0, 5.0),
    ]
}

#[test]
fn nodes_have_the_errors_of_the_axis_within_their_uncertainty() {
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..6 {
        let text = format!(
            "{THREE_BALLS}{COMPONENTS}{LOCATION}{PLACEMENT}commands = {{ step_deg = 5, count = 72 }}\nnoise_um = 1.0\nseed = {seed}"
        );
        let points = scenario(&text).simulate().points();
        let outcome = separated(&format!("{THREE_BALLS}std_um = 1.0\ncurves = {{ pitch_deg = 5 }}"), &points);
        let found = curves(&outcome);
        let nodes = found.of_axis("C");
        assert_eq!(nodes.len(), 73);
        assert!(nodes.iter().all(|node| node.carries == Carries::Work));
        for node in &nodes {
            for (error, truth) in truth(node.position).into_iter().enumerate() {
                let z_score = (node.errors[error] - truth) / node.std[error];
                assert!(z_score.abs() < 5.0, "{error} at {}: {node:?}, is {truth}", node.position);
                squares += z_score * z_score;
                count += 1.0;
            }
        }
        assert!((nodes[0].errors[5] - nodes[72].errors[5]).abs() < 1e-12);
        for (symbol, truth) in [("EX0C", 23.7), ("EY0C", 3.1), ("EA0C", 41.0), ("EB0C", 34.6)] {
            let error = found.location.iter().find(|error| error.symbol == symbol).unwrap();
            assert!((error.value - truth).abs() < 5.0 * error.std, "{error:?}");
        }
    }
    let chi2: f64 = squares / count;
    assert!((0.7..1.3).contains(&chi2), "{chi2}");
}

#[test]
fn wider_nodes_have_less_noise_and_half_a_turn_has_ends() {
    let text =
        |count: usize| format!("{THREE_BALLS}{LOCATION}commands = {{ step_deg = 5, count = {count} }}\nnoise_um = 1.0");
    let of = |points: &_, pitch: &str| {
        let outcome = separator(&format!("{THREE_BALLS}std_um = 1.0\ncurves = {{ pitch_deg = {pitch} }}"))
            .separate(points)
            .unwrap();
        curves(&outcome)
    };
    let whole = scenario(&text(72)).simulate().points();
    let [narrow, wide] = ["5", "30"].map(|pitch| of(&whole, pitch).of_axis("C")[1].std[2]);
    assert!(wide < 0.7 * narrow, "{wide} {narrow}");
    let half = scenario(&text(37)).simulate().points();
    let found = of(&half, "20");
    let ends: Vec<f64> = found.of_axis("C").iter().map(|node| node.position).collect();
    assert_eq!((ends.len(), ends[0], ends[9]), (10, 0.0, 180.0));
    let sparse = of(&half, "2");
    let at = sparse.of_axis("C");
    assert!(at.iter().any(|node| node.errors[2].is_nan()), "{at:?}");
}
