//! A measurement tests its own uncertainty and its own evidence.
//!
//! A value and an effect are sums of what single readings give to them. Readings are cut into parts that the noise model calls independent:
//! the parts' sums must scatter as that model says. A domain declares what its parts are ([`Structure`]), never a test.
//!
//! ```
//! use runout_consistency::{LinearFit, Structure, judge};
//! use runout_numerics::least_squares::Basis;
//!
//! // A level measured in three passes of 20 readings, of which the last is off by 1 µm beside noise of 0.1 µm.
//! let readings: Vec<f64> =
//!     (0..60).map(|i| 0.1 * (i as f64 * 7.0).sin() + if i >= 40 { 1.0 } else { 0.0 }).collect();
//! let level = Basis::of(vec![vec![1.0; 60]]);
//! let mut residual = readings.clone();
//! level.remove_from(&mut residual);
//! let passes: Vec<usize> = (0..60).map(|i| i / 20).collect();
//! let names: Vec<String> = (1..=3).map(|pass| format!("pass {pass}")).collect();
//! let structure = Structure::default().shifting("passes", &passes, &names);
//! let fit = LinearFit {
//!     residual: &residual,
//!     basis: level.columns(),
//!     names: &["level".into()],
//!     weights: &level.weights(),
//!     noise: None,
//!     unit: "µm",
//! };
//! let found = judge(fit, &structure).checks;
//! assert!(found.iter().any(|check| check.finding.starts_with("pass 3 differs from pass")));
//! ```

pub mod blocks;
pub mod check;
pub mod groups;
pub mod in_time;
pub mod keys;
pub mod left_out;
pub mod linear;
pub mod order;
pub mod repeats;
pub mod rows;
pub mod structure;
#[cfg(test)]
mod testing;
#[cfg(test)]
#[path = "../../../tests/support/trials.rs"]
mod trials;
pub mod turns;

pub use check::{Action, Check, Test, findings, refuted_by};
pub use linear::{Judgement, LinearFit, judge};
pub use structure::{Kind, Order, Partition, Shift, Structure};
