//! The short version of `runout-studies spatial-coverage`.

#![allow(clippy::unwrap_used, reason = "tests")]

use runout_studies::spatial;

#[test]
fn predictions_cover_the_true_error_and_compensation_removes_it() {
    let found = spatial::coverage(6, 5, None).unwrap();
    println!("{}", spatial::table(std::slice::from_ref(&found)));
    assert!((0.6..1.6).contains(&found.chi2()) && found.share_inside() > 0.88, "{found:?}");
    assert!(found.compensated >= 5, "{found:?}");
}
