//! A profile whose errors are drawn again and again.

use super::{Angles, Points, Reference, Values};
use crate::evaluate::near::{Course, Near};

/// A profile about one reference circle. Only points that may come to touch it are looked at, where that is certain.
#[derive(Debug, Clone)]
pub struct Disturbed<'a> {
    reference: Reference,
    angles: &'a Angles,
    radius_mm: f64,
    near: Near,
    near_angles: Angles,
    /// Centre of the circle about the profile itself.
    centre_um: [f64; 2],
    /// What the form is above its deviations about LSCI; empty where errors move LSCI.
    offset_um: Vec<f64>,
    points: Points,
    form_um: Vec<f64>,
}

impl<'a> Disturbed<'a> {
    /// `usual_um` is about the largest error of a draw; errors have no orders 0 and 1. `None` where the profile has no such
    /// circle.
    #[must_use]
    pub fn new(
        reference: Reference,
        angles: &'a Angles,
        form_um: &[f64],
        radius_mm: f64,
        usual_um: f64,
    ) -> Option<Self> {
        let mut points = Points::default();
        points.set_profile(angles, form_um, radius_mm);
        let circle = points.reference(reference)?;
        let deviations: Vec<f64> = points.deviations_um(&circle).collect();
        let near = Near::new(&deviations, circle.deviation_um, usual_um);
        // Errors of orders from 2 on are at right angles to what moves LSCI, on all of the circle.
        let stays = reference == Reference::LeastSquares && deviations.iter().all(|deviation| !deviation.is_nan());
        let offset = form_um.iter().zip(&deviations).map(|(form, deviation)| form - deviation);
        Some(Self {
            reference,
            angles,
            radius_mm,
            near_angles: angles.select(&near.points),
            near,
            centre_um: [circle.x_um, circle.y_um],
            offset_um: if stays { offset.collect() } else { Vec::new() },
            points,
            form_um: Vec::new(),
        })
    }

    /// Values of the profile with errors of at most `largest_um` in it. About other circles than LSCI, RONq is that of the
    /// points looked at.
    pub fn values(&mut self, drawn_um: &[f64], largest_um: f64) -> Option<Values> {
        match self.reference {
            Reference::LeastSquares if self.offset_um.len() == drawn_um.len() => {
                Some(Course::less(drawn_um, &self.offset_um).into())
            }
            Reference::LeastSquares => self.of_all(drawn_um),
            _ => self.of_near(drawn_um, largest_um).or_else(|| self.of_all(drawn_um)),
        }
    }

    /// From the points looked at; `None` where others could touch.
    fn of_near(&mut self, drawn_um: &[f64], largest_um: f64) -> Option<Values> {
        self.form_um.clear();
        self.form_um.extend(self.near.points.iter().map(|point| drawn_um[*point]));
        self.points.set_profile(&self.near_angles, &self.form_um, self.radius_mm);
        let circle = self.points.reference(self.reference)?;
        let values = self.points.values(&circle);
        let moved = (circle.x_um - self.centre_um[0]).hypot(circle.y_um - self.centre_um[1]);
        let ends = [circle.deviation_um - values.ronv_um, circle.deviation_um + values.ronp_um];
        self.near.suffice(ends, moved, largest_um).then_some(values)
    }

    fn of_all(&mut self, drawn_um: &[f64]) -> Option<Values> {
        self.points.set_profile(self.angles, drawn_um, self.radius_mm);
        let circle = self.points.reference(self.reference)?;
        Some(self.points.values(&circle))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::f64::consts::TAU;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Errors of orders 2 to 30, from far below the form to above it.
    #[test]
    fn values_are_those_of_all_points() {
        const COUNT: usize = 256;
        let angles = Angles::equal(COUNT);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut wave = |amplitude: f64| -> Vec<f64> {
            let waves: Vec<(f64, f64)> =
                (2..31).map(|_| (amplitude * random.random_range(-1.0..1.0), random.random_range(0.0..TAU))).collect();
            let at = |angle: f64| {
                waves.iter().zip(2..).map(|((a, phase), n)| a * (f64::from(n) * angle + phase).cos()).sum()
            };
            (0..COUNT).map(|point| at(point as f64 * TAU / COUNT as f64)).collect()
        };
        for size in [1e-4, 0.01, 0.1, 1.0] {
            for with_gap in [false, true] {
                let mut form = wave(1.0);
                if with_gap {
                    form[20..40].fill(f64::NAN);
                }
                for reference in Reference::ALL {
                    let mut disturbed = Disturbed::new(reference, &angles, &form, 30.0, 10.0 * size).unwrap();
                    for _ in 0..20 {
                        let errors = wave(size);
                        let largest = errors.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
                        let drawn: Vec<f64> = form.iter().zip(&errors).map(|(form, error)| form + error).collect();
                        let quick = disturbed.values(&drawn, largest).unwrap();
                        let mut points = Points::default();
                        points.set_profile(&angles, &drawn, 30.0);
                        let slow = points.values(&points.reference(reference).unwrap());
                        // Form²/R is neglected about LSCI.
                        let exact = if reference == Reference::LeastSquares { 2e-3 * size } else { 1e-9 };
                        assert!(
                            (quick.ront_um - slow.ront_um).abs() < exact,
                            "{reference:?} {size} {quick:?} {slow:?}"
                        );
                        if reference == Reference::LeastSquares {
                            assert!((quick.ronp_um - slow.ronp_um).abs() < exact, "{size} {quick:?} {slow:?}");
                            assert!((quick.ronv_um - slow.ronv_um).abs() < exact, "{size} {quick:?} {slow:?}");
                            assert!((quick.ronq_um - slow.ronq_um).abs() < exact, "{size} {quick:?} {slow:?}");
                        }
                    }
                }
            }
        }
    }
}
