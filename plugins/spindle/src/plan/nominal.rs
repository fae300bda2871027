//! A station as a rig would measure it: readings predicted by the linear model, with the noise that they would have.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::{
    Complex64,
    profile::{Profile, TurnCount},
    separation::Quantity,
    stage::Station,
};

use crate::{layout::Layout, selection::Selection};

/// Form of each section, root mean square, in µm.
const FORM_UM: f64 = 4.0;
/// Part of its mean square that changes along z, and over which wavelength, in mm.
const OWN_SHARE: f64 = 0.3;
const WAVELENGTH_MM: f64 = 200.0;
/// Synchronous motion along x and along y, root mean square, in µm.
const MOTION_UM: f64 = 1.5;
/// Synchronous tilt about x and about y, root mean square, in µrad.
const TILT_URAD: f64 = 3.0;
/// How far off centre the part is clamped, in µm.
const ECCENTRICITY_UM: f64 = 8.0;
/// Noise of each sensor's samples, root mean square, in µm.
const NOISE_UM: f64 = 0.05;
/// Asynchronous motion along x and along y, root mean square, in µm, of a spectral density that falls with 1/f² from one
/// cycle a recording on.
const ASYNCHRONOUS_UM: f64 = 0.15;
const TURNS: usize = 60;
const SAMPLES_PER_REV: usize = 512;
/// Form and motion have orders 2 to this one.
const MAX_ORDER: usize = 40;
/// Angles a turn on which what is not linear is worked out: enough for products of two orders.
const ANGLES: usize = 128;

/// The campaign in words.
#[must_use]
pub(crate) fn words() -> String {
    format!(
        "form {FORM_UM} µm and motion {MOTION_UM} µm, {TILT_URAD} µrad rms (orders 2-{MAX_ORDER}, falling with 1/order), \
         {ECCENTRICITY_UM} µm off centre, sensor noise {NOISE_UM} µm and asynchronous motion {ASYNCHRONOUS_UM} µm rms, \
         {TURNS} turns of {SAMPLES_PER_REV} samples"
    )
}

/// One station, with phases that are drawn once for all.
#[must_use]
pub(crate) fn station(selection: &Selection) -> Station {
    let rig = &selection.rig;
    // Motion keeps its sign whatever a separator assumes.
    let layout = Layout::new(rig, false);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let sensors = rig.sensors.len();
    let mut profiles: Vec<Profile> = (0..rig.setups.len()).map(|setup| profile(selection, &layout, setup)).collect();
    let mut phase = || Complex64::cis(random.random_range(0.0..TAU));
    for (setup, profile) in profiles.iter_mut().enumerate() {
        let offset = ECCENTRICITY_UM * phase();
        for (index, reading) in layout.readings[setup * sensors..(setup + 1) * sensors].iter().enumerate() {
            let across = !reading.view.is_axial();
            profile.mean[sensors + index] =
                if across { offset * layout.part_phase(reading, 1) } else { Complex64::ZERO };
        }
    }
    // Σ (A/n)²/2 over the orders is the mean square.
    let squares: f64 = (2..=MAX_ORDER).map(|order| (order as f64).powi(-2)).sum();
    for order in 2..=MAX_ORDER {
        let unit = (2.0 / squares).sqrt() / order as f64;
        let [common, along, across] = [(); 3].map(|()| phase());
        let motion = [(); 4].map(|()| phase());
        // Drawn only where there is an axial sensor: other rigs keep their campaign.
        let [face, axial] = if rig.has_axial() { [(); 2].map(|()| phase()) } else { [Complex64::ZERO; 2] };
        let value = |quantity: Quantity| match quantity {
            Quantity::Form(section) => {
                let (sine, cosine) = (TAU * rig.section_z_mm(section) / WAVELENGTH_MM).sin_cos();
                let own = along * cosine + across * sine;
                (common * (1.0 - OWN_SHARE).sqrt() + own * OWN_SHARE.sqrt()) * FORM_UM
            }
            Quantity::FaceForm(_) => face * FORM_UM,
            Quantity::Z => axial * MOTION_UM,
            Quantity::FaceMotion(_) => Complex64::ZERO,
            Quantity::X | Quantity::Along(_) => motion[0] * MOTION_UM,
            Quantity::Y => motion[1] * MOTION_UM,
            Quantity::TiltX => motion[2] * TILT_URAD,
            Quantity::TiltY | Quantity::TiltAlong(_) => motion[3] * TILT_URAD,
        };
        for (index, reading) in layout.readings.iter().enumerate() {
            let seen =
                layout.unknowns.iter().map(|unknown| layout.coefficient(reading, *unknown, order) * value(*unknown));
            profiles[index / sensors].mean[order * sensors + index % sensors] = unit * seen.sum::<Complex64>();
        }
    }
    Station { name: "nominal".into(), z_mm: 0.0, profiles }
}

/// A setup's profile without its readings.
fn profile(selection: &Selection, layout: &Layout, setup: usize) -> Profile {
    let sensors = selection.sensors.len();
    let readings = &layout.readings[setup * sensors..(setup + 1) * sensors];
    // E|c|² of Re c e^{−inΦ} over T turns is 2 S(n)/T, S the spectral density per order: 2σ²/N of white noise, and
    // s²/(T n²) of a mean square s² above one cycle in T turns.
    let turns = TURNS as f64;
    let noise = 4.0 * NOISE_UM.powi(2) / (SAMPLES_PER_REV as f64 * turns);
    let mut covariance = Vec::with_capacity((MAX_ORDER + 1) * sensors * sensors);
    for order in 0..=MAX_ORDER {
        let moved = 2.0 * (ASYNCHRONOUS_UM / (turns * order.max(1) as f64)).powi(2);
        for (row, one) in readings.iter().enumerate() {
            for (column, other) in readings.iter().enumerate() {
                let common = match [one, other].map(|reading| reading.view.is_axial()) {
                    [false, false] => moved * (one.angle_rad - other.angle_rad).cos(),
                    [true, true] => moved,
                    _ => 0.0,
                };
                covariance.push(Complex64::from(if row == column { noise + common } else { common }));
            }
        }
    }
    Profile {
        object: "nominal".into(),
        setup: selection.setups[setup],
        sensors: selection.sensors.clone(),
        samples_per_rev: ANGLES,
        turn_angles: ANGLES,
        mean: vec![Complex64::ZERO; (MAX_ORDER + 1) * sensors],
        scatter: Some(covariance.clone()),
        covariance: Some(covariance),
        spread: None,
        turns: TurnCount { recorded: TURNS, used: TURNS, ..TurnCount::default() },
        speed_rpm: None,
        responses: Vec::new(),
        warnings: Vec::new(),
        ..Profile::default()
    }
}
