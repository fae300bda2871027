//! The noise of averages without what single turns show: drifts that are certain, and lines. Over the record they are no noise.

use runout_core::{
    Complex64,
    near_tone::near_tones,
    neighbours::Neighbours,
    profile::{Profile, Turns},
};

use super::{
    drift::{Creeping, Part},
    turn_observations::TurnObservations,
};
use crate::selection::Selection;

/// Share of a variance that stays whatever is taken out of it.
const LEAST_LEFT: f64 = 0.05;

/// A profile of some turns whose covariance and scatter have neither drifts nor lines. Its mean has them still.
pub(super) fn steadied(
    mut profile: Profile,
    neighbours: Option<&Neighbours>,
    selection: &Selection,
    seen: &TurnObservations,
    part: Part,
) -> Profile {
    let place = selection.setups.iter().position(|setup| *setup == profile.setup);
    let Some(setup) = place.filter(|_| !seen.is_steady()) else { return profile };
    let channel = |sensor: usize| {
        let id = selection.sensors.get(sensor)?;
        profile.sensors.iter().position(|known| known == id)
    };
    let certain = |sensor: usize| -> Option<&Creeping> {
        seen.creeping.get(sensor)?.as_ref().filter(|creeping| creeping.certain())
    };
    let channels: Vec<(usize, usize)> =
        (0..selection.sensors.len()).filter_map(|sensor| Some((sensor, channel(sensor)?))).collect();
    if let Some(mut neighbours) = neighbours.cloned() {
        for (sensor, channel) in &channels {
            certain(*sensor).iter().for_each(|creeping| creeping.take_out_of(&mut neighbours, setup, part, *channel));
        }
        seen.lines.found.iter().for_each(|line| line.take_out_of(&mut neighbours, part, setup, channel));
        profile.covariance = Some(neighbours.covariance());
        profile.near_tones = near_tones(&neighbours);
    }
    // What is known apart has the lines.
    profile.scatter_beside = None;
    if let Some(scatter) = &mut profile.scatter {
        let width = profile.sensors.len();
        let orders = scatter.len() / (width * width);
        let without = seen.lines.without.get(setup);
        let known = without.map_or(0, |turns| turns.orders.min(orders));
        if let Some(turns) = without {
            let used = if part == Part::HeldOut { turns.count() - profile.turns.used } else { 0 };
            scatter_of(turns, used..used + profile.turns.used, &mut scatter[..known * width * width]);
        }
        for (sensor, channel) in &channels {
            let creep = certain(*sensor).map(|creeping| creeping.scatter(setup, part, orders)).unwrap_or_default();
            let mut added = vec![0.0; orders];
            added.iter_mut().zip(creep).for_each(|(sum, creep)| *sum += creep);
            for line in &seen.lines.found {
                // Single turns are known without lines at low orders.
                let line = line.scatter(part, setup, *sensor, orders);
                added.iter_mut().zip(line).skip(known).for_each(|(sum, line)| *sum += line);
            }
            for (matrix, added) in scatter.chunks_exact_mut(width * width).zip(added) {
                lower(matrix, width, *channel, added);
            }
        }
    }
    profile
}

/// The scatter of a mean over some turns, `[order][channel][channel]`.
fn scatter_of(turns: &Turns, of: std::ops::Range<usize>, into: &mut [Complex64]) {
    let (width, count) = (turns.channels, of.len() as f64);
    for (order, matrix) in into.chunks_exact_mut(width * width).enumerate() {
        let values = |turn: usize| (0..width).map(move |channel| turns.at(turn, order, channel));
        let mut mean = vec![Complex64::ZERO; width];
        for turn in of.clone() {
            mean.iter_mut().zip(values(turn)).for_each(|(mean, value)| *mean += value / count);
        }
        matrix.fill(Complex64::ZERO);
        for turn in of.clone() {
            let off: Vec<Complex64> = values(turn).zip(&mean).map(|(value, mean)| value - mean).collect();
            for (row, one) in matrix.chunks_exact_mut(width).zip(&off) {
                let scaled = one / (count * (count - 1.0));
                row.iter_mut().zip(&off).for_each(|(entry, other)| *entry += scaled * other.conj());
            }
        }
    }
}

/// Takes a variance out of a channel's, in row and column alike, so that a covariance stays one.
fn lower(matrix: &mut [Complex64], width: usize, channel: usize, by: f64) {
    let variance = matrix[channel * width + channel].re;
    if by <= 0.0 || variance <= 0.0 {
        return;
    }
    let share = ((variance - by).max(LEAST_LEFT * variance) / variance).sqrt();
    for other in 0..width {
        matrix[channel * width + other] *= share;
        matrix[other * width + channel] *= share;
    }
}
