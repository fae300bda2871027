//! Position and run-out of sections about a datum axis (ISO 1101, ISO 5459), where the sections' centres are known in one
//! system of coordinates.

use super::{cylindricity::Section, near::DeviationSpread, roundness};

/// A datum axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Axis {
    /// Height at which it passes through (`x_um`, `y_um`).
    pub z_mm: f64,
    /// The axis there, from the axis of angles.
    pub x_um: f64,
    /// Place of the axis along y at `z_mm`, from the axis of angles, in µm.
    pub y_um: f64,
    /// dx/dz, in µrad (1000 µrad are 1 µm/mm).
    pub slope_x_urad: f64,
    /// dy/dz.
    pub slope_y_urad: f64,
}

impl Axis {
    /// The least-squares line through the LSCI centres of the datum sections; two sections fix it. Of one section, or of some at
    /// one height, it is the line along z through their mean centre. `None` where no section has a centre.
    #[must_use]
    pub fn through(sections: &[Section], radius_mm: f64) -> Option<Self> {
        let centres: Vec<[f64; 3]> = centres(sections, radius_mm).filter(|[_, x, _]| x.is_finite()).collect();
        let count = centres.len() as f64;
        let mean = |k: usize| centres.iter().map(|centre| centre[k]).sum::<f64>() / count;
        let [z_mm, x_um, y_um] = [0, 1, 2].map(mean);
        let spread: f64 = centres.iter().map(|[z, ..]| (z - z_mm).powi(2)).sum();
        let slope = |k: usize, level: f64| {
            let moment: f64 = centres.iter().map(|centre| (centre[0] - z_mm) * (centre[k] - level)).sum();
            if spread > 0.0 { 1e3 * moment / spread } else { 0.0 }
        };
        let (slope_x_urad, slope_y_urad) = (slope(1, x_um), slope(2, y_um));
        (!centres.is_empty()).then_some(Self { z_mm, x_um, y_um, slope_x_urad, slope_y_urad })
    }

    /// Where it is at a height, in µm.
    #[must_use]
    pub fn centre_um(&self, z_mm: f64) -> [f64; 2] {
        let up = 1e-3 * (z_mm - self.z_mm);
        [self.x_um + self.slope_x_urad * up, self.y_um + self.slope_y_urad * up]
    }
}

/// Positions of sections about a datum axis, in µm; NaN where a section has too few points.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Positions {
    /// Distance of each section's LSCI centre from the axis.
    pub eccentricity_um: Vec<f64>,
    /// Circular radial run-out of each section (ISO 1101:2017, 17.16.1): largest less smallest distance of its points from the axis.
    pub circular_runout_um: Vec<f64>,
    /// Coaxiality (ISO 1101:2017, 17.14; concentricity of one section): the diameter of the cylinder about the axis that holds
    /// all centres, twice the largest eccentricity.
    pub coaxiality_um: f64,
    /// Total radial run-out (ISO 1101:2017, 17.17.1): the same as circular run-out, of all points of all sections together.
    pub total_runout_um: f64,
}

impl Positions {
    /// Of toleranced sections about a datum axis.
    #[must_use]
    pub fn about(sections: &[Section], radius_mm: f64, axis: &Axis) -> Self {
        let eccentricity_um: Vec<f64> = centres(sections, radius_mm)
            .map(|[z_mm, x, y]| {
                let [x_0, y_0] = axis.centre_um(z_mm);
                (x - x_0).hypot(y - y_0)
            })
            .collect();
        let range = |sections: &[Section]| {
            let of_section = sections.iter().map(|section| {
                let at = section.angles.sin_cos().zip(section.form_um).map(|((sin, cos), form)| {
                    let distance = 1e3 * radius_mm + form;
                    distance_um([distance * cos, distance * sin, section.z_mm], axis)
                });
                DeviationSpread::of(at)
            });
            of_section
                .filter(|course| course.points > 0)
                .reduce(DeviationSpread::and)
                .map_or(f64::NAN, |all| all.high - all.low)
        };
        Self {
            circular_runout_um: sections.iter().map(|section| range(std::slice::from_ref(section))).collect(),
            coaxiality_um: 2.0 * eccentricity_um.iter().copied().fold(f64::NAN, f64::max),
            total_runout_um: range(sections),
            eccentricity_um,
        }
    }
}

/// Distance of a point (µm, µm, mm) from the axis, at right angles to it.
fn distance_um([x, y, z_mm]: [f64; 3], axis: &Axis) -> f64 {
    let [a, b] = [1e-6 * axis.slope_x_urad, 1e-6 * axis.slope_y_urad];
    let [x, y] = [x - axis.x_um, y - axis.y_um];
    let z = 1e3 * (z_mm - axis.z_mm);
    let cross = [y - z * b, z * a - x, x * b - y * a];
    (cross.iter().map(|c| c * c).sum::<f64>() / (1.0 + a * a + b * b)).sqrt()
}

/// Height and LSCI centre of each section.
fn centres<'a>(sections: &'a [Section], radius_mm: f64) -> impl Iterator<Item = [f64; 3]> + 'a {
    let mut points = roundness::Points::default();
    sections.iter().map(move |section| {
        points.set_profile(section.angles, section.form_um, radius_mm);
        let circle = points.reference(roundness::Reference::LeastSquares);
        circle.map_or([section.z_mm, f64::NAN, f64::NAN], |circle| [section.z_mm, circle.x_um, circle.y_um])
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::roundness::Angles;

    const RADIUS_MM: f64 = 20.0;

    /// Exact circle of a radius that exceeds the nominal one by `larger`, about (x, y), as deviations over equal angles.
    fn circle(angles: &Angles, [x, y]: [f64; 2], larger: f64) -> Vec<f64> {
        let radius = 1e3 * RADIUS_MM + larger;
        let at = |(sin, cos): (f64, f64)| {
            let (along, across) = (x * cos + y * sin, y * cos - x * sin);
            along + (radius * radius - across * across).sqrt() - 1e3 * RADIUS_MM
        };
        angles.sin_cos().map(at).collect()
    }

    #[test]
    fn displaced_circles_have_the_run_out_of_their_displacement() {
        let angles = Angles::equal(360);
        // Datum sections at 0 and 100 mm fix x = 2 + 0.1 z, y = −0.05 z; one at 50 mm is (3, 4) µm aside, and one at 150 mm 1 µm
        // larger and 1 µm aside.
        let axis = |z: f64| [2.0 + 0.1 * z, -0.05 * z];
        let forms = [
            circle(&angles, axis(0.0), 0.0),
            circle(&angles, axis(100.0), 7.0),
            circle(&angles, [axis(50.0)[0] + 3.0, axis(50.0)[1] + 4.0], 0.0),
            circle(&angles, [axis(150.0)[0], axis(150.0)[1] - 1.0], 1.0),
        ];
        let heights = [0.0, 100.0, 50.0, 150.0];
        let sections: Vec<Section> =
            forms.iter().zip(heights).map(|(form_um, z_mm)| Section { z_mm, angles: &angles, form_um }).collect();
        let datum = Axis::through(&sections[..2], RADIUS_MM).unwrap();
        assert!((datum.slope_x_urad - 100.0).abs() < 1e-6 && (datum.slope_y_urad + 50.0).abs() < 1e-6, "{datum:?}");
        let found = Positions::about(&sections[2..], RADIUS_MM, &datum);
        // 1e-3: a circle across z is an ellipse across the tilted axis, by R·slope²/2.
        for (value, expected) in [
            (found.eccentricity_um[0], 5.0),
            (found.eccentricity_um[1], 1.0),
            (found.circular_runout_um[0], 10.0),
            (found.circular_runout_um[1], 2.0),
            (found.coaxiality_um, 10.0),
            // From R − 5 to R + 5, which holds R + 1 ± 1.
            (found.total_runout_um, 10.0),
        ] {
            assert!((value - expected).abs() < 1e-3, "{value} instead of {expected}: {found:?}");
        }
        // One datum section: the axis is parallel to z through its centre.
        let datum = Axis::through(&sections[..1], RADIUS_MM).unwrap();
        let found = Positions::about(&sections[2..3], RADIUS_MM, &datum);
        assert!((found.eccentricity_um[0] - 8.0_f64.hypot(1.5)).abs() < 1e-6, "{found:?}");
        assert_eq!(Axis::through(&[], RADIUS_MM), None);
    }
}
