//! The traces, and what part and slide come to.

use runout_core::{closed_loop::Effect, numerics::least_squares::Basis};

use crate::{
    effects::{Candidate, Place},
    trace::AxialTrace,
};

/// The traces and what they may lack.
pub(crate) struct Data {
    /// Traces with few enough points.
    pub traces: Vec<AxialTrace>,
    /// Setup of each.
    pub setups: Vec<usize>,
    pub candidates: Vec<Candidate>,
    pub effects: Vec<Effect>,
    /// Effects that are declared with their values.
    pub known: Vec<usize>,
    /// Standard deviation of a reading, where it is known from elsewhere.
    pub std_um: Option<f64>,
    pub max_shift_mm: f64,
    /// The shortest wave of the slide, where it is declared.
    pub slide_cutoff_mm: Option<f64>,
    /// Middle and length of the range that all traces share.
    pub middle_mm: f64,
    pub length_mm: f64,
    /// What part and slide come to.
    pub results: Results,
}

/// The positions on which part and slide are compared.
#[derive(Debug, Clone)]
pub(crate) struct Results {
    pub z_mm: Vec<f64>,
    /// The deviations that the slide may have, where they are declared.
    pub smooth: Option<Basis>,
}

impl Data {
    /// The place of one of its points.
    pub(crate) fn place(&self, trace: usize, point: usize) -> Place {
        self.place_of(&self.traces[trace], trace, point)
    }

    /// The place of a point of a trace that may have more points than this one's of that number.
    pub(crate) fn place_of(&self, trace: &AxialTrace, number: usize, point: usize) -> Place {
        Place {
            sign: if self.setups[number] == 0 { 1.0 } else { -1.0 },
            parabola: -(2.0 * (trace.z_mm[point] - self.middle_mm) / self.length_mm).powi(2),
            time: trace.time[point],
        }
    }
}
