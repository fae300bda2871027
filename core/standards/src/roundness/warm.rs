//! Reference circles of profiles that are drawn about one another: each is sought from the contacts of the last.

use super::{Points, Reference, Values, search};
use runout_numerics::chebyshev::{Chebyshev, Contact};

/// Multipliers below this share of a whole: two contacts are nearly opposite, and the curvature of the circle decides, or another
/// circle is as good.
const DOUBTFUL: f64 = 1e-3;
/// Times that the contacts may change as the place moves.
const MOST_STEPS: usize = 4;

/// A search that keeps its contacts.
#[derive(Debug, Clone)]
pub(super) enum Warm {
    /// MZCI.
    Zone(Chebyshev<2, 4>),
    /// MICI (false) or MCCI (true).
    OneSided(bool, Chebyshev<2, 3>),
}

/// What was found near a place.
pub(super) struct NearbyCircle {
    pub values: Values,
    pub place: [f64; 2],
    /// Lowest and highest deviation from the nominal radius.
    pub ends_um: [f64; 2],
}

impl NearbyCircle {
    /// By how much the circle's radius exceeds the nominal one.
    pub(super) fn level_um(&self, reference: Reference) -> f64 {
        let [low, high] = self.ends_um;
        match reference {
            Reference::MaximumInscribed => low,
            Reference::MinimumCircumscribed => high,
            Reference::MinimumZone | Reference::LeastSquares => 0.5 * (low + high),
        }
    }
}

impl Warm {
    /// `None` for LSCI, which needs no search.
    pub(crate) fn new(reference: Reference) -> Option<Self> {
        match reference {
            Reference::LeastSquares => None,
            Reference::MinimumZone => Some(Self::Zone(Chebyshev::new(true, true))),
            Reference::MaximumInscribed => Some(Self::OneSided(false, Chebyshev::new(false, true))),
            Reference::MinimumCircumscribed => Some(Self::OneSided(true, Chebyshev::new(true, false))),
        }
    }

    /// Values about the circle with its centre near a place. Of a zone, the heights' shares are those at the place given, which errs by
    /// deviation²/R times what the place moves. `None` where the search has to begin anew.
    pub(crate) fn values(&mut self, points: &Points, near: [f64; 2]) -> Option<NearbyCircle> {
        let reach = points.radius_um + points.span_um;
        let limits = near.map(|near| (near - reach, near + reach));
        let place = match self {
            Self::Zone(chebyshev) => {
                let cost = search::zone_slopes(points, &near);
                chebyshev.solve(&points.cloud, &cost, &limits, points.tolerance())?.place
            }
            Self::OneSided(outer, chebyshev) => one_sided(points, near, *outer, chebyshev, &limits)?,
        };
        let (low, high) = points.cloud.extremes(0..points.len(), &place);
        let common = points.common(&place);
        let [low, high] = [low, high].map(|height| points.deviation(height + common));
        let ront_um = high - low;
        let [ronp_um, ronv_um] = match self {
            Self::Zone(_) => [0.5 * ront_um; 2],
            Self::OneSided(true, _) => [0.0, ront_um],
            Self::OneSided(false, _) => [ront_um, 0.0],
        };
        let values = Values { ront_um, ronp_um, ronv_um, ronq_um: f64::NAN, points: points.len() };
        Some(NearbyCircle { values, place, ends_um: [low, high] })
    }
}

/// The centre of MICI or MCCI that three contacts hold: the bound of the heights and |c|²/2R, which bends so little that its slope
/// at the last place serves; where the contacts that it gives stay at their own place, they hold the circle.
fn one_sided(
    points: &Points,
    near: [f64; 2],
    outer: bool,
    chebyshev: &mut Chebyshev<2, 3>,
    limits: &[(f64, f64); 2],
) -> Option<[f64; 2]> {
    let sign = if outer { 1.0 } else { -1.0 };
    let mut place = near;
    for _ in 0..MOST_STEPS {
        let [x, y] = place.map(|place| sign * place / points.radius_um);
        let found = chebyshev.solve(&points.cloud, &[x, y, sign], limits, points.tolerance())?;
        let holds = |(contact, multiplier): &(Contact, f64)| {
            matches!(contact, Contact::Outer(_) | Contact::Inner(_)) && *multiplier >= DOUBTFUL
        };
        if !found.contacts.iter().all(holds) {
            return None;
        }
        let moved = (found.place[0] - place[0]).hypot(found.place[1] - place[1]);
        place = found.place;
        if moved <= points.tolerance() {
            return Some(place);
        }
    }
    None
}
