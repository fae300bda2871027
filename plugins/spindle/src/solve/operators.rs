//! From readings to unknowns: one linear operator an order.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use std::sync::Arc;

use runout_core::{
    Complex64,
    numerics::{
        lanes::{Arithmetic, FusedWork, fused},
        side_by_side::{Complexes, Orthonormal, TOGETHER},
    },
};

use super::{
    algebra::Blocks,
    side_by_side::{Orders, blocks_times, gather, lane, times_blocks},
};
use crate::{layout::Layout, layout::System};

/// Columns of norm 1 are sure to be independent where the inverse of their triangle is below this. What is nearer to
/// dependent is examined by pivoting; the limit is far from both its tolerance and where digits would be missed.
const SURELY_INDEPENDENT: f64 = 1e5;

/// The linear solution of one order: unknowns = operator · readings.
#[derive(Debug, Clone)]
pub(crate) struct OrderOperator {
    /// `[unknown][reading]`.
    pub operator: Vec<Complex64>,
    /// Independent columns of the layout's matrix.
    pub rank: usize,
}

/// Linear solutions of all orders; entry 0 belongs to order 1 and its own unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Operators {
    /// From order 1.
    pub orders: Vec<OrderOperator>,
    /// The equations of each order, from order 1.
    pub systems: Vec<Arc<System>>,
    /// W of each order where readings were weighted.
    pub weights: Option<Vec<Blocks>>,
}

impl Operators {
    /// Least squares for all orders to `max_order`, with W of each order where readings are weighted.
    #[must_use]
    pub(crate) fn least_squares(layout: &Layout, max_order: usize, weights: Option<Vec<Blocks>>) -> Self {
        let systems = layout.systems(max_order);
        let orders = match &weights {
            Some(weights) => weighted(layout, &systems, weights),
            None => systems.iter().map(|system| pivoted(layout, system, None)).collect(),
        };
        Self { orders, systems, weights }
    }

    /// Whether each unknown is observable at an order from 1.
    #[must_use]
    pub(crate) fn observable(&self, order: usize) -> &[bool] {
        &self.systems[order - 1].observable
    }
}

/// One order by column pivoting, whatever its rank.
fn pivoted(layout: &Layout, system: &System, weights: Option<&Blocks>) -> OrderOperator {
    let Some(weights) = weights else {
        let qr = layout.factor_matrix(system.columns, &system.matrix);
        return OrderOperator { operator: qr.operator(), rank: qr.rank() };
    };
    let qr = layout.factor_matrix(system.columns, &weights.times(&system.matrix, system.columns));
    OrderOperator { operator: weights.after(&qr.operator()), rank: qr.rank() }
}

/// All orders, weighted.
fn weighted(layout: &Layout, systems: &[Arc<System>], weights: &[Blocks]) -> Vec<OrderOperator> {
    let mut solved = Vec::with_capacity(systems.len());
    let mut workspaces: [Option<Workspace>; 2] = [None, None];
    for orders in Orders::up_to(systems.len()) {
        let system = &systems[orders.of(0) - 1];
        let kind = usize::from(orders.of(0) > 1);
        let workspace =
            workspaces[kind].get_or_insert_with(|| Workspace::new(layout.readings.len(), system.columns, &weights[0]));
        fused(Solving {
            matrices: orders.map(|order| &systems[order - 1].matrix[..]),
            weights: orders.map(|order| weights[order - 1].entries()),
            size: weights[0].size(),
            workspace,
        });
        solved.extend(orders.each().enumerate().map(|(place, order)| {
            if workspace.full[place] {
                OrderOperator { operator: lane(&workspace.operator, place), rank: system.columns }
            } else {
                pivoted(layout, &systems[order - 1], Some(&weights[order - 1]))
            }
        }));
    }
    solved
}

/// What solving eight orders needs.
struct Workspace {
    weights: Vec<Complexes>,
    /// `[reading][unknown]`, and the same weighted.
    matrix: Vec<Complexes>,
    weighted: Vec<Complexes>,
    orthonormal: Orthonormal,
    /// `[unknown][reading]`, of weighted readings and of readings.
    solving: Vec<Complexes>,
    operator: Vec<Complexes>,
    full: [bool; TOGETHER],
}

impl Workspace {
    fn new(readings: usize, columns: usize, weights: &Blocks) -> Self {
        let matrix = vec![Complexes::ZERO; readings * columns];
        Self {
            weights: vec![Complexes::ZERO; weights.entries().len()],
            weighted: matrix.clone(),
            solving: matrix.clone(),
            operator: matrix.clone(),
            matrix,
            orthonormal: Orthonormal::new(readings, columns),
            full: [false; TOGETHER],
        }
    }
}

/// Eight orders on their way to operators.
struct Solving<'a> {
    matrices: [&'a [Complex64]; TOGETHER],
    weights: [&'a [Complex64]; TOGETHER],
    /// Rows of a block of weights.
    size: usize,
    workspace: &'a mut Workspace,
}

impl FusedWork for Solving<'_> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        let Self { matrices, weights, size, workspace } = self;
        gather(matrices, &mut workspace.matrix);
        gather(weights, &mut workspace.weights);
        blocks_times::<A>(size, &workspace.weights, &workspace.matrix, &mut workspace.weighted);
        workspace.full = workspace.orthonormal.factor::<A>(&workspace.weighted, SURELY_INDEPENDENT);
        workspace.orthonormal.operator::<A>(&mut workspace.solving);
        times_blocks::<A>(size, &workspace.solving, &workspace.weights, &mut workspace.operator);
    }
}

#[cfg(test)]
mod tests {
    use runout_core::rig::{RigConfig, Rotation, SensorConfig, SetupConfig};

    use super::*;

    /// Weights that no two orders share.
    fn weights(size: usize, setups: usize, max_order: usize) -> Vec<Blocks> {
        let entry = |index: usize, order: usize| {
            let angle = (1 + index) as f64 * (0.3 + 0.07 * order as f64);
            let diagonal = (index % (size * size)).is_multiple_of(size + 1);
            Complex64::from_polar(if diagonal { 2.0 + angle.sin() } else { 0.4 }, if diagonal { 0.0 } else { angle })
        };
        let blocks = |order| (0..size * size * setups).map(|index| entry(index, order)).collect();
        (1..=max_order).map(|order| Blocks::new(size, blocks(order))).collect()
    }

    /// Of three sensors, some orders are lost, and orders close to them have a large noise gain.
    #[test]
    fn eight_orders_at_once_are_as_one_after_the_other() {
        const MAX_ORDER: usize = 83;
        for (angles_deg, part_deg) in [
            (&[0.0, 90.0, 180.0, 228.75][..], &[0.0, 180.0][..]),
            (&[0.0, 100.0, 230.0], &[0.0]),
            (&[0.0, 45.0], &[0.0, 90.0]),
            (&[30.0], &[0.0]),
        ] {
            let sensor = |(index, angle_deg): (usize, &f64)| SensorConfig {
                id: format!("S{index}"),
                angle_deg: *angle_deg,
                z_mm: 0.0,
                section: "s".into(),
                sign: 1,
                ..SensorConfig::default()
            };
            let setup = |(index, part_deg): (usize, &f64)| SetupConfig {
                id: format!("{index}"),
                part_deg: *part_deg,
                ..SetupConfig::default()
            };
            let config = RigConfig {
                interruptions: Vec::new(),
                bearings: Vec::new(),
                part_radius_mm: 30.0,
                rotation: Rotation::Ccw,
                sensors: angles_deg.iter().enumerate().map(sensor).collect(),
                setups: part_deg.iter().enumerate().map(setup).collect(),
            };
            let layout = Layout::new(&config.check().unwrap(), false);
            let weights = weights(angles_deg.len(), part_deg.len(), MAX_ORDER);
            let found = Operators::least_squares(&layout, MAX_ORDER, Some(weights.clone()));
            let mut deficient = 0;
            for ((found, system), weights) in found.orders.iter().zip(&found.systems).zip(&weights) {
                let alone = pivoted(&layout, system, Some(weights));
                assert_eq!(found.rank, alone.rank);
                deficient += usize::from(alone.rank < system.columns);
                let size = alone.operator.iter().map(|entry| entry.norm()).fold(0.0, f64::max);
                for (found, alone) in found.operator.iter().zip(&alone.operator) {
                    // Rounding times a condition of some hundreds.
                    assert!((found - alone).norm() < 1e-12 * size, "{found} {alone}");
                }
            }
            assert_eq!(deficient > 0, angles_deg.len() < 4, "{angles_deg:?}");
        }
    }
}
