//! From rows of a table to readings: balls, distinct commands, time, direction, and warnings about what looks wrong.

use nalgebra::Vector3;
use runout_core::{
    Error, Result,
    fault::known_names,
    numerics::number::significant,
    points::{
        PointColumn,
        PointKind::{Label, Number},
        Points,
    },
};

use crate::{
    axis::Axis,
    config::RotaryAxisConfig,
    kinematics::turn,
    noise::{self, Noise},
    solve::{Column, Layout, Reading},
};

/// Commands closer than this are the same, in degrees.
const SAME_COMMAND_DEG: f64 = 5e-3;
/// Fewer distinct commands determine no harmonic.
pub(crate) const FEWEST_COMMANDS: usize = 3;
/// Commands within ±this are a turn in radians, or nothing that separates much.
const RADIANS: f64 = 7.0;
/// A median deviation above this, in mm, looks like another unit.
const LARGE_MM: f64 = 2.0;
/// The largest deviation below this, in mm, looks like another unit.
const SMALL_MM: f64 = 1e-5;
/// A gap between commands above this is worth a word, in degrees.
const GAP_DEG: f64 = 120.0;

/// The columns of an R-test on an axis.
pub(crate) fn columns(axis: Axis) -> Vec<PointColumn> {
    let command = "command of the rotary axis";
    vec![
        PointColumn::needed("ball", Label, "", "id of the ball, one of `balls`"),
        PointColumn::needed(axis.command(), Number, "deg", command),
        PointColumn::needed("dx_mm", Number, "mm", "actual less nominal place of the ball along the machine's x")
            .measured(),
        PointColumn::needed("dy_mm", Number, "mm", "actual less nominal place of the ball along the machine's y")
            .measured(),
        PointColumn::needed("dz_mm", Number, "mm", "actual less nominal place of the ball along the machine's z")
            .measured(),
        PointColumn::optional("time_s", Number, "s", "time; without it the rows are in the order of time"),
        PointColumn::optional("repeat", Number, "", "number of the pass"),
        PointColumn::optional("std_um", Number, "um", "standard uncertainty of one coordinate of this row"),
        PointColumn::optional("direction", Number, "", "1 where the command came from below, -1 from above"),
    ]
}

/// Readings of a campaign, about an axis along z.
pub(crate) struct Campaign {
    pub layout: Layout,
    pub readings: Vec<Reading>,
    /// Ids of the balls that were measured, in the order of the layout.
    pub balls: Vec<String>,
    /// Distinct commands, in degrees, rising.
    pub commands_deg: Vec<f64>,
    /// Time of each reading, from 0 (first) to 1 (last).
    pub time: Vec<f64>,
    /// Duration in s; NaN without a column of times.
    pub duration_s: f64,
    /// Direction in which each command was approached, 1 or -1.
    pub direction: Vec<f64>,
    /// Turn of each command, from that of the smallest one on: −180° and 180° are a turn apart.
    pub turn: Vec<usize>,
    /// Number of the pass, from 0: how often the ball was read at the command, not counting whole turns, before.
    pub pass: Vec<usize>,
    pub noise: Noise,
    pub warnings: Vec<String>,
}

impl Campaign {
    /// The readings of points.
    #[allow(clippy::too_many_lines, reason = "one column after the other")]
    pub(crate) fn of(config: &RotaryAxisConfig, points: &Points) -> Result<Self> {
        let file = points.input.display().to_string();
        let refuse = |problem: String| Error::new("fit", &file, problem);
        let optional = |name: &str| points.columns.iter().find(|column| column.name == name);
        let command = points.column(config.axis.command())?;
        let deviations = [points.column("dx_mm")?, points.column("dy_mm")?, points.column("dz_mm")?];
        let labels = points.labels("ball").ok_or_else(|| refuse("the column `ball` is missing".into()))?;
        let mut of_config = Vec::with_capacity(command.len());
        for (row, id) in labels.iter().enumerate() {
            let place = config.balls.iter().position(|ball| ball.id == *id).ok_or_else(|| {
                let known = config.balls.iter().map(|ball| ball.id.as_str());
                refuse(format!("point {}: `balls` has no ball `{id}`", row + 1)).help(known_names(id, known))
            })?;
            of_config.push(place);
        }
        let used: Vec<usize> = (0..config.balls.len()).filter(|ball| of_config.contains(ball)).collect();
        let (commands_deg, command_of) = distinct(command);
        if commands_deg.len() < FEWEST_COMMANDS {
            let problem = format!(
                "{} points at {} commands: at least {FEWEST_COMMANDS} different commands are needed",
                command.len(),
                commands_deg.len()
            );
            return Err(refuse(problem));
        }
        let mut warnings = Vec::new();
        let absent: Vec<&str> = (0..config.balls.len())
            .filter(|ball| !used.contains(ball))
            .map(|ball| config.balls[ball].id.as_str())
            .collect();
        if !absent.is_empty() {
            warnings.push(format!("no point is of {}", absent.join(", ")));
        }
        warnings.extend(looks_wrong(config.axis, command, deviations));
        warnings.extend(points.copies());
        let order = time_order(optional("time_s").map(|column| column.values.as_slice()), command.len());
        let repeat = optional("repeat").map_or_else(|| vec![0.0; command.len()], |column| column.values.clone());
        let direction = match optional("direction") {
            Some(column) => {
                if let Some(row) = column.values.iter().position(|value| ![1.0_f64, -1.0].contains(value)) {
                    let found = column.values[row];
                    return Err(refuse(format!("point {}: `direction` is 1 or -1, found {found}", row + 1)));
                }
                column.values.clone()
            }
            None => directions(&order.rows, &of_config, &repeat, command),
        };
        let position = |ball: &usize| used.iter().position(|known| known == ball).unwrap_or_default();
        let mut readings: Vec<Reading> = (0..command.len())
            .map(|row| Reading {
                ball: position(&of_config[row]),
                command: command_of[row],
                value: config.axis.inward(deviations.map(|column| column[row])),
                std: 1e-3,
            })
            .collect();
        let of_turn = turns(command);
        let pass = match optional("repeat") {
            Some(_) => ranks(&repeat),
            None => occurrences(&order.rows, &readings, &of_turn),
        };
        let stated = optional("std_um").map(|column| column.values.as_slice());
        if let Some(row) = stated.and_then(|values| values.iter().position(|value| *value <= 0.0)) {
            return Err(refuse(format!("point {}: `std_um` must be above 0", row + 1)));
        }
        let noise = match (stated, config.std_um) {
            (Some(stated), _) => {
                readings.iter_mut().zip(stated).for_each(|(reading, std)| reading.std = 1e-3 * std);
                Noise::Column
            }
            (None, Some(std)) => {
                for reading in &mut readings {
                    reading.std = 1e-3 * std;
                }
                Noise::Stated(std)
            }
            (None, None) => {
                // Lost motion of the axis, and a nest that is displaced by the direction.
                let lost_motion = |(reading, direction): (&Reading, &f64)| {
                    let place = turn(commands_deg[reading.command].to_radians()) * config.ball(used[reading.ball]);
                    Vector3::z().cross(&place) * *direction
                };
                let displaced = |coordinate: usize| -> Column {
                    let unit = Vector3::from_fn(|row, _| f64::from(u8::from(row == coordinate)));
                    direction.iter().map(|direction| unit * *direction).collect()
                };
                let mut by_direction = vec![readings.iter().zip(&direction).map(lost_motion).collect()];
                by_direction.extend((0..3).map(displaced));
                noise::of_repeats(&readings, &of_turn, &order.time, &direction, &by_direction)
            }
        };
        if let Noise::Repeats { std_um, .. } = noise {
            for reading in &mut readings {
                reading.std = 1e-3 * std_um;
            }
        }
        let layout = Layout {
            balls: used.iter().map(|ball| config.ball(*ball)).collect(),
            phi: commands_deg.iter().map(|command| command.to_radians()).collect(),
            component_errors: config.component_errors,
        };
        warnings.extend(incomplete(&readings, &layout));
        let widest = widest_gap(&commands_deg);
        if widest > GAP_DEG {
            warnings.push(format!(
                "the commands leave {widest:.0}° of a turn out: location errors and placement of the balls are separated \
                 less well, and the standard uncertainties contain that"
            ));
        }
        Ok(Self {
            layout,
            readings,
            balls: used.iter().map(|ball| config.balls[*ball].id.clone()).collect(),
            commands_deg,
            time: order.time,
            duration_s: order.duration_s,
            direction,
            turn: of_turn,
            pass,
            noise,
            warnings,
        })
    }
}

/// Distinct commands modulo a turn, each by its smallest value, rising; and that of each row.
fn distinct(command: &[f64]) -> (Vec<f64>, Vec<usize>) {
    let near = |a: f64, b: f64| {
        let apart = (a - b).rem_euclid(360.0);
        apart.min(360.0 - apart) < SAME_COMMAND_DEG
    };
    let mut sorted: Vec<(f64, f64)> = command.iter().map(|command| (command.rem_euclid(360.0), *command)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut groups: Vec<(f64, f64)> = Vec::new();
    for (turned, raw) in sorted {
        match groups.last_mut() {
            Some(last) if near(last.0, turned) => last.1 = last.1.min(raw),
            _ => groups.push((turned, raw)),
        }
    }
    if let [first, .., last] = groups.as_mut_slice()
        && near(first.0, last.0)
    {
        first.1 = first.1.min(last.1);
        groups.pop();
    }
    groups.sort_by(|a, b| a.1.total_cmp(&b.1));
    let nearest = |command: f64| {
        let apart = |group: &(f64, f64)| {
            let apart = (group.0 - command).rem_euclid(360.0);
            apart.min(360.0 - apart)
        };
        let best = groups.iter().enumerate().min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)));
        best.map_or(0, |(index, _)| index)
    };
    (groups.iter().map(|group| group.1).collect(), command.iter().map(|command| nearest(*command)).collect())
}

/// The widest step between neighbouring commands around a turn.
pub(crate) fn widest_gap(commands_deg: &[f64]) -> f64 {
    steps(commands_deg).into_iter().fold(0.0, f64::max)
}

/// Steps between neighbouring commands around a turn.
pub(crate) fn steps(commands_deg: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = commands_deg.iter().map(|command| command.rem_euclid(360.0)).collect();
    sorted.sort_by(f64::total_cmp);
    let mut steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if let [first, .., last] = sorted[..] {
        steps.push(first + 360.0 - last);
    }
    steps
}

struct Order {
    /// Rows in the order of time.
    rows: Vec<usize>,
    /// From 0 to 1.
    time: Vec<f64>,
    duration_s: f64,
}

fn time_order(time_s: Option<&[f64]>, count: usize) -> Order {
    let time: Vec<f64> = time_s.map_or_else(|| (0..count).map(|row| row as f64).collect(), <[f64]>::to_vec);
    let mut rows: Vec<usize> = (0..count).collect();
    rows.sort_by(|a, b| time[*a].total_cmp(&time[*b]));
    let (from, to) = time.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), t| (from.min(*t), to.max(*t)));
    let length = if to > from { to - from } else { 1.0 };
    Order {
        rows,
        time: time.iter().map(|t| (t - from) / length).collect(),
        duration_s: if time_s.is_some() { to - from } else { f64::NAN },
    }
}

/// The sign of the command's change in time within a ball and pass; a pass's first point has that of its second.
fn directions(order: &[usize], balls: &[usize], repeat: &[f64], command: &[f64]) -> Vec<f64> {
    let mut direction = vec![0.0_f64; command.len()];
    let mut passes: Vec<(usize, f64, Vec<usize>)> = Vec::new();
    for row in order {
        let known =
            passes.iter_mut().find(|(ball, pass, _)| *ball == balls[*row] && pass.total_cmp(&repeat[*row]).is_eq());
        match known {
            Some((_, _, rows)) => rows.push(*row),
            None => passes.push((balls[*row], repeat[*row], vec![*row])),
        }
    }
    for (_, _, rows) in passes {
        let changes: Vec<f64> = rows.windows(2).map(|pair| command[pair[1]] - command[pair[0]]).collect();
        let moves = |change: &f64| change.abs() > SAME_COMMAND_DEG;
        let mut last = changes.iter().copied().find(moves).map_or(1.0, f64::signum);
        for (index, row) in rows.iter().enumerate() {
            if let Some(change) = index.checked_sub(1).and_then(|before| changes.get(before)).filter(|own| moves(own)) {
                last = change.signum();
            }
            direction[*row] = last;
        }
    }
    direction
}

/// The turn of each command, from that of the smallest one on.
fn turns(command: &[f64]) -> Vec<usize> {
    let first = command.iter().copied().fold(f64::INFINITY, f64::min);
    command.iter().map(|command| ((command - first + SAME_COMMAND_DEG) / 360.0) as usize).collect()
}

/// The place of each number among those that differ.
fn ranks(numbers: &[f64]) -> Vec<usize> {
    let mut distinct = numbers.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    numbers.iter().map(|number| distinct.iter().take_while(|other| *other < number).count()).collect()
}

/// How often each reading's ball was read at its command in its turn before.
fn occurrences(order: &[usize], readings: &[Reading], turn: &[usize]) -> Vec<usize> {
    let mut seen = std::collections::BTreeMap::new();
    let mut pass = vec![0; readings.len()];
    for row in order {
        let count = seen.entry((readings[*row].ball, readings[*row].command, turn[*row])).or_insert(0);
        pass[*row] = *count;
        *count += 1;
    }
    pass
}

/// Units that look wrong.
fn looks_wrong(axis: Axis, command: &[f64], deviations: [&[f64]; 3]) -> Vec<String> {
    let mut warnings = Vec::new();
    let name = axis.command();
    let largest = command.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let (different, _) = distinct(command);
    if largest <= RADIANS && different.len() > FEWEST_COMMANDS {
        warnings.push(format!(
            "all commands in `{name}` are within ±{largest:.2}°: are they in rad? {} commands within so small an angle \
             separate little",
            different.len()
        ));
    }
    let mut sizes: Vec<f64> = deviations.iter().flat_map(|column| column.iter().map(|value| value.abs())).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let most = sizes.last().copied().unwrap_or(0.0);
    if median > LARGE_MM {
        warnings.push(format!("half of the deviations are above {median:.1} mm: are they in µm?"));
    } else if most > 0.0 && most < SMALL_MM {
        warnings.push(format!("no deviation is above {} mm: are they in m?", significant(most, 2)));
    }
    warnings
}

/// Commands that lack balls which others have.
fn incomplete(readings: &[Reading], layout: &Layout) -> Option<String> {
    let has =
        |command: usize, ball: usize| readings.iter().any(|reading| reading.command == command && reading.ball == ball);
    let commands = layout.phi.len();
    let lacking = (0..commands).filter(|command| (0..layout.balls.len()).any(|ball| !has(*command, ball))).count();
    (lacking > 0 && layout.component_errors).then(|| {
        format!(
            "{lacking} of {commands} commands were not measured with all balls: their component errors are determined by \
             fewer balls, and the gauge leaves them out where at least four others have all (commands are the same within \
             {SAME_COMMAND_DEG}°)"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_counted_once_a_turn() {
        let (commands, of) = distinct(&[0.0, 90.0, 180.0, 270.0, 360.0, 359.999, 90.001, -90.0]);
        assert_eq!(commands, [-90.0, 0.0, 90.0, 180.0]);
        assert_eq!(of, [1, 2, 3, 0, 1, 1, 2, 0]);
        assert!((widest_gap(&commands) - 90.0).abs() < 1e-12);
    }

    #[test]
    fn directions_follow_time_within_a_pass() {
        // Two balls side by side, forward and back.
        let command = [0.0, 0.0, 10.0, 10.0, 20.0, 20.0, 10.0, 10.0, 10.0];
        let balls = [0, 1, 0, 1, 0, 1, 0, 1, 1];
        let order: Vec<usize> = (0..9).collect();
        let found = directions(&order, &balls, &[0.0; 9], &command);
        assert_eq!(found, [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
    }
}
