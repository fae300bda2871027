//! Simulated R-tests: balls carried by a chain of rigid bodies, and linear axes that measure with errors of their own.
//!
//! Everything is in the machine's frame: errors are named as they act there, and places follow from isometries composed one after
//! the other. Nothing is shared with the separator's equations.

use std::{collections::BTreeMap, fmt::Write};

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use runout_core::points::{Column, Labels, Points, Trace};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{axis::Axis, config::Ball};

/// A campaign and its truth.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The rotary axis.
    #[serde(default)]
    pub axis: Axis,
    /// Nominal places at command 0.
    pub balls: Vec<Ball>,
    /// Commands of a pass.
    pub commands: Commands,
    /// Passes of each ball, one ball after the other; every second one runs back where `back_and_forth` is set.
    #[serde(default = "one")]
    pub passes: usize,
    /// Whether every second pass runs back.
    #[serde(default)]
    pub back_and_forth: bool,
    /// Whether all balls are measured in one pass before the next begins, instead of all passes of one ball.
    #[serde(default)]
    pub ball_by_ball: bool,
    /// Time between rows, in s.
    #[serde(default = "ten")]
    pub seconds_per_point: f64,
    /// Standard deviation of one coordinate, in µm.
    pub noise_um: f64,
    /// Seed of the noise.
    #[serde(default)]
    pub seed: u64,
    /// Location errors by their ISO symbols: µm and µrad.
    #[serde(default)]
    pub location: BTreeMap<String, f64>,
    /// Component errors: sums of harmonics of the command.
    #[serde(default)]
    pub component: Vec<Harmonic>,
    /// Standard deviation of random component errors at each command, in µm and µrad.
    #[serde(default)]
    pub random_component: f64,
    /// How balls were placed, in µm by their ids.
    #[serde(default)]
    pub placement: BTreeMap<String, [f64; 3]>,
    /// Scale errors of X, Y, Z, in µm/m.
    #[serde(default)]
    pub scale_um_per_m: BTreeMap<String, f64>,
    /// Squareness errors XY, XZ, YZ, in µrad.
    #[serde(default)]
    pub squareness_urad: BTreeMap<String, f64>,
    /// Drifts.
    #[serde(default)]
    pub drift: Vec<Drift>,
    /// Lost motion of the rotary axis, in µrad.
    #[serde(default)]
    pub backlash_urad: f64,
    /// What no model knows.
    #[serde(default)]
    pub stranger: Vec<Stranger>,
}

fn one() -> usize {
    1
}

fn ten() -> f64 {
    10.0
}

/// Commands of a pass.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Commands {
    /// First command.
    #[serde(default)]
    pub from_deg: f64,
    /// Distance of commands.
    pub step_deg: f64,
    /// How many.
    pub count: usize,
}

/// A harmonic of a component error: cosine·cos(order·φ) + sine·sin(order·φ).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Harmonic {
    /// ISO symbol: EXC.
    pub error: String,
    /// Periods a turn.
    pub order: u32,
    /// In µm or µrad.
    #[serde(default)]
    pub cosine: f64,
    /// In µm or µrad.
    #[serde(default)]
    pub sine: f64,
}

/// A drift along one coordinate of the machine.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Drift {
    /// x, y or z.
    pub along: String,
    /// At the end of the campaign (linear), or long after (exponential), in µm.
    pub drift_um: f64,
    /// Time constant as a share of the campaign; linear without it.
    #[serde(default)]
    pub time_constant: Option<f64>,
}

/// What no model knows: a displacement of one ball from some row on, for some rows.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stranger {
    /// First row.
    pub row: usize,
    /// Rows of the same ball that it lasts; a slip lasts to the end.
    pub rows: usize,
    /// Displacement on the table, in µm.
    pub by_um: [f64; 3],
}

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
        let location = self.isometry(self.errors_at("0", 1.0));
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
        let mut moved = vec![Vector3::zeros(); self.balls.len()];
        let mut remaining = vec![0_usize; self.balls.len()];
        for (ball, pass) in self.sequence() {
            let back = self.back_and_forth && pass % 2 == 1;
            for step in 0..commands.len() {
                let index = if back { commands.len() - 1 - step } else { step };
                let row = made.ball.len();
                for stranger in self.stranger.iter().filter(|stranger| stranger.row == row) {
                    moved[ball] = 1e-3 * Vector3::from(stranger.by_um);
                    remaining[ball] = stranger.rows;
                }
                let nominal = Point3::from(Vector3::from(self.balls[ball].place()));
                let placed = self.placement.get(&self.balls[ball].id).copied().unwrap_or_default();
                let mut stands = nominal + 1e-3 * Vector3::from(placed);
                if remaining[ball] > 0 {
                    stands += moved[ball];
                    remaining[ball] -= 1;
                }
                let ideal = UnitQuaternion::from_scaled_axis(line * commands[index].to_radians());
                let lost = if back { -0.5e-6 } else { 0.5e-6 } * self.backlash_urad;
                let turned = UnitQuaternion::from_scaled_axis(line * lost) * ideal;
                let carried = location * self.isometry(component[index]) * turned;
                let place = carried * stands;
                let share = row as f64 / (total.max(2) - 1) as f64;
                let read = measures * place.coords + self.drift_at(share);
                let mut deviation = read - (ideal * nominal).coords;
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
    fn isometry(&self, errors: [f64; 6]) -> Isometry3<f64> {
        let [x, y, z, a, b, c] = errors;
        let rotation = UnitQuaternion::from_scaled_axis(1e-6 * Vector3::new(a, b, c));
        Isometry3::from_parts(Translation3::new(1e-3 * x, 1e-3 * y, 1e-3 * z), rotation)
    }

    /// What the linear axes read of a place.
    fn measuring(&self) -> Matrix3<f64> {
        let mut reads = Matrix3::identity();
        for (place, letter) in COORDINATES.iter().enumerate() {
            reads[(place, place)] += 1e-6 * self.scale_um_per_m.get(*letter).copied().unwrap_or(0.0);
        }
        for (name, row, column) in [("XY", 0, 1), ("XZ", 0, 2), ("YZ", 1, 2)] {
            reads[(row, column)] += 1e-6 * self.squareness_urad.get(name).copied().unwrap_or(0.0);
        }
        reads
    }

    fn drift_at(&self, share: f64) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for drift in &self.drift {
            let place = COORDINATES.iter().position(|letter| letter.eq_ignore_ascii_case(&drift.along)).unwrap_or(0);
            let course = drift.time_constant.map_or(share, |constant| -(-share / constant).exp_m1());
            sum[place] += 1e-3 * drift.drift_um * course;
        }
        sum
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
        Points { input: "simulated.csv".into(), columns, labels, traces: vec![whole] }
    }

    /// As a text file, deviations to 0.01 µm.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = format!("ball,{},dx_mm,dy_mm,dz_mm,time_s,repeat\n", self.axis.command());
        for (row, ball) in self.ball.iter().enumerate() {
            let [x, y, z] = self.deviation_mm[row];
            let (command, time, repeat) = (self.command_deg[row], self.time_s[row], self.repeat[row]);
            // Writing to a String does not fail.
            let _ = writeln!(text, "{ball},{command},{x:.5},{y:.5},{z:.5},{time},{repeat}");
        }
        text
    }
}
