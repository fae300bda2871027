//! The equations of a station, order by order: least squares by operators, exact geometry, and the uncertainty of both.

mod algebra;
mod angles;
mod consistency;
mod estimate;
mod interpolation;
mod joint;
pub(crate) mod leak;
mod operators;
mod projection;
mod propagation;
mod readings;
mod report;
mod residual;
mod second_order;
mod side_by_side;
mod solution;
mod weights;

pub(crate) use algebra::{Blocks, apply, leftover};
pub(crate) use estimate::Estimate;
pub(crate) use interpolation::interpolate;
pub(crate) use operators::{Operators, OrderOperator};
pub(crate) use projection::projection;
pub(crate) use propagation::Propagation;
pub(crate) use readings::{RESAMPLING, Readings};
pub(crate) use residual::{by_reading, judged_residual};
pub(crate) use second_order::{OVERSAMPLING, SecondOrder};
pub(crate) use solution::Solver;
pub(crate) use weights::{smooth_by_order, whitening};
