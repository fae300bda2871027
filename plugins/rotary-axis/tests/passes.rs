//! Passes whose readings stand at other places of the file.

#![allow(clippy::print_stdout, reason = "tests")]

use crate::common::{COMPONENTS, LOCATION, PLACEMENT, THREE_BALLS, scenario, separated};
use runout_core::points::Points;

/// A pass of one ball whose readings stand in reverse order, and passes of two balls that are exchanged.
#[test]
fn passes_with_readings_of_other_places_are_named() {
    let text = format!(
        "{THREE_BALLS}{COMPONENTS}{LOCATION}{PLACEMENT}noise_um = 1.0\nseed = 6\npasses = 3\nback_and_forth = true\n\
         commands = {{ step_deg = 10, count = 36 }}"
    );
    let points = scenario(&text).simulate().points();
    let said = |points: &Points| {
        let checks = separated(THREE_BALLS, points).checks;
        let order = checks.into_iter().filter(|check| check.of == "order of the passes");
        order.map(|check| check.finding).collect::<String>()
    };
    assert_eq!(said(&points), "");
    // 36 rows a pass, three passes a ball.
    let moved = |order: &dyn Fn(usize) -> usize| {
        let mut points = points.clone();
        for column in points.columns.iter_mut().filter(|column| column.name.starts_with('d')) {
            let values = column.values.clone();
            column.values = (0..values.len()).map(|row| values[order(row)]).collect();
        }
        points
    };
    let reversed = said(&moved(&|row| if row < 36 { 35 - row } else { row }));
    println!("{reversed}");
    assert!(reversed.contains("pass 1 of ball") && reversed.contains("reverse order"), "{reversed}");
    let exchanged = said(&moved(&|row| match row {
        0..36 => row + 108,
        108..144 => row - 108,
        _ => row,
    }));
    println!("{exchanged}");
    assert!(exchanged.matches("pass 1 of ball").count() == 2 && exchanged.contains("exchanged"), "{exchanged}");
}
