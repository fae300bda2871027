//! Numerical tools that know nothing of rigs.

pub mod chebyshev;
pub mod cloud;
pub mod filter;
pub mod fourier;
pub mod golden_section;
pub mod height_map;
pub mod interpolation;
pub mod lanes;
pub mod least_squares;
pub mod moderated;
pub mod number;
pub mod side_by_side;
pub mod statistics;
pub mod stretches;
pub mod threads;

pub use num_complex::Complex64;

/// Largest distance of other values from one.
#[must_use]
pub fn farthest(value: f64, others: impl IntoIterator<Item = f64>) -> f64 {
    others.into_iter().map(|other| (other - value).abs()).fold(0.0, f64::max)
}
