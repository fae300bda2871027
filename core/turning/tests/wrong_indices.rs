//! A wrong index of a caller is answered, not a panic.
#![allow(clippy::unwrap_used, reason = "tests")]

use runout_error::ErrorKind;
use runout_numerics::{Complex64, height_map::HeightMap};
use runout_turning::{profile::Turns, surface::Surface};

#[test]
fn a_ring_that_is_not_there_is_empty() {
    let surface = Surface {
        radius_mm: 10.0,
        angles: 4,
        z_mm: vec![0.0, 1.0],
        deviation_um: vec![1.0; 8],
        interpolation: "",
        meetings: Vec::new(),
    };
    assert_eq!(surface.ring(1).len(), 4);
    for ring in [2, 1_000_000] {
        assert!(surface.ring(ring).is_empty());
    }
    let short = HeightMap::unrolled(10.0, &[0.0, 1.0], 4, &[1.0; 7]).unwrap_err();
    assert_eq!(short.kind(), ErrorKind::InsufficientData);
}

#[test]
fn a_harmonic_that_was_not_kept_is_no_number() {
    let turns = Turns {
        numbers: vec![0, 1],
        orders: 2,
        channels: 2,
        spans: vec![[0.0, 1.0], [1.0, 2.0]],
        harmonics: (0..8).map(|value| Complex64::from(f64::from(value))).collect(),
    };
    assert!((turns.at(1, 1, 1).re - 7.0).abs() < 1e-15);
    // An order or channel beyond the last one is not the next turn's first.
    for (turn, order, channel) in [(0, 2, 0), (0, 0, 2), (2, 0, 0), (9, 9, 9)] {
        assert!(turns.at(turn, order, channel).is_nan(), "{turn} {order} {channel}");
    }
    assert!(turns.levels(5).all(f64::is_nan));
}
