//! What averaged readings have by themselves: run-out as a dial gauge shows it, and the eccentricity of each section in each setup.
//!
//! A section whose centre lies at the part angle γ, e away from the axis of rotation, adds C = e·e^{−iγ} to order 1 of its form Re Σ c e^{+inα}.
//! A sensor that looks at the part angle α₀ = θ′ − β at spindle angle 0 reads the coefficient m = C e^{iα₀} of Re m e^{−iΦ}, conjugated where
//! the part turns clockwise. C is the mean over the section's sensors of what each of them says.

use super::Label;
use crate::Value;
use runout_draws::{Uncertainty, noise_95, student_95};
use runout_numerics::Complex64;
use runout_turning::{profile::Profile, reading::ReadingValues, rig::Rig};

const DIRECTION: &str = "part angle at which the section's centre lies, from order 1 of its readings";
const SIZE: &str = "distance of the section's centre from the axis of rotation, from order 1 of its readings: with 1/rev motion that turns with the part";
const TIR: &str = "highest less lowest averaged reading (TIR): form, eccentricity and motion together";

/// Values of the readings of one section.
pub(crate) fn values(profiles: &[Profile], readings: &[ReadingValues], rig: &Rig, section: usize) -> Vec<Value> {
    let is_here = |sensor: &usize| rig.sensors.get(*sensor).is_some_and(|sensor| sensor.section == section);
    let mut values = Vec::new();
    for profile in profiles {
        let Some(setup) = rig.setups.get(profile.setup) else { continue };
        let of_setup = || readings.iter().filter(|reading| reading.setup == setup.id);
        for reading in of_setup().filter(|reading| rig.sensor(&reading.sensor).as_ref().is_some_and(is_here)) {
            let label = Label::new("TIR", "µm", TIR, format!("reading of {} in {}", reading.sensor, setup.id));
            values.push(value(label, [1, profile.max_order()], reading.tir_um, reading.tir_uncertainty.clone()));
        }
        let centre = Eccentricity::of(profile, rig, section);
        values.extend(centre.map(|found| found.values(&setup.id)).into_iter().flatten());
    }
    values
}

/// C of a section in the first setup that gives it, in µm; nothing of a face, or without order 1.
pub(crate) fn first_centre_um(profiles: &[Profile], rig: &Rig, section: usize) -> Option<Complex64> {
    profiles.iter().find_map(|profile| Eccentricity::of(profile, rig, section)).map(|found| found.centre)
}

fn value(label: Label, band_upr: [usize; 2], value: f64, uncertainty: Option<Uncertainty>) -> Value {
    Value { band_upr, uncertainty, ..label.of(value) }
}

/// A section's centre beside the axis of rotation.
struct Eccentricity {
    /// C, in µm.
    centre: Complex64,
    /// Standard uncertainty of each part of it; none below two turns.
    std_um: Option<f64>,
    /// Real degrees of freedom behind that.
    freedom: usize,
}

impl Eccentricity {
    /// From the section's channels; nothing of a face, where there is none, or where the average holds no order 1.
    fn of(profile: &Profile, rig: &Rig, section: usize) -> Option<Self> {
        if rig.is_face(section) {
            return None;
        }
        let is_here = |sensor: usize| rig.sensors.get(sensor).is_some_and(|sensor| sensor.section == section);
        let channels: Vec<(usize, usize)> =
            profile.sensors.iter().copied().enumerate().filter(|(_, sensor)| is_here(*sensor)).collect();
        let (width, count) = (profile.sensors.len(), channels.len());
        let setup = rig.setups.get(profile.setup)?;
        let direction = rig.rotation.direction();
        // What each coefficient enters with: C of a part that turns counter-clockwise, its conjugate of one that turns clockwise.
        let weights: Vec<(usize, Complex64)> = channels
            .iter()
            .filter_map(|(channel, sensor)| {
                let seen_rad = rig.sensors.get(*sensor)?.angle_rad + setup.sensors_rad - setup.part_rad;
                Some((*channel, Complex64::cis(-direction * seen_rad) / count as f64))
            })
            .collect();
        let means: Option<Vec<Complex64>> =
            weights.iter().map(|(channel, weight)| Some(weight * profile.mean.get(width + channel)?)).collect();
        let sum: Complex64 = means.filter(|means| !means.is_empty())?.iter().sum();
        let course = profile.course.covariance(1, profile.order(1));
        let covariance = profile.covariance.as_ref().map(|all| {
            let at = |row: usize, column: usize| {
                let place = row * width + column;
                all.get(width * width + place).copied().unwrap_or_default()
                    + course.as_ref().map_or(Complex64::ZERO, |course| course[place])
            };
            let pairs = weights.iter().flat_map(|one| weights.iter().map(move |other| (one, other)));
            pairs.map(|((row, one), (column, other))| (one * at(*row, *column) * other.conj()).re).sum::<f64>()
        });
        Some(Self {
            centre: if direction < 0.0 { sum.conj() } else { sum },
            std_um: covariance.map(|variance| (0.5 * variance.max(0.0)).sqrt()),
            freedom: 2 * profile.turns.used.saturating_sub(1),
        })
    }

    /// Size, and direction as far as it is more than noise.
    fn values(&self, setup: &str) -> [Value; 2] {
        let size_um = self.centre.norm();
        let angle_deg = (-self.centre.arg().to_degrees()).rem_euclid(360.0);
        let of_size = self.std_um.map(|std| Uncertainty::of_amplitude(size_um, std, self.freedom));
        let clear = self.std_um.filter(|std| size_um >= noise_95(self.freedom as f64) * std);
        let of_angle = clear.map(|std| {
            let std = (std / size_um).to_degrees();
            let reach = student_95(self.freedom as f64) * std;
            Uncertainty::new(std, [angle_deg - reach, angle_deg + reach], 0)
        });
        let reference = format!("axis of rotation in {setup}");
        let label = |symbol, unit, source: &str| Label::new(symbol, unit, source, reference.clone());
        [
            value(label("eccentricity", "µm", SIZE), [1; 2], size_um, of_size),
            value(label("eccentricity-angle", "°", DIRECTION), [1; 2], angle_deg, of_angle),
        ]
    }
}
