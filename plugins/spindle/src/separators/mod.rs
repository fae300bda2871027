//! Separators: each gives one linear operator an order; solving, second-order geometry and uncertainty are shared.

pub mod four_sensor_reversal;
pub mod harmonic_least_squares;
mod readings;
mod second_order;
mod solution;
mod swapped_setups;
mod weights;
