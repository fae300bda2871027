//! The short version of `runout-studies minimum-zone-cylinder`.

use runout_studies::minimum_zone_cylinder::{ROUNDING_UM, Wall, table};

#[test]
fn no_start_ends_with_a_narrower_zone() {
    let rows: Vec<_> = (0..6).map(|seed| Wall::simulated(seed).study(20).unwrap()).collect();
    println!("{}", table(&rows, 20));
    for row in &rows {
        let [narrowest, _] = row.searched_um;
        assert!(row.mzcy_um <= narrowest + ROUNDING_UM, "{}: {} beside {narrowest} µm", row.name, row.mzcy_um);
        // The search comes near, and least squares does not: the study can fail.
        assert!(narrowest < row.lscy_um, "{}: the search ended at {narrowest} µm", row.name);
    }
}
