//! Spatial error of a machine tool: kriging of what a tracker reads over the travel of the axes, and its compensation.
//!
//! The separator `spatial-error` fits the placement of the tracker and a random field together, predicts the error anywhere with its
//! standard uncertainty, and computes what the axes have to add. Its loop finds errors of single axes. The simulator of the same
//! name moves a chain of rigid bodies.

mod campaign;
mod checks;
mod compensate;
mod compensated;
mod conclusion;
mod config;
mod correlation;
mod curves;
mod diagnose;
mod effects;
mod families;
mod joint;
mod level;
mod likelihood;
mod measured;
mod neighbours;
mod noise;
mod outcome;
mod parameters;
mod projections;
mod query;
mod remarks;
mod residual;
mod rough;
mod separate;
mod shapes;
mod shared_errors;
pub mod simulate;
mod smooth;
mod solution;
mod solve;
mod span;
mod suspects;
mod terms;
mod trace;
mod trend;
mod values;
mod variogram;
mod whole;

use runout_core::pipeline::{Plugin, Registry};

pub use config::{Compensate, Curves, Declared, Kriging, Letter, SpatialError, SpatialErrorConfig, Variogram};
pub use query::Query;

/// Predictions from points with a covariance that is known, without a pipeline.
pub mod kriging {
    pub use crate::{
        correlation::Family,
        joint::{Covariance, Data, Joint, Observed, Predicted, Predictor, Query},
    };
}

/// Adds the separator and the simulator `spatial-error`.
pub fn register(registry: &mut Registry) {
    registry.separators.add(Plugin::of::<SpatialErrorConfig>());
    registry.simulators.add(Plugin::of::<simulate::Scenario>());
}
