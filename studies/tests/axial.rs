//! The short version of `runout-studies axial`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::trials::{fewest, trials};
use runout_studies::{
    axial::{Layout, rows},
    coverage::table,
};

/// 40 spindles a layout, or a third. Of 40 intervals that cover the true value with 95 %, 33 or fewer do in 1 of 300 cases; errors at angles depend
/// on each other, 36 of a campaign.
#[test]
fn stated_intervals_of_axial_motion_cover_the_true_value() {
    let spindles = trials(40);
    let mut of_all = [0; 2];
    for layout in Layout::ALL {
        let rows = rows(&layout.campaigns(0, spindles as u64)).unwrap();
        println!("{}\n{}", layout.name(), table(&rows));
        let names: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
        for symbol in [
            "z at angles",
            "fundamental-axial",
            "synchronous-axial",
            "asynchronous-axial",
            "synchronous-face-at-25mm-200deg",
        ] {
            assert!(names.contains(&symbol), "{symbol}: {names:?}");
        }
        assert_eq!(names.contains(&"face at angles"), layout == Layout::Face);
        for row in &rows {
            let least = if spindles < 40 { fewest(spindles, [34, 40], 0.95) as f64 / spindles as f64 } else { 0.84 };
            assert!(row.percent() >= 100.0 * least, "{}: {}: {:.1} %", layout.name(), row.name, row.percent());
            of_all[0] += row.inside;
            of_all[1] += row.all;
        }
    }
    // All of a third are as many spindles as a layout has in the full study.
    assert!(100 * of_all[0] >= 84 * of_all[1], "{of_all:?}");
}
