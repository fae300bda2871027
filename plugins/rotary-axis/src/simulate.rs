//! Simulated R-tests: balls carried by a chain of rigid bodies, and linear axes that measure with errors of their own.
//!
//! Everything is in the machine's frame: errors are named as they act there, and places follow from isometries composed one after
//! the other. Nothing is shared with the separator's equations.

mod scenario;

pub use scenario::{Commands, Harmonic, Scenario, SimulatedEffect};

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use runout_core::{
    Result,
    fault::{Fault, known_names},
    pipeline::{Context, StageConfig},
    points::{Column, Labels, Points, Trace},
    stage::{Simulation, Simulator},
    table::{ColumnSpec, TableSpec, numbers, texts},
};

use crate::axis::Axis;

/// Simulated rows.
#[derive(Debug, Clone)]
pub struct Simulated {
    axis: Axis,
    /// Ball of each row.
    pub ball: Vec<String>,
    /// Command of each row, in degrees.
    pub command_deg: Vec<f64>,
    /// Deviations, in mm.
    pub deviation_mm: Vec<[f64; 3]>,
    /// Times, in s.
    pub time_s: Vec<f64>,
    /// Passes, from 1.
    pub repeat: Vec<f64>,
    /// True component errors in the machine's order (µm, µrad), at each command of a pass.
    pub component: Vec<[f64; 6]>,
}

const COORDINATES: [&str; 3] = ["X", "Y", "Z"];
const ROTATIONS: [&str; 3] = ["A", "B", "C"];
const DRIFTS: [&str; 3] = ["x", "y", "z"];
/// What is read along the first axis in proportion to the second.
const SQUARENESS: [(&str, (usize, usize)); 3] = [("XY", (0, 1)), ("XZ", (0, 2)), ("YZ", (1, 2))];

impl Scenario {
    /// The rows.
    #[must_use]
    pub fn simulate(&self) -> Simulated {
        let mut noise = ChaCha8Rng::seed_from_u64(self.seed);
        let own = COORDINATES.iter().zip(ROTATIONS).position(|(_, letter)| letter == self.letter()).unwrap_or(2);
        let mut line = Vector3::zeros();
        line[own] = 1.0;
        let commands: Vec<f64> = (0..self.commands.count)
            .map(|index| self.commands.from_deg + self.commands.step_deg * index as f64)
            .collect();
        let component: Vec<[f64; 6]> =
            commands.iter().map(|command| self.component_at(command.to_radians(), &mut noise)).collect();
        let location = Self::isometry(self.errors_at("0", 1.0));
        let measures = self.measuring();
        let mut made = Simulated {
            axis: self.axis,
            ball: Vec::new(),
            command_deg: Vec::new(),
            deviation_mm: Vec::new(),
            time_s: Vec::new(),
            repeat: Vec::new(),
            component: component.clone(),
        };
        let total = self.balls.len() * self.passes * commands.len();
        let mut slipped = vec![Vector3::zeros(); self.balls.len()];
        let lost_motion: f64 = self
            .effect
            .iter()
            .map(
                |effect| {
                    if let SimulatedEffect::Backlash { lost_motion_urad } = effect { *lost_motion_urad } else { 0.0 }
                },
            )
            .sum();
        for (ball, pass) in self.sequence() {
            let back = self.back_and_forth && pass % 2 == 1;
            for step in 0..commands.len() {
                let index = if back { commands.len() - 1 - step } else { step };
                let row = made.ball.len();
                let mut bad = Vector3::zeros();
                for effect in &self.effect {
                    match effect {
                        SimulatedEffect::SlippedBall { row: from, by_um } if *from == row => {
                            slipped[ball] = 1e-3 * Vector3::from(*by_um);
                        }
                        SimulatedEffect::BadReading { row: at, by_um } if *at == row => {
                            bad = 1e-3 * Vector3::from(*by_um);
                        }
                        _ => {}
                    }
                }
                let nominal = Point3::from(Vector3::from(self.balls[ball].place()));
                let placed = self.placement.get(&self.balls[ball].id).copied().unwrap_or_default();
                let stands = nominal + 1e-3 * Vector3::from(placed) + slipped[ball];
                let ideal = UnitQuaternion::from_scaled_axis(line * commands[index].to_radians());
                let lost = if back { -0.5e-6 } else { 0.5e-6 } * lost_motion;
                let turned = UnitQuaternion::from_scaled_axis(line * lost) * ideal;
                let carried = location * Self::isometry(component[index]) * turned;
                let place = carried * stands;
                let share = row as f64 / (total.max(2) - 1) as f64;
                let read = measures * place.coords + self.drift_at(share) + self.nest_at(share, back);
                let mut deviation = read - (ideal * nominal).coords + bad;
                for coordinate in 0..3 {
                    deviation[coordinate] += 1e-3 * self.noise_um * noise.sample::<f64, _>(StandardNormal);
                }
                made.ball.push(self.balls[ball].id.clone());
                made.command_deg.push(commands[index]);
                made.deviation_mm.push(deviation.into());
                made.time_s.push(self.seconds_per_point * row as f64);
                made.repeat.push((pass + 1) as f64);
            }
        }
        made
    }

    fn letter(&self) -> &'static str {
        match self.axis {
            Axis::A => "A",
            Axis::B => "B",
            Axis::C => "C",
        }
    }

    /// Ball and pass, in the order in which they are measured.
    fn sequence(&self) -> Vec<(usize, usize)> {
        let (balls, passes) = (self.balls.len(), self.passes);
        if self.ball_by_ball {
            return (0..passes).flat_map(|pass| (0..balls).map(move |ball| (ball, pass))).collect();
        }
        (0..balls).flat_map(|ball| (0..passes).map(move |pass| (ball, pass))).collect()
    }

    /// The six errors named E⟨letter⟩⟨between⟩⟨axis⟩ in `location`.
    fn errors_at(&self, between: &str, unit: f64) -> [f64; 6] {
        let mut errors = [0.0; 6];
        for (place, letter) in COORDINATES.iter().chain(&ROTATIONS).enumerate() {
            let symbol = format!("E{letter}{between}{}", self.letter());
            errors[place] = unit * self.location.get(&symbol).copied().unwrap_or(0.0);
        }
        errors
    }

    fn component_at(&self, phi: f64, random: &mut impl Rng) -> [f64; 6] {
        let mut errors = [0.0; 6];
        for (place, letter) in COORDINATES.iter().chain(&ROTATIONS).enumerate() {
            let symbol = format!("E{letter}{}", self.letter());
            for harmonic in self.component.iter().filter(|harmonic| harmonic.error == symbol) {
                let angle = f64::from(harmonic.order) * phi;
                errors[place] += harmonic.cosine * angle.cos() + harmonic.sine * angle.sin();
            }
            errors[place] += self.random_component * random.sample::<f64, _>(StandardNormal);
        }
        errors
    }

    /// Displacement and rotation by six errors in µm and µrad: displacement first to act last.
    fn isometry(errors: [f64; 6]) -> Isometry3<f64> {
        let [x, y, z, a, b, c] = errors;
        let rotation = UnitQuaternion::from_scaled_axis(1e-6 * Vector3::new(a, b, c));
        Isometry3::from_parts(Translation3::new(1e-3 * x, 1e-3 * y, 1e-3 * z), rotation)
    }

    /// What the linear axes read of a place.
    fn measuring(&self) -> Matrix3<f64> {
        let mut reads = Matrix3::identity();
        for effect in &self.effect {
            match effect {
                SimulatedEffect::LinearAxisScale { targets: [target], scale_um_per_m } => {
                    let place = COORDINATES.iter().position(|letter| letter == target).unwrap_or(0);
                    reads[(place, place)] += 1e-6 * scale_um_per_m;
                }
                SimulatedEffect::LinearAxisSquareness { targets: [target], angle_urad } => {
                    let (_, place) = SQUARENESS.iter().find(|(name, _)| name == target).unwrap_or(&SQUARENESS[0]);
                    reads[*place] += 1e-6 * angle_urad;
                }
                _ => {}
            }
        }
        reads
    }

    /// By how much the nest is displaced.
    fn nest_at(&self, share: f64, back: bool) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for effect in &self.effect {
            let (target, by_um) = match effect {
                SimulatedEffect::NestByDirection { targets: [target], shift_um } => {
                    (target, if back { -0.5 * shift_um } else { 0.5 * shift_um })
                }
                SimulatedEffect::NestStep { targets: [target], step_um, at } if share > *at => (target, *step_um),
                _ => continue,
            };
            sum[DRIFTS.iter().position(|letter| letter == target).unwrap_or(0)] += 1e-3 * by_um;
        }
        sum
    }

    fn drift_at(&self, share: f64) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for effect in &self.effect {
            if let SimulatedEffect::ThermalDrift { targets: [target], drift_um, time_constant } = effect {
                let place = DRIFTS.iter().position(|letter| letter == target).unwrap_or(0);
                let course = time_constant.map_or(share, |constant| -(-share / constant).exp_m1());
                sum[place] += 1e-3 * drift_um * course;
            }
        }
        sum
    }
}

impl StageConfig for Scenario {
    type Stage = Box<dyn Simulator>;

    const NAME: &'static str = "rotary-axis";
    const ABOUT: &'static str = "an R-test: balls on a rotary axis, read at commands of it";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Box::new(self.checked()?))
    }
}

impl Scenario {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn checked(self) -> std::result::Result<RotaryAxisSimulator, Fault> {
        if i64::try_from(self.seed).is_err() {
            return Err(Fault::at("seed", format!("expected a seed up to {}, found {}", i64::MAX, self.seed)));
        }
        if !(self.noise_um.is_finite() && self.noise_um >= 0.0) {
            return Err(Fault::at("noise_um", format!("the noise must be at least 0 µm, found {}", self.noise_um)));
        }
        if self.balls.is_empty() {
            return Err(Fault::at("balls", "expected at least one ball"));
        }
        if self.commands.count == 0 {
            return Err(Fault::at("count", "expected at least one command").under("commands"));
        }
        if self.passes == 0 {
            return Err(Fault::at("passes", "expected at least one pass"));
        }
        let letters = || COORDINATES.iter().chain(&ROTATIONS);
        let one_of = |name: &str, known: Vec<String>| {
            known.iter().all(|own| own != name).then(|| known_names(name, known.iter().map(String::as_str)))
        };
        let of =
            |between: &str| letters().map(|letter| format!("E{letter}{between}{}", self.letter())).collect::<Vec<_>>();
        for symbol in self.location.keys() {
            if let Some(help) = one_of(symbol, of("0")) {
                return Err(Fault::at(symbol, "there is no such location error").help(help).under("location"));
            }
        }
        for (index, harmonic) in self.component.iter().enumerate() {
            if let Some(help) = one_of(&harmonic.error, of("")) {
                let fault = Fault::at("error", "there is no such component error").help(help);
                return Err(fault.under_item("component", index));
            }
        }
        for id in self.placement.keys() {
            if let Some(help) = one_of(id, self.balls.iter().map(|ball| ball.id.clone()).collect()) {
                return Err(Fault::at(id, "there is no such ball").help(help).under("placement"));
            }
        }
        for (index, effect) in self.effect.iter().enumerate() {
            let names = |all: &[&str]| all.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
            let unknown = match effect {
                SimulatedEffect::LinearAxisScale { targets: [target], .. } => one_of(target, names(&COORDINATES)),
                SimulatedEffect::LinearAxisSquareness { targets: [target], .. } => {
                    one_of(target, names(&SQUARENESS.map(|(name, _)| name)))
                }
                SimulatedEffect::ThermalDrift { targets: [target], .. }
                | SimulatedEffect::NestByDirection { targets: [target], .. }
                | SimulatedEffect::NestStep { targets: [target], .. } => one_of(target, names(&DRIFTS)),
                _ => None,
            };
            if let Some(help) = unknown {
                let fault = Fault::at("targets", "the effect cannot act there").help(help);
                return Err(fault.under_item("effect", index));
            }
        }
        let text = toml::to_string(&self)
            .map_err(|error| Fault::here(format!("the scenario cannot be written as text: {error}")))?;
        Ok(RotaryAxisSimulator { text: format!("plugin = \"{}\"\n{text}", Self::NAME), scenario: self })
    }
}

/// A checked scenario.
#[derive(Debug, Clone)]
pub struct RotaryAxisSimulator {
    scenario: Scenario,
    text: String,
}

impl Simulator for RotaryAxisSimulator {
    fn simulate(&self) -> Result<Simulation<'_>> {
        let made = self.scenario.simulate();
        let table = made.table();
        let deviation = |coordinate: usize| {
            // To 0.01 µm, as devices write them.
            numbers(made.deviation_mm.iter().map(|all| (all[coordinate] * 1e5).round() / 1e5).collect::<Vec<f64>>())
        };
        let rows = table.rows(vec![
            texts(&made.ball),
            numbers(made.command_deg.iter().copied()),
            deviation(0),
            deviation(1),
            deviation(2),
            numbers(made.time_s.iter().copied()),
            numbers(made.repeat.iter().copied()),
        ])?;
        Ok(Simulation::Points { table, rows })
    }

    fn scenario(&self) -> &str {
        &self.text
    }
}

impl Simulated {
    /// As the loader `points` gives them.
    #[must_use]
    pub fn points(&self) -> Points {
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        let deviation = |coordinate: usize| self.deviation_mm.iter().map(|all| all[coordinate]).collect();
        let columns = vec![
            column(self.axis.command(), self.command_deg.clone()),
            column("dx_mm", deviation(0)),
            column("dy_mm", deviation(1)),
            column("dz_mm", deviation(2)),
            column("time_s", self.time_s.clone()),
            column("repeat", self.repeat.clone()),
        ];
        let labels = vec![Labels { name: "ball".into(), values: self.ball.clone() }];
        let whole = Trace { id: "points".into(), kind: "points".into(), points: 0..self.ball.len() };
        Points { input: "simulated.csv".into(), columns, labels, traces: vec![whole], ..Points::default() }
    }

    fn table(&self) -> TableSpec {
        let deviation = |name: &str| ColumnSpec::number(name, "mm", "actual less nominal place of the ball");
        let columns = vec![
            ColumnSpec::name("ball", "id of the ball"),
            ColumnSpec::number(self.axis.command(), "deg", "command of the axis").repeating(),
            deviation("dx_mm"),
            deviation("dy_mm"),
            deviation("dz_mm"),
            ColumnSpec::number("time_s", "s", "time").repeating(),
            ColumnSpec::number("repeat", "", "number of the pass").repeating(),
        ];
        TableSpec::new("points", "readings of a simulated R-test", columns)
    }
}
