//! Linear least squares, min |A·x − b|, once for all crates. Which to take:
//!
//! | problem | takes |
//! | --- | --- |
//! | small and complex, many right-hand sides: an operator an order | [`PivotedQr`] |
//! | real, and the rank is in question: what the data do not determine is lost | [`least_norm`] |
//! | columns that come one after the other, models nested in each other, predictions of data left out | [`Basis`] |
//!
//! All scale columns to norm 1 first, or compare with a column's own norm, so that units do not decide on the rank.

mod basis;
mod least_norm;
mod pivoted;

pub use basis::{Basis, dot, norm, orthonormal};
pub use least_norm::{LeastNorm, SINGULAR, least_norm};
pub use pivoted::{PivotedQr, cholesky, invert_lower};
