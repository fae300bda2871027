//! Numerical tools that know nothing of rigs.

pub mod chebyshev;
pub mod cloud;
pub mod filter;
pub mod fourier;
pub mod height_map;
pub mod interpolation;
pub mod lanes;
pub mod least_squares;
pub mod side_by_side;
