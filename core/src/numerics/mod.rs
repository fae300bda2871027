//! Numerical tools that know nothing of rigs.

pub mod chebyshev;
pub mod cloud;
pub mod fourier;
pub mod lanes;
pub mod least_squares;
