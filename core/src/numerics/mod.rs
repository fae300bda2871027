//! Numerical tools that know nothing of rigs.

pub mod fourier;
pub mod lanes;
pub mod least_squares;
