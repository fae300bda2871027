//! The ellipse on which a line moves the axis.

use std::f64::consts::{PI, SQRT_2};

use runout_core::Complex64;

use crate::layout::Layout;

/// Directions of sensors that differ by less, in rad, are one.
const ALONG: f64 = 1e-3;
/// Semi-axes differ from 0 and from each other beyond so many standard uncertainties of theirs or of their difference.
const CERTAIN_STD: f64 = 4.0;

/// Semi-axes of the motion across the axis, over all setups. Where all sensors look one way, it is the motion along them.
#[derive(Debug, Clone)]
pub(crate) struct Orbit {
    /// The larger one, in µm.
    pub amplitude_um: f64,
    /// The smaller one, in µm.
    pub across_um: f64,
    /// Standard uncertainty of either.
    pub std_um: f64,
    /// Direction of the larger one.
    pub direction_rad: f64,
    /// Its standard uncertainty.
    pub direction_std_rad: f64,
}

impl Orbit {
    /// From the amplitudes of a line, `[setup][channel]`, and those found beside it, where only noise is.
    pub(super) fn new(found: &[Vec<Complex64>], beside: &[Vec<Vec<Complex64>>], layout: &Layout) -> Self {
        let [xx, xy, yy] = squares(found, layout);
        let half = 0.5 * (xx - yy);
        let [amplitude_um, across_um] =
            [1.0, -1.0].map(|sign| (0.5 * (xx + yy) + sign * half.hypot(xy)).max(0.0).sqrt());
        let noise = beside.iter().map(|found| squares(found, layout)).map(|[xx, _, yy]| xx + yy).sum::<f64>();
        let directions = if one_direction(layout) { 1.0 } else { 2.0 };
        let noise_um = (noise / (directions * beside.len() as f64)).sqrt();
        // Half of a complex amplitude's noise is along it; setups are independent.
        let std_um = noise_um / (2.0 * found.len() as f64).sqrt();
        // Semi-axes a and b turn by δ where the amplitudes along and across change by noise: (a² − b²)·δ = a·ε₁ + b·ε₂.
        let apart = amplitude_um.powi(2) - across_um.powi(2);
        Self {
            amplitude_um,
            across_um,
            std_um,
            direction_rad: (0.5 * xy.atan2(half)).rem_euclid(PI),
            direction_std_rad: std_um * amplitude_um.hypot(across_um) / apart,
        }
    }

    /// Whether it is no straight line.
    pub(crate) fn is_open(&self) -> bool {
        self.across_um > CERTAIN_STD * self.std_um
    }

    /// Whether it is no circle, which has no direction.
    pub(crate) fn has_direction(&self) -> bool {
        self.amplitude_um - self.across_um > CERTAIN_STD * SQRT_2 * self.std_um
    }
}

/// Whether all sensors look along one direction.
fn one_direction(layout: &Layout) -> bool {
    let mut angles = layout.readings.iter().filter(|reading| !reading.view.is_axial()).map(|reading| reading.angle_rad);
    let first = angles.next().unwrap_or(0.0);
    angles.all(|angle| (angle - first).sin().abs() < ALONG)
}

/// Mean over setups of |x|², Re x·ȳ and |y|², x and y the phasors of the motion; NaN where no sensor looks across the axis.
fn squares(found: &[Vec<Complex64>], layout: &Layout) -> [f64; 3] {
    let mut squares = [0.0; 3];
    for (setup, amplitudes) in found.iter().enumerate() {
        let (mut cc, mut cs, mut ss) = (0.0, 0.0, 0.0);
        let (mut c, mut s) = (Complex64::ZERO, Complex64::ZERO);
        let readings = layout.readings.iter().filter(|reading| reading.setup == setup);
        for (reading, amplitude) in readings.zip(amplitudes).filter(|(reading, _)| !reading.view.is_axial()) {
            let (sine, cosine) = reading.angle_rad.sin_cos();
            (cc, cs, ss) = (cc + cosine * cosine, cs + cosine * sine, ss + sine * sine);
            (c, s) = (c + amplitude * cosine, s + amplitude * sine);
        }
        let determinant = cc * ss - cs * cs;
        let (x, y) = if determinant > ALONG * ALONG {
            ((c * ss - s * cs) / determinant, (s * cc - c * cs) / determinant)
        } else {
            // What is along the sensors, cos θ·c + sin θ·s, of their common direction.
            (c / (cc + ss), s / (cc + ss))
        };
        squares[0] += x.norm_sqr();
        squares[1] += (x * y.conj()).re;
        squares[2] += y.norm_sqr();
    }
    squares.map(|sum| sum / found.len() as f64)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};
    use runout_core::rig::{RigConfig, Rotation, SensorConfig, SetupConfig};

    use super::*;

    /// Two sensors at right angles and one between them, in two setups.
    fn layout() -> Layout {
        let sensor = |angle_deg: f64| SensorConfig {
            id: format!("S{angle_deg}"),
            angle_deg,
            section: "s".into(),
            sign: 1,
            ..SensorConfig::default()
        };
        let setup = |id: &str| SetupConfig { id: id.into(), ..SetupConfig::default() };
        let config = RigConfig {
            interruptions: Vec::new(),
            bearings: Vec::new(),
            part_radius_mm: 30.0,
            rotation: Rotation::Ccw,
            sensors: [0.0, 50.0, 90.0].map(sensor).into(),
            setups: ["a", "b"].map(setup).into(),
        };
        Layout::new(&config.check().unwrap(), false)
    }

    /// What is stated of lines, ellipses and circles is what noise scatters them by; a circle has no direction.
    #[test]
    fn axes_and_directions_are_as_uncertain_as_they_scatter() {
        const NOISE: f64 = 0.01;
        let layout = layout();
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut noise = || -> Complex64 {
            let [re, im]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
            NOISE * Complex64::new(re, im)
        };
        let direction_rad: f64 = 0.7;
        for across in [0.0, 0.5, 0.9, 1.0] {
            let (mut turned, mut lengths, mut stated, mut known) = (Vec::new(), Vec::new(), Vec::new(), 0);
            for _ in 0..400 {
                let mut amplitudes = |size: f64| -> Vec<Vec<Complex64>> {
                    let of = |reading: &crate::layout::Reading| {
                        let (sine, cosine) = (reading.angle_rad - direction_rad).sin_cos();
                        size * Complex64::new(cosine, across * sine) + noise()
                    };
                    let readings: Vec<Complex64> = layout.readings.iter().map(of).collect();
                    readings.chunks(3).map(<[Complex64]>::to_vec).collect()
                };
                let beside: Vec<_> = (0..4).map(|_| amplitudes(0.0)).collect();
                let orbit = Orbit::new(&amplitudes(1.0), &beside, &layout);
                turned.push((orbit.direction_rad - direction_rad + PI / 2.0).rem_euclid(PI) - PI / 2.0);
                lengths.push(orbit.amplitude_um - 1.0);
                stated.push([orbit.direction_std_rad, orbit.std_um]);
                known += usize::from(orbit.has_direction());
            }
            let rms = |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / 400.0).sqrt();
            let median = |which: usize| {
                let mut all: Vec<f64> = stated.iter().map(|one| one[which]).collect();
                all.sort_by(f64::total_cmp);
                all[200]
            };
            println!("{across}: {} / {}, {} / {}", rms(&turned), median(0), rms(&lengths), median(1));
            if across < 1.0 {
                // 400 draws know a scatter to 4 %; sensors that are not at right angles have no one noise in all directions.
                assert!((0.75..1.33).contains(&(median(0) / rms(&turned))), "{across}: {} {}", median(0), rms(&turned));
                assert!((0.75..1.33).contains(&(median(1) / rms(&lengths))), "{across}");
                assert_eq!(known, 400, "{across}");
            } else {
                assert!(known < 4, "{known} of 400 circles have a direction");
            }
        }
    }
}
