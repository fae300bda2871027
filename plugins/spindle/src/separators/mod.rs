//! Separators: each gives one linear operator an order; solving, second-order geometry and uncertainty are those of
//! `solve`.

mod closed_form;
mod donaldson_reversal;
mod face_notes;
pub mod four_sensor_reversal;
mod harmonic_least_squares;
mod keys;
mod multi_step;
mod one_direction;
mod station;
mod three_point;

pub use closed_form::{ClosedForm, ClosedFormSeparator, Method, MethodConfig};
pub use donaldson_reversal::DonaldsonReversal;
pub use face_notes::face_notes;
pub use harmonic_least_squares::{HarmonicLeastSquares, HarmonicLeastSquaresConfig, Weighting};
pub use multi_step::MultiStep;
pub use three_point::ThreePoint;
