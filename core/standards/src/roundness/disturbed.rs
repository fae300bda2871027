//! A profile whose errors are drawn again and again.

use super::{
    Angles, FixedCentre, Points, Reference, Values,
    warm::{Found, Warm},
};
use crate::{
    near::{Course, Near},
    uncertainty::DrawnErrors,
};

/// A profile about one reference circle. Only points that may come to touch it are looked at, where that is certain.
#[derive(Debug, Clone)]
pub struct Disturbed<'a> {
    reference: Reference,
    angles: &'a Angles,
    form_um: &'a [f64],
    radius_mm: f64,
    near: Near,
    near_angles: Angles,
    /// Centre of the circle about the profile itself.
    centre_um: [f64; 2],
    about: Values,
    /// Where errors move LSCI by nothing.
    fixed: Option<FixedCentre>,
    search: Option<Warm>,
    points: Points,
    drawn_um: Vec<f64>,
}

impl<'a> Disturbed<'a> {
    /// `usual_um` is about the largest error of a draw; errors have no orders 0 and 1. `None` where the profile has no such
    /// circle.
    #[must_use]
    pub fn new(
        reference: Reference,
        angles: &'a Angles,
        form_um: &'a [f64],
        radius_mm: f64,
        usual_um: f64,
    ) -> Option<Self> {
        let mut points = Points::default();
        points.set_profile(angles, form_um, radius_mm);
        let circle = points.reference(reference)?;
        let deviations: Vec<f64> = points.deviations_um(&circle).collect();
        let near = Near::new(&deviations, circle.deviation_um, usual_um);
        let about = Course::of(deviations.iter().copied()).into();
        // Errors of orders from 2 on are at right angles to what moves LSCI, on all of the circle.
        let stays = reference == Reference::LeastSquares && deviations.iter().all(|deviation| !deviation.is_nan());
        Some(Self {
            reference,
            angles,
            form_um,
            radius_mm,
            near_angles: angles.select(&near.points),
            near,
            centre_um: [circle.x_um, circle.y_um],
            about,
            fixed: stays.then(|| FixedCentre::new(deviations)),
            search: Warm::new(reference),
            points,
            drawn_um: Vec::new(),
        })
    }

    /// Values of the profile itself.
    #[must_use]
    pub fn about(&self) -> Values {
        self.about
    }

    /// Values of the profile with errors in it. About other circles than LSCI, RONq is that of the points looked at, or NaN.
    pub fn values(&mut self, drawn: &DrawnErrors) -> Option<Values> {
        match (self.reference, &self.fixed) {
            (Reference::LeastSquares, Some(fixed)) => Some(fixed.values(drawn)),
            (Reference::LeastSquares, None) => self.of_all(drawn),
            _ => self.of_near(drawn).or_else(|| self.anew(drawn.largest_um())).or_else(|| self.of_all(drawn)),
        }
    }

    /// The points that may come to touch.
    #[must_use]
    pub fn points(&self) -> &[usize] {
        &self.near.points
    }

    /// Values of the profile with these errors at its [`points`](Self::points), where no error is above `largest_um`; RONq is NaN.
    /// `None` where other points could touch, or about LSCI of an interrupted profile.
    pub fn values_at(&mut self, errors_um: &[f64], largest_um: f64) -> Option<Values> {
        if let Some(fixed) = &self.fixed {
            return Some(fixed.values_at(&self.near.points, errors_um));
        }
        self.drawn_um.clear();
        let errors = self.near.points.iter().zip(errors_um);
        self.drawn_um.extend(errors.map(|(point, error)| self.form_um[*point] + error));
        if self.reference == Reference::LeastSquares {
            return None;
        }
        self.touching(largest_um).or_else(|| self.anew(largest_um))
    }

    /// From the points looked at; `None` where others could touch.
    fn of_near(&mut self, drawn: &DrawnErrors) -> Option<Values> {
        self.drawn_um.clear();
        self.drawn_um.extend(self.near.points.iter().map(|point| self.form_um[*point] + drawn.at(*point)));
        self.touching(drawn.largest_um())
    }

    /// From the contacts of the last draw.
    fn touching(&mut self, largest_um: f64) -> Option<Values> {
        self.points.set_profile(&self.near_angles, &self.drawn_um, self.radius_mm);
        let Found { values, place, ends_um } = self.search.as_mut()?.values(&self.points, self.centre_um)?;
        let moved = (place[0] - self.centre_um[0]).hypot(place[1] - self.centre_um[1]);
        self.near.suffice(ends_um, moved, largest_um).then_some(values)
    }

    /// The same, sought anew.
    fn anew(&mut self, largest_um: f64) -> Option<Values> {
        let circle = self.points.reference(self.reference)?;
        let values = self.points.values(&circle);
        let ends_um = [circle.deviation_um - values.ronv_um, circle.deviation_um + values.ronp_um];
        let moved = (circle.x_um - self.centre_um[0]).hypot(circle.y_um - self.centre_um[1]);
        self.near.suffice(ends_um, moved, largest_um).then_some(values)
    }

    fn of_all(&mut self, drawn: &DrawnErrors) -> Option<Values> {
        self.drawn_um.clear();
        self.drawn_um.extend(self.form_um.iter().zip(drawn.iter()).map(|(form, error)| form + error));
        self.points.set_profile(self.angles, &self.drawn_um, self.radius_mm);
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
                        let drawn: Vec<f64> = form.iter().zip(&errors).map(|(form, error)| form + error).collect();
                        let drawn_errors = DrawnErrors::new(&errors);
                        let quick = disturbed.values(&drawn_errors).unwrap();
                        let near: Vec<f64> = disturbed.points().iter().map(|point| errors[*point]).collect();
                        if let Some(at) = disturbed.values_at(&near, drawn_errors.largest_um()) {
                            assert!((at.ront_um - quick.ront_um).abs() < 1e-9, "{reference:?} {size} {at:?} {quick:?}");
                            assert!((at.ronp_um - quick.ronp_um).abs() < 1e-9, "{reference:?} {size} {at:?} {quick:?}");
                        }
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
