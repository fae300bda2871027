//! Stretches of a wall along which no section was measured: rings that are interpolated there are no surface.

use runout_numerics::{height_map::HeightMap, stretches::stretches};

/// Steps between sections below this share of λc are no gap, however even the others are.
const GAP_OF_CUT_OFF: f64 = 0.1;
/// Rings nearer than this to a section are at it.
const NEAR_MM: f64 = 1e-6;

/// Where sections are so far apart that they leave a gap: from and to, in mm.
pub(super) struct SectionGaps(Vec<[f64; 2]>);

impl SectionGaps {
    /// Of ascending places of sections.
    pub(super) fn new(measured_mm: &[f64], lambda_c_mm: Option<f64>) -> Self {
        let stretches = stretches(measured_mm, GAP_OF_CUT_OFF * lambda_c_mm.unwrap_or(0.0));
        let gap = |pair: &[std::ops::Range<usize>]| [measured_mm[pair[0].end - 1], measured_mm[pair[1].start]];
        Self(stretches.windows(2).map(gap).collect())
    }

    /// A map without the rings in the gaps and so far beside them.
    pub(super) fn left_out(&self, map: HeightMap<'static>, z_mm: &[f64], beside_mm: f64) -> HeightMap<'static> {
        if self.0.is_empty() {
            return map;
        }
        let mut heights = map.heights_um().to_vec();
        for (z_mm, ring) in z_mm.iter().zip(heights.chunks_mut(map.columns())) {
            let is_in = |[from, to]: &[f64; 2]| *z_mm > from - beside_mm + NEAR_MM && *z_mm < to + beside_mm - NEAR_MM;
            if self.0.iter().any(is_in) {
                ring.fill(f64::NAN);
            }
        }
        map.with(heights)
    }

    /// What is said of them.
    pub(super) fn remark(&self) -> Option<String> {
        let gaps: Vec<String> = self.0.iter().map(|[from, to]| format!("{from} to {to} mm")).collect();
        (!gaps.is_empty()).then(|| {
            format!(
                "no section was measured from {}: areal values leave out what is between and, behind λc, half a cut-off beside it",
                gaps.join(", from ")
            )
        })
    }
}
