//! The short version of `runout-studies eccentricity`.

use runout_studies::eccentricity;

#[test]
fn form_error_does_not_grow_with_eccentricity() {
    let rows = eccentricity::rows(3).unwrap();
    println!("{}", eccentricity::table(&rows));
    for row in &rows {
        for error in &row.exact_um {
            assert!(*error <= eccentricity::LIMIT_UM, "{} µm: {error} µm rms", row.eccentricity_um);
        }
    }
    // Without the second order, 150 µm of eccentricity makes errors far above the limit: the study can fail.
    let linear = &rows[2].linear_um;
    assert!(linear.iter().all(|error| *error > 5.0 * eccentricity::LIMIT_UM), "{linear:?}");
}
