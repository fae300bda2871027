//! The separator `rotor-modes`: natural frequencies, Campbell diagram, critical speeds, and the speeds to avoid.

use runout_core::{
    Result,
    fault::{Fault, within},
    numerics::number::significant,
    pipeline::{Context, StageConfig},
    points::{PointColumn, Points},
    stage::{Outcome, PointSeparator, Separator},
    summary::Value,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, numbers, numbers_or_null, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    avoid::{self, Range, USUAL_ORDERS, USUAL_PERCENT},
    crossings::{Crossing, Search},
    equations::{Equations, Node},
    modal::{Modal, Mode, hertz, rpm},
    transfer,
    whirl::{Whirl, align, shape, whirl},
};

/// `[separate] plugin = "rotor-modes"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotorModesConfig {
    /// How many modes are given, by ascending frequency.
    #[serde(default = "usual_modes")]
    pub modes: usize,
    /// Speeds of the Campbell diagram, in rpm.
    #[serde(default)]
    pub campbell_rpm: Vec<f64>,
    /// Multiples of the speed that matter to a measurement: no mode may be near them.
    #[serde(default = "usual_orders")]
    pub avoid_orders: Vec<f64>,
    /// How near a mode may not be, in percent of order times speed.
    #[serde(default = "usual_percent")]
    pub avoid_within_percent: f64,
}

pub(crate) fn usual_modes() -> usize {
    12
}

pub(crate) fn usual_orders() -> Vec<f64> {
    USUAL_ORDERS.to_vec()
}

pub(crate) fn usual_percent() -> f64 {
    USUAL_PERCENT
}

impl StageConfig for RotorModesConfig {
    type Stage = Separator;

    const NAME: &'static str = "rotor-modes";
    const ABOUT: &'static str = "natural frequencies, Campbell diagram and critical speeds of a rotor";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        within("modes", "a number of modes", self.modes, 1..=200)?;
        if let Some(speed) = self.campbell_rpm.iter().find(|speed| !(speed.is_finite() && **speed >= 0.0)) {
            let fault = Fault::at("campbell_rpm", format!("expected speeds of at least 0 rpm, found {speed}"));
            return Err(
                fault.help("the rotor turns from x towards y; turning the other way gives the same frequencies")
            );
        }
        within("campbell_rpm", "a number of speeds", self.campbell_rpm.len(), 0..=2000)?;
        avoid::check("avoid_orders", &self.avoid_orders, "avoid_within_percent", self.avoid_within_percent)?;
        Ok(Separator::Points(Box::new(RotorModes { config: self })))
    }
}

/// Finds the modes of a rotor.
struct RotorModes {
    config: RotorModesConfig,
}

impl PointSeparator for RotorModes {
    fn columns(&self) -> Vec<PointColumn> {
        transfer::columns()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![modes_table(), campbell_table(), critical_table(), shapes_table(), avoid_table()]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        Solution::new(&transfer::from_points(points)?, &self.config)?.outcome(&self.config)
    }

    fn notes(&self) -> Vec<String> {
        vec![
            "the model is lateral: torsional and axial modes are not computed; neither are the modes of housing and machine".into(),
            "natural frequencies are those of the model: stiffness of bearings and joints is rarely known better than to 20 %".into(),
        ]
    }
}

/// Everything that is computed of a rotor.
struct Solution {
    nodes: Vec<Node>,
    standstill: f64,
    rigid: usize,
    at_rest: Vec<Mode>,
    /// Motions at rest that are damped so strongly that they do not oscillate.
    overdamped: usize,
    /// Speed in rpm and modes.
    campbell: Vec<(f64, Vec<Mode>)>,
    critical: Vec<Crossing>,
    ranges: Vec<Range>,
}

impl Solution {
    fn new(equations: &Equations, config: &RotorModesConfig) -> Result<Self> {
        let modal = Modal::new(equations)?;
        let modes_at = |speed_rpm: f64| {
            let mut modes = modal.at(speed_rpm * std::f64::consts::PI / 30.0)?;
            if speed_rpm == 0.0 {
                align(&mut modes, &equations.nodes);
            }
            let oscillating = modes.len();
            modes.truncate(config.modes);
            Ok((oscillating, modes))
        };
        let (oscillating, at_rest) = modes_at(0.0)?;
        let campbell =
            config.campbell_rpm.iter().map(|speed| Ok((*speed, modes_at(*speed)?.1))).collect::<Result<_>>()?;
        let mut search = Search::new(&modal);
        let critical = search.crossings(1.0, config.modes)?;
        let share = config.avoid_within_percent / 100.0;
        let ranges = avoid::ranges(&mut search, &config.avoid_orders, share, config.modes)?;
        Ok(Self {
            nodes: equations.nodes.clone(),
            standstill: modal.standstill(),
            rigid: modal.rigid(),
            at_rest,
            overdamped: modal.size() - modal.rigid() - oscillating.min(modal.size() - modal.rigid()),
            campbell,
            critical,
            ranges,
        })
    }

    fn outcome(&self, config: &RotorModesConfig) -> Result<Outcome> {
        let mut remarks = Vec::new();
        if self.rigid > 0 {
            remarks.push(format!(
                "{} motions of the whole rotor as a rigid body have no natural frequency at rest and are left out, like everything \
                 below {} Hz",
                self.rigid,
                significant(hertz(self.standstill), 2)
            ));
        }
        if self.overdamped > 0 {
            remarks.push(format!(
                "{} motions do not oscillate at rest: they are damped too strongly, and are no modes",
                self.overdamped
            ));
        }
        if let Some((number, mode)) = unstable(&self.at_rest) {
            remarks.push(format!(
                "mode {number} grows by itself at rest (damping ratio {}): check the cross-coupling of the bearings",
                significant(mode.damping_ratio(), 2)
            ));
        }
        if let Some((speed, number, mode)) =
            self.campbell.iter().find_map(|(speed, modes)| unstable(modes).map(|(number, mode)| (speed, number, mode)))
        {
            remarks.push(format!(
                "mode {number} grows by itself at {speed} rpm (damping ratio {})",
                significant(mode.damping_ratio(), 2)
            ));
        }
        if self.at_rest.len() < config.modes {
            remarks.push(format!("the model has {} modes; {} were asked for", self.at_rest.len(), config.modes));
        }
        Ok(Outcome {
            convention: "z along the axis, rotation from x towards y; mode 1 has the lowest frequency of its speed"
                .into(),
            tables: self.rows()?,
            values: self.values(),
            remarks,
            ..Outcome::default()
        })
    }

    fn whirl(&self, mode: &Mode) -> Whirl {
        whirl(&mode.shape, &self.nodes)
    }

    fn rows(&self) -> Result<Vec<TableRows>> {
        let campbell: Vec<(f64, usize, &Mode)> = self
            .campbell
            .iter()
            .flat_map(|(speed, modes)| modes.iter().enumerate().map(|(index, mode)| (*speed, index + 1, mode)))
            .collect();
        let at_rest: Vec<(usize, &Mode)> =
            self.at_rest.iter().enumerate().map(|(index, mode)| (index + 1, mode)).collect();
        let shapes: Vec<(usize, f64, (f64, f64))> = at_rest
            .iter()
            .flat_map(|(number, mode)| {
                let places: Vec<f64> = self.nodes.iter().map(|node| node.z_mm).collect();
                let at = move |index: usize| places.get(index).copied().unwrap_or(f64::NAN);
                shape(mode, &self.nodes).into_iter().enumerate().map(move |(index, place)| (*number, at(index), place))
            })
            .collect();
        let planar = !self.nodes.is_empty();
        let rows = [
            (
                modes_table(),
                vec![
                    counts(at_rest.iter().map(|(number, _)| *number)),
                    numbers(at_rest.iter().map(|(_, mode)| hertz(mode.frequency()))),
                    numbers(at_rest.iter().map(|(_, mode)| mode.damping_ratio())),
                    texts(at_rest.iter().map(|(_, mode)| self.whirl(mode).name())),
                ],
            ),
            (
                campbell_table(),
                vec![
                    numbers(campbell.iter().map(|(speed, ..)| *speed)),
                    counts(campbell.iter().map(|(_, number, _)| *number)),
                    numbers(campbell.iter().map(|(.., mode)| hertz(mode.frequency()))),
                    numbers(campbell.iter().map(|(.., mode)| mode.damping_ratio())),
                    texts(campbell.iter().map(|(.., mode)| self.whirl(mode).name())),
                    numbers(campbell.iter().map(|(speed, ..)| speed / 60.0)),
                ],
            ),
            (
                critical_table(),
                vec![
                    counts(1..=self.critical.len()),
                    texts(self.critical.iter().map(|critical| self.whirl(&critical.mode).name())),
                    numbers(self.critical.iter().map(|critical| rpm(critical.speed))),
                    numbers(self.critical.iter().map(|critical| hertz(critical.mode.frequency()))),
                ],
            ),
            (
                shapes_table(),
                vec![
                    counts(shapes.iter().map(|(number, ..)| *number)),
                    numbers_or_null(shapes.iter().map(|(_, z_mm, _)| Some(*z_mm).filter(|_| planar))),
                    numbers(shapes.iter().map(|(.., (x, _))| *x)),
                    numbers_or_null(shapes.iter().map(|(.., (_, y))| Some(*y).filter(|_| planar))),
                ],
            ),
            (
                avoid_table(),
                vec![
                    numbers(self.ranges.iter().map(|range| range.order)),
                    counts(self.ranges.iter().map(|range| range.mode)),
                    numbers(self.ranges.iter().map(|range| rpm(range.from))),
                    numbers_or_null(self.ranges.iter().map(|range| Some(rpm(range.to)).filter(|to| to.is_finite()))),
                ],
            ),
        ];
        rows.into_iter().map(|(spec, columns)| Ok(TableRows { rows: spec.rows(columns)?, table: spec.name })).collect()
    }

    fn values(&self) -> Vec<Value> {
        let exact =
            |symbol: &str, number: f64, unit: &str, about: &str| Value::new(symbol, number, f64::NAN, unit, about);
        let mut values = Vec::new();
        for (index, mode) in self.at_rest.iter().enumerate() {
            let about = "natural frequency at rest";
            values.push(exact("f", hertz(mode.frequency()), "Hz", about).key().of(format!("mode {}", index + 1)));
        }
        for (index, critical) in self.critical.iter().enumerate() {
            let of = match self.whirl(&critical.mode) {
                Whirl::Unknown => format!("{}", index + 1),
                whirl => format!("{} {}", index + 1, whirl.name()),
            };
            let about = "critical speed: a natural frequency is the speed";
            values.push(exact("n_crit", rpm(critical.speed), "rpm", about).key().of(of));
        }
        for (index, (from, to)) in avoid::joined(&self.ranges).into_iter().enumerate() {
            let of = format!("range {}", index + 1);
            let begins = "speeds to avoid while measuring: from here a mode is near an order that matters";
            values.push(exact("avoid_from", rpm(from), "rpm", begins).of(of.clone()));
            values.push(exact("avoid_to", rpm(to), "rpm", "up to here; null where a mode stays near").of(of));
        }
        values
    }
}

/// Damping ratios below this are growth, and no rounding.
const GROWTH: f64 = -1e-6;

fn unstable(modes: &[Mode]) -> Option<(usize, &Mode)> {
    let found = modes.iter().enumerate().find(|(_, mode)| mode.damping_ratio() < GROWTH);
    found.map(|(index, mode)| (index + 1, mode))
}

fn mode_column() -> ColumnSpec {
    ColumnSpec::count("mode", "", "number in the order of frequency, from 1")
}

fn frequency_column() -> ColumnSpec {
    ColumnSpec::number("frequency_hz", "Hz", "damped natural frequency, Im λ/2π")
}

fn damping_column() -> ColumnSpec {
    ColumnSpec::number("damping_ratio", "", "−Re λ/|λ|; negative where the mode grows by itself")
}

fn whirl_column() -> ColumnSpec {
    ColumnSpec::name("whirl", "forward, backward, mixed (both along the shaft), planar, or unknown")
}

fn speed_column() -> ColumnSpec {
    ColumnSpec::number("speed_rpm", "rpm", "speed of rotation")
}

fn modes_table() -> TableSpec {
    let columns = vec![mode_column(), frequency_column(), damping_column(), whirl_column()];
    TableSpec::new("modes", "modes at rest, without those of the whole rotor as a rigid body", columns)
}

fn campbell_table() -> TableSpec {
    let columns = vec![
        speed_column().repeating(),
        ColumnSpec::count("mode", "", "number in the order of frequency at this speed, from 1"),
        frequency_column(),
        damping_column(),
        whirl_column(),
        ColumnSpec::number("rotation_hz", "Hz", "frequency of the rotation at this speed").repeating(),
    ];
    let values = [Measure::new("frequency_hz"), Measure::new("rotation_hz").with_symbol("1/rev").common()];
    let figure = Figure::points("campbell", "Campbell diagram", "speed_rpm", values).curves(["whirl"]);
    TableSpec::new("campbell", "modes over the speed of rotation", columns).figure(figure)
}

fn critical_table() -> TableSpec {
    let columns = vec![
        ColumnSpec::count("mode", "", "number in the order of speed, from 1"),
        whirl_column(),
        speed_column(),
        frequency_column(),
    ];
    TableSpec::new("critical_speeds", "speeds that are a natural frequency of the rotor that turns with them", columns)
}

fn shapes_table() -> TableSpec {
    let about = "shapes of the modes at rest, at the instant of the largest displacement; the largest is 1";
    let columns = vec![
        mode_column(),
        ColumnSpec::number("z_mm", "mm", "place along the shaft; null where matrices do not say it")
            .or_null()
            .repeating(),
        ColumnSpec::number("x", "1", "displacement along x; without places, each degree of freedom in its order"),
        ColumnSpec::number("y", "1", "displacement along y; null without places").or_null(),
    ];
    TableSpec::new("mode_shapes", about, columns)
}

fn avoid_table() -> TableSpec {
    let about =
        "speeds at which a mode is near a multiple of the speed; at these, error motion is the rotor's vibration";
    let columns = vec![
        ColumnSpec::number("order", "1/rev", "multiple of the speed").repeating(),
        ColumnSpec::count("mode", "", "number of the mode in the order of the speeds at which it meets this order"),
        ColumnSpec::number("from_rpm", "rpm", "where the range begins"),
        ColumnSpec::number("to_rpm", "rpm", "where it ends; null where the mode stays near").or_null(),
    ];
    TableSpec::new("speeds_to_avoid", about, columns)
}
