//! Polar plots of error motion: what repeats from turn to turn, over the spindle's angle, and the centres of such plots.

use runout_draws::crest_order;
use runout_numerics::{Complex64, fourier::Fourier};
use runout_standards::roundness::{Angles, Points, Reference};
use runout_turning::{
    separation::{Quantity, Separation, UM_PER_MM_URAD},
    spread::{Direction, Projection, face_shares},
};

/// What the values of a polar plot are referred to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Centre {
    /// PC: the centre of the polar chart.
    PolarChart,
    /// LSC, MZC (the standards' MRS), MIC or MCC of the synchronous plot.
    Plot(Reference),
}

/// Radius of the polar chart's base circle: so large that what is drawn on it has the same value on any larger one.
const BASE_CIRCLE_MM: f64 = 1000.0;

impl Centre {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::PolarChart,
        Self::Plot(Reference::LeastSquares),
        Self::Plot(Reference::MinimumZone),
        Self::Plot(Reference::MaximumInscribed),
        Self::Plot(Reference::MinimumCircumscribed),
    ];

    /// Its usual abbreviation.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::PolarChart => "PC",
            Self::Plot(Reference::LeastSquares) => "LSC",
            Self::Plot(Reference::MinimumZone) => "MZC",
            Self::Plot(Reference::MaximumInscribed) => "MIC",
            Self::Plot(Reference::MinimumCircumscribed) => "MCC",
        }
    }

    /// Whether adding orders from 2 leaves it where it is.
    pub(super) fn is_linear(self) -> bool {
        matches!(self, Self::PolarChart | Self::Plot(Reference::LeastSquares))
    }

    /// Where it is in a plot on equal angles; `None` where it is not determined.
    pub(super) fn of(self, angles: &Angles, plot: &[f64], points: &mut Points) -> Option<[f64; 2]> {
        match self {
            Self::PolarChart => Some([0.0; 2]),
            Self::Plot(Reference::LeastSquares) => {
                let scale = 2.0 / plot.len() as f64;
                let (sine, cosine) = (angles.sin_cos().zip(plot))
                    .fold((0.0, 0.0), |sums, ((sin, cos), value)| (sums.0 + sin * value, sums.1 + cos * value));
                Some([scale * cosine, scale * sine])
            }
            Self::Plot(reference) => {
                points.set_profile(angles, plot, BASE_CIRCLE_MM);
                points.reference(reference).map(|circle| [circle.x_um, circle.y_um])
            }
        }
    }
}

/// A plot as it is seen from a centre.
pub(super) fn seen_from([x, y]: [f64; 2], angles: &Angles, plot: &[f64]) -> Vec<f64> {
    angles.sin_cos().zip(plot).map(|((sin, cos), value)| value - x * cos - y * sin).collect()
}

/// Synchronous motion in a direction, from the separated harmonics.
pub(super) struct Synchronous {
    /// Coefficients of Re Σ cₙ e^{−inΦ} of the motion that counts, from order 0.
    first: Vec<Complex64>,
    /// Factor of sin Φ and coefficients of the second motion, in a direction that turns.
    second: Option<(f64, Vec<Complex64>)>,
    /// Variance E|δ|² of the plot's harmonics, by order from 0; 0 where none is known.
    pub variance: Vec<f64>,
    /// Real degrees of freedom that it comes from, by order from 0; 0, and nothing, where it is taken as exact.
    pub freedom: Vec<usize>,
    /// Orders of the motion that count, both ends included.
    pub band: [usize; 2],
    /// Orders of that band that are not observable.
    pub lost: Vec<usize>,
    /// By how much declared forms may move the plot, peak to valley.
    pub bound: f64,
}

impl Synchronous {
    /// Motion at `z_mm` along the spindle; `None` where the separation does not know it.
    ///
    /// In a fixed direction 1/rev is centring and left out. In a radial one that turns, what is left of 1/rev (the part that
    /// turns against the spindle) is a 2/rev of the plot, and belongs to it. Tilt is residual: the fundamental is no part of
    /// it.
    pub(crate) fn new(
        separation: &Separation,
        projection: &Projection,
        direction: Direction,
        z_mm: f64,
    ) -> Option<Self> {
        let lowest = if direction.rotates() && !direction.is_tilt() { 1 } else { 2 };
        Self::from_order(lowest, separation, projection, direction, z_mm)
    }

    /// Motion at `z_mm` along the spindle, of orders from `lowest` on: from 1, with the part of 1/rev that turns against the
    /// spindle. `None` where the separation does not know it.
    pub(crate) fn from_order(
        lowest: usize,
        separation: &Separation,
        projection: &Projection,
        direction: Direction,
        z_mm: f64,
    ) -> Option<Self> {
        let (first, second) = direction.parts();
        let first = Motion::new(separation, first, z_mm)?;
        let second = match second {
            Some((quantity, factor)) => Some((factor * projection.rotation, Motion::new(separation, quantity, z_mm)?)),
            None => None,
        };
        let band = [lowest, separation.max_order()];
        let motions = || std::iter::once(&first).chain(second.iter().map(|(_, motion)| motion));
        let mut lost: Vec<usize> = motions().flat_map(|motion| motion.lost_orders(separation)).collect();
        lost.retain(|order| *order >= band[0]);
        lost.sort_unstable();
        lost.dedup();
        let coefficients = |motion: &Motion| -> Vec<Complex64> {
            let all = motion.coefficients(separation).into_iter().enumerate();
            all.map(|(order, value)| {
                let counts = order >= band[0] && lost.binary_search(&order).is_err();
                if counts { value } else { Complex64::ZERO }
            })
            .collect()
        };
        // cos Φ and sin Φ take an order n to n − 1 and n + 1.
        let mut variance = vec![0.0; band[1] + 2];
        for order in (band[0]..=band[1]).filter(|order| lost.binary_search(order).is_err()) {
            match &second {
                None => variance[order] = first.variance(separation, order, None),
                Some((factor, motion)) => {
                    for (to, sign) in [(order - 1, -1.0), (order + 1, 1.0)] {
                        let quarter = Complex64::new(0.0, sign * factor);
                        variance[to] += 0.25 * first.variance(separation, order, Some((quarter, motion)));
                    }
                }
            }
        }
        let bounds = first.form_bound(separation)
            + second.as_ref().map_or(0.0, |(factor, motion)| factor.abs() * motion.form_bound(separation));
        Some(Self {
            freedom: (0..variance.len()).map(|order| separation.degrees_of_freedom(order.min(band[1]))).collect(),
            bound: bounds,
            first: coefficients(&first),
            second: second.as_ref().map(|(factor, motion)| (*factor, coefficients(motion))),
            variance,
            band,
            lost,
        })
    }

    /// In a fixed direction, from coefficients of Re Σ cₙ e^{+inΦ} and the variance of each by order from 0, known from so many squares
    /// (0: exactly), of those from `lowest` on.
    pub(super) fn fixed(lowest: usize, harmonics: &[Complex64], variance: &[f64], squares: usize) -> Self {
        let counting = |order: usize| order >= lowest;
        let first =
            harmonics.iter().enumerate().map(|(n, value)| if counting(n) { value.conj() } else { Complex64::ZERO });
        let variance = variance.iter().enumerate().map(|(n, variance)| if counting(n) { *variance } else { 0.0 });
        Self {
            band: [lowest, harmonics.len().saturating_sub(1)],
            first: first.collect(),
            second: None,
            variance: variance.collect(),
            freedom: vec![squares; harmonics.len()],
            lost: Vec::new(),
            bound: 0.0,
        }
    }

    /// Whether no order of the band is observable.
    pub(crate) fn is_lost(&self) -> bool {
        self.lost.len() > self.band[1].saturating_sub(self.band[0])
    }

    /// The coefficient of an order in a direction that does not turn.
    pub(crate) fn harmonic(&self, order: usize) -> Option<Complex64> {
        self.first.get(order).copied().filter(|_| self.second.is_none())
    }

    /// How sharp the crests of the motion are, and those of its errors.
    pub(super) fn crest_orders(&self) -> [f64; 2] {
        let power = |coefficients: &[Complex64]| -> Vec<f64> { coefficients.iter().map(Complex64::norm_sqr).collect() };
        let mut motion = power(&self.first);
        if let Some((factor, second)) = &self.second {
            motion.iter_mut().zip(power(second)).for_each(|(power, second)| *power += factor * factor * second);
        }
        [crest_order(motion.into_iter()), crest_order(self.variance.iter().copied())]
    }

    /// The plot on equal angles of the spindle from 0.
    pub(crate) fn over_angle(&self, angles: &Angles) -> Vec<f64> {
        let mut fourier = Fourier::new(angles.len());
        let mut plot = fourier.synthesise(self.first.iter().map(Complex64::conj)).to_vec();
        if let Some((factor, second)) = &self.second {
            let second = fourier.synthesise(second.iter().map(Complex64::conj));
            for ((value, second), (sin, cos)) in plot.iter_mut().zip(second).zip(angles.sin_cos()) {
                *value = cos * *value + factor * sin * second;
            }
        }
        plot
    }
}

/// One motion at a place along the spindle, as a sum of what was separated.
pub(super) struct Motion {
    /// Place among the unknowns, place among the motions, factor.
    terms: Vec<(usize, usize, f64)>,
}

impl Motion {
    /// x + z·ε_y, y − z·ε_x, or a tilt; along a line that was not separated, the sum of what was along x and y.
    pub(crate) fn new(separation: &Separation, quantity: Quantity, z_mm: f64) -> Option<Self> {
        if let Quantity::FaceMotion(place) = quantity {
            let mut terms = Self::new(separation, Quantity::Z, z_mm)?.terms;
            for (tilt, share) in face_shares(place, separation.azimuth()) {
                let tilt = Self::new(separation, tilt, z_mm)?;
                terms.extend(tilt.terms.into_iter().map(|(unknown, before, factor)| (unknown, before, share * factor)));
            }
            return Some(Self { terms });
        }
        if separation.position(quantity).is_none() && quantity.azimuth().is_some() {
            let mut terms = Vec::new();
            let each =
                [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY].into_iter().zip(quantity.cartesian());
            for (part, share) in each.filter(|(_, share)| *share != 0.0) {
                let part = Self::new(separation, part, z_mm)?;
                terms.extend(part.terms.into_iter().map(|(unknown, before, factor)| (unknown, before, share * factor)));
            }
            return Some(Self { terms });
        }
        let lever = (z_mm - separation.motion_z_mm) * UM_PER_MM_URAD;
        let term = |quantity: Quantity, factor: f64| {
            let unknown = separation.position(quantity)?;
            let before = separation.unknowns.iter().take(unknown).filter(|other| !other.is_form()).count();
            Some((unknown, before, factor))
        };
        let tilt = quantity.moved_by_tilt().and_then(|(tilt, factor)| term(tilt, factor * lever));
        Some(Self { terms: std::iter::once(term(quantity, 1.0)?).chain(tilt).collect() })
    }

    /// By how much declared forms may move it, peak to valley.
    pub(crate) fn form_bound(&self, separation: &Separation) -> f64 {
        self.terms.iter().map(|(unknown, _, factor)| factor.abs() * separation.bound_of(*unknown)).sum()
    }

    pub(crate) fn lost_orders<'a>(&'a self, separation: &'a Separation) -> impl Iterator<Item = usize> + 'a {
        self.terms.iter().flat_map(|(unknown, ..)| separation.lost_orders(*unknown))
    }

    /// By order from 0.
    pub(crate) fn coefficients(&self, separation: &Separation) -> Vec<Complex64> {
        let mut sum = vec![Complex64::ZERO; separation.max_order() + 1];
        for (unknown, _, factor) in &self.terms {
            let values = separation.coefficients(*unknown);
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * *factor);
        }
        sum
    }

    /// E|δ|² of an order, of this motion or of it and a multiple of another one; 0 where it is not known.
    pub(crate) fn variance(&self, separation: &Separation, order: usize, other: Option<(Complex64, &Self)>) -> f64 {
        let Some(covariance) = &separation.motion_covariance else { return 0.0 };
        let motions = separation.unknowns.iter().filter(|unknown| !unknown.is_form()).count();
        let others = other.iter().flat_map(|(multiple, motion)| {
            motion.terms.iter().map(move |(_, place, factor)| (*place, multiple * *factor))
        });
        let terms: Vec<(usize, Complex64)> =
            self.terms.iter().map(|(_, place, factor)| (*place, Complex64::from(*factor))).chain(others).collect();
        let entry = |row: usize, column: usize| {
            covariance.get((order * motions + row) * motions + column).copied().unwrap_or_default()
        };
        let products =
            terms.iter().flat_map(|(row, a)| terms.iter().map(move |(column, b)| (*row, *column, a * b.conj())));
        products.map(|(row, column, product)| (product * entry(row, column)).re).sum::<f64>().max(0.0)
    }
}
