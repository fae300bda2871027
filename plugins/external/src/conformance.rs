//! Whether a separator of turns that is a program keeps what every separator must.

use std::path::Path;

use runout_core::{
    Complex64, Error, ErrorKind, Result,
    fault::Fault,
    profile::{Profile, TurnCount},
    rig::{Rig, RigConfig},
    separation::{Quantity, Separation, UM_PER_MM_URAD},
    stage::{Station, StationSeparator},
};
use serde_json::{Map, Value};

use crate::{program::Program, session::Session, turns::TurnSeparator};

/// Highest order of the profiles.
const MAX_ORDER: usize = 30;
/// Factor of the scaled data.
const SCALE: f64 = 3.0;
/// Largest relative difference that is rounding.
const ROUNDING: f64 = 1e-9;
/// Standard deviation of the averages, in µm.
const NOISE_UM: f64 = 0.01;

/// One check: its name, and what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// What must hold.
    pub name: &'static str,
    /// What was found.
    pub found: CheckResult,
}

/// What a check found.
#[derive(Debug, Clone, PartialEq)]
pub enum CheckResult {
    /// It holds.
    Holds,
    /// It cannot be said, and why.
    NotTested(String),
    /// It does not hold, and why.
    Fails(String),
}

/// How a program is tested.
#[derive(Debug, Clone)]
pub struct Conformance {
    /// The program and its arguments.
    pub command: Vec<String>,
    /// What the program gets as `runout.config`.
    pub config: Map<String, Value>,
    /// The rig that it is given.
    pub rig: Rig,
    /// Longest time for one answer, in s.
    pub timeout_s: f64,
}

impl Conformance {
    /// Three sensors around one section in one setup, which every separator of turns for one section can take.
    ///
    /// # Errors
    /// None: this rig is valid.
    pub fn three_sensors() -> std::result::Result<Rig, Fault> {
        let rig = serde_json::json!({
            "part_radius_mm": 30.0,
            "sensors": [
                { "id": "S1", "angle_deg": 0.0 }, { "id": "S2", "angle_deg": 99.844 }, { "id": "S3", "angle_deg": 202.5 },
            ],
            "setups": [{ "id": "initial" }],
        });
        let rig: RigConfig = serde_json::from_value(rig).map_err(|error| Fault::here(error.to_string()))?;
        rig.check()
    }

    /// Does all checks; `folder` is where the program runs.
    ///
    /// # Errors
    /// When the command or the rig cannot be.
    pub fn run(&self, folder: &Path) -> std::result::Result<Vec<Check>, Fault> {
        let begin = || self.begin(folder, &self.rig);
        begin()?;
        let stations = [1, 2, 3].map(|number| self.station(number, 1.0, 1.0));
        let mut checks = Vec::new();
        let mut add = |name, found: std::result::Result<CheckResult, String>| {
            checks.push(Check { name, found: found.unwrap_or_else(CheckResult::Fails) });
        };
        let all = |stations: &[&Station]| -> Result<Vec<Separation>> {
            let separator = begin().map_err(|fault| Error::new("start", "the program", fault.message))?;
            stations.iter().map(|station| separator.separate(station)).collect()
        };
        let [first, second, third] = &stations;
        let usual = all(&[first, second, third]);
        let is_answer = usual.as_ref().err().is_none_or(|error| error.kind() == ErrorKind::DamagedData);
        let failure = || usual.as_ref().err().map_or(Ok(CheckResult::Holds), |error| Err(error.to_string()));
        add("it starts and answers", if is_answer { Ok(CheckResult::Holds) } else { failure() });
        if is_answer {
            add("its answers are in the protocol", failure());
        }
        let Ok(usual) = usual else { return Ok(checks) };
        let all = |stations: &[&Station]| all(stations).map_err(|error| error.to_string());
        add("some order from 2 is a number", answers(&usual));
        let again = all(&[first, first]);
        add(
            "equal data give equal results, in one process and in another",
            again.and_then(|again| again.iter().try_for_each(|one| equal(&usual[0], one)).map(|()| CheckResult::Holds)),
        );
        let turned = all(&[third, first, second]);
        add(
            "the order of stations does not matter",
            turned.and_then(|turned| {
                let pairs = [(2, 0), (0, 1), (1, 2)];
                pairs.iter().try_for_each(|(a, b)| equal(&usual[*a], &turned[*b])).map(|()| CheckResult::Holds)
            }),
        );
        add("an order that the rig loses is lost at every station", lost_alike(&usual));
        add("what no rig can separate is lost or refused", self.inseparable(folder));
        let scaled = all(&[&self.station(1, SCALE, SCALE)]);
        add(
            "data times 3 give results times 3, and ± times 3",
            scaled.and_then(|scaled| scales(&usual[0], &scaled[0])),
        );
        let noisy = all(&[&self.station(1, 1.0, 2.0)]);
        add("noise doubled doubles ±", noisy.and_then(|noisy| noise_doubles(&usual[0], &noisy[0])));
        add("bad input is an error in words", self.refuses_bad_input(folder, first));
        Ok(checks)
    }

    fn session(&self, folder: &Path) -> std::result::Result<Session, Fault> {
        Ok(Session::new(Program::new(self.command.clone(), folder, (self.timeout_s, None, 64))?))
    }

    fn begin(&self, folder: &Path, rig: &Rig) -> std::result::Result<TurnSeparator, Fault> {
        TurnSeparator::new(self.session(folder)?, Value::Object(self.config.clone()), rig)
    }

    /// Data of form, motion and tilt with some noise, times a factor; the covariance is that of `noise` times the usual standard deviation.
    fn station(&self, number: usize, factor: f64, noise: f64) -> Station {
        station(&self.rig, number, factor, noise)
    }

    /// All sensors look along one line: form is then motion along it, at every order.
    fn inseparable(&self, folder: &Path) -> std::result::Result<CheckResult, String> {
        let mut rig = self.rig.clone();
        let angle_rad = rig.sensors.first().map_or(0.0, |sensor| sensor.angle_rad);
        rig.sensors.iter_mut().for_each(|sensor| sensor.angle_rad = angle_rad);
        rig.setups.truncate(1);
        let separator = self.begin(folder, &rig).map_err(|fault| fault.to_string())?;
        match separator.separate(&station(&rig, 1, 1.0, 1.0)) {
            Err(error) if in_words(&error) => Ok(CheckResult::Holds),
            Err(error) => Err(format!("it fails without words: {error}")),
            Ok(found) => {
                let width = found.unknowns.len();
                let given = (2..=found.max_order()).find(|order| {
                    (0..width)
                        .any(|unknown| found.unknowns[unknown].is_form() && found.observable[order * width + unknown])
                });
                given.map_or(Ok(CheckResult::Holds), |order| {
                    Err(format!("all sensors look along one line, and form of order {order} is a number"))
                })
            }
        }
    }

    /// Profiles without a column that they must have.
    fn refuses_bad_input(&self, folder: &Path, station: &Station) -> std::result::Result<CheckResult, String> {
        let separator = self.begin(folder, &self.rig).map_err(|fault| fault.to_string())?;
        let request = separator.request(station, Some("re")).map_err(|error| error.to_string())?;
        let session = self.session(folder).map_err(|fault| fault.to_string())?;
        match session.ask(request, |_| Ok(())) {
            Ok(()) => Err("profiles without the column `re` give an answer".into()),
            Err(failure) if failure.said.is_empty() => {
                Err(format!("it {} and says nothing on stderr", failure.problem))
            }
            Err(failure) if failure.problem.starts_with("ended with") => Ok(CheckResult::Holds),
            Err(failure) => Err(format!("it {}: expected an exit status above 0", failure.problem)),
        }
    }
}

/// Whether an error has what the program said.
fn in_words(error: &Error) -> bool {
    error.to_string().contains("its stderr ends with")
}

fn answers(found: &[Separation]) -> std::result::Result<CheckResult, String> {
    let some = |one: &Separation| one.observable.iter().skip(2 * one.unknowns.len()).any(|seen| *seen);
    if found.iter().all(some) { Ok(CheckResult::Holds) } else { Err("every order from 2 is lost".into()) }
}

fn equal(one: &Separation, other: &Separation) -> std::result::Result<(), String> {
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
    for place in 0..one.estimate.len() {
        let [a, b] = [one, other].map(|one| (one.estimate[place], one.variance[place]));
        if !same(a.0.re, b.0.re) || !same(a.0.im, b.0.im) || !same(a.1, b.1) {
            return Err(format!("{} is {} and {}", named(one, place), a.0, b.0));
        }
    }
    Ok(())
}

fn lost_alike(found: &[Separation]) -> std::result::Result<CheckResult, String> {
    let first = &found[0];
    for other in found {
        if let Some(place) =
            (0..first.observable.len()).find(|place| first.observable[*place] != other.observable[*place])
        {
            return Err(format!("{} is lost at one station and a number at another", named(first, place)));
        }
    }
    Ok(CheckResult::Holds)
}

fn scales(one: &Separation, scaled: &Separation) -> std::result::Result<CheckResult, String> {
    lost_alike(&[one.clone(), scaled.clone()])?;
    let largest = one.estimate.iter().map(|value| value.norm()).filter(|size| size.is_finite()).fold(0.0, f64::max);
    for place in (0..one.estimate.len()).filter(|place| one.observable[*place]) {
        let difference = (scaled.estimate[place] - one.estimate[place] * SCALE).norm();
        if difference > ROUNDING * SCALE * largest {
            let factor = scaled.estimate[place].norm() / one.estimate[place].norm();
            return Err(format!("{} is {factor:.9} times as large", named(one, place)));
        }
        deviations(one, scaled, place, SCALE)?;
    }
    Ok(CheckResult::Holds)
}

fn noise_doubles(one: &Separation, noisy: &Separation) -> std::result::Result<CheckResult, String> {
    let seen = |place: &usize| one.observable[*place] && *place >= one.unknowns.len();
    if (0..one.variance.len()).filter(seen).all(|place| one.variance[place].is_nan()) {
        return Ok(CheckResult::NotTested("it gives no `std`".into()));
    }
    (0..one.variance.len()).filter(seen).try_for_each(|place| deviations(one, noisy, place, 2.0))?;
    Ok(CheckResult::Holds)
}

fn deviations(one: &Separation, other: &Separation, place: usize, factor: f64) -> std::result::Result<(), String> {
    let [a, b] = [one, other].map(|one| one.variance[place].sqrt());
    let same = (a.is_nan() && b.is_nan()) || (b - factor * a).abs() <= ROUNDING.sqrt() * factor * a;
    if same { Ok(()) } else { Err(format!("± of {} is {:.6} times as large", named(one, place), b / a)) }
}

fn named(separation: &Separation, place: usize) -> String {
    let width = separation.unknowns.len();
    format!("{} of order {}", separation.unknowns[place % width].id(), place / width)
}

/// A station's averages: readings = form + motion along the sensor, in first order, with noise of the stated size.
fn station(rig: &Rig, number: usize, factor: f64, noise: f64) -> Station {
    let z_mm = 2.0 * number as f64;
    let channels = rig.sensors.len();
    let profiles = rig.setups.iter().enumerate().map(|(index, setup)| {
        let mut mean = Vec::new();
        for order in 0..=MAX_ORDER {
            for (channel, sensor) in rig.sensors.iter().enumerate() {
                let looks_rad = sensor.angle_rad + setup.sensors_rad;
                let n = order as f64;
                let of = |quantity: Quantity| coefficient(number, quantity, order);
                let direction = rig.rotation.direction();
                let form = of(Quantity::Form(sensor.section));
                let form = if direction < 0.0 { form.conj() } else { form };
                let lever = (sensor.z_mm + z_mm) * UM_PER_MM_URAD;
                let x = of(Quantity::X) + of(Quantity::TiltY) * lever;
                let y = of(Quantity::Y) - of(Quantity::TiltX) * lever;
                let seen = form * Complex64::cis(direction * n * (looks_rad - setup.part_rad));
                let reading = seen + x * looks_rad.cos() + y * looks_rad.sin();
                let error = pseudo(&[number, index, channel, order]) * NOISE_UM;
                mean.push(if order == 0 { Complex64::ZERO } else { (reading + error) * factor });
            }
        }
        let own = (NOISE_UM * noise).powi(2);
        let entries = (0..=MAX_ORDER).flat_map(|_| 0..channels * channels);
        let entry = |place: usize| if place.is_multiple_of(channels + 1) { own } else { 0.0 };
        Profile {
            object: format!("{}/s{number}", setup.id),
            setup: index,
            sensors: (0..channels).collect(),
            samples_per_rev: 2 * MAX_ORDER + 2,
            mean,
            covariance: Some(entries.map(|place| Complex64::from(entry(place))).collect()),
            turns: TurnCount { used: 60, ..TurnCount::default() },
            ..Profile::default()
        }
    });
    Station { name: format!("s{number}"), z_mm, profiles: profiles.collect() }
}

/// A harmonic of the part or the spindle, in µm or µrad, that falls with its order.
fn coefficient(station: usize, quantity: Quantity, order: usize) -> Complex64 {
    let kind = match quantity {
        Quantity::Form(section) => 10 + section,
        Quantity::X => 1,
        Quantity::Y => 2,
        Quantity::TiltX => 3,
        _ => 4,
    };
    pseudo(&[station, kind, order, 99]) * (4.0 / order.max(1) as f64)
}

/// A number within ±1 ± i that follows from others by multiplication without order.
fn pseudo(of: &[usize]) -> Complex64 {
    let mix = |seed: u64| {
        let mixed = of
            .iter()
            .fold(seed, |sum, part| (sum ^ (*part as u64)).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29));
        (mixed >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    Complex64::new(mix(1), mix(2))
}
