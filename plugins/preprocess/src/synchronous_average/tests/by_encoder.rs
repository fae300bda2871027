//! Turns by the angle of an encoder.

use super::*;

/// Turns of about 1000 samples at a speed that swings, with the encoder's angle and the places of its whole turns.
fn swinging(turns: usize) -> (MemoryStream, MemoryStream) {
    let angle = |position: f64| {
        let even = (position - 30.3) / 1000.7;
        even + 0.002 * (3.0 * TAU * even).sin() + 0.001 * (2.0 * TAU * even).cos()
    };
    let frames = 1001 * turns + 100;
    let data: Vec<Vec<f64>> = (0..2)
        .map(|channel| {
            let harmonics = harmonics(channel);
            (0..frames).map(|frame| signal(&harmonics, TAU * angle(frame as f64))).collect()
        })
        .collect();
    let place = |turn: usize| {
        let (mut low, mut high) = (0.0, frames as f64);
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            if angle(middle) < turn as f64 { low = middle } else { high = middle }
        }
        low
    };
    let index = stream(&data, (1..=turns).map(place).collect());
    let mut encoder = index.clone();
    encoder.capture.encoder = true;
    encoder.angle_rev = (0..frames).map(|frame| angle(frame as f64)).collect();
    (index, encoder)
}

#[test]
fn the_encoder_sees_through_a_swinging_speed() {
    let (index, encoder) = swinging(9);
    // Marks alone put 5 µm of order 1 at angles that are wrong by up to 0.02 rad.
    assert!(worst(&average(1000, index).unwrap()) > 0.01);
    for block_samples in [1, 300, usize::MAX] {
        let mut input = encoder.clone();
        input.block_samples = block_samples;
        let profile = average(1000, input).unwrap();
        assert_eq!(profile.turns.used, 8);
        assert!(worst(&profile) < 5.0 * kernel::ERROR, "{:e}", worst(&profile));
    }
}

#[test]
fn an_encoder_that_stumbles_costs_its_turn() {
    let (_, mut encoder) = swinging(9);
    encoder.angle_rev[3500] -= 0.01;
    encoder.angle_rev[5700] = f64::NAN;
    let profile = average(1000, encoder).unwrap();
    assert_eq!(reasons(&profile), [(2, &Rejection::Angle), (4, &Rejection::Angle)]);
    assert!(worst(&profile) < 5.0 * kernel::ERROR);
}

/// What the program takes for degrees: so many units make a revolution of parts that are mostly eccentric, or mostly lobes.
fn in_another_unit(revolution: f64, turns: usize, lobes: usize) -> MemoryStream {
    let (samples_per_turn, frames) = (97.3, 98 * turns);
    let angle = |frame: usize| frame as f64 / samples_per_turn;
    let harmonics = [(1, Complex64::new(2.0, 1.0)), (lobes, Complex64::new(-3.0, 2.0)), (17, Complex64::from(0.3))];
    let data: Vec<f64> = (0..frames).map(|frame| signal(&harmonics, TAU * angle(frame))).collect();
    let found_rev = |turn: f64| turn * revolution / 360.0;
    let marks = (0..).map(|mark| f64::from(mark) * samples_per_turn * 360.0 / revolution);
    let mut encoder = stream(&[data], marks.take_while(|mark| *mark < frames as f64).collect());
    encoder.capture.encoder = true;
    encoder.angle_rev = (0..frames).map(|frame| found_rev(angle(frame))).collect();
    encoder
}

#[test]
fn an_angle_in_radians_is_refused_and_one_in_turns_warned_of() {
    for lobes in [1, 2, 3, 5] {
        let error = average(64, in_another_unit(TAU, 400, lobes)).unwrap_err().to_string();
        assert!(error.contains("it is in radians"), "{lobes}: {error}");
        let warnings = average(64, in_another_unit(1.0, 2500, lobes)).unwrap().warnings.join("\n");
        assert!(warnings.contains("it is in turns"), "{lobes}: {warnings}");
        let warnings = average(64, in_another_unit(360.0, 40, lobes)).unwrap().warnings.join("\n");
        assert!(!warnings.contains("it is in"), "{lobes}: {warnings}");
    }
}
