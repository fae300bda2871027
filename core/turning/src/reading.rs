//! What one sensor's reading in one setup has by itself.
//!
//! A layout that separates nothing (one sensor, one clamping) reads form, eccentricity and error motion as one sum. Run-out
//! (ISO 1101, as a dial gauge shows it) and harmonics are then those of the reading, and of neither the part nor the axis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{profile::Profile, rig::Rig};
use runout_draws::{Draws, Measured, Uncertainty, VarianceFrom, seed};
use runout_numerics::{Complex64, fourier::Fourier};
use runout_standards::roundness::ront_lsci_um;

/// Points a wave of the highest order: a crest between two of them is at most 2 % of that order's amplitude higher.
const POINTS_A_WAVE: usize = 16;
/// Harmonics from 2 that are listed; tables have all.
const LISTED: usize = 15;

/// What the averaged reading of one sensor in one setup has. All of it is of form and motion together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct ReadingValues {
    /// Id of the setup.
    pub setup: String,
    /// Id of the sensor.
    pub sensor: String,
    /// Turns averaged.
    pub turns: usize,
    /// Run-out: highest less lowest reading of the averaged turn (TIR), in µm.
    pub tir_um: f64,
    /// Its standard uncertainty, from the scatter of the turns; null below two turns.
    pub tir_std_um: Option<f64>,
    /// The same with the 95 % interval.
    #[serde(default)]
    pub tir_uncertainty: Option<Uncertainty>,
    /// Once per revolution: eccentricity of the part and motion of the axis.
    pub once_per_rev: ReadingHarmonic,
    /// Orders from 2 to 15, as far as the average has them.
    pub harmonics: Vec<ReadingHarmonic>,
    /// Standard deviation of single turns about their mean at one angle (root mean square over the turn), in µm; null below two
    /// turns.
    pub turns_std_um: Option<f64>,
}

/// amplitude · cos(order · angle − phase) over the spindle's angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct ReadingHarmonic {
    /// Waves a turn.
    pub order: usize,
    /// In µm.
    pub amplitude_um: f64,
    /// In degrees: at order 1 the spindle's angle at which the reading is highest.
    pub phase_deg: f64,
    /// Standard uncertainty of the amplitude, in µm; null below two turns.
    pub std_um: Option<f64>,
}

impl ReadingHarmonic {
    fn of(order: usize, value: Complex64, variance: Option<f64>) -> Self {
        Self {
            order,
            amplitude_um: value.norm(),
            phase_deg: value.arg().to_degrees().rem_euclid(360.0),
            // Of a complex error, half is along the amplitude.
            std_um: variance.map(|variance| (0.5 * variance).sqrt()),
        }
    }
}

impl ReadingValues {
    /// Of every channel of every capture.
    #[must_use]
    pub fn of_all(profiles: &[Profile], rig: Option<&Rig>) -> Vec<Self> {
        let of = |profile: &Profile| -> Vec<Self> {
            let setup = setup_id(profile, rig);
            let channels = profile.sensors.iter().enumerate();
            channels
                .filter_map(|(channel, sensor)| Self::of(profile, channel, &setup, &sensor_id(*sensor, rig)))
                .collect()
        };
        profiles.iter().flat_map(of).collect()
    }

    /// Of one channel of a profile. Nothing where the average holds no order 1.
    #[must_use]
    pub fn of(profile: &Profile, channel: usize, setup: &str, sensor: &str) -> Option<Self> {
        let (mean, variance) = (coefficients(profile, channel), variances(profile, channel));
        let of = |order: usize| {
            Some(ReadingHarmonic::of(
                order,
                *mean.get(order)?,
                variance.as_ref().and_then(|all| all.get(order).copied()),
            ))
        };
        let once_per_rev = of(1)?;
        let scatter = profile.scatter.as_ref().map(|all| diagonal(all, profile.channels(), channel));
        let turns = profile.turns.used;
        let turns_std_um = scatter.map(|scatter| {
            let level = scatter.first().copied().unwrap_or_default();
            (turns as f64 * (level + 0.5 * scatter.iter().skip(1).sum::<f64>())).sqrt()
        });
        let squares = 2 * turns.saturating_sub(1);
        let (tir_um, tir_uncertainty) =
            run_out(&mean, variance.clone(), squares, seed(&[&profile.object, setup, sensor]));
        Some(Self {
            setup: setup.to_owned(),
            sensor: sensor.to_owned(),
            turns,
            tir_um,
            tir_std_um: tir_uncertainty.as_ref().map(|known| known.std),
            tir_uncertainty,
            once_per_rev,
            harmonics: (2..=LISTED).map_while(of).collect(),
            turns_std_um,
        })
    }
}

/// Id of the setup of a capture.
#[must_use]
pub fn setup_id(profile: &Profile, rig: Option<&Rig>) -> String {
    rig.and_then(|rig| rig.setups.get(profile.setup)).map_or_else(String::new, |setup| setup.id.clone())
}

/// Id of a sensor, by its index in the rig.
#[must_use]
pub fn sensor_id(index: usize, rig: Option<&Rig>) -> String {
    rig.and_then(|rig| rig.sensors.get(index)).map_or_else(|| format!("sensor {index}"), |sensor| sensor.id.clone())
}

/// Coefficients of one channel of the mean, by order from 0.
#[must_use]
pub fn coefficients(profile: &Profile, channel: usize) -> Vec<Complex64> {
    profile.mean.iter().skip(channel).step_by(profile.channels().max(1)).copied().collect()
}

/// Variances E|δ|² of the same, with the course of the turns; `None` where the turns' scatter is not known.
#[must_use]
pub fn variances(profile: &Profile, channel: usize) -> Option<Vec<f64>> {
    let mut variances = profile.covariance.as_ref().map(|all| diagonal(all, profile.channels(), channel))?;
    for (order, variance) in variances.iter_mut().enumerate().skip(1) {
        // What changes from turn to turn is no noise.
        let course = profile.course.covariance(order, profile.order(order));
        *variance += course.map_or(0.0, |matrix| matrix[channel * (profile.channels() + 1)].re);
    }
    Some(variances)
}

/// One channel's variances of matrices `[order][channel][channel]`.
fn diagonal(matrices: &[Complex64], channels: usize, channel: usize) -> Vec<f64> {
    let own = matrices.iter().skip(channel * (channels + 1)).step_by((channels * channels).max(1));
    own.map(|entry| entry.re.max(0.0)).collect()
}

/// Peak-to-valley of Re Σ cₙ e^{−inΦ} over the turn without its level, with its uncertainty; variances are known from so many squares.
fn run_out(mean: &[Complex64], variance: Option<Vec<f64>>, squares: usize, seed: u64) -> (f64, Option<Uncertainty>) {
    let points = (POINTS_A_WAVE * mean.len()).next_power_of_two();
    let harmonics: Vec<Complex64> =
        mean.iter().enumerate().map(|(order, value)| if order == 0 { Complex64::ZERO } else { value.conj() }).collect();
    let tir_um = ront_lsci_um(Fourier::new(points).synthesise(harmonics.iter().copied()));
    let draws = variance.and_then(|variance| {
        let squares = vec![squares; harmonics.len()];
        Draws::of_section(
            &Measured { harmonics, variance, squares, variance_from: VarianceFrom::OrdersBeside, lowest: 1 },
            seed,
        )
    });
    let known = draws.and_then(|draws| {
        let profiles = draws.profiles(|_| Complex64::ONE, points, |_, _| ());
        profiles.values_of_section(|turn, found| found.push(ront_lsci_um(turn))).pop()?.uncertainty
    });
    (tir_um, known)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::profile::TurnCount;

    /// Two channels of turns sampled directly: 5 cos(Φ − 40°) + 0.5 cos(3Φ − 100°) µm and noise of 0.2 µm in the second one.
    #[test]
    fn a_reading_has_what_was_put_into_it() {
        let (angles, turns, orders) = (128, 400, 20);
        let mut seed = 5_u64;
        let mut normal = || {
            let mut uniform = || {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            };
            (0..12).map(|_| uniform()).sum::<f64>()
        };
        let truth =
            |angle: f64| 5.0 * (angle - 40_f64.to_radians()).cos() + 0.5 * (3.0 * angle - 100_f64.to_radians()).cos();
        let mut fourier = Fourier::new(angles);
        let each: Vec<Vec<Complex64>> = (0..turns)
            .map(|_| {
                let mut found = vec![Complex64::ZERO; orders];
                let noisy = (0..angles).map(|step| truth(TAU * step as f64 / angles as f64) + 0.2 * normal());
                fourier.analyse(noisy.collect::<Vec<_>>(), &mut found);
                found.iter().map(Complex64::conj).collect()
            })
            .collect();
        let mean = |order: usize| each.iter().map(|turn| turn[order]).sum::<Complex64>() / f64::from(turns);
        let scatter: Vec<f64> = (0..orders)
            .map(|order| {
                let squares: f64 = each.iter().map(|turn| (turn[order] - mean(order)).norm_sqr()).sum();
                squares / f64::from(turns - 1) / f64::from(turns)
            })
            .collect();
        let matrices: Vec<Complex64> =
            scatter.iter().flat_map(|value| [0.0, 0.0, 0.0, *value]).map(Complex64::from).collect();
        let profile = Profile {
            sensors: vec![0, 1],
            mean: (0..orders).flat_map(|order| [Complex64::ZERO, mean(order)]).collect(),
            covariance: Some(matrices.clone()),
            scatter: Some(matrices),
            turns: TurnCount { used: 400, ..TurnCount::default() },
            ..Profile::default()
        };
        let found = ReadingValues::of(&profile, 1, "a", "S2").unwrap();
        let fine = (0..100_000).map(|step| truth(TAU * f64::from(step) / 1e5));
        let [low, high] = fine.fold([f64::MAX, f64::MIN], |[low, high], value| [low.min(value), high.max(value)]);
        // 0.2 µm over √400 turns, and its share in 19 of 64 orders: 5.6 nm at one angle, about √2 of it for two.
        let std = found.tir_std_um.unwrap();
        assert!((0.004..0.012).contains(&std), "{std}");
        assert!((found.tir_um - (high - low)).abs() < 5.0 * std, "{} for {}", found.tir_um, high - low);
        let once = found.once_per_rev;
        // 0.2 µm over √(400·128/2): five of them.
        assert!((once.amplitude_um - 5.0).abs() < 5.0 * 0.00125 && (once.phase_deg - 40.0).abs() < 0.08, "{once:?}");
        assert!((once.std_um.unwrap() / 0.00125 - 1.0).abs() < 0.2, "{once:?}");
        let third = found.harmonics[1];
        assert!(third.order == 3 && (third.amplitude_um - 0.5).abs() < 5.0 * 0.00125, "{third:?}");
        assert!((third.phase_deg - 100.0).abs() < 1.0, "{third:?}");
        assert_eq!(found.harmonics.last().unwrap().order, 15);
        // 1 + 2·19 of 128 degrees of freedom are in the orders kept.
        let expected = 0.2 * (39.0_f64 / 128.0).sqrt();
        assert!((found.turns_std_um.unwrap() / expected - 1.0).abs() < 0.05, "{:?}", found.turns_std_um);
        // A channel without any scatter is known as it is; without turns to compare, nothing is stated.
        let silent = ReadingValues::of(&profile, 0, "a", "S1").unwrap();
        assert_eq!((silent.tir_um, silent.tir_std_um, silent.turns_std_um), (0.0, None, Some(0.0)));
        let single = Profile { covariance: None, scatter: None, ..profile };
        let single = ReadingValues::of(&single, 1, "a", "S2").unwrap();
        assert_eq!((single.tir_std_um, single.turns_std_um, single.once_per_rev.std_um), (None, None, None));
    }
}
