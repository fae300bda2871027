//! Which reference cylinder of a wall is found how.

use super::{Cylinder, Points, Reference, Undetermined, columns::Axis, least_squares, search};

impl Points {
    /// The reference cylinder as [`determine`](Self::determine) finds it, without the reason where there is none.
    #[must_use]
    pub fn reference(&self, reference: Reference) -> Option<Cylinder> {
        self.determine(reference).ok()
    }

    /// The reference cylinder. MZCY, MICY and MCCY are the local optimum that is reached downhill from LSCY; none is worse
    /// than LSCY by its own criterion.
    ///
    /// The largest inscribed and the smallest circumscribed cylinder often leave their axis free: contacts at one height do
    /// not fix the tilt. The zone (CYLt) then decides, with a small weight in what is minimised: MCCY is the axis with the
    /// least `high` + 10⁻³ (`high` − `low`), MICY that with the least 10⁻³ (`high` − `low`) − `low`, of the highest and the
    /// lowest distance of a point. The radius is the extreme one to 10⁻³ of the zone; it is exactly that wherever
    /// the contacts fix the axis.
    ///
    /// # Errors
    /// Fewer than five points, all at one height, points that do not surround an axis (not for MCCY), or deviations as large
    /// as the radius, beside which they are taken to be small.
    pub fn determine(&self, reference: Reference) -> Result<Cylinder, Undetermined> {
        if self.there().count() < 5 {
            return Err(Undetermined::TooFewPoints);
        }
        if !(self.half_um > 0.0 && self.half_um.is_finite()) {
            return Err(Undetermined::OneHeight);
        }
        if !(self.radius_um > 0.0 && self.span_um < self.radius_um) {
            return Err(Undetermined::Radius);
        }
        let least_squares = self.least_squares.get_or_init(|| least_squares::axis(self));
        let (axis, deviation) = least_squares.ok_or(Undetermined::NotFound)?;
        match reference {
            Reference::LeastSquares => Ok(self.about(axis, deviation, vec![])),
            _ => search::search(self, axis, reference),
        }
    }

    /// The axis of a cylinder at the middle of these points, and its lean; `None` where they lie at one height.
    pub(super) fn axis_of(&self, cylinder: &Cylinder) -> Option<Axis> {
        let lean = [cylinder.slope_x_urad, cylinder.slope_y_urad].map(|slope| 1e-6 * slope * self.half_um);
        let up = 1e-3 * (self.middle_mm - cylinder.z_mm);
        let at = [cylinder.x_um + cylinder.slope_x_urad * up, cylinder.y_um + cylinder.slope_y_urad * up];
        let determined = self.half_um > 0.0 && self.half_um.is_finite();
        determined.then_some([at[0], at[1], lean[0], lean[1]])
    }

    /// MZCY, MICY or MCCY, reached downhill from the axis of a cylinder nearby.
    pub(super) fn reference_near(&self, reference: Reference, near: &Cylinder) -> Option<Cylinder> {
        search::search(self, self.axis_of(near)?, reference).ok()
    }
}
