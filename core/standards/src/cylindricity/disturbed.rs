//! A wall whose errors are drawn again and again.

use super::{Cylinder, Points, Reference, Section, Values, zone::Zone};
use crate::near::{DeviationSpread, NearContacts};

/// A wall about one reference cylinder. Only points that may come to touch it are evaluated, where that is certain.
#[derive(Debug, Clone)]
pub struct Disturbed {
    reference: Reference,
    radius_mm: f64,
    near: NearContacts,
    /// Direction, height, section and place in it of the points near.
    at: Vec<((f64, f64), f64, [usize; 2])>,
    /// The cylinder about the wall itself, and heights between which it is evaluated.
    cylinder: Cylinder,
    about: Values,
    heights_mm: [f64; 2],
    /// Of each section, what the form is above its deviations about LSCY; empty where errors move LSCY.
    offset_um: Vec<Vec<f64>>,
    zone: Option<Zone>,
}

impl Disturbed {
    /// `points` are those of the sections; `usual_um` is about the largest error of a draw. `centred` says that errors have no
    /// orders 0 and 1. `None` where the wall has no such cylinder.
    #[must_use]
    pub fn new(
        reference: Reference,
        sections: &[Section],
        points: &Points,
        radius_mm: f64,
        usual_um: f64,
        centred: bool,
    ) -> Option<Self> {
        let cylinder = points.reference(reference)?;
        let deviations: Vec<f64> = points.deviations_um(&cylinder).collect();
        let near = NearContacts::new(&deviations, cylinder.deviation_um, usual_um);
        let about = DeviationSpread::of(deviations.iter().copied()).into();
        let whole = deviations.iter().all(|deviation| !deviation.is_nan());
        // Errors of orders from 2 on are at right angles to what moves LSCY, on whole circles.
        let stays = reference == Reference::LeastSquares && centred && whole;
        let mut offset_um = Vec::new();
        let mut all = Vec::new();
        for (index, section) in sections.iter().enumerate() {
            let directions = section.angles.sin_cos().enumerate();
            all.extend(directions.map(|(point, direction)| (direction, section.z_mm, [index, point])));
            if stays {
                let deviations = &deviations[all.len() - section.form_um.len()..];
                offset_um
                    .push(section.form_um.iter().zip(deviations).map(|(form, deviation)| form - deviation).collect());
            }
        }
        let heights = || sections.iter().map(|section| section.z_mm);
        let forms = sections.iter().flat_map(|section| section.form_um).copied();
        let is_zone = reference == Reference::MinimumZone;
        let zone = if is_zone { Zone::new(points, forms, &cylinder) } else { None };
        let at = near.points.iter().map(|point| all[*point]).collect();
        let heights_mm = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
        Some(Self { reference, radius_mm, near, at, cylinder, about, heights_mm, offset_um, zone })
    }

    /// Values of the wall itself.
    #[must_use]
    pub fn about(&self) -> Values {
        self.about
    }

    /// Values of the wall with errors of at most `largest_um` in it. About other cylinders than LSCY, CYLq is that of the
    /// points evaluated, or NaN.
    #[must_use]
    pub fn values(&mut self, drawn: &[Section], largest_um: f64) -> Option<Values> {
        match self.reference {
            Reference::LeastSquares if !self.offset_um.is_empty() => {
                let each = drawn.iter().zip(&self.offset_um);
                let each = each.map(|(section, offset)| DeviationSpread::less(section.form_um, offset));
                each.reduce(DeviationSpread::and).map(Values::from)
            }
            Reference::LeastSquares => self.of_all(drawn),
            Reference::MinimumZone if self.zone.is_some() => {
                self.zone.as_mut().and_then(|zone| zone.values(drawn)).or_else(|| self.of_all(drawn))
            }
            _ => self.of_near(drawn, largest_um).or_else(|| self.of_all(drawn)),
        }
    }

    /// From the points evaluated; `None` where others could touch.
    fn of_near(&self, drawn: &[Section], largest_um: f64) -> Option<Values> {
        let near = self.at.iter().map(|(direction, z_mm, [section, point])| {
            let form_um = drawn.get(*section).and_then(|section| section.form_um.get(*point));
            (*direction, *z_mm, form_um.copied().unwrap_or(f64::NAN))
        });
        let points = Points::of(self.radius_mm, self.at.len(), near);
        let cylinder = points.reference_near(self.reference, &self.cylinder)?;
        let values = points.values(&cylinder);
        let ends = [cylinder.deviation_um - values.cylv_um, cylinder.deviation_um + values.cylp_um];
        self.near.suffice(ends, self.moved_um(&cylinder), largest_um).then_some(values)
    }

    /// How far the axis has moved at the end where it has moved most.
    fn moved_um(&self, cylinder: &Cylinder) -> f64 {
        let at = |cylinder: &Cylinder, z_mm: f64| {
            let height = 1e-3 * (z_mm - cylinder.z_mm);
            [cylinder.x_um + cylinder.slope_x_urad * height, cylinder.y_um + cylinder.slope_y_urad * height]
        };
        let moved = self.heights_mm.map(|z_mm| {
            let ([x, y], [now_x, now_y]) = (at(&self.cylinder, z_mm), at(cylinder, z_mm));
            (now_x - x).hypot(now_y - y)
        });
        moved[0].max(moved[1])
    }

    fn of_all(&self, drawn: &[Section]) -> Option<Values> {
        let points = Points::of_sections(self.radius_mm, drawn);
        let cylinder = points.reference(self.reference)?;
        Some(points.values(&cylinder))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::f64::consts::TAU;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::roundness::Angles;

    fn sections<'a>(rings: &'a [Vec<f64>], angles: &'a Angles) -> Vec<Section<'a>> {
        let ring = |(form_um, z): (&'a Vec<f64>, u32)| Section { z_mm: 7.0 * f64::from(z), angles, form_um };
        rings.iter().zip(0..).map(ring).collect()
    }

    #[test]
    fn values_are_those_of_all_points() {
        const COUNT: usize = 96;
        let angles = Angles::equal(COUNT);
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let mut wall_of = |amplitude: f64| -> Vec<Vec<f64>> {
            let mut ring = |_| -> Vec<f64> {
                let waves: Vec<(f64, f64)> = (2..20)
                    .map(|_| (amplitude * random.random_range(-1.0..1.0), random.random_range(0.0..TAU)))
                    .collect();
                let at = |angle: f64| {
                    waves.iter().zip(2..).map(|((a, phase), n)| a * (f64::from(n) * angle + phase).cos()).sum()
                };
                (0..COUNT).map(|point| at(point as f64 * TAU / COUNT as f64)).collect()
            };
            (0..5).map(&mut ring).collect()
        };
        for size in [1e-4, 0.01, 0.3] {
            let rings = wall_of(1.0);
            for reference in Reference::ALL {
                let wall = sections(&rings, &angles);
                let points = Points::of_sections(30.0, &wall);
                let mut disturbed = Disturbed::new(reference, &wall, &points, 30.0, 8.0 * size, true).unwrap();
                for _ in 0..10 {
                    let errors = wall_of(size);
                    let largest = errors.iter().flatten().fold(0.0, |a: f64, b| a.max(b.abs()));
                    let add =
                        |(ring, errors): (&Vec<f64>, &Vec<f64>)| ring.iter().zip(errors).map(|(a, b)| a + b).collect();
                    let drawn: Vec<Vec<f64>> = rings.iter().zip(&errors).map(add).collect();
                    let quick = disturbed.values(&sections(&drawn, &angles), largest).unwrap();
                    let points = Points::of_sections(30.0, &sections(&drawn, &angles));
                    let slow = points.values(&points.reference(reference).unwrap());
                    // Errors times the form, over R, are neglected about LSCY and MZCY.
                    let is_linear = [Reference::LeastSquares, Reference::MinimumZone].contains(&reference);
                    let exact = if is_linear { 2e-3 * size } else { 1e-8 };
                    assert!((quick.cylt_um - slow.cylt_um).abs() < exact, "{reference:?} {size} {quick:?} {slow:?}");
                    if reference == Reference::LeastSquares {
                        assert!((quick.cylq_um - slow.cylq_um).abs() < exact, "{size} {quick:?} {slow:?}");
                    }
                }
            }
        }
    }
}
