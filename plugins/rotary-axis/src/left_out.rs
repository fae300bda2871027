//! What a fit leaves of commands that it has not seen.

use nalgebra::Vector3;
use runout_core::numerics::statistics::upper_median;

use crate::{
    campaign::{Campaign, FEWEST_COMMANDS, steps},
    kinematics::Errors,
    solve::{Column, Fit, Layout, Reading, fit},
};

/// Commands are left out in at most so many fits.
const MOST_LEFT_OUT: usize = 40;
/// A command left out is predicted where its neighbours are at most this many median steps apart.
const WIDEST_STEPS: f64 = 3.5;

/// The residual of each reading (mm) of a fit without its command, with component errors interpolated linearly between
/// the commands beside it; nothing beside a gap.
pub(crate) fn left_out(campaign: &Campaign, effects: &[Column], whole: &Fit) -> Vec<Option<Vector3<f64>>> {
    let Campaign { layout, readings, commands_deg, .. } = campaign;
    let commands = commands_deg.len();
    let mut left = vec![None; readings.len()];
    if commands <= FEWEST_COMMANDS {
        return left;
    }
    let values: Vec<f64> =
        whole.effects().iter().map(|one| if one.value.is_finite() { one.value } else { 0.0 }).collect();
    // Effects keep the values of the whole: a fit without a command would hardly change them.
    let corrected = |row: usize| {
        effects.iter().zip(&values).fold(readings[row].value, |sum, (column, value)| sum - column[row] * *value)
    };
    let mut widths = steps(commands_deg);
    let widest = WIDEST_STEPS * upper_median(&mut widths).unwrap_or(0.0);
    let folds = commands.min(MOST_LEFT_OUT);
    for fold in 0..folds {
        let kept: Vec<usize> = (0..commands).filter(|command| command % folds != fold).collect();
        let place = |command: usize| kept.iter().position(|own| *own == command);
        let seen: Vec<Reading> = (0..readings.len())
            .filter_map(|row| {
                let command = place(readings[row].command)?;
                Some(Reading { command, value: corrected(row), ..readings[row] })
            })
            .collect();
        let reduced = Layout { phi: kept.iter().map(|command| layout.phi[*command]).collect(), ..layout.clone() };
        let Ok(found) = fit(&reduced, &seen, &[]) else { continue };
        for row in 0..readings.len() {
            let reading = &readings[row];
            if reading.command % folds != fold {
                continue;
            }
            let errors = if layout.component_errors {
                between(&kept, commands_deg, reading.command, widest, &found)
            } else {
                Some(found.errors(0))
            };
            if let Some(errors) = errors {
                let expected = found.expected(&errors, layout.phi[reading.command], reading.ball);
                left[row] = Some(corrected(row) - expected);
            }
        }
    }
    left
}

/// Errors at a command that a fit has not seen, from its neighbours around the turn.
fn between(kept: &[usize], commands_deg: &[f64], command: usize, widest: f64, found: &Fit) -> Option<Errors> {
    let ahead = |from: f64, to: f64| (to - from).rem_euclid(360.0);
    let at = commands_deg[command];
    let by = |distance: &dyn Fn(f64) -> f64| {
        let all = kept.iter().enumerate().map(|(place, own)| (place, distance(commands_deg[*own])));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let (before, back) = by(&|own| ahead(own, at))?;
    let (after, forth) = by(&|own| ahead(at, own))?;
    if back + forth > widest {
        return None;
    }
    let share = back / (back + forth);
    let [one, other] = [before, after].map(|place| found.errors(place));
    let mean = |a: Vector3<f64>, b: Vector3<f64>| a * (1.0 - share) + b * share;
    Some(Errors { shift: mean(one.shift, other.shift), angle: mean(one.angle, other.angle), ..one })
}
