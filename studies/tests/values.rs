//! The short version of `runout-studies value-coverage`.

use runout_studies::values::{RIGS, Spectrum, rows, table};

#[test]
fn intervals_of_values_hold_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let rows = rows(RIGS[0], Spectrum::Falling, 0..10, folder.path()).unwrap();
    println!("{}", table(&rows));
    let known = ["RONt | LSCI | none", "Ra | mean line | none", "synchronous-radial-x | LSC | none"];
    assert!(known.iter().all(|name| rows[*name].intervals() >= 10), "{known:?}");
    assert!(rows["Rk | mean line | Gaussian λc 8 mm"].without > 0, "values without an interval are counted");
    let (inside, all) = rows.values().fold((0, 0), |(inside, all), row| (inside + row.inside, all + row.intervals()));
    let share = 100.0 * f64::from(u32::try_from(inside).unwrap()) / f64::from(u32::try_from(all).unwrap());
    // Values of a campaign depend on each other: about 10 campaigns of ten independent ones, known to 2.2 %. ± too small by
    // a quarter would give 86 %.
    assert!((90.0..=99.0).contains(&share), "{share:.1} % of {all}");
}
