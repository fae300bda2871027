//! Separators: each gives one linear operator an order; solving, second-order geometry and uncertainty are those of
//! `solve`.

pub mod closed_form;
pub mod donaldson_reversal;
pub mod face_notes;
pub mod four_sensor_reversal;
pub mod harmonic_least_squares;
mod keys;
pub mod multi_step;
mod one_direction;
mod station;
pub mod three_point;
