//! Rigs and readings for tests, written in the angle domain and independent of the layout's algebra.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::f64::consts::TAU;

use runout_core::{
    Complex64,
    numerics::fourier::Fourier,
    profile::{Profile, TurnCount},
    rig::{Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
    separation::Separation,
    stage::Station,
};

/// A rig from sensors (angle in degrees, z in mm, section) and setups (part, sensors in degrees).
pub(crate) fn rig(sensors: &[(f64, f64, &str)], setups: &[(f64, f64)]) -> Rig {
    let sensors = sensors.iter().enumerate().map(|(index, (angle_deg, z_mm, section))| SensorConfig {
        id: format!("S{}", index + 1),
        angle_deg: *angle_deg,
        z_mm: *z_mm,
        section: (*section).into(),
        sign: 1,
        ..SensorConfig::default()
    });
    let setups = setups.iter().enumerate().map(|(index, (part_deg, sensors_deg))| SetupConfig {
        id: format!("k{index}"),
        part_deg: *part_deg,
        sensors_deg: *sensors_deg,
        ..SetupConfig::default()
    });
    let config = RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Ccw,
        sensors: sensors.collect(),
        setups: setups.collect(),
    };
    config.check().unwrap()
}

/// The paper's four sensors, at L1 = 100 mm and L2 = 30 mm further.
pub(crate) const FOUR_SENSORS: [(f64, f64, &str); 4] =
    [(0.0, 100.0, "a"), (90.0, 100.0, "a"), (0.0, 130.0, "b"), (90.0, 130.0, "b")];

/// A sum of cosines: (order, amplitude, phase).
pub(crate) type Sum = Vec<(usize, f64, f64)>;

/// Its value at an angle.
pub(crate) fn value(sum: &Sum, angle: f64) -> f64 {
    sum.iter().map(|(order, amplitude, phase)| amplitude * (*order as f64 * angle + phase).cos()).sum()
}

/// A pseudo-random sum over orders 2..=highest.
pub(crate) fn random_sum(seed: u64, highest: usize, size: f64) -> Sum {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (2..=highest).map(|order| (order, size * next() / order as f64, TAU * next())).collect()
}

/// Form of each section and motion x, y, tilt x, tilt y (µm and µrad).
pub(crate) struct Truth {
    pub form_um: Vec<Sum>,
    pub motion: [Sum; 4],
}

/// Averaged readings by the linear equation of `docs/appendix/physics.md` section 1, sample by sample.
pub(crate) fn linear_station(rig: &Rig, truth: &Truth, samples: usize, eccentricity_um: f64) -> Station {
    let profiles = rig.setups.iter().enumerate().map(|(setup, clamping)| {
        let channels: Vec<Vec<f64>> = rig
            .sensors
            .iter()
            .map(|sensor| {
                let stand = sensor.angle_rad + clamping.sensors_rad;
                (0..samples)
                    .map(|step| {
                        let spindle = rig.rotation.direction() * TAU * step as f64 / samples as f64;
                        let part = stand - spindle - clamping.part_rad;
                        let [x, y, tilt_x, tilt_y] =
                            [0, 1, 2, 3].map(|axis| value(&truth.motion[axis], TAU * step as f64 / samples as f64));
                        value(&truth.form_um[sensor.section], part)
                            + eccentricity_um * (part + setup as f64).cos()
                            + stand.cos() * (x + sensor.z_mm * 1e-3 * tilt_y)
                            + stand.sin() * (y - sensor.z_mm * 1e-3 * tilt_x)
                    })
                    .collect()
            })
            .collect();
        profile(setup, &channels, samples)
    });
    Station { name: "s1".into(), z_mm: 0.0, profiles: profiles.collect() }
}

/// A profile of one turn.
pub(crate) fn profile(setup: usize, channels: &[Vec<f64>], samples: usize) -> Profile {
    let mut fourier = Fourier::new(samples);
    let orders = fourier.max_order() + 1;
    let mut mean = vec![Complex64::ZERO; orders * channels.len()];
    let mut harmonics = vec![Complex64::ZERO; orders];
    for (channel, signal) in channels.iter().enumerate() {
        fourier.analyse(signal.iter().copied(), &mut harmonics);
        for (order, harmonic) in harmonics.iter().enumerate() {
            mean[order * channels.len() + channel] = harmonic.conj();
        }
    }
    Profile {
        turn_angles: 512,
        object: format!("test/k{setup}"),
        setup,
        sensors: (0..channels.len()).collect(),
        samples_per_rev: samples,
        mean,
        covariance: None,
        scatter: None,
        spread: None,
        turns: TurnCount { recorded: 1, used: 1, ..TurnCount::default() },
        speed_rpm: None,
        responses: Vec::new(),
        warnings: Vec::new(),
        ..Profile::default()
    }
}

/// Readings that no form and motion explain, so that methods have something to weigh.
pub(crate) fn disturb(station: &mut Station) {
    for (setup, profile) in station.profiles.iter_mut().enumerate() {
        for (index, entry) in profile.mean.iter_mut().enumerate() {
            *entry += Complex64::from_polar(0.01, (index * (setup + 3)) as f64);
        }
    }
}

/// Error of one order of an unknown against the sum of cosines that is true, in µm or µrad.
pub(crate) fn coefficient_error(separation: &Separation, unknown: usize, order: usize, truth: &Sum) -> f64 {
    let (_, amplitude, phase) = truth.iter().find(|(known, ..)| *known == order).copied().unwrap_or((order, 0.0, 0.0));
    // cos(nα + φ) is Re e^{iφ} e^{+inα}, and Re e^{−iφ} e^{−inΦ}.
    let turned = if separation.unknowns[unknown].is_form() { phase } else { -phase };
    let found = separation.estimate[order * separation.unknowns.len() + unknown];
    (found - Complex64::from_polar(amplitude, turned)).norm()
}
