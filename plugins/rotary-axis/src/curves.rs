//! Component errors over the angle at evenly spaced nodes, linear between, as controls interpolate them.
//!
//! The nodes are the least-squares fit to the component errors at all commands, each weighted equally. Their covariance is that of the
//! commands: what each adds by its own readings, and what all share.

use nalgebra::DMatrix;
use runout_core::{
    Result,
    component_curves::{Carries, Location, Node, curves_rows, curves_table, location_rows},
    summary::Value,
    table::{TableRows, TableSpec},
};

use crate::{
    axis::Axis,
    campaign::{Campaign, widest_gap},
    config::Curves,
    scale::Scale,
    solve::{Combined, Fit},
};

/// A full turn has no gap wider than this many distances of nodes.
const WIDE: f64 = 1.5;
/// Share of a direction of the nodes, of the best, that commands determine.
const DETERMINED: f64 = 1e-6;
/// µm and µrad of mm and rad.
const MICRO: [f64; 6] = [1e3, 1e3, 1e3, 1e6, 1e6, 1e6];

const ABOUT: &str = "component errors of the axis at nodes, linear between: of the workpiece side, for the point `at` on the axis; mean 0, \
                     and no part that turns with the table (1/rev)";

/// The table of the curves.
pub(crate) fn table() -> TableSpec {
    curves_table(true, ABOUT)
}

/// Nodes, and what each command adds to each of them.
struct Nodes {
    position_deg: Vec<f64>,
    /// Nodes × commands; NaN where commands do not determine a node.
    weights: DMatrix<f64>,
}

impl Nodes {
    fn new(commands_deg: &[f64], pitch_deg: f64) -> Self {
        let ends = commands_deg
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], command| [low.min(*command), high.max(*command)]);
        let turns = widest_gap(commands_deg) <= WIDE * pitch_deg;
        let [from, to] = if turns { [0.0, 360.0] } else { ends };
        let steps = ((to - from) / pitch_deg).round().max(1.0) as usize;
        let step = (to - from) / steps as f64;
        let position_deg: Vec<f64> = (0..=steps).map(|node| from + step * node as f64).collect();
        // The last node of a turn is the first one.
        let free = if turns { steps } else { steps + 1 };
        let design = DMatrix::from_fn(commands_deg.len(), free, |row, node| {
            let command = if turns { commands_deg[row].rem_euclid(360.0) } else { commands_deg[row] };
            let apart = ((command - from) / step - node as f64).abs();
            let apart = if turns { apart.min(steps as f64 - apart) } else { apart };
            (1.0 - apart).max(0.0)
        });
        let svd = design.svd(true, true);
        let least = DETERMINED * svd.singular_values.max();
        let mut weights = DMatrix::from_element(steps + 1, commands_deg.len(), f64::NAN);
        if let (Some(left), Some(right)) = (&svd.u, &svd.v_t) {
            for node in 0..=steps {
                let at = node % free;
                let (mut known, mut row) = (0.0, DMatrix::zeros(1, commands_deg.len()));
                for index in (0..svd.singular_values.len()).filter(|index| svd.singular_values[*index] > least) {
                    known += right[(index, at)].powi(2);
                    row += left.column(index).transpose() * (right[(index, at)] / svd.singular_values[index]);
                }
                if known > 1.0 - DETERMINED {
                    weights.set_row(node, &row.row(0));
                }
            }
        }
        Self { position_deg, weights }
    }
}

/// Value and standard uncertainty of the six errors of a fit at each node, in the order of an axis along z.
fn evaluated(fit: &Fit, nodes: &Nodes, factor: f64) -> Vec<[[f64; 2]; 6]> {
    let rows: [[f64; 6]; 6] = std::array::from_fn(|row| {
        let mut one = [0.0; 6];
        one[row] = MICRO[row];
        one
    });
    let commands: Vec<Combined> = (0..nodes.weights.ncols()).map(|command| fit.combined(command, &rows)).collect();
    let one = |node: usize, error: usize| {
        let each = || commands.iter().enumerate().map(|(at, command)| (nodes.weights[(node, at)], command));
        let used = || each().filter(|(weight, _)| weight.is_nan() || weight.abs() > 1e-12);
        let value: f64 = used().map(|(weight, command)| weight * command.value[error]).sum();
        let own: f64 = used().map(|(weight, command)| weight * weight * command.own[(error, error)]).sum();
        let shared = commands.first().map_or(0, |command| command.common.ncols());
        let common =
            |change: usize| -> f64 { used().map(|(weight, command)| weight * command.common[(error, change)]).sum() };
        let variance = own + (0..shared).map(|change| common(change).powi(2)).sum::<f64>();
        if value.is_finite() { [value, factor * variance.max(0.0).sqrt()] } else { [f64::NAN; 2] }
    };
    (0..nodes.position_deg.len()).map(|node| std::array::from_fn(|error| one(node, error))).collect()
}

/// Rows of the curves; `others` are fits with other effects, between which and this one the data do not decide.
pub(crate) fn rows(
    axis: Axis,
    curves: Curves,
    campaign: &Campaign,
    found: &Fit,
    others: &[Fit],
    scale: &Scale,
) -> Result<TableRows> {
    if !campaign.layout.component_errors {
        return curves_rows(&table(), &[]);
    }
    let nodes = Nodes::new(&campaign.commands_deg, curves.pitch_deg);
    let all = evaluated(found, &nodes, scale.factor);
    let others: Vec<_> = others.iter().map(|other| evaluated(other, &nodes, 1.0)).collect();
    let list = all.iter().enumerate().map(|(node, found)| {
        let (mut errors, mut std) = ([f64::NAN; 6], [f64::NAN; 6]);
        for (place, coordinate) in axis.order().into_iter().enumerate() {
            for (from, to) in [(place, coordinate), (3 + place, 3 + coordinate)] {
                let farthest = others.iter().map(|other| (other[node][from][0] - found[from][0]).abs());
                errors[to] = found[from][0];
                std[to] = found[from][1].hypot(farthest.fold(0.0, f64::max));
            }
        }
        let position = nodes.position_deg[node];
        Node { axis: axis.letter().to_string(), carries: Carries::Work, position, at_mm: [0.0; 3], errors, std }
    });
    curves_rows(&table(), &list.collect::<Vec<_>>())
}

/// Rows of the location errors.
pub(crate) fn location(values: &[Value], axis: Axis) -> Result<TableRows> {
    let symbols = axis.location_symbols();
    let of_location = values.iter().filter(|value| symbols.contains(&value.symbol));
    let one = |value: &Value| Location {
        symbol: value.symbol.clone(),
        value: value.value,
        std: value.std().unwrap_or(f64::NAN),
    };
    location_rows(&of_location.map(one).collect::<Vec<_>>())
}
