#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;

/// A course and a seeded wander of levels.
fn levels(capture: usize, size_um: f64, course: CreepLaw) -> Levels {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(capture as u64 + 1);
    let mut noise = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    Levels::new((0..60).map(|turn| (turn, size_um * course.at(turn as f64 + 0.5) / course.at(60.0) + 0.1 * noise())))
}

fn creep(sizes: &[f64], course: CreepLaw) -> Creep {
    let steady: Vec<Levels> = (0..sizes.len()).map(|index| levels(index + 90, 0.0, CreepLaw::Straight)).collect();
    let moved = sizes.iter().enumerate().map(|(index, size)| levels(index, *size, course)).collect();
    creeps(&[moved, steady])[0].clone().unwrap()
}

#[test]
fn straight_and_settling_creeps_are_distinguished_by_evidence() {
    for size in [1.0, -24.0, 100.0] {
        let found = creep(&[size; 3], CreepLaw::Straight);
        assert!(found.certain && found.shared && found.time_constant.is_none(), "{found:?}");
        assert!((found.over_capture(0) - size).abs() < 3.0 * found.over_capture_std, "{found:?}");
        let found = creep(&[size; 3], CreepLaw::Settling(12.0));
        assert!(found.certain && found.shared, "{found:?}");
        let [tau, std] = found.time_constant.unwrap();
        assert!((tau - 12.0).abs() < 3.0 * std, "{found:?}");
        assert!((found.over_capture(0) - size).abs() < 3.0 * found.over_capture_std, "{found:?}");
    }
}

#[test]
fn a_creep_of_one_capture_is_that_of_no_other() {
    let found = creep(&[0.0, -20.0, 3.0], CreepLaw::Straight);
    assert!(found.certain && !found.shared, "{found:?}");
    for (capture, size) in [0.0, -20.0, 3.0].into_iter().enumerate() {
        assert!((found.over_capture(capture) - size).abs() < 3.0 * found.over_capture_std, "{found:?}");
    }
}

#[test]
fn steady_levels_have_no_creep() {
    assert!(!creep(&[0.0; 3], CreepLaw::Straight).certain);
    assert!(creeps(&[vec![Levels::new((0..3).map(|turn| (turn, 0.0)))]])[0].is_none());
}

/// A line through a whole wave has a slope, and an averaged turn has nothing of it.
#[test]
fn a_wave_of_the_level_is_no_drift() {
    for size_um in [1.0, 20.0] {
        let wave = |capture: usize| {
            let turns = levels(capture, 0.0, CreepLaw::Straight).means_um.into_iter().enumerate();
            let at = |turn: usize| size_um * (std::f64::consts::TAU * (turn as f64 + 0.5) / 60.0).sin();
            Levels::new(turns.map(|(turn, noise)| (turn, noise + at(turn))).collect::<Vec<_>>().into_iter())
        };
        let found = creeps(&[(0..3).map(wave).collect()])[0].clone().unwrap();
        assert!(!found.certain, "{found:?}");
    }
}
