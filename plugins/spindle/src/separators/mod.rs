//! Separators: each gives one linear operator an order; solving, second-order geometry and uncertainty are shared.

mod algebra;
mod angles;
pub mod closed_form;
pub mod donaldson_reversal;
pub mod face_notes;
pub mod four_sensor_reversal;
pub mod harmonic_least_squares;
mod joint;
pub(crate) mod leak;
pub mod multi_step;
mod one_direction;
mod operators;
mod projection;
mod propagation;
mod readings;
mod second_order;
mod side_by_side;
mod solution;
pub mod three_point;
mod weights;
pub(crate) mod wiring;

pub(crate) use algebra::{Blocks, apply, leftover};
pub(crate) use operators::Operators;
pub(crate) use propagation::Propagation;
pub(crate) use readings::{Readings, Scatter};
pub(crate) use second_order::{OVERSAMPLING, interpolate};
pub(crate) use solution::{Estimate, Solver, residual};
pub(crate) use weights::{smooth_by_order, whitening};
