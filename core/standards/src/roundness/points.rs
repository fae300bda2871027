//! The points of a profile, and what they are about a circle.

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use std::{cell::RefCell, f64::consts::TAU, rc::Rc};

use super::{Circle, Values};
use crate::near::DeviationSpread;
use runout_numerics::{
    cloud::Cloud,
    lanes::{NullaryFnOnce, vectorised},
};

/// Sets of equal angles that are kept: those of the filters of one section.
const MOST_SHARED: usize = 8;

thread_local! {
    /// Profiles of one recording mostly ask for the same.
    static SHARED: RefCell<Vec<Rc<Angles>>> = const { RefCell::new(Vec::new()) };
}

/// Directions of a profile's points, to be kept and used for many profiles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Angles {
    cos: Vec<f64>,
    sin: Vec<f64>,
}

impl Angles {
    /// `count` equal steps from 0 on.
    #[must_use]
    pub fn equal(count: usize) -> Self {
        (0..count).map(|index| TAU * index as f64 / count as f64).collect()
    }

    /// Sine and cosine of each.
    pub fn sin_cos(&self) -> impl Iterator<Item = (f64, f64)> + Clone + '_ {
        self.sin.iter().copied().zip(self.cos.iter().copied())
    }

    /// `count` equal steps from 0 on, computed once and shared by all that ask on this thread.
    #[must_use]
    pub fn shared(count: usize) -> Rc<Self> {
        SHARED.with_borrow_mut(|shared| {
            if let Some(angles) = shared.iter().find(|angles| angles.len() == count) {
                return Rc::clone(angles);
            }
            let angles = Rc::new(Self::equal(count));
            shared.truncate(MOST_SHARED - 1);
            shared.insert(0, Rc::clone(&angles));
            angles
        })
    }

    /// Number of angles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cos.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cos.is_empty()
    }

    /// Becomes others, each turned by at most a quarter of a radian: sine and cosine by their series, right to 1e-12.
    pub(super) fn set_aside(&mut self, angles: &Self, aside_rad: &[f64]) {
        let count = aside_rad.len().min(angles.cos.len());
        self.cos.resize(count, 0.0);
        self.sin.resize(count, 0.0);
        let turned = self.cos.iter_mut().zip(&mut self.sin);
        let all = angles.cos.iter().zip(&angles.sin).zip(aside_rad);
        for ((to_cos, to_sin), ((cos, sin), aside)) in turned.zip(all) {
            let square = aside * aside;
            let less = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
            let across = aside * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
            (*to_cos, *to_sin) = (less * cos - across * sin, less * sin + across * cos);
        }
    }

    /// Those of some points.
    pub(super) fn select(&self, points: &[usize]) -> Self {
        let [cos, sin] = [&self.cos, &self.sin].map(|all| points.iter().map(|point| all[*point]).collect());
        Self { cos, sin }
    }
}

/// From angles in rad.
impl FromIterator<f64> for Angles {
    fn from_iter<T: IntoIterator<Item = f64>>(angles: T) -> Self {
        let (sin, cos) = angles.into_iter().map(f64::sin_cos).unzip();
        Self { cos, sin }
    }
}

/// Points of a profile; memory is reused from one profile to the next.
///
/// A point p is held as f = p/R and w = (|p|² − R²)/2R. Its squared distance ρ² from a centre c is then
/// R² + 2R·(w − f·c + |c|²/2R): linear in c up to a term that all points share, without cancellation, and exact. A
/// deviation that is not a finite number is a point that is missing (a lost angle, a keyway).
#[derive(Debug, Clone, Default)]
pub struct Points {
    pub(super) cloud: Cloud<2>,
    pub(super) radius_um: f64,
    pub(super) origin_um: [f64; 2],
    /// The largest |w|.
    pub(super) span_um: f64,
}

/// Where points of a profile are put.
struct Profile<'a> {
    u: &'a mut [f64],
    v: &'a mut [f64],
    levels: &'a mut [f64],
    form_um: &'a [f64],
    cos: &'a [f64],
    sin: &'a [f64],
    radius_um: f64,
}

impl NullaryFnOnce for Profile<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { u, v, levels, form_um, cos, sin, radius_um } = self;
        let (per_radius, half) = (radius_um.recip(), 0.5 / radius_um);
        for (level, form) in levels.iter_mut().zip(form_um) {
            // An infinite form is no point either.
            *level = if form.abs() < f64::INFINITY { form + form * form * half } else { f64::NAN };
        }
        for (column, direction) in [(u, cos), (v, sin)] {
            for ((feature, direction), form) in column.iter_mut().zip(direction).zip(form_um) {
                let scale = if form.abs() < f64::INFINITY { 1.0 + form * per_radius } else { 0.0 };
                *feature = scale * direction;
            }
        }
    }
}

impl Points {
    /// Takes a profile: radial deviations `form_um` from a circle of `radius_mm` (positive), one at each angle.
    ///
    /// Deviations may be as large as the radius: for a polar plot, `radius_mm` is its base circle.
    pub fn set_profile(&mut self, angles: &Angles, form_um: &[f64], radius_mm: f64) {
        let radius_um = 1e3 * radius_mm;
        (self.radius_um, self.origin_um) = (radius_um, [0.0; 2]);
        let ([u, v], levels) = self.cloud.columns_mut();
        let count = form_um.len().min(angles.len());
        for column in [&mut *u, &mut *v, &mut *levels] {
            column.resize(count, 0.0);
        }
        let form_um = &form_um[..count];
        vectorised(Profile { u, v, levels, form_um, cos: &angles.cos[..count], sin: &angles.sin[..count], radius_um });
        self.measure();
    }

    /// Takes points of the plane, in any order; the mean distance from their centroid serves as nominal radius.
    pub fn set_plane(&mut self, x_um: &[f64], y_um: &[f64]) {
        let there = || x_um.iter().zip(y_um).filter(|(x, y)| x.is_finite() && y.is_finite());
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / there().count().max(1) as f64;
        let [x0, y0] = [mean(&mut there().map(|(x, _)| *x)), mean(&mut there().map(|(_, y)| *y))];
        let radius = mean(&mut there().map(|(x, y)| (x - x0).hypot(y - y0)));
        let radius = if radius > 0.0 { radius } else { 1.0 };
        (self.radius_um, self.origin_um) = (radius, [x0, y0]);
        self.cloud.clear();
        for (x, y) in x_um.iter().zip(y_um) {
            let distance = (x - x0).hypot(y - y0);
            if distance.is_finite() {
                let level = (distance - radius) * (distance + radius) / (2.0 * radius);
                self.cloud.push([(x - x0) / radius, (y - y0) / radius], level);
            } else {
                self.cloud.push([0.0; 2], f64::NAN);
            }
        }
        self.measure();
    }

    /// Adds a point of a profile.
    pub(super) fn push(&mut self, angle_rad: f64, form_um: f64) {
        let ((sin, cos), scale) = (angle_rad.sin_cos(), 1.0 + form_um / self.radius_um);
        let level = form_um + form_um * form_um / (2.0 * self.radius_um);
        self.cloud.push([scale * cos, scale * sin], level);
        self.span_um = self.span_um.max(level.abs());
    }

    fn measure(&mut self) {
        let (low, high) = self.cloud.extremes(0..self.cloud.len(), &[0.0; 2]);
        self.span_um = if high < low { 0.0 } else { high.abs().max(low.abs()) };
    }

    /// The nominal radius R.
    #[must_use]
    pub fn radius_um(&self) -> f64 {
        self.radius_um
    }

    /// Points, those that are missing included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cloud.len()
    }

    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cloud.is_empty()
    }

    /// Share of the points that are there.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        self.there() as f64 / self.len() as f64
    }

    pub(super) fn there(&self) -> usize {
        self.cloud.levels().iter().filter(|level| !level.is_nan()).count()
    }

    /// Deviation of each point from a circle, outward positive; NaN where it is missing.
    pub fn deviations_um<'a>(&'a self, circle: &Circle) -> impl Iterator<Item = f64> + 'a {
        let place = [circle.x_um - self.origin_um[0], circle.y_um - self.origin_um[1]];
        let (common, deviation) = (self.common(&place), circle.deviation_um);
        let [u, v] = [self.cloud.column(0), self.cloud.column(1)];
        let points = self.cloud.levels().iter().zip(u.iter().zip(v));
        points.map(move |(w, (u, v))| self.deviation(w - u * place[0] - v * place[1] + common) - deviation)
    }

    /// RONt, RONp, RONv and RONq about a circle; NaN where no point is there.
    #[must_use]
    pub fn values(&self, circle: &Circle) -> Values {
        DeviationSpread::of(self.deviations_um(circle)).into()
    }

    /// |c|²/2R, which all heights over a centre lack to (ρ² − R²)/2R.
    pub(super) fn common(&self, place: &[f64; 2]) -> f64 {
        (place[0] * place[0] + place[1] * place[1]) / (2.0 * self.radius_um)
    }

    /// ρ/R of (ρ² − R²)/2R.
    pub(super) fn stretch(&self, lifted: f64) -> f64 {
        (1.0 + 2.0 * lifted / self.radius_um).max(0.0).sqrt()
    }

    /// ρ − R of (ρ² − R²)/2R.
    pub(super) fn deviation(&self, lifted: f64) -> f64 {
        2.0 * lifted / (1.0 + self.stretch(lifted))
    }

    /// Heights that differ by less are equal: rounding of coordinates.
    pub(super) fn tolerance(&self) -> f64 {
        4.0 * f64::EPSILON * (self.radius_um + self.span_um)
    }

    /// A circle about a place of the cloud.
    pub(super) fn about(&self, place: [f64; 2], deviation_um: f64, [outer, inner]: [Vec<usize>; 2]) -> Circle {
        let [x_um, y_um] = [place[0] + self.origin_um[0], place[1] + self.origin_um[1]];
        Circle { x_um, y_um, deviation_um, outer, inner }
    }
}
