//! What a declared R-test may lack: errors of the linear axes that measure, drift, and lost motion of the rotary axis.
//!
//! With the nominal place (x, y, z) of the ball in the machine and the time t (0 at the first reading, 1 at the last), a
//! deviation gains
//!
//! | effect | target | what it adds |
//! | --- | --- | --- |
//! | `linear-axis-scale` | X, Y, Z | s·x to dx, and so on |
//! | `linear-axis-squareness` | XY, XZ, YZ | γ·y to dx, γ·z to dx, γ·z to dy |
//! | `thermal-drift` | x, y, z, linear | D·t |
//! | `thermal-drift` | x, y, z, exponential | D·(1 − e^(−t/T)) |
//! | `backlash` | | ±B/2 of rotation, by the direction of approach |
//! | `nest-by-direction` | x, y, z | ±S/2, by the direction of approach |
//! | `nest-step` | x, y, z | S from a time on |

use nalgebra::Vector3;
use runout_core::closed_loop::{Effect, Parameter};

use crate::{axis::Axis, campaign::Campaign, kinematics::turn, solve::Column};

/// An effect, wherever it acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    LinearAxisScale,
    LinearAxisSquareness,
    ThermalDrift,
    Backlash,
    NestByDirection,
    NestStep,
}

/// Every effect.
pub(crate) const KINDS: [Kind; 6] = [
    Kind::LinearAxisScale,
    Kind::LinearAxisSquareness,
    Kind::ThermalDrift,
    Kind::Backlash,
    Kind::NestByDirection,
    Kind::NestStep,
];

/// Time constant at which a known drift without one counts, as a share of the campaign.
pub(crate) const USUAL_TIME_CONSTANT: f64 = 0.3;
/// Time constants that are looked for: shorter ones end within the first readings, longer ones are straight lines.
const TIME_CONSTANTS: [f64; 2] = [0.02, 1.0];
/// Time constants that are tried for an exponential drift, and times for a step.
pub(crate) const TRIED: usize = 24;

/// Shapes of the effects that are not linear in one parameter: the time constant of an exponential drift of each coordinate, then the time
/// of a step in each, as shares of the campaign.
pub(crate) type Shapes = [f64; 6];
/// Before any of them is looked for.
pub(crate) const USUAL: Shapes = [USUAL_TIME_CONSTANT, USUAL_TIME_CONSTANT, USUAL_TIME_CONSTANT, 0.5, 0.5, 0.5];

/// What is tried of each shape: of steps, times between passes, over the whole campaign, and near those of `now`.
pub(crate) fn tried(campaign: &Campaign, now: &Shapes) -> [Vec<f64>; 6] {
    let [low, high] = TIME_CONSTANTS;
    let constants: Vec<f64> =
        (0..TRIED).map(|index| low * (high / low).powf(index as f64 / (TRIED - 1) as f64)).collect();
    // A step is between two readings.
    let mut rows: Vec<usize> = (0..campaign.time.len()).collect();
    rows.sort_by(|a, b| campaign.time[*a].total_cmp(&campaign.time[*b]));
    let gap = |[one, next]: [usize; 2]| {
        let [from, to] = [campaign.time[one], campaign.time[next]];
        (to > from).then(|| (f64::midpoint(from, to), campaign.pass[one] != campaign.pass[next]))
    };
    let gaps: Vec<(f64, bool)> = rows.windows(2).filter_map(|pair| gap([pair[0], pair[1]])).collect();
    let every = gaps.len().div_ceil(TRIED).max(1);
    let between_passes = || gaps.iter().filter(|(_, between)| *between).take(TRIED);
    let steps = |now: f64| {
        let place = gaps.partition_point(|(time, _)| *time < now);
        let near = &gaps[place.saturating_sub(every)..(place + every).min(gaps.len())];
        let near = near.iter().step_by((2 * every).div_ceil(TRIED));
        let all = gaps.iter().skip(every / 2).step_by(every).chain(between_passes()).chain(near);
        let mut steps: Vec<f64> = all.map(|(time, _)| *time).collect();
        steps.sort_by(f64::total_cmp);
        steps.dedup();
        steps
    };
    [constants.clone(), constants.clone(), constants, steps(now[3]), steps(now[4]), steps(now[5])]
}

impl Kind {
    /// Its id.
    pub(crate) fn id(self) -> &'static str {
        match self {
            Self::LinearAxisScale => "linear-axis-scale",
            Self::LinearAxisSquareness => "linear-axis-squareness",
            Self::ThermalDrift => "thermal-drift",
            Self::Backlash => "backlash",
            Self::NestByDirection => "nest-by-direction",
            Self::NestStep => "nest-step",
        }
    }

    /// What it does, in one line.
    pub(crate) fn about(self) -> &'static str {
        match self {
            Self::LinearAxisScale => "a linear axis that measures has a scale error",
            Self::LinearAxisSquareness => "two linear axes that measure are not square to each other",
            Self::ThermalDrift => "readings drift along an axis in time: linearly or exponentially",
            Self::Backlash => "a rotary axis loses motion where its direction reverses",
            Self::NestByDirection => "a nest of sensors is displaced by the direction of approach: a cable pulls it",
            Self::NestStep => "a nest of sensors, the table or a ball is displaced from a time on",
        }
    }

    /// What it is described by.
    pub(crate) fn parameters(self) -> Vec<Parameter> {
        let of = |name: &str, unit: &str, tolerance| Parameter { name: name.into(), unit: unit.into(), tolerance };
        match self {
            Self::LinearAxisScale => vec![of("scale", "um/m", 50.0)],
            Self::LinearAxisSquareness => vec![of("angle", "urad", 50.0)],
            Self::ThermalDrift => vec![of("drift", "um", 10.0)],
            Self::Backlash => vec![of("lost_motion", "urad", 50.0)],
            Self::NestByDirection => vec![of("shift", "um", 2.0)],
            Self::NestStep => vec![of("step", "um", 2.0)],
        }
    }
}

/// An effect at its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Candidate {
    /// Of the machine's coordinate.
    Scale(usize),
    /// Adds to the first coordinate, in proportion to the second.
    Squareness(usize, usize),
    Linear(usize),
    Exponential(usize),
    Backlash,
    ByDirection(usize),
    Step(usize),
}

/// Everything that is looked for.
pub(crate) const CANDIDATES: [Candidate; 19] = [
    Candidate::Scale(0),
    Candidate::Scale(1),
    Candidate::Scale(2),
    Candidate::Squareness(0, 1),
    Candidate::Squareness(0, 2),
    Candidate::Squareness(1, 2),
    Candidate::Linear(0),
    Candidate::Linear(1),
    Candidate::Linear(2),
    Candidate::Exponential(0),
    Candidate::Exponential(1),
    Candidate::Exponential(2),
    Candidate::Backlash,
    Candidate::ByDirection(0),
    Candidate::ByDirection(1),
    Candidate::ByDirection(2),
    Candidate::Step(0),
    Candidate::Step(1),
    Candidate::Step(2),
];

impl Candidate {
    fn kind(self) -> Kind {
        match self {
            Self::Scale(_) => Kind::LinearAxisScale,
            Self::Squareness(..) => Kind::LinearAxisSquareness,
            Self::Linear(_) | Self::Exponential(_) => Kind::ThermalDrift,
            Self::Backlash => Kind::Backlash,
            Self::ByDirection(_) => Kind::NestByDirection,
            Self::Step(_) => Kind::NestStep,
        }
    }

    /// Place of its shape among [`Shapes`].
    pub(crate) fn shape(self) -> Option<usize> {
        match self {
            Self::Exponential(coordinate) => Some(coordinate),
            Self::Step(coordinate) => Some(3 + coordinate),
            _ => None,
        }
    }

    /// Its description.
    pub(crate) fn effect(self) -> Effect {
        let upper = ["X", "Y", "Z"];
        let lower = ["x", "y", "z"];
        let mut parameters = self.kind().parameters();
        let targets = match self {
            Self::Scale(coordinate) => vec![upper[coordinate].to_owned()],
            Self::Squareness(one, other) => vec![format!("{}{}", upper[one], upper[other])],
            Self::Linear(coordinate) => vec![lower[coordinate].to_owned(), "linear".to_owned()],
            Self::Exponential(coordinate) => {
                // Of the linear column beside: a change of the time constant, times the drift.
                parameters.push(Parameter {
                    name: "time_constant".into(),
                    unit: "campaign".into(),
                    tolerance: USUAL_TIME_CONSTANT,
                });
                vec![lower[coordinate].to_owned(), "exponential".to_owned()]
            }
            Self::Step(coordinate) => {
                parameters.push(Parameter { name: "at".into(), unit: "campaign".into(), tolerance: 0.5 });
                vec![lower[coordinate].to_owned()]
            }
            Self::ByDirection(coordinate) => vec![lower[coordinate].to_owned()],
            Self::Backlash => Vec::new(),
        };
        Effect { id: self.kind().id().into(), targets, parameters }
    }

    /// What one unit of each parameter adds to each reading, mm; of an exponential drift, D and D·ΔT at a time constant T; of a step, S at
    /// its time.
    pub(crate) fn columns(self, axis: Axis, campaign: &Campaign, shapes: &Shapes) -> Vec<Column> {
        let shape = self.shape().map_or(f64::NAN, |place| shapes[place]);
        let each = |add: &dyn Fn(usize, [f64; 3]) -> [f64; 3]| -> Column {
            let readings = campaign.readings.iter().enumerate();
            readings
                .map(|(row, reading)| {
                    let nominal = turn(campaign.layout.phi[reading.command]) * campaign.layout.balls[reading.ball];
                    axis.inward(add(row, axis.outward(&nominal)))
                })
                .collect()
        };
        let along = |coordinate: usize, value: f64| {
            let mut machine = [0.0; 3];
            machine[coordinate] = value;
            machine
        };
        match self {
            Self::Scale(coordinate) => vec![each(&|_, at| along(coordinate, 1e-6 * at[coordinate]))],
            Self::Squareness(one, other) => vec![each(&|_, at| along(one, 1e-6 * at[other]))],
            Self::Linear(coordinate) => vec![each(&|row, _| along(coordinate, 1e-3 * campaign.time[row]))],
            Self::Exponential(coordinate) => {
                let settled = |row: usize| (-campaign.time[row] / shape).exp();
                let slope = |row: usize| -settled(row) * campaign.time[row] / (shape * shape);
                vec![
                    each(&|row, _| along(coordinate, 1e-3 * (1.0 - settled(row)))),
                    each(&|row, _| along(coordinate, 1e-3 * slope(row))),
                ]
            }
            Self::ByDirection(coordinate) => {
                vec![each(&|row, _| along(coordinate, 0.5e-3 * campaign.direction[row]))]
            }
            Self::Step(coordinate) => {
                vec![each(&|row, _| along(coordinate, if campaign.time[row] > shape { 1e-3 } else { 0.0 }))]
            }
            Self::Backlash => {
                let about = Vector3::z();
                let column = campaign.readings.iter().zip(&campaign.direction).map(|(reading, direction)| {
                    let nominal = turn(campaign.layout.phi[reading.command]) * campaign.layout.balls[reading.ball];
                    about.cross(&nominal) * (0.5e-6 * direction)
                });
                vec![column.collect()]
            }
        }
    }
}
