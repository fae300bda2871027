//! What campaigns say against themselves: turns that do not close, passes that are offset, and nothing of sound ones.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::common::{COMPONENTS, LOCATION, PLACEMENT, THREE_BALLS, scenario, separated, value};

/// A turn from −180° to 180° that does not close, or does: the end of the turn is no repeat of its beginning.
#[test]
fn a_turn_that_does_not_close_is_named_and_is_no_noise() {
    let balls = "balls = [{ id = 'P1', x_mm = 40, y_mm = 60, z_mm = 0 }]\n";
    for (seed, gap_um) in [(1, 60.0), (2, 90.0), (3, -120.0), (4, 0.0), (5, 0.0), (6, 0.0), (7, 0.0)] {
        let text = format!(
            "{balls}{LOCATION}seed = {seed}\ncommands = {{ from_deg = -180, step_deg = 24, count = 16 }}\nnoise_um = 4.0"
        );
        let mut points = scenario(&text).simulate().points();
        let last = points.columns.iter().position(|column| column.name == "c_deg").unwrap();
        let row = points.columns[last].values.iter().position(|deg| (deg - 180.0).abs() < 1e-9).unwrap();
        points.columns.iter_mut().find(|column| column.name == "dx_mm").unwrap().values[row] += 1e-3 * gap_um;
        let found = separated(&format!("{balls}component_errors = false"), &points);
        let [error, std] = value(&found, "closing_error");
        assert!(!found.notes.iter().any(|note| note.contains("scatter of repeats")), "{:?}", found.notes);
        let said = found.checks.iter().any(|check| check.finding.starts_with("the turn does not close by"));
        println!("{seed}: {error:.1} ± {std:.1} µm, {:?}", found.checks);
        assert_eq!(said, gap_um != 0.0, "{:?}", found.checks);
        if gap_um != 0.0 {
            assert!((error - f64::abs(gap_um)).abs() < 25.0, "{error}");
            assert!(found.values.iter().all(|value| value.refuted_by.is_some()));
        }
    }
}

/// A pass that is offset in one coordinate is named with it; passes that are not, are not.
#[test]
fn a_pass_that_is_offset_is_named() {
    let mut clean = 0;
    for seed in 0..24 {
        let mut points = scenario(&format!("{THREE_BALLS}{COMPONENTS}{LOCATION}{PLACEMENT}commands = {{ step_deg = 15, count = 24 }}\nseed = {seed}\nnoise_um = 2.0\npasses = 2")).simulate().points();
        if seed < 6 {
            let repeat = points.columns.iter().find(|column| column.name == "repeat").unwrap().values.clone();
            let dy = points.columns.iter_mut().find(|column| column.name == "dy_mm").unwrap();
            dy.values.iter_mut().zip(repeat).filter(|(_, pass)| *pass > 1.0).for_each(|(value, _)| *value += 3e-3);
        }
        let found = separated(&format!("{THREE_BALLS}std_um = 2.0"), &points);
        let said: Vec<&str> =
            found.checks.iter().map(|check| check.finding.as_str()).filter(|said| !said.is_empty()).collect();
        if seed < 6 {
            assert!(
                said.iter().any(|said| said.contains("dy of pass 2 differs from dy of pass 1")),
                "{seed}: {said:?}"
            );
        } else {
            clean += usize::from(!said.is_empty());
        }
    }
    assert!(clean < 2, "{clean} of 18");
}
