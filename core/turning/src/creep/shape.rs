//! Courses at the levels of a capture.

use std::sync::Arc;

use runout_numerics::least_squares::dot;

use super::{CreepLaw, about_mean};

/// Time constants that are tried, from one turn to this many captures, by equal ratios.
pub(super) const TRIED: usize = 61;
const LONGEST: f64 = 10.0;

/// One of the time constants that are tried, in turns, where captures have so many turns.
pub(super) fn tau_tried(turns: f64, step: usize) -> f64 {
    (LONGEST * turns).powf(step as f64 / (TRIED - 1) as f64)
}

/// A course of rate 1 at the levels of a capture, about its mean.
#[derive(Clone)]
pub(super) struct Shape {
    pub values: Vec<f64>,
    pub square: f64,
}

impl Shape {
    pub(super) fn new(course: CreepLaw, middles: &[f64]) -> Self {
        let values = about_mean(middles.iter().map(|turns| course.at(*turns)).collect());
        Self { square: dot(&values, &values), values }
    }
}

/// All courses that are tried at levels with these middles.
pub(super) struct TriedShapes {
    middles: Vec<f64>,
    turns: f64,
    pub straight: Shape,
    /// By time constant, ascending.
    pub settling: Vec<Shape>,
}

impl TriedShapes {
    /// Those that are known, or new ones, which are known then.
    pub(super) fn of(middles: &[f64], turns: f64, known: &mut Vec<Arc<Self>>) -> Arc<Self> {
        if let Some(known) =
            known.iter().find(|known| known.turns.to_bits() == turns.to_bits() && known.middles == middles)
        {
            return Arc::clone(known);
        }
        let settling = |step: usize| Shape::new(CreepLaw::Settling(tau_tried(turns, step)), middles);
        let shapes = Arc::new(Self {
            middles: middles.to_vec(),
            turns,
            straight: Shape::new(CreepLaw::Straight, middles),
            settling: (0..TRIED).map(settling).collect(),
        });
        known.push(Arc::clone(&shapes));
        shapes
    }
}
