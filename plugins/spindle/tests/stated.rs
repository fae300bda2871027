//! What a run and a diagnosis state of the same simulated campaign, and marks that are known to half a sample.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic, reason = "tests")]

use crate::campaigns::{averaged, averaged_from, campaign};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::{
    Complex64, Result,
    closed_loop::Settings,
    measurement::{Block, Capture, SampleStream, StationTruth},
    numerics::fourier::Fourier,
    separation::{Quantity, Separation},
    stage::{Station, StationDiagnosis, StationSeparator},
};
use runout_spindle::{
    diagnose::diagnose,
    effects,
    layout::Layout,
    selection::Selection,
    separators::{HarmonicLeastSquares, Weighting},
    simulate::SpindleConfig,
};

fn separated(config: &SpindleConfig, station: &Station) -> Separation {
    let rig = config.rig.clone().check().unwrap();
    HarmonicLeastSquares::new(&rig, true, Weighting::TurnCovariance).separate(station).unwrap()
}

fn diagnosed(config: &SpindleConfig, station: &Station) -> StationDiagnosis {
    let rig = config.rig.clone().check().unwrap();
    let (layout, settings) = (Layout::new(&rig, false), Settings::default());
    diagnose(Selection::whole(&rig), layout, true, effects::all(), std::slice::from_ref(station), &settings).unwrap()
}

/// Before the loop adds anything, a diagnosis states what a run states: residual, χ², and each harmonic with its variance.
#[test]
fn before_is_what_a_run_states() {
    for (seed, effect) in [
        (1, "[]"),
        (2, r#"[{"plugin":"sensor-gain","targets":["S1"],"relative_gain":0.017}]"#),
        (3, r#"[{"plugin":"reversal-angle","targets":["b"],"angle_deg":0.34}]"#),
    ] {
        let config = campaign(seed, effect);
        let rig = config.rig.clone().check().unwrap();
        let (station, _) = averaged(&config, &rig);
        let (run, found) = (separated(&config, &station), diagnosed(&config, &station));
        let before = &found.diagnosis.before;
        println!("simulated, {effect}: run {:?}, before {before:?}", run.residual);
        let same = |one: f64, other: f64| (one / other - 1.0).abs() < 1e-9;
        assert!(same(run.residual.chi2_per_dof, before.chi2_per_dof.unwrap()), "{effect}");
        assert!(same(run.residual.rms_um, before.residual_rms_um), "{effect}");
        assert!(same(run.residual.expected_rms_um, before.noise_floor_um.unwrap()), "{effect}");
        for (one, other) in run.estimate.iter().zip(&found.before[0].estimate).filter(|(one, _)| one.is_finite()) {
            assert!((one - other).norm() < 1e-9, "{effect}: {one} {other}");
        }
    }
}

/// A recording whose marks are off by a part of a sample, which it says.
struct Rounded<'a> {
    input: Box<dyn SampleStream + 'a>,
    capture: Capture,
}

impl SampleStream for Rounded<'_> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        self.input.next_block(block)
    }
}

/// Marks of each setup are off by anything within half a sample, the same in all turns: what a column of 0 and 1 makes of 512
/// samples a turn.
fn with_rounded_marks(config: &SpindleConfig, says_so: bool) -> (Station, StationTruth) {
    let rig = config.rig.clone().check().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(config.seed);
    averaged_from(config, &rig, |input| {
        let mut capture = input.capture().clone();
        let off: f64 = random.random_range(-0.5..0.5);
        capture.marks.iter_mut().for_each(|mark| *mark += off);
        capture.marks_within_samples = if says_so { 0.5 } else { 0.0 };
        Box::new(Rounded { input, capture })
    })
}

/// Squared errors of form's orders 2 to 15 and their stated variances, summed, about the best common angle: that of all setups
/// together has no effect on any value.
fn errors_and_variances(separation: &Separation, truth: &StationTruth) -> [f64; 2] {
    let mut sums = [0.0; 2];
    let width = separation.unknowns.len();
    let (mut across, mut along) = (0.0, 0.0);
    let mut all = Vec::new();
    for (section, curve) in truth.form_um.iter().enumerate() {
        let mut harmonics = vec![Complex64::ZERO; 16];
        Fourier::new(curve.len()).analyse(curve.iter().copied(), &mut harmonics);
        let unknown = separation.position(Quantity::Form(section)).unwrap();
        for (order, truth) in harmonics.iter().enumerate().skip(2) {
            let index = order * width + unknown;
            let (error, turned) = (separation.estimate[index] - truth, Complex64::new(0.0, order as f64) * truth);
            across += (turned.conj() * error).re;
            along += turned.norm_sqr();
            all.push((error, turned));
            sums[1] += separation.variance_of(index);
        }
    }
    let common = across / along;
    sums[0] = all.iter().map(|(error, turned)| (error - turned * common).norm_sqr()).sum();
    sums
}

/// Half a sample is in the standard uncertainty, and the residual that it leaves is no contradiction; left unsaid, the residual refutes the
/// noise and widens what is stated, by less than errors that are alike in all sensors of a setup need.
#[test]
fn marks_known_to_half_a_sample_are_in_the_uncertainty() {
    let [mut said, mut unsaid] = [[0.0; 2]; 2];
    let mut chi2 = Vec::new();
    for seed in 1..=12 {
        let config = campaign(seed, "[]");
        for (sums, says_so) in [(&mut said, true), (&mut unsaid, false)] {
            let (station, truth) = with_rounded_marks(&config, says_so);
            let found = separated(&config, &station);
            let own = errors_and_variances(&found, &truth);
            sums.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
            if says_so {
                chi2.push(found.residual.chi2_per_dof);
            }
        }
    }
    let ratios = [said, unsaid].map(|[errors, variances]| (errors / variances).sqrt());
    println!("simulated: errors over stated {ratios:.2?} (said, unsaid); χ² {chi2:.2?}");
    // 36 offsets; the angle common to all setups, a third of the variance, is taken out of the errors and not of the variance.
    assert!((0.4..1.25).contains(&ratios[0]), "{ratios:?}");
    assert!((1.5..3.0).contains(&ratios[1]), "{ratios:?}");
    // Below what a run warns of; angles of half a sample are not small at high orders, for which the linear equations are not exact.
    assert!(chi2.iter().all(|chi2| (0.6..4.0).contains(chi2)), "{chi2:?}");
}

/// What a diagnosis states covers the true value, whether it finds by how much the setups are turned or not.
#[test]
fn a_diagnosis_of_marks_at_whole_samples_covers_the_true_value() {
    let mut inside = 0;
    for seed in 1..=3 {
        let config = campaign(seed, "[]");
        let (station, truth) = with_rounded_marks(&config, true);
        let found = diagnosed(&config, &station);
        let [errors, variances] = errors_and_variances(&found.after[0], &truth);
        println!(
            "simulated: {:?}, error over stated {:.2}, {:?}",
            found.diagnosis.verdict,
            (errors / variances).sqrt(),
            found.diagnosis.added.iter().map(|added| (&added.effect, &added.targets)).collect::<Vec<_>>()
        );
        inside += usize::from(errors < 4.0 * variances);
    }
    assert_eq!(inside, 3);
}

/// A line of asynchronous motion half a period over the record from order 2 looks synchronous there. The neighbours of the order show what
/// it puts into the average, and the uncertainty of form holds it; without it, errors were 2.7 times as large as stated.
#[test]
fn a_tone_near_an_order_is_in_the_uncertainty() {
    const TURNS: usize = 43;
    let mut sums = [0.0; 2];
    for seed in 1..=12 {
        let order = 2.0 + 0.5 / TURNS as f64;
        let line = format!(
            r#"[{{"plugin":"asynchronous-line","order":{order},"amplitude_um":0.2,"direction_deg":{}}}]"#,
            30 * seed
        );
        let mut config = campaign(seed, &line);
        config.recording.revolutions = TURNS;
        let rig = config.rig.clone().check().unwrap();
        let (station, truth) = averaged(&config, &rig);
        for profile in &station.profiles {
            assert!(profile.near_tones.iter().any(|tone| tone.order == 2), "{:?}", profile.near_tones);
            assert!(profile.warnings.iter().any(|warning| warning.contains("from order 2")), "{:?}", profile.warnings);
        }
        let separation = separated(&config, &station);
        let width = separation.unknowns.len();
        for (section, curve) in truth.form_um.iter().enumerate() {
            let mut harmonics = [Complex64::ZERO; 3];
            Fourier::new(curve.len()).analyse(curve.iter().copied(), &mut harmonics);
            let index = 2 * width + separation.position(Quantity::Form(section)).unwrap();
            sums[0] += (separation.estimate[index] - harmonics[2]).norm_sqr();
            sums[1] += separation.variance_of(index);
        }
    }
    let ratio = (sums[0] / sums[1]).sqrt();
    println!("simulated: errors of order 2 are {ratio:.2} times what is stated");
    assert!((0.5..1.4).contains(&ratio), "{ratio}");
    // Nothing of that size in a clean campaign: its asynchronous motion has tones of its own.
    let config = campaign(3, "[]");
    let rig = config.rig.clone().check().unwrap();
    let (station, _) = averaged(&config, &rig);
    let leaks = station.profiles.iter().flat_map(|profile| &profile.near_tones).flat_map(|tone| &tone.leak);
    assert!(leaks.clone().all(|leak| leak.norm() < 0.03) && leaks.count() <= 8);
}
