//! Form error of a separation with exact geometry against the eccentricity, without noise.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::{
    campaigns,
    common::{coefficient_error, profile, random_sum, rig, value},
};
use std::{f64::consts::TAU, time::Instant};

use runout_core::{
    Complex64,
    measurement::StationTruth,
    numerics::fourier::Fourier,
    rig::{Rig, Sensor},
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

/// Four sensors about one section, by the circle that each line meets: motion at 1/rev whose half turns against the spindle moves a part that is off
/// centre across the sensors' lines, also where the other half is lost in the eccentricity.
#[test]
fn form_is_exact_beside_motion_at_once_a_turn() {
    let sensors = [0.0, 99.844, 202.5, 310.0].map(|angle| (angle, 100.0, "a"));
    let rig = rig(&sensors, &[(0.0, 0.0)]);
    let radius_um = 1e3 * rig.part_radius_mm;
    let form = random_sum(3, 12, 1.0);
    let samples = 512;
    let reading = |stand: f64, turned: f64| {
        // The motion is along x only: 0.8 µm with the spindle, and 0.8 µm against it.
        let centre = Complex64::from_polar(200.0, turned + 0.4) + Complex64::from(1.6 * (turned + 1.1).cos());
        let towards = Complex64::cis(stand);
        let seen = centre * towards.conj();
        let mut at_um = radius_um;
        for _ in 0..8 {
            let angle = (towards * at_um - centre).arg() - turned;
            let met_um = radius_um + value(&form, angle);
            at_um = seen.re + (met_um * met_um - seen.im * seen.im).sqrt();
        }
        at_um - radius_um
    };
    let channel = |sensor: &Sensor| -> Vec<f64> {
        let step = rig.rotation.direction() * TAU / samples as f64;
        (0..samples).map(|number| reading(sensor.angle_rad, step * number as f64)).collect()
    };
    let channels: Vec<Vec<f64>> = rig.sensors.iter().map(channel).collect();
    let station = Station { name: "s1".into(), z_mm: 0.0, profiles: vec![profile(0, &channels, samples)] };
    let separation = HarmonicLeastSquares::new(&rig, true, Weighting::None).separate(&station).unwrap();
    let unknown = separation.position(Quantity::Form(0)).unwrap();
    let worst = (2..=20).map(|order| coefficient_error(&separation, unknown, order, &form)).fold(0.0, f64::max);
    println!("{worst:.1e} µm");
    // Where the half that turns against the spindle is left out, order 2 is off by 200 · 0.8 / 30 000 = 0.005 µm.
    assert!(worst < 1e-5, "{worst}");
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

/// A reversal of two sensors a section, so far off centre that form of the order n is seen n·e/R of its size one order lower and higher: what badly
/// determined orders carry into others is in the stated uncertainty of these.
#[test]
fn stated_uncertainty_holds_where_orders_couple() {
    // Nine in ten of all coefficients are within 1.52 standard uncertainties, |error|² over variance being exponential.
    const NINE_IN_TEN: f64 = 2.3;
    for eccentricity_um in [8.0, 120.0, 240.0] {
        let (mut ratio, mut within, mut count) = (0.0, 0_usize, 0_usize);
        for seed in 1..=3 {
            let mut config = campaigns::campaign(seed, "[]");
            config.rig.setups.truncate(2);
            (config.rig.setups[1].part_deg, config.rig.setups[1].sensors_deg) = (180.0, 180.0);
            config.eccentricity.offset_um = eccentricity_um;
            config.recording.revolutions = 20;
            let rig = config.rig.clone().check().unwrap();
            let (station, truth) = campaigns::averaged(&config, &rig);
            let separation =
                HarmonicLeastSquares::new(&rig, true, Weighting::TurnCovariance).separate(&station).unwrap();
            for (section, form_um) in truth.form_um.iter().enumerate() {
                let unknown = separation.position(Quantity::Form(section)).unwrap();
                let mut fourier = Fourier::new(form_um.len());
                let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
                fourier.analyse(form_um.iter().copied(), &mut harmonics);
                for (order, (found, truth)) in separation.coefficients(unknown).zip(&harmonics).enumerate().skip(2) {
                    let variance = separation.variance_of(order * separation.unknowns.len() + unknown);
                    if found.re.is_finite() && variance.is_finite() {
                        let square = (found - truth).norm_sqr() / variance;
                        (ratio, count, within) =
                            (ratio + square, count + 1, within + usize::from(square < NINE_IN_TEN));
                    }
                }
            }
        }
        let (ratio, share) = (ratio / count as f64, within as f64 / count as f64);
        println!("{eccentricity_um} µm: error² over variance {ratio:.2}, within {share:.3} of {count}");
        assert!((0.5..2.0).contains(&ratio) && share > 0.8, "{eccentricity_um} µm: {ratio} {share}");
    }
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
