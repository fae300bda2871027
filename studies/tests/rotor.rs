//! Rotors beside closed forms and beside a peer.

#![allow(clippy::unwrap_used, reason = "tests")]

use runout_studies::rotor;

/// What rotary inertia and shear take from a beam of length/diameter 200 in its third mode is 0.04 %.
#[test]
fn slender_beams_have_the_frequencies_of_their_closed_forms() {
    let rows = rotor::beams().unwrap();
    assert_eq!(rows.len(), 3 * 4 * 3 * 2);
    for row in rows {
        assert!(row.percent().abs() <= 0.1, "{row:?}");
    }
}

/// Both programs solve the same equations, so they differ by rounding: 0.5 % is asked for, 0.01 % is held.
#[test]
fn rotors_of_a_peer_have_its_frequencies() {
    let peer = rotor::peer().unwrap();
    assert_eq!(peer.rows.len(), 2 * (6 * 8 + 4));
    assert_eq!(peer.damping.len(), 6 * 8);
    for row in peer.rows {
        assert!(row.percent().abs() <= 0.01, "{row:?}");
    }
    for row in peer.damping {
        assert!((row.found - row.reference).abs() <= 1e-5, "{row:?}");
    }
}
