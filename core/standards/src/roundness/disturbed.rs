//! A profile whose errors are drawn again and again.

use std::f64::consts::TAU;

use super::{
    Angles, Circle, Points, Reference, Values,
    crests::{Crests, LIFT, around},
    search,
    warm::{NearbyCircle, Warm},
};
use crate::near::{DeviationSpread, NearContacts};
use runout_draws::DrawnErrors;

/// A profile about one reference circle, with its crests between the angles. Only points that may come to touch it are looked
/// at, where that is certain.
#[derive(Debug, Clone)]
pub struct Disturbed<'a> {
    reference: Reference,
    /// Whether crests lie between the angles.
    between: bool,
    angles: &'a Angles,
    form_um: &'a [f64],
    radius_mm: f64,
    near: NearContacts,
    near_angles: Angles,
    /// Centre of the circle about the profile itself.
    centre_um: [f64; 2],
    about: Values,
    search: Option<Warm>,
    points: Points,
    drawn_um: Vec<f64>,
    crests: Crests,
}

/// Seeks the reference circles of profiles that differ little, each from that of the last.
#[derive(Debug, Clone)]
pub struct CircleSearch<'a> {
    reference: Reference,
    /// Whether crests lie between the angles.
    between: bool,
    angles: &'a Angles,
    radius_mm: f64,
    search: Option<Warm>,
    /// Points of the last profile, and its circle's centre.
    last: Option<(usize, [f64; 2])>,
}

impl<'a> CircleSearch<'a> {
    /// Crests are those between the angles where `between`, else the highest and lowest at an angle.
    #[must_use]
    pub fn new(reference: Reference, angles: &'a Angles, radius_mm: f64, between: bool) -> Self {
        Self { reference, between, angles, radius_mm, search: Warm::new(reference), last: None }
    }

    /// The circle of the next profile. A profile far from a circle may have several, among which the last one decides nothing.
    fn circle(&mut self, points: &Points) -> Option<Circle> {
        let warm = match (&mut self.search, self.last) {
            (Some(search), Some((count, last_um))) if count == points.len() && !search::is_wide(points) => {
                search.values(points, last_um)
            }
            _ => None,
        };
        let circle = match warm {
            Some(found) => points.about(found.place, found.level_um(self.reference), [Vec::new(), Vec::new()]),
            None => points.reference(self.reference)?,
        };
        if self.last.is_some_and(|(count, _)| count != points.len()) {
            // Its contacts are places among other points.
            self.search = Warm::new(self.reference);
        }
        self.last = Some((points.len(), [circle.x_um, circle.y_um]));
        Some(circle)
    }

    /// A profile about its circle. `usual_um` is about the largest error of a draw; errors have no orders 0 and 1. `None` where the
    /// profile has no such circle.
    #[must_use]
    pub fn disturbed(&mut self, form_um: &'a [f64], usual_um: f64) -> Option<Disturbed<'a>> {
        let (reference, between, angles, radius_mm) = (self.reference, self.between, self.angles, self.radius_mm);
        let (mut points, mut crests) = (Points::default(), Crests::default());
        let of_angles = reference == Reference::LeastSquares;
        if of_angles || !between {
            points.set_profile(angles, form_um, radius_mm);
        } else {
            set_crests(&mut points, &mut crests, angles, form_um, radius_mm);
        }
        let circle = self.circle(&points)?;
        let raw: Vec<f64> = points.deviations_um(&circle).collect();
        if of_angles && between {
            crests.set_all(&raw);
        }
        let deviations = if of_angles && between { &crests.heights } else { &raw };
        let near = NearContacts::new(deviations, circle.deviation_um, usual_um);
        let ends = DeviationSpread::of(deviations.iter().copied());
        let about = DeviationSpread { squares: DeviationSpread::of(raw.iter().copied()).squares, ..ends }.into();
        Some(Disturbed {
            reference,
            between,
            angles,
            form_um,
            radius_mm,
            near_angles: angles.select(&near.points),
            near,
            centre_um: [circle.x_um, circle.y_um],
            about,
            search: Warm::new(reference),
            points,
            drawn_um: Vec::new(),
            crests,
        })
    }
}

impl Disturbed<'_> {
    /// Values of the profile itself.
    #[must_use]
    pub fn about(&self) -> Values {
        self.about
    }

    /// Values of the profile with errors in it. RONq is that of all points about LSCI of an interrupted profile, or where crests are at the
    /// angles; else that of the points evaluated, or NaN.
    pub fn values(&mut self, drawn: &DrawnErrors) -> Option<Values> {
        if self.reference == Reference::LeastSquares {
            return self.of_all(drawn);
        }
        let anew = |own: &mut Self| own.anew((1.0 + LIFT) * drawn.largest_um());
        self.of_near(drawn).or_else(|| anew(self)).or_else(|| self.of_all(drawn))
    }

    /// From the points evaluated; `None` where others could touch.
    fn of_near(&mut self, drawn: &DrawnErrors) -> Option<Values> {
        let (form_um, step_rad, between) = (self.form_um, self.step_rad(), self.between);
        let heights =
            |point: &usize| beside(between, *point, form_um.len()).map(|point| form_um[point] + drawn.at(point));
        self.crests.set(self.near.points.iter().map(heights), step_rad);
        self.touching((1.0 + LIFT) * drawn.largest_um())
    }

    /// Between two angles.
    fn step_rad(&self) -> f64 {
        TAU / self.form_um.len() as f64
    }

    /// From the contacts of the last draw.
    fn touching(&mut self, largest_um: f64) -> Option<Values> {
        self.crests.set_profile(&self.near_angles, &mut self.points, self.radius_mm);
        let NearbyCircle { values, place, ends_um } = self.search.as_mut()?.values(&self.points, self.centre_um)?;
        let moved = (place[0] - self.centre_um[0]).hypot(place[1] - self.centre_um[1]);
        self.near.suffice(ends_um, moved, largest_um).then_some(values)
    }

    /// From the contacts of the last draw, by a new search for the circle; `None` where others could touch.
    fn anew(&mut self, largest_um: f64) -> Option<Values> {
        let circle = self.points.reference(self.reference)?;
        let values = self.points.values(&circle);
        let ends_um = [circle.deviation_um - values.ronv_um, circle.deviation_um + values.ronp_um];
        let moved = (circle.x_um - self.centre_um[0]).hypot(circle.y_um - self.centre_um[1]);
        self.near.suffice(ends_um, moved, largest_um).then_some(values)
    }

    fn of_all(&mut self, drawn: &DrawnErrors) -> Option<Values> {
        drawn.added_to(self.form_um, &mut self.drawn_um);
        if self.reference == Reference::LeastSquares {
            self.points.set_profile(self.angles, &self.drawn_um, self.radius_mm);
            let circle = self.points.reference(self.reference)?;
            self.drawn_um.clear();
            self.drawn_um.extend(self.points.deviations_um(&circle));
            let between = self.between;
            let count = self.drawn_um.len();
            let drawn_um = &self.drawn_um;
            let heights = (0..count).map(|point| beside(between, point, count).map(|point| drawn_um[point]));
            self.crests.set(heights, TAU / count as f64);
            let ends = DeviationSpread::of(self.crests.heights.iter().copied());
            return Some(
                DeviationSpread { squares: DeviationSpread::of(self.drawn_um.iter().copied()).squares, ..ends }.into(),
            );
        }
        if self.between {
            set_crests(&mut self.points, &mut self.crests, self.angles, &self.drawn_um, self.radius_mm);
        } else {
            self.points.set_profile(self.angles, &self.drawn_um, self.radius_mm);
        }
        let circle = self.points.reference(self.reference)?;
        Some(self.points.values(&circle))
    }
}

/// A point's number between those of its neighbours; thrice its own where crests lie at the angles.
fn beside(between: bool, point: usize, count: usize) -> [usize; 3] {
    if between { around(point, count) } else { [point; 3] }
}

/// Takes a profile with its crests where they are.
fn set_crests(points: &mut Points, crests: &mut Crests, angles: &Angles, form_um: &[f64], radius_mm: f64) {
    crests.set_all(form_um);
    crests.set_profile(angles, points, radius_mm);
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Of profiles from alike to quite different, one of them shorter and one wide, with and without a gap.
    #[test]
    fn circles_from_the_last_are_those_sought_anew() {
        const COUNT: usize = 256;
        let angles = Angles::equal(COUNT);
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for with_gap in [false, true] {
            let mut forms: Vec<Vec<f64>> = vec![vec![0.0; COUNT]];
            for size in [1.0, 1e-4, 0.01, 0.1, 1.0, 1e-6, 300.0, 1.0] {
                let mut form = forms[forms.len() - 1].clone();
                for n in 2..20 {
                    let (a, phase) = (size * random.random_range(-1.0..1.0), random.random_range(0.0..TAU));
                    let wave = |point: usize| a * ((n * point) as f64 * TAU / COUNT as f64 + phase).cos();
                    form.iter_mut().enumerate().for_each(|(point, form)| *form += wave(point));
                }
                if with_gap {
                    form[20..40].fill(f64::NAN);
                }
                forms.push(form);
            }
            forms.remove(0);
            let short = forms[3][..200].to_vec();
            forms.insert(4, short);
            for (reference, between) in Reference::ALL.into_iter().flat_map(|one| [(one, false), (one, true)]) {
                let mut search = CircleSearch::new(reference, &angles, 30.0, between);
                for (place, form) in forms.iter().enumerate() {
                    let found = search.disturbed(form, 0.1).map(|found| found.about().ront_um);
                    let mut anew = CircleSearch::new(reference, &angles, 30.0, between);
                    let expected = anew.disturbed(form, 0.1).map(|found| found.about().ront_um);
                    let (found, expected) = (found.unwrap(), expected.unwrap());
                    assert!(
                        (found - expected).abs() < 1e-6 * expected,
                        "{reference:?} {between} {with_gap} {place}: {found} {expected}"
                    );
                }
            }
        }
    }

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
                    let mut search = CircleSearch::new(reference, &angles, 30.0, true);
                    let mut disturbed = search.disturbed(&form, 10.0 * size).unwrap();
                    for _ in 0..20 {
                        let errors = wave(size);
                        let drawn: Vec<f64> = form.iter().zip(&errors).map(|(form, error)| form + error).collect();
                        let drawn_errors = DrawnErrors::new(&errors);
                        let quick = disturbed.values(&drawn_errors).unwrap();
                        let (mut points, mut crests) = (Points::default(), Crests::default());
                        let slow: Values = if reference == Reference::LeastSquares {
                            points.set_profile(&angles, &drawn, 30.0);
                            let circle = points.reference(reference).unwrap();
                            let deviations: Vec<f64> = points.deviations_um(&circle).collect();
                            crests.set_all(&deviations);
                            let squares = DeviationSpread::of(deviations.into_iter()).squares;
                            DeviationSpread { squares, ..DeviationSpread::of(crests.heights.iter().copied()) }.into()
                        } else {
                            set_crests(&mut points, &mut crests, &angles, &drawn, 30.0);
                            points.values(&points.reference(reference).unwrap())
                        };
                        // Form²/R is neglected about LSCI.
                        let exact = if reference == Reference::LeastSquares { 2e-3 * size } else { 1e-9 };
                        assert!(
                            (quick.ront_um - slow.ront_um).abs() < exact,
                            "{reference:?} {size} {quick:?} {slow:?}"
                        );
                        if reference == Reference::LeastSquares {
                            assert!((quick.ronp_um - slow.ronp_um).abs() < exact, "{size} {quick:?} {slow:?}");
                            assert!((quick.ronv_um - slow.ronv_um).abs() < exact, "{size} {quick:?} {slow:?}");
                        }
                    }
                }
            }
        }
    }
}
