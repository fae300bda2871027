//! What single sensors see of form and motion.

use super::{
    effects::{INITIAL, PART, TURNED, ids, place, scene},
    *,
};

fn beside(scene: &SpindleConfig, effect: Effect) -> SpindleConfig {
    SpindleConfig { effect: vec![effect], ..scene.clone() }
}

/// An undulation with a whole period under the spot is not seen, one with half a period by 2/π, and others sensors see all of them.
#[test]
fn a_spot_averages_the_form() {
    let period_mm = TAU * 30.0 / 20.0;
    for (width_mm, share) in [(period_mm, 0.0), (0.5 * period_mm, 4.0 / TAU), (0.0, 1.0)] {
        let mut scene = plain();
        scene.form.harmonics = vec![FormHarmonic { order: 20, amplitude_um: 2.0, ..FormHarmonic::default() }];
        let with = beside(&scene, Effect::ProbeSpot(ProbeSpot { targets: ids(&["S1"]), width_mm, declared: false }));
        let (before, after) = (readings(&scene, 0, INITIAL), readings(&with, 0, INITIAL));
        assert_eq!(before[1..], after[1..]);
        // The midpoint rule of 512 points.
        assert!(largest_difference(&after[0], |phi| 2.0 * share * (20.0 * phi).cos()) < 1e-5, "{width_mm}");
    }
}

/// Without form a bracket that moves takes its share of all that is read; the part's clamping is not motion.
#[test]
fn a_bracket_takes_motion_along() {
    let mut scene = scene();
    (scene.form.rms_um, scene.form.harmonics, scene.noise.rms_um) = (0.0, Vec::new(), 0.0);
    (scene.eccentricity.offset_um, scene.eccentricity.tilt_urad, scene.geometry) = (0.0, 0.0, Geometry::Linear);
    let with = |scene: &SpindleConfig| {
        let bracket = BracketMotion { targets: ids(&["S3"]), share: 0.25, declared: false };
        readings(&beside(scene, Effect::BracketMotion(bracket)), 0, INITIAL)
    };
    let (before, after) = (readings(&scene, 0, INITIAL), with(&scene));
    assert!(before[2].iter().any(|value| value.abs() > 0.1));
    assert!(before[2].iter().zip(&after[2]).all(|(before, after)| (0.75 * before - after).abs() < 1e-12));
    assert_eq!((&before[0], &before[3]), (&after[0], &after[3]));
    let mut clamped = scene.clone();
    clamped.eccentricity.offset_um = 5.0;
    let (all, without) = (readings(&clamped, 0, INITIAL), with(&clamped));
    let same = |sample: usize| (all[2][sample] - before[2][sample]) - (without[2][sample] - after[2][sample]);
    assert!((0..TURN).all(|sample| same(sample).abs() < 1e-12));
}

/// A pattern, whether it turns with the part (1) or the spindle (0), and which setup and channel has it.
type Case = (Effect, f64, fn(usize, usize) -> bool);

/// A chuck's form is where the sensor is on the spindle; those of a clamping and of a sensor are where it is on the part.
#[test]
fn patterns_turn_with_what_they_are_fixed_to() {
    let scene = scene();
    let both = |config: &SpindleConfig| [INITIAL, TURNED].map(|setup| readings(config, 0, setup));
    let (order, amplitude_um, phase_deg, declared) = (4, 0.6, 25.0, false);
    let lobes = |targets| Lobes { targets, order, amplitude_um, phase_deg, declared };
    let setup = vec![scene.rig.setups[TURNED].id.clone()];
    let before = both(&scene);
    let cases: [Case; 3] = [
        (Effect::ChuckForm(ChuckForm(lobes(vec![]))), 0.0, |_, _| true),
        (Effect::ClampingForm(ClampingForm(lobes(setup))), 1.0, |setup, _| setup == TURNED),
        (Effect::ElectricalRunOut(ElectricalRunOut(lobes(ids(&["S2"])))), 1.0, |_, channel| channel == 1),
    ];
    for (effect, on_part, has) in cases {
        let after = both(&beside(&scene, effect));
        for (setup, (after, before)) in after.iter().zip(&before).enumerate() {
            for channel in 0..4 {
                let from_rad = place(channel).0 - on_part * PART[setup].to_radians();
                let angle = |phi: f64| 4.0 * (from_rad - phi) - 25.0_f64.to_radians();
                let size = if has(setup, channel) { 0.6 } else { 0.0 };
                let added: Vec<f64> = after[channel].iter().zip(&before[channel]).map(|(a, b)| a - b).collect();
                assert!(largest_difference(&added, |phi| size * angle(phi).cos()) < 1e-12, "{setup} {channel}");
            }
        }
    }
}
