//! Simulated campaigns: a chain of rigid bodies, a random field, and a tracker that stands anywhere.
//!
//! The tool follows from isometries composed one after the other, with full rotations, and the field is a sum of waves with
//! directions and lengths drawn from its spectrum. Nothing is shared with the separator's equations.

mod field;
mod scenario;

use nalgebra::{Isometry3, Point3, Rotation2, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use runout_core::{
    Result,
    points::{Column, Points, Trace},
    stage::{Simulation, Simulator},
    table::{ColumnSpec, TableSpec, numbers},
};

pub use field::{Field, Waves};
pub use scenario::{Layout, Placement, Scenario, SimulatedEffect, Tracker};

/// A campaign, and the machine behind it.
#[derive(Debug, Clone)]
pub struct Simulated {
    /// Commands of each row, in mm.
    pub commands_mm: Vec<[f64; 3]>,
    /// Readings, in µm.
    pub readings_um: Vec<[f64; 3]>,
    /// Times, in s.
    pub time_s: Vec<f64>,
    /// Passes, from 1.
    pub repeat: Vec<f64>,
    machine: Machine,
}

/// A machine with errors.
#[derive(Debug, Clone)]
struct Machine {
    scenario: Scenario,
    waves: Option<Waves>,
}

const LETTERS: [char; 3] = ['X', 'Y', 'Z'];
const ROTATIONS: [char; 3] = ['A', 'B', 'C'];

impl Scenario {
    /// The campaign.
    #[must_use]
    pub fn simulate(&self) -> Simulated {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let waves = self.field.as_ref().map(|field| Waves::draw(field, &mut random));
        let machine = Machine { scenario: self.clone(), waves };
        let places = self.places(&mut random);
        let total = places.len() * self.passes;
        let mut made = Simulated {
            commands_mm: vec![],
            readings_um: vec![],
            time_s: vec![],
            repeat: vec![],
            machine: machine.clone(),
        };
        for pass in 0..self.passes {
            let mut order: Vec<usize> = (0..places.len()).collect();
            if self.random_order {
                order.shuffle(&mut random);
            }
            for place in order {
                let row = made.readings_um.len();
                let share = row as f64 / (total.max(2) - 1) as f64;
                let command = places[place];
                let noise = Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
                let read = machine.read(command)
                    + machine.drift(share)
                    + self.moved(share)
                    + self.tracker.noise(command, noise);
                made.readings_um.push((read + self.bad(row)).into());
                made.commands_mm.push(command);
                made.time_s.push(self.seconds_per_point * row as f64);
                made.repeat.push((pass + 1) as f64);
            }
        }
        self.swap(&mut made.readings_um);
        made
    }

    /// Exchanges readings of passes, which have equal lengths.
    fn swap(&self, readings_um: &mut [[f64; 3]]) {
        let length = readings_um.len() / self.passes.max(1);
        for effect in &self.effect {
            let SimulatedEffect::PassSwapped { passes: [one, other] } = effect else { continue };
            let first = |pass: &usize| pass.saturating_sub(1).min(self.passes - 1) * length;
            if one == other {
                readings_um[first(one)..first(one) + length].reverse();
            } else {
                (0..length).for_each(|row| readings_um.swap(first(one) + row, first(other) + row));
            }
        }
    }

    /// Places of a pass, in the order of measurement.
    fn places(&self, random: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
        match self.layout {
            Layout::Grid { from_mm, to_mm, counts } => {
                let at = |axis: usize, index: usize| {
                    let steps = (counts[axis].max(2) - 1) as f64;
                    from_mm[axis] + (to_mm[axis] - from_mm[axis]) * index as f64 / steps
                };
                let mut places = Vec::new();
                for z in 0..counts[2] {
                    for y in 0..counts[1] {
                        places.extend((0..counts[0]).map(|x| [at(0, x), at(1, y), at(2, z)]));
                    }
                }
                places
            }
            Layout::Scattered { from_mm, to_mm, count } => {
                let mut place = || [0, 1, 2].map(|axis| random.random_range(from_mm[axis]..=to_mm[axis]));
                (0..count).map(|_| place()).collect()
            }
        }
    }

    /// Where the tracker is, at a share of the campaign, beside where it was at first, seen from it.
    fn moved(&self, share: f64) -> Vector3<f64> {
        let of = |effect: &SimulatedEffect| match effect {
            SimulatedEffect::TrackerStep { at, by_um } if share > *at => Vector3::from(*by_um),
            _ => Vector3::zeros(),
        };
        self.effect.iter().map(of).sum()
    }

    fn bad(&self, row: usize) -> Vector3<f64> {
        let of = |effect: &SimulatedEffect| match effect {
            SimulatedEffect::BadReading { row: at, by_um } if *at == row => Vector3::from(*by_um),
            _ => Vector3::zeros(),
        };
        self.effect.iter().map(of).sum()
    }
}

impl Tracker {
    /// A range and two angles, each with noise, in µm; beside it the noise of the target.
    fn noise(&self, command: [f64; 3], drawn: Vector3<f64>) -> Vector3<f64> {
        let sight = Vector3::from(command) - Vector3::from(self.at_mm);
        let distance = sight.norm();
        if distance < 1e-9 || self.angle_urad == 0.0 {
            return self.noise_um * drawn;
        }
        let along = sight / distance;
        let angular = 1e-3 * distance * self.angle_urad;
        let along_noise = along * along.dot(&drawn);
        self.noise_um * along_noise + self.noise_um.hypot(angular) * (drawn - along_noise)
    }
}

impl Machine {
    /// Middle and half size of the travel.
    fn travel(&self) -> [Vector3<f64>; 2] {
        let (from, to) = self.scenario.layout.ends();
        [0.5 * (from + to), 0.5 * (to - from)]
    }

    /// What the tracker would read without noise and drift, in µm.
    fn read(&self, command: [f64; 3]) -> Vector3<f64> {
        let [middle, _] = self.travel();
        let Placement { shift_um, turn_urad } = self.scenario.placement;
        let turned = Rotation3::from_scaled_axis(1e-6 * Vector3::from(turn_urad));
        let nominal = Vector3::from(command) + Vector3::from(self.scenario.tool_mm);
        let actual = nominal + 1e-3 * self.error(command);
        // The tracker's frame turns about the middle of the travel.
        let about = middle;
        1e3 * (turned * (actual - about) + about - nominal) + Vector3::from(shift_um)
    }

    /// Error of the machine, in µm.
    fn error(&self, command: [f64; 3]) -> Vector3<f64> {
        let [middle, half] = self.travel();
        let offset = Vector3::from(command) - middle;
        let mut carried = Isometry3::identity();
        for letter in self.scenario.chain_letters() {
            let axis = LETTERS.iter().position(|known| *known == letter).unwrap_or(0);
            let unit = if half[axis] > 0.0 { offset[axis] / half[axis] } else { 0.0 };
            let [mut displaced, rotated] = self.of_axis(axis, unit);
            displaced[axis] += self.of_screw(axis, command[axis]);
            let along = self.direction(axis) * offset[axis];
            let body = Isometry3::from_parts(
                Translation3::from(along + 1e-3 * displaced),
                UnitQuaternion::from_scaled_axis(1e-6 * rotated),
            );
            carried *= body;
        }
        let tool = carried * Point3::from(Vector3::from(self.scenario.tool_mm));
        let ideal = offset + Vector3::from(self.scenario.tool_mm);
        let mut error = 1e3 * (tool.coords - ideal) + self.jump(command);
        if let Some(waves) = &self.waves {
            error += waves.at(command);
        }
        error
    }

    /// Direction of an axis, with its scale.
    fn direction(&self, axis: usize) -> Vector3<f64> {
        let mut direction = Vector3::zeros();
        direction[axis] = 1.0;
        for effect in &self.scenario.effect {
            match effect {
                SimulatedEffect::Scale { targets: [target], scale_um_per_m } if target.starts_with(LETTERS[axis]) => {
                    direction[axis] += 1e-6 * scale_um_per_m;
                }
                SimulatedEffect::Squareness { targets: [target], angle_urad } if target.ends_with(LETTERS[axis]) => {
                    let moved = LETTERS.iter().position(|letter| target.starts_with(*letter)).unwrap_or(0);
                    direction[moved] += 1e-6 * angle_urad;
                }
                _ => {}
            }
        }
        direction
    }

    /// Displacement (µm) and rotation (µrad) of the body that an axis moves, at a place from −1 to 1.
    fn of_axis(&self, axis: usize, unit: f64) -> [Vector3<f64>; 2] {
        let (mut displaced, mut rotated) = (Vector3::zeros(), Vector3::zeros());
        for effect in &self.scenario.effect {
            let (target, order, amplitude) = match effect {
                SimulatedEffect::Positioning { targets: [target], order, amplitude_um }
                | SimulatedEffect::Straightness { targets: [target], order, amplitude_um } => {
                    (target, *order, *amplitude_um)
                }
                SimulatedEffect::Angular { targets: [target], order, amplitude_urad } => {
                    (target, *order, *amplitude_urad)
                }
                _ => continue,
            };
            let mut letters = target.chars().skip(1);
            let (Some(first), Some(second)) = (letters.next(), letters.next()) else { continue };
            if second != LETTERS[axis] {
                continue;
            }
            let size = amplitude * polynomial(order, unit);
            if let Some(along) = LETTERS.iter().position(|letter| *letter == first) {
                displaced[along] += size;
            }
            if let Some(about) = ROTATIONS.iter().position(|letter| *letter == first) {
                rotated[about] += size;
            }
        }
        [displaced, rotated]
    }

    /// How far an eccentric screw is ahead at a command, in µm: the height of a pin that turns with it.
    fn of_screw(&self, axis: usize, command_mm: f64) -> f64 {
        let of = |effect: &SimulatedEffect| match effect {
            SimulatedEffect::AxisPitch { targets: [target], period_mm, amplitude_um, phase_deg }
                if target.starts_with(LETTERS[axis]) =>
            {
                let turned = Rotation2::new(command_mm / period_mm * std::f64::consts::TAU + phase_deg.to_radians());
                (turned * Vector2::new(*amplitude_um, 0.0)).y
            }
            _ => 0.0,
        };
        self.scenario.effect.iter().map(of).sum()
    }

    fn jump(&self, command: [f64; 3]) -> Vector3<f64> {
        let of = |effect: &SimulatedEffect| match effect {
            SimulatedEffect::Step { axis, at_mm, by_um } => {
                let along = LETTERS.iter().position(|letter| axis.starts_with(*letter)).unwrap_or(0);
                if command[along] > *at_mm { Vector3::from(*by_um) } else { Vector3::zeros() }
            }
            SimulatedEffect::DisplacedBox { from_mm, to_mm, by_um } => {
                let inside = (0..3).all(|axis| (from_mm[axis]..=to_mm[axis]).contains(&command[axis]));
                if inside { Vector3::from(*by_um) } else { Vector3::zeros() }
            }
            _ => Vector3::zeros(),
        };
        self.scenario.effect.iter().map(of).sum()
    }

    fn drift(&self, share: f64) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for effect in &self.scenario.effect {
            if let SimulatedEffect::ThermalDrift { targets: [target], drift_um, time_constant } = effect {
                let axis = LETTERS.iter().position(|letter| target.to_uppercase().starts_with(*letter)).unwrap_or(0);
                sum[axis] += drift_um * time_constant.map_or(share, |constant| -(-share / constant).exp_m1());
            }
        }
        sum
    }
}

/// Legendre's polynomial by its powers (DLMF 18.5.8, x = 1 − 2s: Murphy's formula), of low orders.
fn polynomial(order: u32, x: f64) -> f64 {
    let s = 0.5 * (1.0 - x);
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 0..order {
        let (n, k) = (f64::from(order), f64::from(k));
        term *= -(n - k) * (n + k + 1.0) / ((k + 1.0) * (k + 1.0)) * s;
        sum += term;
    }
    sum
}

impl Simulated {
    /// What would be read at a command without noise, at the time of the first reading, in µm.
    #[must_use]
    pub fn truth_um(&self, command_mm: [f64; 3]) -> [f64; 3] {
        (self.machine.read(command_mm) + self.machine.drift(0.0)).into()
    }

    /// The machine's error without the placement of the tracker, in µm.
    #[must_use]
    pub fn error_um(&self, command_mm: [f64; 3]) -> [f64; 3] {
        self.machine.error(command_mm).into()
    }

    /// As the loader `points` gives them.
    #[must_use]
    pub fn points(&self) -> Points {
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        let command = |axis: usize| self.commands_mm.iter().map(|all| all[axis]).collect();
        let reading = |axis: usize| self.readings_um.iter().map(|all| all[axis]).collect();
        let columns = vec![
            column("x_mm", command(0)),
            column("y_mm", command(1)),
            column("z_mm", command(2)),
            column("dx_um", reading(0)),
            column("dy_um", reading(1)),
            column("dz_um", reading(2)),
            column("time_s", self.time_s.clone()),
            column("repeat", self.repeat.clone()),
        ];
        let whole = Trace { id: "points".into(), kind: "points".into(), points: 0..self.time_s.len() };
        Points { input: "simulated.csv".into(), columns, labels: Vec::new(), traces: vec![whole], ..Points::default() }
    }
}

/// A checked scenario.
#[derive(Debug, Clone)]
pub struct SpatialErrorSimulator {
    pub(crate) scenario: Scenario,
    pub(crate) text: String,
}

impl Simulator for SpatialErrorSimulator {
    fn simulate(&self) -> Result<Simulation<'_>> {
        let made = self.scenario.simulate();
        let number = |name: &str, unit: &str, about: &str| ColumnSpec::number(name, unit, about);
        let table = TableSpec::new(
            "points",
            "readings of a simulated campaign",
            vec![
                number("x_mm", "mm", "command of X").repeating(),
                number("y_mm", "mm", "command of Y").repeating(),
                number("z_mm", "mm", "command of Z").repeating(),
                number("dx_um", "um", "actual less commanded place along x"),
                number("dy_um", "um", "actual less commanded place along y"),
                number("dz_um", "um", "actual less commanded place along z"),
                number("time_s", "s", "time").repeating(),
                number("repeat", "", "number of the pass").repeating(),
            ],
        );
        // To 0.01 µm, as trackers write them.
        let rounded = |value: f64| (value * 100.0).round() / 100.0;
        let place = |axis: usize| {
            numbers(made.commands_mm.iter().map(|all| (all[axis] * 1e3).round() / 1e3).collect::<Vec<_>>())
        };
        let reading = |axis: usize| numbers(made.readings_um.iter().map(|all| rounded(all[axis])).collect::<Vec<_>>());
        let rows = table.rows(vec![
            place(0),
            place(1),
            place(2),
            reading(0),
            reading(1),
            reading(2),
            numbers(made.time_s.iter().copied()),
            numbers(made.repeat.iter().copied()),
        ])?;
        Ok(Simulation::Points { table, rows })
    }

    fn scenario(&self) -> &str {
        &self.text
    }
}
