//! The minimum zone of a wall to which errors are added again and again.
//!
//! Near the axis of MZCY every deviation is linear in the axis, which errors move by about their own size; errors times
//! the form, over R, are neglected. The zone with errors is then the solution of one linear problem, sought from the contacts of the
//! last one among the points near the ends; a look at all points shows whether others have come to touch.

use super::{Cylinder, Points, Section, Values};
use crate::near::Near;
use runout_numerics::{
    chebyshev::{Chebyshev, Contact},
    cloud::Cloud,
};

/// Multipliers of the limits above this: the points do not hold the axis.
const ADRIFT: f64 = 1e-3;
/// The highest deviation less the lowest.
const ZONE: [f64; 6] = [0.0, 0.0, 0.0, 0.0, 1.0, -1.0];

#[derive(Debug, Clone)]
pub(super) struct Zone {
    /// Of each point its derivatives by the axis, and its deviation about the axis with the errors last added.
    all: Cloud<4>,
    /// What each point's deviation exceeds its form by.
    offset_um: Vec<f64>,
    /// Points that may come to touch, and their places among all.
    near: Cloud<4>,
    places: Vec<usize>,
    chebyshev: Chebyshev<4, 6>,
    limits: [(f64, f64); 4],
    tolerance: f64,
    /// Points that are there.
    count: usize,
}

impl Zone {
    /// `None` where the points do not fix an axis.
    pub(crate) fn new(
        points: &Points,
        forms_um: impl Iterator<Item = f64>,
        cylinder: &Cylinder,
        near: &Near,
    ) -> Option<Self> {
        let frame = points.frame(&points.axis_of(cylinder)?);
        let (mut all, mut offset_um) = (Cloud::default(), Vec::with_capacity(points.len()));
        all.reserve(points.len());
        for (point, form_um) in (0..points.len()).zip(forms_um) {
            // A missing point has the level NaN, and so has its deviation.
            let (deviation, slopes) = frame.with_slopes(points.held.at(point));
            all.push(slopes.map(|slope| -slope), deviation);
            offset_um.push(deviation - form_um);
        }
        let mut those_near = Cloud::default();
        near.points.iter().for_each(|point| those_near.push(all.features(*point), f64::NAN));
        let (tolerance, chebyshev) = (points.tolerance(), Chebyshev::new(true, true));
        let reach = 4.0 * points.span_um + tolerance;
        let limits = [(-reach, reach); 4];
        let (places, count) = (near.points.clone(), points.there().count());
        Some(Self { all, offset_um, near: those_near, places, chebyshev, limits, tolerance, count })
    }

    /// Values about the minimum zone of these sections, of the same points; CYLq is not looked for. `None` where the search has
    /// to begin anew.
    pub(crate) fn values(&mut self, drawn: &[Section]) -> Option<Values> {
        let forms = drawn.iter().flat_map(|section| section.form_um);
        let (_, levels) = self.all.columns_mut();
        levels.iter_mut().zip(forms.zip(&self.offset_um)).for_each(|(level, (form, offset))| *level = form + offset);
        let (_, near) = self.near.columns_mut();
        near.iter_mut().zip(&self.places).for_each(|(level, place)| *level = levels[*place]);
        let place = solve(&mut self.chebyshev, &self.near, &self.limits, self.tolerance)?;
        let (low, high) = self.near.extremes(0..self.near.len(), &place);
        let mut ends = self.all.extremes(0..self.all.len(), &place);
        if ends.0 < low - self.tolerance || ends.1 > high + self.tolerance {
            // Contacts among all points are no contacts among those near.
            let place = solve(&mut Chebyshev::new(true, true), &self.all, &self.limits, self.tolerance)?;
            ends = self.all.extremes(0..self.all.len(), &place);
        }
        let zone_um = ends.1 - ends.0;
        Some(Values {
            cylt_um: zone_um,
            cylp_um: 0.5 * zone_um,
            cylv_um: 0.5 * zone_um,
            cylq_um: f64::NAN,
            points: self.count,
        })
    }
}

/// The axis with the narrowest zone, where points and not limits hold it.
fn solve(
    chebyshev: &mut Chebyshev<4, 6>,
    cloud: &Cloud<4>,
    limits: &[(f64, f64); 4],
    tolerance: f64,
) -> Option<[f64; 4]> {
    let found = chebyshev.solve(cloud, &ZONE, limits, tolerance)?;
    let is_limit = |contact: &Contact| matches!(contact, Contact::Least(_) | Contact::Most(_));
    let adrift = found.contacts.iter().any(|(contact, multiplier)| is_limit(contact) && *multiplier > ADRIFT);
    (!adrift).then_some(found.place)
}
