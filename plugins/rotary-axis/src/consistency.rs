//! The tests of a campaign on its own readings: repeats against the fit, the end of a turn against its beginning, and parts of the
//! campaign against each other.
//!
//! Component errors are free at each command: parts are compared in the rows that these cannot reach ([`redundant`]), by what an offset of
//! a part adds to them.

use nalgebra::Vector3;
use runout_core::{
    consistency::{Check, check::Test, linear, repeats::repeats},
    numerics::{
        least_squares::{Basis, dot},
        statistics::f_tail,
    },
    summary::NamedValue,
};

use crate::{
    axis::Axis,
    campaign::Campaign,
    noise::Noise,
    solve::{Column, Fit, Reading, fit, redundant},
};

const COORDINATES: [&str; 3] = ["dx", "dy", "dz"];

/// A way to divide a campaign in parts that may be offset against each other.
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
            levels: named(["approached from below", "approached from above"]),
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

/// The tests of a fit with effects.
pub(crate) fn checks(axis: Axis, campaign: &Campaign, effects: &[Column], found: &Fit) -> Vec<Check> {
    let (left, dof) = (found.chi2_per_dof(), found.dof as f64);
    let of_noise = match campaign.noise {
        _ if found.dof == 0 => return Vec::new(),
        Noise::Repeats { dof: of_repeats, .. } => Some(repeats([1.0, of_repeats as f64], [left, dof])),
        Noise::Column | Noise::Stated(_) => Some(linear::residual(left, dof, f64::INFINITY)),
        Noise::Unknown => None,
    };
    let mut all: Vec<Check> = of_noise.into_iter().collect();
    all.extend(closing_check(campaign, effects));
    all.extend(offsets(axis, campaign, effects));
    all
}

/// Parts that are offset against the first of them in a coordinate: F beside everything that is fitted.
fn offsets(axis: Axis, campaign: &Campaign, effects: &[Column]) -> Vec<Check> {
    let parts = divided(campaign);
    let mut columns: Vec<Column> = effects.to_vec();
    for one in &parts {
        for coordinate in 0..3 {
            let mut machine = [0.0; 3];
            machine[coordinate] = 1e-3;
            let unit: Vector3<f64> = axis.inward(machine);
            columns.extend((1..one.levels.len()).map(|level| {
                one.level.iter().map(|own| if *own == level { unit } else { Vector3::zeros() }).collect::<Column>()
            }));
        }
    }
    let Ok(data) = redundant(&campaign.layout, &campaign.readings, &columns) else { return Vec::new() };
    let declared = Basis::of(data.declared.clone()).extended(data.effects[..effects.len()].to_vec());
    let mut residual = data.rows.clone();
    declared.remove_from(&mut residual);
    let squares = dot(&residual, &residual);
    let tests = (3 * parts.len()) as f64;
    let mut first = effects.len();
    let mut all = Vec::new();
    for one in &parts {
        let others = one.levels.len() - 1;
        let of_coordinates = COORDINATES.iter().filter_map(|coordinate| {
            let columns = data.effects[first..first + others].to_vec();
            first += others;
            let joint = declared.extended(columns);
            let parameters = joint.rank() - declared.rank();
            let dof = residual.len().saturating_sub(joint.rank());
            if parameters == 0 || dof == 0 {
                return None;
            }
            let gain: f64 =
                joint.columns()[declared.rank()..].iter().map(|column| dot(column, &residual).powi(2)).sum();
            let f = gain / parameters as f64 / ((squares - gain) / dof as f64).max(f64::MIN_POSITIVE);
            let p = f_tail(f, parameters as f64, dof as f64) * tests;
            let coefficients = joint.coefficients(&residual);
            let of_levels = coefficients[coefficients.len() - others..].iter().copied().enumerate();
            let (level, size) = of_levels.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
            let check = Check::new(Test::Shift, one.name, f, &[parameters as f64, dof as f64], p);
            Some(check.finding(|| {
                format!("{} differs from {} in {coordinate} by {size:.2} µm", one.levels[level + 1], one.levels[0])
            }))
        });
        let of_coordinates: Vec<Check> = of_coordinates.collect();
        all.extend(of_coordinates.into_iter().min_by(|a, b| a.p.total_cmp(&b.p)));
    }
    all
}

/// Readings of one ball at commands that are whole turns apart, `[earlier turn, later turn]`, and what they differ by, in mm.
fn closings(campaign: &Campaign) -> Vec<([usize; 2], Vector3<f64>)> {
    let of = |row: usize| (campaign.readings[row].ball, campaign.readings[row].command);
    let all = 0..campaign.readings.len();
    let pairs = all.clone().flat_map(|row| all.clone().map(move |other| [row, other]));
    let closes = |[row, other]: &[usize; 2]| of(*row) == of(*other) && campaign.turn[*row] + 1 == campaign.turn[*other];
    let difference =
        |[row, other]: [usize; 2]| ([row, other], campaign.readings[other].value - campaign.readings[row].value);
    pairs.filter(closes).map(difference).collect()
}

/// By how far each ball is off after a turn: the mean difference of its readings at commands that are a turn apart.
pub(crate) fn closing_errors(campaign: &Campaign, std_um: f64) -> Vec<NamedValue> {
    let pairs = closings(campaign);
    let of_ball = |(ball, id): (usize, &String)| {
        let own: Vec<&([usize; 2], Vector3<f64>)> =
            pairs.iter().filter(|([row, _], _)| campaign.readings[*row].ball == ball).collect();
        let count = own.len() as f64;
        let mean = own.iter().map(|(_, difference)| difference).sum::<Vector3<f64>>() / count;
        let about = "distance between the ball's places at the end and the beginning of a turn";
        let std = std_um * (2.0 / count).sqrt();
        (!own.is_empty()).then(|| NamedValue::new("closing_error", 1e3 * mean.norm(), std, "um", about).of(id))
    };
    campaign.balls.iter().enumerate().filter_map(of_ball).collect()
}

/// Whether the turn closes: differences over a turn against what the fit leaves of one turn.
fn closing_check(campaign: &Campaign, effects: &[Column]) -> Option<Check> {
    let pairs = closings(campaign);
    let later: Vec<usize> = pairs.iter().map(|([_, other], _)| *other).collect();
    let rows: Vec<usize> = (0..campaign.readings.len()).filter(|row| !later.contains(row)).collect();
    let pick = |column: &Column| rows.iter().map(|row| column[*row]).collect::<Column>();
    let readings: Vec<Reading> = rows.iter().map(|row| campaign.readings[*row]).collect();
    let effects: Vec<Column> = effects.iter().map(pick).collect();
    let one_turn = if pairs.is_empty() { return None } else { fit(&campaign.layout, &readings, &effects).ok()? };
    let (dof, count) = (one_turn.dof as f64, 3.0 * pairs.len() as f64);
    if one_turn.dof == 0 {
        return None;
    }
    let in_noise = |([row, other], difference): &([usize; 2], Vector3<f64>)| {
        difference.norm_squared() / (campaign.readings[*row].std.powi(2) + campaign.readings[*other].std.powi(2))
    };
    let f = pairs.iter().map(in_noise).sum::<f64>() / count / one_turn.chi2_per_dof().max(f64::MIN_POSITIVE);
    let farthest = pairs.iter().max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))?;
    let ball = &campaign.balls[campaign.readings[farthest.0[0]].ball];
    let check = Check::new(Test::Repeats, "closing error", f, &[count, dof], f_tail(f, count, dof));
    Some(check.finding(|| format!("the turn does not close by {:.1} µm at {ball}", 1e3 * farthest.1.norm())))
}
