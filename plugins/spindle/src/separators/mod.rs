//! Separators: each gives one linear operator an order; solving, second-order geometry and uncertainty are shared.

mod algebra;
pub mod closed_form;
pub mod donaldson_reversal;
pub mod four_sensor_reversal;
pub mod harmonic_least_squares;
pub mod multi_step;
mod one_direction;
mod projection;
mod readings;
mod second_order;
mod solution;
mod swapped_setups;
pub mod three_point;
mod weights;

pub(crate) use algebra::{Blocks, apply, expected_weighted_squares, leftover};
pub(crate) use readings::Readings;
pub(crate) use second_order::{OVERSAMPLING, interpolate};
pub(crate) use solution::{Estimate, Operators, Solver};
pub(crate) use weights::{smooth, whitening};
