//! Which reference circle of a profile is found how, and values that are found faster near one that is known.

use super::{Circle, Points, Reference, Undetermined, Values, circumscribed, least_squares, search};
use crate::near::DeviationSpread;
use runout_numerics::lanes::vectorised;

impl Points {
    /// The reference circle as [`determine`](Self::determine) finds it, without the reason where there is none.
    #[must_use]
    pub fn reference(&self, reference: Reference) -> Option<Circle> {
        self.determine(reference).ok()
    }

    /// The reference circle.
    ///
    /// MZCI and MICI are those whose centre is reached downhill (uphill) from that of the algebraic least-squares circle
    /// (Kåsa). Where deviations are small beside the radius there is no better one. A profile that is far from a circle
    /// (a polar plot with the base circle's size) may have several of them, as a kidney has several inscribed circles: from
    /// deviations of 2 % of the radius on, the search also starts at the best places of a grid, and the best circle is taken.
    ///
    /// # Errors
    /// Fewer than three points (two for MCCI); a nominal radius that is not a positive number; points that do not surround a
    /// centre, of which the inscribed circle or the zone grows without bound.
    pub fn determine(&self, reference: Reference) -> Result<Circle, Undetermined> {
        if !(self.radius_um > 0.0 && self.radius_um.is_finite()) {
            return Err(Undetermined::Radius);
        }
        if self.there() < if reference == Reference::MinimumCircumscribed { 2 } else { 3 } {
            return Err(Undetermined::TooFewPoints);
        }
        match reference {
            Reference::LeastSquares => least_squares::circle(self).ok_or(Undetermined::NotFound),
            Reference::MinimumZone => search::minimum_zone(self),
            Reference::MaximumInscribed => search::maximum_inscribed(self),
            Reference::MinimumCircumscribed => circumscribed::circle(self).ok_or(Undetermined::NotFound),
        }
    }

    /// Peak to valley about a circle.
    pub(super) fn ront_um(&self, circle: &Circle) -> f64 {
        let [low, high] = self.ends_um(circle);
        high - low
    }

    /// Lowest and highest deviation from a circle.
    fn ends_um(&self, circle: &Circle) -> [f64; 2] {
        let place = [circle.x_um - self.origin_um[0], circle.y_um - self.origin_um[1]];
        let common = self.common(&place);
        let (low, high) = self.cloud.extremes(0..self.len(), &place);
        [low, high].map(|height| self.deviation(height + common) - circle.deviation_um)
    }

    /// Values about a circle, RONq of the first `count` points, the others of all.
    pub(super) fn values_of_first(&self, circle: &Circle, count: usize) -> Values {
        let place = [circle.x_um - self.origin_um[0], circle.y_um - self.origin_um[1]];
        let common = self.common(&place);
        let [low, high] = self.ends_um(circle);
        let [u, v] = [self.cloud.column(0), self.cloud.column(1)].map(|column| &column[..count]);
        let squares = least_squares::Squares {
            levels: &self.cloud.levels()[..count],
            directions: [u, v],
            place,
            common,
            radius_um: self.radius_um,
            deviation_um: circle.deviation_um,
        };
        let (squares, points) = vectorised(squares);
        if points == 0 {
            DeviationSpread::of([].into_iter()).into()
        } else {
            DeviationSpread { low, high, squares, points }.into()
        }
    }
}
