//! The tests of a campaign on its own readings: repeats against the fit, the end of a turn against its beginning, and parts of the
//! campaign against each other.
//!
//! Component errors are free at each command: parts are compared in the rows that these cannot reach ([`redundant`]), by what an offset of
//! a part adds to them.

use nalgebra::Vector3;
use runout_core::{
    consistency::{Check, Kind, LinearFit, Shift, Structure, Test, in_time::InTime, judge, linear, repeats::repeats},
    numerics::{least_squares::Basis, statistics::f_tail},
    points::mistakes,
    summary::Value,
};

use crate::{
    axis::Axis,
    campaign::Campaign,
    noise::Noise,
    solve::{Column, Fit, Reading, fit, redundant},
};

const COORDINATES: [&str; 3] = ["dx", "dy", "dz"];

/// Parts of the commands that are independent of each other.
const PARTS: usize = 8;

/// Parts of a campaign that may be offset against the first of them.
struct Parts {
    name: &'static str,
    level: Vec<usize>,
    levels: Vec<String>,
}

/// Directions, passes, halves in time; those that have more than one part.
fn divided(campaign: &Campaign) -> Vec<Parts> {
    let passes = 1 + campaign.pass.iter().copied().max().unwrap_or(0);
    let level = |of: &dyn Fn(usize) -> bool| (0..campaign.readings.len()).map(|row| usize::from(of(row))).collect();
    let named = |names: [&str; 2]| names.map(str::to_owned).to_vec();
    let mut all = vec![
        Parts {
            name: "directions",
            level: level(&|row| campaign.direction[row] < 0.0),
            levels: named(["readings approached from below", "readings approached from above"]),
        },
        Parts {
            name: "passes",
            level: campaign.pass.clone(),
            levels: (1..=passes).map(|pass| format!("pass {pass}")).collect(),
        },
        Parts {
            name: "halves of the time",
            level: level(&|row| campaign.time[row] > 0.5),
            levels: named(["the first half", "the second half"]),
        },
    ];
    // With two passes one after the other, the halves are the passes.
    all.dedup_by(|later, earlier| later.level == earlier.level);
    all.retain(|parts| parts.level.iter().any(|level| *level != parts.level[0]));
    all
}

/// What is declared of the rows that component errors cannot reach: neighbouring commands make parts that are independent of each other;
/// directions, passes and halves may be offset in each coordinate.
pub(crate) struct Offsets(Vec<Parts>);

impl Offsets {
    pub(crate) fn of(campaign: &Campaign) -> Self {
        Self(divided(campaign))
    }

    /// What an offset of 1 µm of each part but the first adds to each reading, coordinate by coordinate of each way to divide.
    pub(crate) fn columns(&self, axis: Axis) -> Vec<Column> {
        let unit = |coordinate: usize| -> Vector3<f64> {
            let mut machine = [0.0; 3];
            machine[coordinate] = 1e-3;
            axis.inward(machine)
        };
        let column = |parts: &Parts, part: usize, unit: Vector3<f64>| -> Column {
            parts.level.iter().map(|own| if *own == part { unit } else { Vector3::zeros() }).collect()
        };
        let of_parts = |parts: &Parts| -> Vec<Column> {
            let each = (0..3).flat_map(|coordinate| (1..parts.levels.len()).map(move |part| (coordinate, part)));
            each.map(|(coordinate, part)| column(parts, part, unit(coordinate))).collect()
        };
        self.0.iter().flat_map(of_parts).collect()
    }

    /// With these columns as the rows have them.
    pub(crate) fn structure(&self, command: &[usize], commands: usize, columns: &[Vec<f64>]) -> Structure {
        let names = (1..=PARTS).map(|part| format!("part {part} of the commands")).collect();
        let level = command.iter().map(|command| command * PARTS / commands).collect();
        let mut structure = Structure::default().divided("parts of the commands", Kind::Blocks, level, names);
        let mut left = columns;
        for parts in &self.0 {
            for coordinate in COORDINATES {
                let (own, others) = left.split_at(parts.levels.len() - 1);
                left = others;
                let name = format!("{} in {coordinate}", parts.name);
                let levels = parts.levels.iter().map(|level| format!("{coordinate} of {level}")).collect();
                structure.shifts.push(Shift { name, levels, columns: own.to_vec() });
            }
        }
        structure
    }
}

/// The tests of a fit with effects.
pub(crate) fn checks(axis: Axis, campaign: &Campaign, effects: &[Column], found: &Fit) -> Vec<Check> {
    let (left, dof) = (found.chi2_per_dof(), found.dof as f64);
    let of_noise = match campaign.noise {
        _ if found.dof == 0 => return Vec::new(),
        Noise::Repeats { dof: of_repeats, .. } => Some(repeats([1.0, of_repeats as f64], [left, dof])),
        Noise::Column | Noise::Stated(_) => Some(linear::residual(left, dof, f64::INFINITY)),
        Noise::Unknown => None,
    };
    let mut all: Vec<Check> = of_noise.into_iter().chain(of_passes(campaign)).collect();
    all.extend(closing_check(campaign, effects));
    all.extend(of_rows(axis, campaign, effects));
    all.extend(of_time(campaign, found));
    all
}

/// Readings of a ball at a command in several passes, as errors along time.
fn of_time(campaign: &Campaign, found: &Fit) -> Vec<Check> {
    let mut places = vec![Vec::new(); campaign.balls.len() * campaign.commands_deg.len()];
    for (row, reading) in campaign.readings.iter().enumerate() {
        places[reading.ball * campaign.commands_deg.len() + reading.command].push(row);
    }
    let of_coordinate = |(coordinate, name): (usize, &&str)| {
        let left: Vec<f64> = found.residual.iter().map(|left| 1e3 * left[coordinate]).collect();
        let in_time = InTime::of(&places, &campaign.time, &left, &[])?;
        Some(in_time.check(name, COORDINATES.len(), "µm", 1.0))
    };
    COORDINATES.iter().enumerate().filter_map(of_coordinate).collect()
}

/// Passes of a ball with readings of another place.
pub(crate) fn of_passes(campaign: &Campaign) -> Option<Check> {
    let readings = || campaign.readings.iter();
    let place: Vec<usize> =
        readings().map(|reading| reading.ball * campaign.commands_deg.len() + reading.command).collect();
    let mut passes: Vec<(String, Vec<usize>)> = Vec::new();
    for (row, (reading, pass)) in readings().zip(&campaign.pass).enumerate() {
        let name = format!("pass {} of ball {}", pass + 1, campaign.balls[reading.ball]);
        match passes.iter_mut().find(|(known, _)| *known == name) {
            Some((_, rows)) => rows.push(row),
            None => passes.push((name, vec![row])),
        }
    }
    let values: Vec<[f64; 3]> = readings().map(|reading| reading.value.into()).collect();
    mistakes::passes(&place, &passes, &values)
}

/// The tests of the rows that component errors cannot reach.
fn of_rows(axis: Axis, campaign: &Campaign, effects: &[Column]) -> Vec<Check> {
    let offsets = Offsets::of(campaign);
    let columns: Vec<Column> = effects.iter().cloned().chain(offsets.columns(axis)).collect();
    let Ok(data) = redundant(&campaign.layout, &campaign.readings, &columns) else { return Vec::new() };
    let (of_effects, of_offsets) = data.effects.split_at(effects.len());
    let basis = Basis::of(data.declared.iter().chain(of_effects).cloned().collect());
    let mut residual = data.rows;
    basis.remove_from(&mut residual);
    let names: Vec<String> = (0..data.declared.len()).map(combination).collect();
    let weights = basis.weights();
    let fit = LinearFit {
        residual: &residual,
        basis: basis.columns(),
        names: &names,
        weights: weights.get(..names.len()).unwrap_or_default(),
        noise: None,
        unit: "µm",
    };
    // A row is a combination of the readings at a command.
    let at = |command: &usize| format!("a combination of the readings at {}°", campaign.commands_deg[*command]);
    let structure = offsets.structure(&data.command, campaign.commands_deg.len(), of_offsets);
    judge(fit, &structure.naming(data.command.iter().map(at).collect())).checks
}

/// What the rows determine of location errors and placement, each a number.
pub(crate) fn combination(place: usize) -> String {
    format!("combination {} of location and placement", place + 1)
}

/// Readings of one ball in one pass at commands that are a turn apart, `[earlier turn, later turn]`, and what they differ by, in mm.
fn closings(campaign: &Campaign) -> Vec<([usize; 2], Vector3<f64>)> {
    let of = |row: usize| (campaign.readings[row].ball, campaign.readings[row].command, campaign.pass[row]);
    let all = 0..campaign.readings.len();
    let pairs = all.clone().flat_map(|row| all.clone().map(move |other| [row, other]));
    let closes = |[row, other]: &[usize; 2]| of(*row) == of(*other) && campaign.turn[*row] + 1 == campaign.turn[*other];
    let difference =
        |[row, other]: [usize; 2]| ([row, other], campaign.readings[other].value - campaign.readings[row].value);
    pairs.filter(closes).map(difference).collect()
}

/// By how far each ball is off after a turn: the mean difference of its readings at commands that are a turn apart.
pub(crate) fn closing_errors(campaign: &Campaign, std_um: f64) -> Vec<Value> {
    let pairs = closings(campaign);
    let of_ball = |(ball, id): (usize, &String)| {
        let own: Vec<&([usize; 2], Vector3<f64>)> =
            pairs.iter().filter(|([row, _], _)| campaign.readings[*row].ball == ball).collect();
        let count = own.len() as f64;
        let mean = own.iter().map(|(_, difference)| difference).sum::<Vector3<f64>>() / count;
        let about = "distance between the ball's places at the end and the beginning of a turn";
        let std = std_um * (2.0 / count).sqrt();
        (!own.is_empty())
            .then(|| Value::new("closing_error", 1e3 * mean.norm(), std, "um", about).not_negative().of(id))
    };
    campaign.balls.iter().enumerate().filter_map(of_ball).collect()
}

/// Whether the turn closes: differences over a turn against what the fit leaves of one turn.
fn closing_check(campaign: &Campaign, all_effects: &[Column]) -> Option<Check> {
    let pairs = closings(campaign);
    let later: Vec<usize> = pairs.iter().map(|([_, other], _)| *other).collect();
    let rows: Vec<usize> = (0..campaign.readings.len()).filter(|row| !later.contains(row)).collect();
    let pick = |column: &Column| rows.iter().map(|row| column[*row]).collect::<Column>();
    let readings: Vec<Reading> = rows.iter().map(|row| campaign.readings[*row]).collect();
    let effects: Vec<Column> = all_effects.iter().map(pick).collect();
    let one_turn = if pairs.is_empty() { return None } else { fit(&campaign.layout, &readings, &effects).ok()? };
    let (dof, count) = (one_turn.dof as f64, 3.0 * pairs.len() as f64);
    if one_turn.dof == 0 {
        return None;
    }
    let values: Vec<f64> = one_turn.effects().iter().map(|effect| effect.value).collect();
    let pairs: Vec<([usize; 2], Vector3<f64>)> = pairs
        .into_iter()
        .map(|([row, other], difference)| {
            let of_effect = |(column, value): (&Column, &f64)| (column[other] - column[row]) * *value;
            ([row, other], difference - all_effects.iter().zip(&values).map(of_effect).sum::<Vector3<f64>>())
        })
        .collect();
    let in_noise = |([row, other], difference): &([usize; 2], Vector3<f64>)| {
        difference.norm_squared() / (campaign.readings[*row].std.powi(2) + campaign.readings[*other].std.powi(2))
    };
    let f = pairs.iter().map(in_noise).sum::<f64>() / count / one_turn.chi2_per_dof().max(f64::MIN_POSITIVE);
    let farthest = pairs.iter().max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))?;
    let ball = &campaign.balls[campaign.readings[farthest.0[0]].ball];
    let check = Check::new(Test::Repeats, "closing error", f, &[count, dof], f_tail(f, count, dof));
    Some(check.finding(|| format!("the turn does not close by {:.1} µm at {ball}", 1e3 * farthest.1.norm())))
}
