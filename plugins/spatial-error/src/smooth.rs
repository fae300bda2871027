//! Whether a field is smooth between neighbouring places: one that is not is as well a nugget, which no axis follows.

use crate::joint::Covariance;

/// Correlation of neighbouring places below which a field is not smooth.
const SMOOTH: f64 = 0.2;
/// Places whose neighbours are looked for at most.
const MOST: usize = 500;

/// Distance of neighbouring places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spacing {
    /// Its components, root mean square over places, in mm.
    mm: [f64; 3],
}

impl Spacing {
    /// From places to the nearest other one.
    #[must_use]
    pub(crate) fn of(places: &[[f64; 3]]) -> Self {
        let squares = |place: &[f64; 3]| {
            let apart = places.iter().map(|other| [0, 1, 2].map(|axis| (other[axis] - place[axis]).powi(2)));
            let others = apart.filter(|apart| apart.iter().sum::<f64>() > 0.0);
            others.min_by(|one, other| one.iter().sum::<f64>().total_cmp(&other.iter().sum())).unwrap_or_default()
        };
        let some: Vec<[f64; 3]> = places.iter().step_by(places.len().div_ceil(MOST).max(1)).map(squares).collect();
        Self { mm: [0, 1, 2].map(|axis| (some.iter().map(|one| one[axis]).sum::<f64>() / some.len() as f64).sqrt()) }
    }

    /// Whether a field is smooth at this distance.
    #[must_use]
    pub(crate) fn is_smooth(&self, covariance: &Covariance) -> bool {
        let scaled = (0..3).map(|axis| (self.mm[axis] / covariance.range_mm[axis]).powi(2)).sum::<f64>();
        covariance.family.correlation(scaled.sqrt()) > SMOOTH
    }

    /// Standard deviation of what is not smooth, in µm: the nugget, with the field where that is not smooth either.
    #[must_use]
    pub(crate) fn rough_um(&self, covariance: &Covariance) -> f64 {
        let field = if self.is_smooth(covariance) { 0.0 } else { covariance.sill_um };
        covariance.nugget_um.hypot(field)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correlation::Family;

    #[test]
    fn a_range_far_below_the_spacing_is_a_nugget() {
        let places: Vec<[f64; 3]> =
            (0..24).map(|index| [f64::from(index % 6) * 100.0, f64::from(index / 6) * 90.0, 3.0]).collect();
        let spacing = Spacing::of(&places);
        assert!((spacing.mm[1] - 90.0).abs() < 1e-9 && spacing.mm[0].abs() < 1e-9, "{spacing:?}");
        let field =
            |range: f64| Covariance { family: Family::Exponential, sill_um: 4.0, range_mm: [range; 3], nugget_um: 3.0 };
        assert!(spacing.is_smooth(&field(200.0)) && !spacing.is_smooth(&field(30.0)));
        assert!(
            (spacing.rough_um(&field(200.0)) - 3.0).abs() < 1e-12
                && (spacing.rough_um(&field(30.0)) - 5.0).abs() < 1e-12
        );
    }
}
