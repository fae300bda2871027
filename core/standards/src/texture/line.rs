//! A line and the stretches of it that were measured.

use std::ops::Range;

use super::{Settings, half_cut_off_mm, profile::AT_AN_END};
use runout_numerics::stretches::stretches;

/// A gap that is a shorter share of a section than this is missing points in it.
const GAP_OF_SECTION: f64 = 0.1;

/// A line and the stretches of it that were measured.
pub(super) struct Line<'a> {
    z_mm: &'a [f64],
    pub(super) stretches: Vec<Range<usize>>,
    /// Length that a stretch beside a gap needs: a section and, at each end, half of the longest cut-off.
    least_mm: f64,
}

impl<'a> Line<'a> {
    pub(super) fn new(z_mm: &'a [f64], profile_um: &[f64], settings: &Settings) -> Self {
        let there: Vec<usize> =
            (0..z_mm.len().min(profile_um.len())).filter(|point| profile_um[*point].is_finite()).collect();
        let measured_mm: Vec<f64> = there.iter().map(|point| z_mm[*point]).collect();
        let length_mm = match measured_mm[..] {
            [first, .., last] => last - first,
            _ => 0.0,
        };
        let section_mm = settings.section_mm.or(settings.lambda_c_mm).unwrap_or(0.2 * length_mm);
        let found = stretches(&measured_mm, GAP_OF_SECTION * section_mm);
        let stretches = match &found[..] {
            // Without gaps, what is missing at the ends is missing.
            [] | [_] => std::iter::once(0..z_mm.len().min(profile_um.len())).collect(),
            _ => found.into_iter().map(|points| there[points.start]..there[points.end - 1] + 1).collect(),
        };
        Self { z_mm, stretches, least_mm: section_mm + 2.0 * half_cut_off_mm(settings) }
    }

    pub(super) fn has_gaps(&self) -> bool {
        self.stretches.len() > 1
    }

    pub(super) fn length_mm(&self, points: &Range<usize>) -> f64 {
        self.z_mm[points.end - 1] - self.z_mm[points.start]
    }

    /// The line, or of a line with gaps the stretches that are long enough to be lines.
    pub(super) fn long_enough(&self) -> Vec<Range<usize>> {
        let is_long = |points: &&Range<usize>| {
            let length_mm = self.length_mm(points);
            length_mm + AT_AN_END * length_mm / points.len() as f64 >= self.least_mm
        };
        if self.has_gaps() { self.stretches.iter().filter(is_long).cloned().collect() } else { self.stretches.clone() }
    }
}
