//! The general separator: any rig, one complex least-squares problem an order.

use runout_core::{
    Complex64, Result,
    pipeline::{
        error::Fault,
        registry::{Context, StageConfig},
    },
    rig::Rig,
    separation::{Assessment, Separation},
    stage::{Separator, Station, StationSeparator, separator::require_rig},
};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    readings::Readings,
    solution::{Operators, OrderOperator, Solver},
    weights,
};
use crate::layout::Layout;

/// How readings are weighed against each other where there are more than unknowns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Weighting {
    /// By their covariance over the turns, order by order; equally where there is no scatter to measure.
    #[default]
    TurnCovariance,
    /// Equally.
    None,
}

/// `plugin = "harmonic-least-squares"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HarmonicLeastSquaresConfig {
    /// Whether readings follow exact geometry (a line meets the displaced profile) or the linear equations.
    #[serde(default = "yes")]
    pub second_order: bool,
    /// How readings are weighed.
    #[serde(default)]
    pub weighting: Weighting,
}

fn yes() -> bool {
    true
}

impl StageConfig for HarmonicLeastSquaresConfig {
    type Stage = Separator;

    const NAME: &'static str = "harmonic-least-squares";
    const ABOUT: &'static str = "any rig: least squares order by order, weighted by the scatter over the turns";

    fn check(self, context: &Context) -> std::result::Result<Separator, Fault> {
        let rig = require_rig(context.rig)?;
        Ok(Separator::Stations(Box::new(HarmonicLeastSquares::new(rig.clone(), self.second_order, self.weighting))))
    }
}

/// The general separator, for one rig.
#[derive(Debug, Clone)]
pub struct HarmonicLeastSquares {
    rig: Rig,
    layout: Layout,
    second_order: bool,
    weighting: Weighting,
}

impl HarmonicLeastSquares {
    /// For one rig.
    #[must_use]
    pub fn new(rig: Rig, second_order: bool, weighting: Weighting) -> Self {
        Self { layout: Layout::new(&rig, false), rig, second_order, weighting }
    }
}

impl StationSeparator for HarmonicLeastSquares {
    fn assess(&self, max_order: usize) -> std::result::Result<Assessment, Fault> {
        Ok(self.layout.assess(max_order))
    }

    fn separate(&self, station: &Station) -> Result<Separation> {
        let solver = Solver { rig: &self.rig, layout: &self.layout, second_order: self.second_order };
        solver.separate(station, |readings| operators(&self.layout, readings, self.weighting))
    }
}

/// Least-squares operators of all orders.
#[must_use]
pub fn operators(layout: &Layout, readings: &Readings, weighting: Weighting) -> Operators {
    let count = layout.readings.len();
    let weights: Option<Vec<_>> = match weighting {
        Weighting::TurnCovariance => {
            (1..=readings.max_order).map(|order| weights::whitening(readings, order)).collect()
        }
        Weighting::None => None,
    };
    let solve = |order: usize| {
        let (columns, matrix) = if order == 1 {
            (layout.first_order_unknowns().len(), layout.first_order_matrix())
        } else {
            (layout.unknowns.len(), layout.matrix(order))
        };
        let Some(weights) = weights.as_ref().map(|weights| &weights[order - 1]) else {
            let qr = layout.factor_matrix(columns, &matrix);
            return OrderOperator { operator: qr.operator(None), rank: qr.rank() };
        };
        let mut weighted = vec![Complex64::ZERO; matrix.len()];
        for (row, target) in weighted.chunks_exact_mut(columns).enumerate() {
            for (source, weight) in weights[row * count..(row + 1) * count].iter().enumerate() {
                let from = &matrix[source * columns..(source + 1) * columns];
                target.iter_mut().zip(from).for_each(|(to, from)| *to += weight * from);
            }
        }
        let qr = layout.factor_matrix(columns, &weighted);
        OrderOperator { operator: qr.operator(Some(weights)), rank: qr.rank() }
    };
    Operators {
        orders: (1..=readings.max_order).map(solve).collect(),
        observable: (1..=readings.max_order).map(|order| layout.observable(order)).collect(),
        weights,
    }
}
