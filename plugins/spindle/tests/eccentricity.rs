//! Form error of a separation with exact geometry against the eccentricity, without noise.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::campaigns;
use std::time::Instant;

use runout_core::{
    Complex64,
    measurement::StationTruth,
    numerics::fourier::Fourier,
    rig::Rig,
    separation::{Quantity, Separation},
    stage::{Station, StationSeparator},
};
use runout_spindle::separators::{HarmonicLeastSquares, Weighting};

/// Without noise; asynchronous motion, if any, is averaged over the turns.
fn quiet(eccentricity_um: f64, noise_um: f64) -> (Station, StationTruth, Rig) {
    let mut config = campaigns::campaign(5, "[]");
    config.eccentricity.offset_um = eccentricity_um;
    config.asynchronous.rms_um = Some(0.0);
    config.noise.rms_um = noise_um;
    config.recording.revolutions = if noise_um > 0.0 { 60 } else { 4 };
    let rig = config.rig.clone().check().unwrap();
    let (station, truth) = campaigns::averaged(&config, &rig);
    (station, truth, rig)
}

/// Root mean square error of all sections' forms, orders from 2, in µm.
fn form_error_um(separation: &Separation, truth: &StationTruth) -> f64 {
    let mut squares = 0.0;
    for (section, form_um) in truth.form_um.iter().enumerate() {
        let unknown = separation.position(Quantity::Form(section)).unwrap();
        let mut fourier = Fourier::new(form_um.len());
        let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
        fourier.analyse(form_um.iter().copied(), &mut harmonics);
        let found = separation.coefficients(unknown).zip(&harmonics).skip(2);
        squares += found.map(|(found, truth)| (found - truth).norm_sqr()).sum::<f64>();
    }
    (0.5 * squares / truth.form_um.len() as f64).sqrt()
}

/// To 1 mm on a radius of 30 mm, with and without weights; noise of 0.05 µm over 60 turns makes no more of it than when
/// centred.
#[test]
fn form_is_exact_to_an_eccentricity_of_a_millimetre() {
    let separated = |eccentricity_um: f64, noise_um: f64, weighting| {
        let (station, truth, rig) = quiet(eccentricity_um, noise_um);
        let begun = Instant::now();
        let separation = HarmonicLeastSquares::new(&rig, true, weighting).separate(&station).unwrap();
        let took = begun.elapsed();
        let (error_um, chi2) = (form_error_um(&separation, &truth), separation.residual.chi2_per_dof);
        println!("{eccentricity_um} µm, noise {noise_um} µm, {weighting:?}: {error_um:.2e} µm, χ² {chi2:.3}, {took:?}");
        (error_um, chi2)
    };
    let (centred_um, _) = separated(0.0, 0.05, Weighting::TurnCovariance);
    for eccentricity_um in [8.0, 150.0, 250.0, 400.0, 700.0, 1000.0] {
        for weighting in [Weighting::TurnCovariance, Weighting::None] {
            let (error_um, _) = separated(eccentricity_um, 0.0, weighting);
            assert!(error_um < 1e-4, "{eccentricity_um} µm, {weighting:?}: {error_um}");
        }
        let (error_um, chi2) = separated(eccentricity_um, 0.05, Weighting::TurnCovariance);
        assert!(
            error_um < 1.1 * centred_um && (0.85..1.15).contains(&chi2),
            "{eccentricity_um} µm: {error_um}, {chi2}"
        );
    }
}

/// A lobe at the highest order of the average, 20 µm off centre: a part of it is seen two orders higher, which the average does not have.
#[test]
fn a_lobe_at_the_highest_order_is_exact() {
    let mut config = campaigns::campaign(6, "[]");
    config.form.harmonics = serde_json::from_str(r#"[{"order": 255, "amplitude_um": 1.0}]"#).unwrap();
    config.eccentricity.offset_um = 20.0;
    config.asynchronous.rms_um = Some(0.0);
    config.noise.rms_um = 0.0;
    config.recording.revolutions = 4;
    config.recording.samples_per_rev = 4096;
    let rig = config.rig.clone().check().unwrap();
    let (station, truth) = campaigns::averaged(&config, &rig);
    let separation = HarmonicLeastSquares::new(&rig, true, Weighting::None).separate(&station).unwrap();
    let error_um = form_error_um(&separation, &truth);
    println!("{error_um:.2e} µm");
    // Half of J₂(255·20/30 000) = 0.0036 µm with the angles of the average.
    assert!(error_um < 2e-4, "{error_um}");
}

/// A radius that is declared ten times too small: nothing is given, and the error names the cause.
#[test]
fn an_eccentricity_that_does_not_settle_is_an_error() {
    let (station, _, rig) = quiet(1000.0, 0.05);
    let mistaken = Rig { part_radius_mm: 3.0, ..rig };
    let separation = HarmonicLeastSquares::new(&mistaken, true, Weighting::TurnCovariance).separate(&station);
    let error = separation.unwrap_err().to_string();
    assert!(error.contains("an eccentricity of 10") && error.contains("radius of 3 mm"), "{error}");
}
