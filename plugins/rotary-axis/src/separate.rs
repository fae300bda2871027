//! The separator `rotary-axis`.

use nalgebra::Vector3;
use runout_core::{
    Error, ErrorKind, Result,
    component_curves::location_table,
    points::{PointColumn, Points},
    stage::{
        Evaluable, EvaluableKind, Outcome, PointModel, PointPlan, PointSeparator, far_below_noise, residual_table,
    },
    summary::Value,
    table::{TableRows, TableSpec, numbers, numbers_or_null, texts},
};

use crate::{
    axis::Axis,
    campaign::{Campaign, columns},
    config::RotaryAxis,
    consistency::{checks, closing_errors},
    curves,
    diagnose::typical_um,
    left_out::left_out,
    motion::axis_motion,
    noise::Noise,
    scale::{noise_remark, scale},
    solve::{Column, Estimate, Fit, Layout, Reading, fit},
    tables::{compensation_table, component_table, residual_rows},
};

/// Commands of the full turn by which `check` finds what the balls observe.
const CHECKED_COMMANDS: usize = 12;

/// Range of each coordinate of one ball's deviations, mm.
#[derive(Debug, Clone, Copy)]
struct Ranges([[f64; 2]; 3]);

impl Ranges {
    fn none() -> Self {
        Self([[f64::INFINITY, f64::NEG_INFINITY]; 3])
    }

    fn take(&mut self, machine: [f64; 3]) {
        for (range, value) in self.0.iter_mut().zip(machine) {
            *range = [range[0].min(value), range[1].max(value)];
        }
    }

    /// µm; NaN where there is none.
    fn um(&self, coordinate: usize) -> f64 {
        let [low, high] = self.0[coordinate];
        if high >= low { 1e3 * (high - low) } else { f64::NAN }
    }
}

impl PointSeparator for RotaryAxis {
    fn columns(&self) -> Vec<PointColumn> {
        columns(self.0.axis)
    }

    fn tables(&self) -> Vec<TableSpec> {
        let mut all = vec![component_table(self.0.axis), compensation_table(self.0.axis), residual_table("um")];
        if self.0.curves.is_some() {
            all.extend([curves::table(), location_table()]);
        }
        all
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let campaign = Campaign::of(&self.0, points)?;
        self.fitted_outcome(points, &campaign, &[], &[], &[])
    }

    /// One ball does not separate component errors from location errors.
    fn evaluables(&self) -> Vec<EvaluableKind> {
        if self.0.component_errors && self.0.balls.len() > 1 { vec![EvaluableKind::AxisMotion] } else { Vec::new() }
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![
            "the zero error of the sensor nest enters the two offsets of the axis one to one: not observable".to_owned(),
            "a gain error or cross-talk of the sensor nest acts as scale and squareness of the linear axes do: no ball separates them"
                .to_owned(),
            "component errors have mean 0 over the distinct commands and no part that turns with the table (1/rev): those are \
             location of the axis and placement of the balls"
                .to_owned(),
        ];
        if !self.0.component_errors {
            notes.push("component errors are declared absent".to_owned());
        }
        notes.extend(self.observed());
        notes
    }

    fn plan(&self, points: Option<&Points>) -> Result<Option<PointPlan>> {
        self.planned(points).map(Some)
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl RotaryAxis {
    /// The four location errors (µm, µrad) by the one fit alone, without what a result has besides: for benchmarks.
    ///
    /// # Errors
    /// When the points do not hold what the fit needs.
    pub fn fit_only(&self, points: &Points) -> Result<[f64; 4]> {
        let campaign = Campaign::of(&self.0, points)?;
        let found = fit(&campaign.layout, &campaign.readings, &[])
            .map_err(|problem| Error::new("fit", points.input.display().to_string(), problem))?;
        let location = found.location();
        Ok([0, 1, 2, 3].map(|index| if index < 2 { 1e3 } else { 1e6 } * location[index].value))
    }

    /// What the configured balls observe over a full turn.
    fn observed(&self) -> Vec<String> {
        let layout = Layout {
            balls: (0..self.0.balls.len()).map(|ball| self.0.ball(ball)).collect(),
            phi: (0..CHECKED_COMMANDS).map(|command| (30.0 * command as f64).to_radians()).collect(),
            component_errors: self.0.component_errors,
        };
        let readings: Vec<Reading> = (0..layout.balls.len())
            .flat_map(|ball| {
                (0..CHECKED_COMMANDS).map(move |command| Reading { ball, command, value: Vector3::zeros(), std: 1.0 })
            })
            .collect();
        let Ok(found) = fit(&layout, &readings, &[]) else { return Vec::new() };
        let location = self.0.axis.location_symbols();
        let mut names: Vec<String> = location.into_iter().collect();
        let mut lost: Vec<bool> = found.location().iter().map(|one| one.value.is_nan()).collect();
        if self.0.component_errors {
            names.extend(self.0.axis.component_symbols());
            let mut of_components = [false; 6];
            for command in 0..CHECKED_COMMANDS {
                let found = machine_order(self.0.axis, found.component(command));
                of_components.iter_mut().zip(found).for_each(|(lost, one)| *lost |= one.value.is_nan());
            }
            lost.extend(of_components);
        }
        let list = |wanted: bool| -> Vec<&str> {
            names.iter().zip(&lost).filter(|(_, lost)| **lost == wanted).map(|(name, _)| name.as_str()).collect()
        };
        let mut said = vec![match (list(false), list(true)) {
            (observed, lost) if lost.is_empty() => {
                format!("observable with all balls at all commands of a full turn: {}", observed.join(", "))
            }
            (observed, lost) if observed.is_empty() => {
                let help = if layout.balls.len() == 1 {
                    "one ball: declare `component_errors = false`, or measure three balls off one line"
                } else {
                    "measure three balls off one line"
                };
                format!("not observable with these balls: {} ({help})", lost.join(", "))
            }
            (observed, lost) => format!(
                "observable with all balls at all commands of a full turn: {}; not observable: {} (the rotation about the \
                 balls' line; measure three balls off one line)",
                observed.join(", "),
                lost.join(", ")
            ),
        }];
        let heights = layout.balls.iter().map(|ball| ball.z);
        let spread = heights.clone().fold(f64::NEG_INFINITY, f64::max) - heights.fold(f64::INFINITY, f64::min);
        if layout.balls.len() > 2 && spread < 1e-3 * layout.balls.iter().map(Vector3::norm).fold(0.0, f64::max) {
            said.push(
                "the balls are at one height along the axis: squareness of the linear axis along it to the others is not \
                 observable"
                    .to_owned(),
            );
        }
        said
    }

    /// The outcome of a fit with effects, whose values are fitted beside; `before` is the residual without them. Where the data
    /// do not decide between effects, `alternatives` are the others: how far results with them differ is added to the
    /// uncertainty.
    pub(crate) fn fitted_outcome(
        &self,
        points: &Points,
        campaign: &Campaign,
        effects: &[Column],
        before: &[Vector3<f64>],
        alternatives: &[Vec<Column>],
    ) -> Result<Outcome> {
        let failure = |problem: String| {
            Error::new("fit", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData)
        };
        let found = fit(&campaign.layout, &campaign.readings, effects).map_err(failure)?;
        let axis = self.0.axis;
        let others: Vec<Fit> =
            alternatives.iter().filter_map(|effects| fit(&campaign.layout, &campaign.readings, effects).ok()).collect();
        let scale = scale(&found, campaign.noise);
        let widened = |of: &dyn Fn(&Fit) -> Estimate| {
            let one = of(&found);
            let farthest = others.iter().map(|other| (of(other).value - one.value).abs()).fold(0.0, f64::max);
            Estimate { value: one.value, std: (scale.factor * one.std).hypot(farthest) }
        };

        let mut values = location_values(axis, [0, 1, 2, 3].map(|index| widened(&|fit| fit.location()[index])));
        let left_out = left_out(campaign, effects, &found);
        values.extend(self.ranges(campaign, &left_out));
        values.extend(closing_errors(campaign, scale.factor * typical_um(campaign)));
        let checks = checks(axis, campaign, effects, &found);
        let mistake = if effects.is_empty() { self.mistake(points, found.chi2_per_dof().sqrt()) } else { None };
        let mut remarks: Vec<String> = mistake.into_iter().chain(campaign.warnings.iter().cloned()).collect();
        remarks.extend(self.lost(&found, campaign));
        let notes = noise_remark(campaign.noise).into_iter().collect();
        remarks.extend(scale.remark.clone());
        if campaign.noise != Noise::Unknown {
            remarks.extend(far_below_noise(found.chi2_per_dof(), found.dof));
        }
        if left_out.iter().any(Option::is_none) {
            remarks.push(
                "commands beside a gap are not predicted when they are left out: the ranges after compensation lack them"
                    .into(),
            );
        }
        let sized = |of: &dyn Fn(&Fit) -> Estimate, unit: f64| {
            let one = widened(of);
            [unit * one.value, unit * one.std].map(|number| number.is_finite().then_some(number))
        };
        let mut tables = vec![
            self.component_rows(campaign, &sized)?,
            self.compensation_rows(campaign, &left_out, &sized)?,
            residual_rows(axis, campaign, if before.is_empty() { &found.residual } else { before }, &found.residual)?,
        ];
        if let Some(curves) = self.0.curves {
            tables.push(curves::rows(axis, curves, campaign, &found, &others, &scale)?);
            tables.push(curves::location(&values, axis)?);
        }
        let [first, second] = ["offsets", "tilts"];
        let convention = format!(
            "deviations are actual less nominal places of the balls in machine coordinates; the axis turns right-handed about \
             +{}; {first} of the axis in the machine frame at the origin, {second} by the right hand; compensation is to be \
             added to the commands of the linear axes",
            ['X', 'Y', 'Z'][axis.order()[2]]
        );
        let motion = || Evaluable::AxisMotion(axis_motion(axis, campaign, &found, &others, &scale));
        let evaluables = if self.evaluables().is_empty() { Vec::new() } else { vec![motion()] };
        let outcome = Outcome { convention, tables, values, checks, evaluables, remarks, notes, ..Outcome::default() };
        Ok(outcome.refuted())
    }

    fn lost(&self, found: &Fit, campaign: &Campaign) -> Option<String> {
        let symbols = self.0.axis.location_symbols();
        let lost: Vec<&str> = symbols
            .iter()
            .zip(found.location())
            .filter(|(_, one)| one.value.is_nan())
            .map(|(symbol, _)| symbol.as_str())
            .collect();
        let components = self.0.axis.component_symbols();
        let mut counts = [0; 6];
        if campaign.layout.component_errors {
            for command in 0..campaign.commands_deg.len() {
                let at = machine_order(self.0.axis, found.component(command));
                counts.iter_mut().zip(at).for_each(|(count, one)| *count += usize::from(one.value.is_nan()));
            }
        }
        let all = campaign.commands_deg.len();
        let of_components = components.iter().zip(counts).filter(|(_, count)| *count > 0).map(|(symbol, count)| {
            if count == all { symbol.clone() } else { format!("{symbol} at {count} of {all} commands") }
        });
        let said: Vec<String> = lost.into_iter().map(str::to_owned).chain(of_components).collect();
        let help = match campaign.balls.len() {
            1 => {
                "one ball does not separate location errors from component errors; `component_errors = false` declares \
                  these absent"
            }
            2 => "two balls do not show the rotation about their line",
            _ => "the balls, or the commands at which all were measured, do not determine them",
        };
        (!said.is_empty()).then(|| format!("not observable: {} ({help})", said.join(", ")))
    }

    /// Range of each ball's coordinates as measured, and after compensation on commands that the fit has not seen.
    fn ranges(&self, campaign: &Campaign, left_out: &[Option<Vector3<f64>>]) -> Vec<Value> {
        let balls = campaign.balls.len();
        let mut before = vec![Ranges::none(); balls];
        let mut after = vec![Ranges::none(); balls];
        for (reading, left) in campaign.readings.iter().zip(left_out) {
            before[reading.ball].take(self.0.axis.outward(&reading.value));
            if let Some(left) = left {
                after[reading.ball].take(self.0.axis.outward(left));
            }
        }
        let what = [
            ("before", before, "peak to valley of the ball's deviation as measured, its placement included"),
            (
                "after",
                after,
                "peak to valley of the ball's deviation less compensation and placement, at commands left out of the fit",
            ),
        ];
        let mut values = Vec::new();
        for (ball, id) in campaign.balls.iter().enumerate() {
            for (when, ranges, about) in &what {
                for (coordinate, name) in ["dx", "dy", "dz"].into_iter().enumerate() {
                    let number = ranges[ball].um(coordinate);
                    values.push(Value::new(&format!("{name}_range_{when}"), number, f64::NAN, "um", about).of(id));
                }
            }
        }
        values
    }

    fn component_rows(&self, campaign: &Campaign, sized: &Sized<'_>) -> Result<TableRows> {
        let spec = component_table(self.0.axis);
        let mut cells: Vec<Vec<Option<f64>>> = vec![Vec::new(); 12];
        for command in 0..campaign.commands_deg.len() {
            for index in 0..6 {
                let one = |fit: &Fit| machine_order(self.0.axis, fit.component(command))[index];
                let [number, std] = sized(&one, if index < 3 { 1e3 } else { 1e6 });
                cells[index].push(number);
                cells[6 + index].push(std);
            }
        }
        let mut arrays = vec![numbers(campaign.commands_deg.iter().copied())];
        arrays.extend(cells.into_iter().map(numbers_or_null));
        if !campaign.layout.component_errors {
            arrays = spec.columns.iter().map(|_| numbers_or_null([])).collect();
        }
        Ok(TableRows { rows: spec.rows(arrays)?, table: spec.name })
    }

    fn compensation_rows(
        &self,
        campaign: &Campaign,
        left_out: &[Option<Vector3<f64>>],
        sized: &Sized<'_>,
    ) -> Result<TableRows> {
        let axis = self.0.axis;
        let spec = compensation_table(axis);
        let commands = campaign.commands_deg.len();
        let mut of_ball = vec![vec![(Vector3::zeros(), 0_usize); commands]; campaign.balls.len()];
        for (reading, left) in campaign.readings.iter().zip(left_out) {
            if let Some(left) = left {
                let cell = &mut of_ball[reading.ball][reading.command];
                *cell = (cell.0 + left, cell.1 + 1);
            }
        }
        let balls = campaign.balls.iter().zip(&campaign.layout.balls).enumerate();
        let balls = balls.map(|(ball, (id, place))| (id.as_str(), *place, Some(ball)));
        let tool = self.0.tool_points.iter().map(|point| (point.id.as_str(), axis.inward(point.place()), None));
        let (mut command_deg, mut ids) = (Vec::new(), Vec::new());
        let mut cells: Vec<Vec<Option<f64>>> = vec![Vec::new(); 9];
        for (id, place, ball) in balls.chain(tool) {
            for command in 0..commands {
                command_deg.push(campaign.commands_deg[command]);
                ids.push(id);
                let mean = ball.map(|ball| of_ball[ball][command]).filter(|(_, count)| *count > 0);
                for (coordinate, machine) in axis.order().into_iter().enumerate() {
                    let [number, std] = sized(&|fit| fit.deviation(command, &place)[coordinate], 1.0);
                    cells[machine].push(number);
                    cells[3 + machine].push(std);
                    cells[6 + machine].push(mean.map(|(sum, count)| 1e3 * sum[coordinate] / count as f64));
                }
            }
        }
        let mut arrays = vec![numbers(command_deg), texts(ids)];
        arrays.extend(cells.into_iter().map(numbers_or_null));
        Ok(TableRows { rows: spec.rows(arrays)?, table: spec.name })
    }
}

/// The four location errors as values, offsets before tilts, in the order of their symbols.
pub(crate) fn location_values(axis: Axis, found: [Estimate; 4]) -> Vec<Value> {
    let mut values: Vec<Value> = axis
        .location_symbols()
        .into_iter()
        .zip(found)
        .enumerate()
        .map(|(index, (symbol, one))| {
            let (scale, unit, about) = if index < 2 {
                (1e3, "um", "location error: offset of the axis' average line (ISO 230-1)")
            } else {
                (1e6, "urad", "location error: tilt of the axis' average line (ISO 230-1)")
            };
            Value::new(&symbol, scale * one.value, scale * one.std, unit, about).key()
        })
        .collect();
    values.sort_by(|a, b| (&b.unit == "um", &a.symbol).cmp(&(&a.unit == "um", &b.symbol)));
    values
}

/// A number of a fit in a unit, with its standard uncertainty; nothing where it is not observable.
type Sized<'a> = dyn Fn(&dyn Fn(&Fit) -> Estimate, f64) -> [Option<f64>; 2] + 'a;

/// Component errors of an axis along z in the machine's order.
pub(crate) fn machine_order(axis: Axis, along_z: [Estimate; 6]) -> [Estimate; 6] {
    let mut machine = along_z;
    for (place, coordinate) in axis.order().into_iter().enumerate() {
        machine[coordinate] = along_z[place];
        machine[3 + coordinate] = along_z[3 + place];
    }
    machine
}
