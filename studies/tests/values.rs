//! The short version of `runout-studies value-coverage`.

use runout_studies::values::{RIGS, Spectrum, rows, table};

use crate::trials::trials;

#[test]
fn intervals_of_values_cover_the_true_value() {
    let folder = tempfile::tempdir().unwrap();
    let campaigns = trials(10);
    let rows = rows(RIGS[0], Spectrum::Falling, 0..campaigns as u64, folder.path()).unwrap();
    println!("{}", table(&rows));
    let known = ["RONt | LSCI | none", "Ra | mean line | none", "synchronous-radial-x | LSC | none"];
    assert!(known.iter().all(|name| rows[*name].intervals() >= campaigns), "{known:?}");
    assert!(rows["Rk | mean line | Gaussian λc 8 mm"].without > 0, "values without an interval are counted");
    let (inside, all) = rows.values().fold((0, 0), |(inside, all), row| (inside + row.inside, all + row.intervals()));
    let share = 100.0 * f64::from(u32::try_from(inside).unwrap()) / f64::from(u32::try_from(all).unwrap());
    // Values of a campaign depend on each other: about 10 campaigns of ten independent ones, known to 2.2 %. ± too small by
    // a quarter would give 86 %. Of fewer campaigns it is known less well, by the root of their number.
    let off = 5.0 * f64::sqrt(10.0 / campaigns as f64);
    assert!((95.0 - off..=99.0).contains(&share), "{share:.1} % of {all}");
}
