//! The minimum zone of a wall to which errors are added again and again.
//!
//! NearContacts the axis of MZCY every deviation is linear in the axis, which errors move by about their own size; errors times
//! the form, over R, are neglected. The zone with errors is then the solution of one linear problem, sought among the points that are near
//! the ends about the axis of the last one; an evaluation of all points shows whether others touch.

use super::{Cylinder, Points, Section, Values};
use runout_numerics::{
    chebyshev::{Chebyshev, Contact},
    cloud::Cloud,
};

/// Multipliers of the limits above this: the points do not hold the axis.
const ADRIFT: f64 = 1e-3;
/// The highest deviation less the lowest.
const ZONE: [f64; 6] = [0.0, 0.0, 0.0, 0.0, 1.0, -1.0];
/// Shares of the zone within which points are near its ends, one after the other until no other point touches; the last holds all points.
const NEAR: [f64; 4] = [0.125, 0.25, 0.5, 1.0];

#[derive(Debug, Clone)]
pub(super) struct Zone {
    /// Of each point its derivatives by the axis, and its deviation about the axis with the errors last added.
    all: Cloud<4>,
    /// What each point's deviation exceeds its form by.
    offset_um: Vec<f64>,
    /// The axis last found.
    place: [f64; 4],
    /// Points near the ends, and their places among all.
    near: Cloud<4>,
    places: Vec<usize>,
    limits: [(f64, f64); 4],
    tolerance: f64,
    /// Points that are there.
    count: usize,
}

impl Zone {
    /// `None` where the points do not fix an axis.
    pub(crate) fn new(points: &Points, forms_um: impl Iterator<Item = f64>, cylinder: &Cylinder) -> Option<Self> {
        let frame = points.frame(&points.axis_of(cylinder)?);
        let (mut all, mut offset_um) = (Cloud::default(), Vec::with_capacity(points.len()));
        all.reserve(points.len());
        for (point, form_um) in (0..points.len()).zip(forms_um) {
            // A missing point has the level NaN, and so has its deviation.
            let (deviation, slopes) = frame.with_slopes(points.held.at(point));
            all.push(slopes.map(|slope| -slope), deviation);
            offset_um.push(deviation - form_um);
        }
        let tolerance = points.tolerance();
        let reach = 4.0 * points.span_um + tolerance;
        let (limits, count) = ([(-reach, reach); 4], points.there().count());
        let (place, near, places) = ([0.0; 4], Cloud::default(), Vec::new());
        Some(Self { all, offset_um, place, near, places, limits, tolerance, count })
    }

    /// Values about the minimum zone of these sections, of the same points; CYLq is not looked for. `None` where the points do not hold
    /// the axis.
    pub(crate) fn values(&mut self, drawn: &[Section]) -> Option<Values> {
        let forms = drawn.iter().flat_map(|section| section.form_um);
        let (_, levels) = self.all.columns_mut();
        levels.iter_mut().zip(forms.zip(&self.offset_um)).for_each(|(level, (form, offset))| *level = form + offset);
        let ends = NEAR.into_iter().find_map(|share| self.ends_among(share))?;
        let zone_um = ends[1] - ends[0];
        Some(Values {
            cylt_um: zone_um,
            cylp_um: 0.5 * zone_um,
            cylv_um: 0.5 * zone_um,
            cylq_um: f64::NAN,
            points: self.count,
        })
    }

    /// The ends of the narrowest zone among the points that are near the ends about the axis last found; `None` where others touch, or these do
    /// not hold the axis.
    fn ends_among(&mut self, share: f64) -> Option<[f64; 2]> {
        let (low, high) = self.all.extremes(0..self.all.len(), &self.place);
        let margin = share * (high - low);
        self.all.outside(&self.place, [low + margin, high - margin], &mut self.places);
        self.near.clear();
        for point in &self.places {
            self.near.push(self.all.features(*point), self.all.levels()[*point]);
        }
        let place = solve(&self.near, &self.limits, self.tolerance)?;
        let (low, high) = self.near.extremes(0..self.near.len(), &place);
        let ends = self.all.extremes(0..self.all.len(), &place);
        self.place = place;
        (ends.0 >= low - self.tolerance && ends.1 <= high + self.tolerance).then_some([ends.0, ends.1])
    }
}

/// The axis with the narrowest zone, where points and not limits hold it.
fn solve(cloud: &Cloud<4>, limits: &[(f64, f64); 4], tolerance: f64) -> Option<[f64; 4]> {
    let found = Chebyshev::new(true, true).solve(cloud, &ZONE, limits, tolerance)?;
    let is_limit = |contact: &Contact| matches!(contact, Contact::Least(_) | Contact::Most(_));
    let adrift = found.contacts.iter().any(|(contact, multiplier)| is_limit(contact) && *multiplier > ADRIFT);
    (!adrift).then_some(found.place)
}
