//! The short version of `runout-studies monte-carlo`.

use runout_studies::monte_carlo::{Row, rows};

/// Threads change no campaign.
#[test]
fn more_threads_find_the_same() {
    let found = rows(4, &[1, 2]).unwrap();
    let bits = |row: &Row| row.form_error_um.map(f64::to_bits);
    assert_eq!(bits(&found[0]), bits(&found[1]));
    // Three setups of 60 turns: noise of 0.05 µm and asynchronous motion of 0.15 µm leave some nanometres.
    assert!((5e-4..2e-2).contains(&found[0].form_error_um[1]), "{:?}", found[0]);
}
