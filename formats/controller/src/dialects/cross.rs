//! One axis that is moved by the position of another: straightness and squareness, and the radial and axial errors of a rotary axis.

use runout_core::component_curves::{Carries, symbols};

use super::positioning;
use crate::chain::{Chain, LETTERS, SQUARENESS, index};

/// A table: input axis, output axis, and by what the output axis has to move at each node of the input axis, in mm.
pub(super) struct Table<'a> {
    pub input: &'a str,
    pub output: &'static str,
    pub wanted_mm: Vec<f64>,
}

/// Of all pairs of axes with such errors.
pub(super) fn tables(chain: &Chain) -> Vec<Table<'_>> {
    let mut tables = Vec::new();
    for axis in &chain.axes {
        for (error, output) in LETTERS.into_iter().enumerate() {
            if axis.letter == output {
                continue;
            }
            let own = index(&axis.letter);
            let squareness = SQUARENESS.iter().find(|(_, moved, with, _)| *moved == error && own == Some(*with));
            let line = |position: f64| {
                squareness.map_or(0.0, |(symbol, _, with, sign)| {
                    sign * 1e-3 * chain.location(symbol) * (position - chain.middle_mm(*with))
                })
            };
            // The tool has to go back; a workpiece that is displaced has to be followed.
            let sign = if axis.carries == Carries::Tool { -1.0 } else { 1.0 };
            let wanted = axis.nodes.iter().map(|node| sign * 1e-3 * (node.errors[error] + line(node.position)));
            let wanted_mm: Vec<f64> = wanted.collect();
            if wanted_mm.iter().any(|value| value.abs() > 0.0) {
                tables.push(Table { input: &axis.letter, output, wanted_mm });
            }
        }
    }
    tables
}

/// Whether such tables hold an error.
pub(super) fn holds(symbol: &str) -> bool {
    let squareness = SQUARENESS.iter().any(|(known, ..)| *known == symbol);
    let moves = LETTERS.contains(&symbol.get(1..2).unwrap_or_default());
    squareness || (symbol.len() == 3 && moves && symbol[1..2] != symbol[2..3])
}

/// What they add to a command of the linear axes, in µm.
pub(super) fn adds_um(chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
    let mut adds = [0.0; 3];
    for axis in chain.axes.iter().filter(|axis| !axis.rotary) {
        let own = index(&axis.letter).unwrap_or(0);
        let of = axis.at(place_mm[own]);
        for (error, _) in symbols(&axis.letter).iter().take(3).enumerate() {
            if error != positioning(&axis.letter) {
                adds[error] -= of[error];
            }
        }
    }
    for (symbol, moved, with, sign) in SQUARENESS {
        adds[moved] -= sign * 1e-3 * chain.location(symbol) * (place_mm[with] - chain.middle_mm(with));
    }
    adds
}
