//! Synchronous error motion of the spindle's axis.

use runout_core::{Complex64, fault::Fault};

use super::{
    check,
    config::{MotionConfig, Orders},
    random::{Place, Purpose, phase, stream},
    series::{self, Phasor, Series},
};

/// Harmonics over the spindle's angle, Re Σ cₙ e^{−inΦ}: x and y in µm, tilt about x and y in µrad, z in µm.
#[derive(Debug, Clone, Default)]
pub(super) struct Motion {
    pub axes: [Vec<Complex64>; 5],
}

/// Displacement and tilt of the axis at some instants: x, y in µm, tilt about x and y in µrad, z in µm.
pub(super) type Displacement<const L: usize> = [[f64; L]; 5];

impl Motion {
    /// `orders` is the first order that cannot be sampled.
    pub(crate) fn new(config: &MotionConfig, seed: u64, orders: usize) -> Result<Self, Fault> {
        check::finite("slope", config.slope)?;
        let rms = [
            ("x_rms_um", config.x_rms_um),
            ("y_rms_um", config.y_rms_um),
            ("tilt_rms_urad", config.tilt_rms_urad),
            ("tilt_rms_urad", config.tilt_rms_urad),
            ("z_rms_um", config.z_rms_um),
        ];
        let mut motion = Self::default();
        for (item, (key, rms)) in rms.into_iter().enumerate() {
            check::not_negative(key, rms)?;
            if rms > 0.0 {
                check::order("max_order", config.max_order, 2, orders)?;
                let first = if config.orders == Orders::Odd { 3 } else { 2 };
                if config.max_order < first {
                    return Err(Fault::at("max_order", "the random odd orders begin at 3"));
                }
                let step = if config.orders == Orders::All { 1 } else { 2 };
                let chosen = (first..=config.max_order).step_by(step);
                motion.axes[item] = random_harmonics(rms, chosen, config.slope, seed, Purpose::Motion, item);
            }
        }
        let micrometres = |list: &[super::config::MotionHarmonic]| {
            list.iter().map(|harmonic| (harmonic.order, harmonic.amplitude_um, harmonic.phase_deg)).collect::<Vec<_>>()
        };
        let microradians = |list: &[super::config::TiltHarmonic]| {
            list.iter().map(|harmonic| (harmonic.order, harmonic.amplitude_urad, harmonic.phase_deg)).collect()
        };
        let lists = [
            ("x", "amplitude_um", micrometres(&config.x)),
            ("y", "amplitude_um", micrometres(&config.y)),
            ("tilt_x", "amplitude_urad", microradians(&config.tilt_x)),
            ("tilt_y", "amplitude_urad", microradians(&config.tilt_y)),
            ("z", "amplitude_um", micrometres(&config.z)),
        ];
        for (axis, (list, key, harmonics)) in motion.axes.iter_mut().zip(lists) {
            for (index, (order, amplitude, phase_deg)) in harmonics.into_iter().enumerate() {
                add_harmonic(axis, order, (key, amplitude), phase_deg, orders)
                    .map_err(|fault| fault.under_item(list, index))?;
            }
        }
        Ok(motion)
    }

    /// At spindle angles Φ; `turn` is e^{iΦ}.
    pub(crate) fn at<const L: usize>(&self, turn: &Phasor<L>) -> Displacement<L> {
        let backwards = turn.conj();
        self.axes.each_ref().map(|axis| axis.as_slice().sum(&backwards))
    }

    /// What a separation can find of it: of order 1 only the part that turns against the spindle, since the part that
    /// turns with it is how the workpiece is clamped. Along the axis it finds all.
    pub(crate) fn error_motion(&self, direction: f64) -> Self {
        let [mut x, mut y, mut tilt_x, mut tilt_y, z] = self.axes.clone();
        keep_counter_rotating(&mut x, &mut y, direction);
        // A tilt (εx, εy) displaces the axis at z by z·(εy, −εx).
        tilt_x = negated(tilt_x);
        keep_counter_rotating(&mut tilt_y, &mut tilt_x, direction);
        tilt_x = negated(tilt_x);
        Self { axes: [x, y, tilt_x, tilt_y, z] }
    }
}

fn negated(harmonics: Vec<Complex64>) -> Vec<Complex64> {
    harmonics.into_iter().map(|value| -value).collect()
}

/// With X and Y of Re c e^{−iΦ}, x + iy turns against the spindle where Y = −i·direction·X.
fn keep_counter_rotating(x: &mut Vec<Complex64>, y: &mut Vec<Complex64>, direction: f64) {
    let first = |axis: &[Complex64]| axis.get(1).copied().unwrap_or_default();
    let quarter = Complex64::new(0.0, direction);
    let counter = 0.5 * (first(x) + quarter * first(y));
    if x.len() > 1 || y.len() > 1 {
        let (old_x, old_y) = (first(x), first(y));
        series::add(x, 1, counter - old_x);
        series::add(y, 1, -quarter * counter - old_y);
    }
}

/// Harmonics with random phases whose amplitudes fall with order^-slope, of the root mean square that is asked for.
pub(super) fn random_harmonics(
    rms: f64,
    orders: impl Iterator<Item = usize>,
    slope: f64,
    seed: u64,
    purpose: Purpose,
    item: usize,
) -> Vec<Complex64> {
    let mut random = stream(seed, purpose, Place { item, ..Place::default() });
    let mut harmonics = Vec::new();
    for order in orders {
        series::add(&mut harmonics, order, (order as f64).powf(-slope) * phase(&mut random));
    }
    let scale = rms / series::rms(&harmonics);
    for value in &mut harmonics {
        *value *= scale;
    }
    harmonics
}

/// Checks and adds amplitude · cos(order·Φ − phase).
pub(super) fn add_harmonic(
    axis: &mut Vec<Complex64>,
    order: usize,
    (key, amplitude): (&str, f64),
    phase_deg: f64,
    orders: usize,
) -> Result<(), Fault> {
    check::order("order", order, 1, orders)?;
    check::finite(key, amplitude)?;
    check::finite("phase_deg", phase_deg)?;
    series::add(axis, order, Complex64::from_polar(amplitude, phase_deg.to_radians()));
    Ok(())
}
