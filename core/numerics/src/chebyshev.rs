//! Chebyshev approximation in few unknowns by exchange: which points bound a zone.

use super::cloud::Cloud;

/// Pivots before the smallest index is taken, which cannot cycle, and before giving up.
const HASTY: usize = 100;
const MOST: usize = 2000;
/// Entries of an exchange's direction below this are rounding.
const PIVOT: f64 = 1e-11;

/// What holds a solution in its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Contact {
    /// A point at the upper bound.
    Outer(usize),
    /// A point at the lower bound.
    Inner(usize),
    /// Coordinate `0` of the place at its lower limit.
    Least(usize),
    /// Coordinate `0` of the place at its upper limit.
    Most(usize),
}

/// The least b·(s, A, B) over places s of a [`Cloud`] with heights h(s) ≤ A and h(s) ≥ B, s within limits.
///
/// `N` is `D` + 2 with both bounds, `D` + 1 with one of them. Solved by the dual simplex method: `N` contacts that
/// balance the cost with multipliers λ ≥ 0 fix a place, the point that violates its bound most takes the place of one
/// of them, and the cost grows until no point does. (Chvátal, *Linear Programming*, 1983, chapter 10; for circles this
/// is the exchange of Chetwynd, *Precision Engineering* 7 (1985) 93.) It keeps its contacts from one call to the next.
#[derive(Debug, Clone)]
pub struct Chebyshev<const D: usize, const N: usize> {
    outer: bool,
    inner: bool,
    basis: Option<[Contact; N]>,
}

/// Where no better place is.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum<const D: usize, const N: usize> {
    /// The place s.
    pub place: [f64; D],
    /// b·(s, A, B).
    pub cost: f64,
    /// What holds it there, each with its multiplier λ ≥ 0: Σ λ·(row of the contact) = b, which proves the optimum.
    pub contacts: [(Contact, f64); N],
}

impl<const D: usize, const N: usize> Chebyshev<D, N> {
    /// With an upper bound A, a lower bound B or both; the bounds have to be `N` − `D`.
    #[must_use]
    pub fn new(outer: bool, inner: bool) -> Self {
        Self { outer, inner, basis: None }
    }

    /// Solves for one cost b (s first, then A, then B, as far as they are there) and limits of each coordinate of s.
    /// Heights count as equal within `tolerance`; where points are so nearly the same that rounding exchanges them for each other again and
    /// again, within what ends this.
    ///
    /// `None` where there is no point, or rounding leaves no way on.
    pub fn solve(
        &mut self,
        cloud: &Cloud<D>,
        cost: &[f64; N],
        limits: &[(f64, f64); D],
        tolerance: f64,
    ) -> Option<Optimum<D, N>> {
        let found = self.basis.and_then(|basis| self.pivot(basis, cloud, cost, limits, tolerance));
        let found = found.or_else(|| self.pivot(self.start(cloud, cost)?, cloud, cost, limits, tolerance));
        self.basis = found.as_ref().map(|optimum| optimum.contacts.map(|(contact, _)| contact));
        found
    }

    fn pivot(
        &self,
        mut basis: [Contact; N],
        cloud: &Cloud<D>,
        cost: &[f64; N],
        limits: &[(f64, f64); D],
        tolerance: f64,
    ) -> Option<Optimum<D, N>> {
        let mut tolerance = tolerance;
        for step in 0..MOST {
            if step > 0 && step % HASTY == 0 {
                tolerance *= 2.0;
            }
            let rows = basis.map(|contact| row(contact, cloud));
            let inverse = inverse(rows)?;
            let right = basis.map(|contact| right(contact, cloud, limits));
            let unknowns: [f64; N] = std::array::from_fn(|j| dot(&inverse[j], &right));
            let multipliers = from_left(cost, &inverse);
            if step == 0 && multipliers.iter().any(|multiplier| *multiplier < -1e-12) {
                return None;
            }
            let multipliers = multipliers.map(|multiplier| multiplier.max(0.0));
            let place: [f64; D] = std::array::from_fn(|k| unknowns[k]);
            let enters = self.violated(&unknowns, &place, cloud, limits, tolerance, step >= HASTY);
            // Only rounding can violate what is held.
            let Some(enters) = enters.filter(|enters| !basis.contains(enters)) else {
                let contacts = std::array::from_fn(|i| (basis[i], multipliers[i]));
                return Some(Optimum { place, cost: dot(cost, &unknowns), contacts });
            };
            let direction = from_left(&row(enters, cloud), &inverse);
            let ratio = |i: usize| multipliers[i] / direction[i];
            let leaves = (0..N).filter(|i| direction[*i] > PIVOT).min_by(|a, b| {
                let tie =
                    if step >= HASTY { basis[*a].cmp(&basis[*b]) } else { direction[*b].total_cmp(&direction[*a]) };
                ratio(*a).total_cmp(&ratio(*b)).then(tie)
            })?;
            basis[leaves] = enters;
        }
        None
    }

    /// One point between both bounds, or at the one there is, and limits for the rest of the cost.
    fn start(&self, cloud: &Cloud<D>, cost: &[f64; N]) -> Option<[Contact; N]> {
        let point = cloud.levels().iter().position(|level| !level.is_nan())?;
        let bounds = [(self.outer, Contact::Outer(point)), (self.inner, Contact::Inner(point))];
        let bounds: Vec<Contact> = bounds.into_iter().filter_map(|(there, contact)| there.then_some(contact)).collect();
        let mut rest = *cost;
        for (contact, column) in bounds.iter().zip(D..) {
            let row: [f64; N] = row(*contact, cloud);
            let multiplier = cost[column] / row[column];
            (0..D).for_each(|k| rest[k] -= multiplier * row[k]);
        }
        Some(std::array::from_fn(|i| match bounds.get(i.wrapping_sub(D)) {
            Some(contact) => *contact,
            None if rest[i] < 0.0 => Contact::Most(i),
            None => Contact::Least(i),
        }))
    }

    /// The constraint that is violated most, or the first that is.
    fn violated(
        &self,
        unknowns: &[f64; N],
        place: &[f64; D],
        cloud: &Cloud<D>,
        limits: &[(f64, f64); D],
        tolerance: f64,
        first: bool,
    ) -> Option<Contact> {
        let (low, high) = cloud.extremes(0..cloud.len(), place);
        let (mut worst, mut enters) = (tolerance, None);
        let mut look = |violation: f64, contact: &mut dyn FnMut() -> Option<Contact>| {
            if violation > worst && !(first && enters.is_some()) {
                (worst, enters) = (violation, contact());
            }
        };
        let all = || 0..cloud.len();
        if self.outer {
            let bound = unknowns[D];
            look(high - bound, &mut || {
                let point = if first {
                    all().find(|point| cloud.height(*point, place) - bound > tolerance)
                } else {
                    cloud.find(all(), place, high)
                };
                point.map(Contact::Outer)
            });
        }
        if self.inner {
            let bound = unknowns[N - 1];
            look(bound - low, &mut || {
                let point = if first {
                    all().find(|point| bound - cloud.height(*point, place) > tolerance)
                } else {
                    cloud.find(all(), place, low)
                };
                point.map(Contact::Inner)
            });
        }
        for (k, (least, most)) in limits.iter().enumerate() {
            look(least - place[k], &mut || Some(Contact::Least(k)));
            look(place[k] - most, &mut || Some(Contact::Most(k)));
        }
        enters
    }
}

/// Row a of a·(s, A, B) ≥ right.
fn row<const D: usize, const N: usize>(contact: Contact, cloud: &Cloud<D>) -> [f64; N] {
    let mut row = [0.0; N];
    match contact {
        Contact::Outer(point) => {
            row[..D].copy_from_slice(&cloud.features(point));
            row[D] = 1.0;
        }
        Contact::Inner(point) => {
            row[..D].copy_from_slice(&cloud.features(point).map(|feature| -feature));
            row[N - 1] = -1.0;
        }
        Contact::Least(k) => row[k] = 1.0,
        Contact::Most(k) => row[k] = -1.0,
    }
    row
}

fn right<const D: usize>(contact: Contact, cloud: &Cloud<D>, limits: &[(f64, f64); D]) -> f64 {
    match contact {
        Contact::Outer(point) => cloud.levels()[point],
        Contact::Inner(point) => -cloud.levels()[point],
        Contact::Least(k) => limits[k].0,
        Contact::Most(k) => -limits[k].1,
    }
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Row vector times matrix.
fn from_left<const N: usize>(row: &[f64; N], matrix: &[[f64; N]; N]) -> [f64; N] {
    std::array::from_fn(|i| (0..N).map(|j| row[j] * matrix[j][i]).sum())
}

/// Inverse of a small matrix (`[row][col]`) by Gauss-Jordan elimination with row pivoting; `None` where it has none.
#[must_use]
pub fn inverse<const N: usize>(mut matrix: [[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let mut inverse = [[0.0; N]; N];
    (0..N).for_each(|i| inverse[i][i] = 1.0);
    for col in 0..N {
        let pivot = (col..N).max_by(|a, b| matrix[*a][col].abs().total_cmp(&matrix[*b][col].abs()))?;
        let head = matrix[pivot][col];
        if !(head.abs() > f64::MIN_POSITIVE && head.is_finite()) {
            return None;
        }
        matrix.swap(col, pivot);
        inverse.swap(col, pivot);
        let scale = head.recip();
        for k in 0..N {
            matrix[col][k] *= scale;
            inverse[col][k] *= scale;
        }
        let (row, unit) = (matrix[col], inverse[col]);
        for other in (0..N).filter(|other| *other != col) {
            let factor = matrix[other][col];
            for k in 0..N {
                matrix[other][k] -= factor * row[k];
                inverse[other][k] -= factor * unit[k];
            }
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_narrowest_strip_of_a_parabola() {
        // t² on [−1, 1] lies within ±½ about the constant ½ (Chebyshev): h = t² − s·t between A = 1 and B = 0.
        let mut cloud = Cloud::<1>::default();
        (0..=100).for_each(|i| cloud.push([f64::from(i) / 50.0 - 1.0], (f64::from(i) / 50.0 - 1.0).powi(2)));
        let mut chebyshev = Chebyshev::<1, 3>::new(true, true);
        let found = chebyshev.solve(&cloud, &[0.0, 1.0, -1.0], &[(-9.0, 9.0)], 1e-14).unwrap();
        assert!((found.cost - 1.0).abs() < 1e-14 && found.place[0].abs() < 1e-14, "{found:?}");
        // Only below: the lowest cover of the points has the same slope as they have on the whole, none.
        let mut chebyshev = Chebyshev::<1, 2>::new(true, false);
        let found = chebyshev.solve(&cloud, &[0.0, 1.0], &[(-9.0, 9.0)], 1e-14).unwrap();
        assert!((found.cost - 1.0).abs() < 1e-14, "{found:?}");
        assert!(found.contacts.iter().all(|(_, multiplier)| (multiplier - 0.5).abs() < 1e-14), "{found:?}");
    }

    #[test]
    fn nothing_has_no_optimum() {
        let mut chebyshev = Chebyshev::<2, 4>::new(true, true);
        assert_eq!(chebyshev.solve(&Cloud::default(), &[0.0, 0.0, 1.0, -1.0], &[(-1.0, 1.0); 2], 0.0), None);
    }
}
