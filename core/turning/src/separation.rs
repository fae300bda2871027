//! Form and motion, one harmonic at a time: estimates, covariance, and what is not observable with the layout.

mod quantity;

pub use crate::residual::{OrderResidual, ReadingResidual, Residual};
use crate::{azimuth::Azimuth, smoothing::orders_beside};
pub use quantity::{ALONG_COLUMN, MotionColumn, Quantity, motion_columns};
pub use runout_draws::VarianceFrom;
use runout_draws::{NORMAL_95, student_95};
use runout_numerics::Complex64;
use runout_standards::gaps::Gaps;

/// What the numbers of form, motion and harmonics are, for files that explain themselves.
pub const CONVENTION: &str = "Form is Re sum c exp(+i n alpha) over the part's angle alpha, outward positive; motion is \
    Re sum c exp(-i n Phi) over the spindle's angle Phi. Lost orders are not observable with the layout: NaN in the \
    harmonics, left out of form and motion.";

/// What is said where no order of form is observable.
pub const NOTHING_SEPARATED: &str = "nothing is separated: this layout has no observable order of form. Each reading is form, \
    eccentricity and error motion together, and nothing says how much of it is which";

/// Displacement in µm at a lever of 1 mm per 1 µrad.
pub const UM_PER_MM_URAD: f64 = 1e-3;

/// What is and is not observable by a separator with a rig, before any data.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// What it solves for.
    pub unknowns: Vec<Quantity>,
    /// One entry an order, ascending from 1.
    pub orders: Vec<OrderAssessment>,
    /// Ids of the rig's sensors and setups that it does not use.
    pub unused: Vec<String>,
    /// What the user should know: conventions, assumptions, definitions.
    pub notes: Vec<String>,
}

/// One order of an [`Assessment`].
#[derive(Debug, Clone, PartialEq)]
pub struct OrderAssessment {
    /// Undulations per revolution.
    pub order: usize,
    /// Rank of the layout's matrix.
    pub rank: usize,
    /// Readings (complex) that are left over for a residual.
    pub residual_dof: usize,
    /// Whether each unknown is observable.
    pub observable: Vec<bool>,
    /// Standard deviation of each unknown per unit standard deviation of every reading; NaN where it is not observable.
    pub noise_gain: Vec<f64>,
    /// Why something is not observable.
    pub lost_because: Option<String>,
}

impl Assessment {
    /// Orders at which a form is not observable.
    #[must_use]
    pub fn lost_form_orders(&self) -> Vec<usize> {
        self.lost(Quantity::is_form)
    }

    /// Orders at which a motion is not observable.
    #[must_use]
    pub fn lost_motion_orders(&self) -> Vec<usize> {
        self.lost(|quantity| !quantity.is_form())
    }

    /// Whether no order (from 2) of any section's form is observable, nor any motion: readings are then form and motion together.
    #[must_use]
    pub fn has_no_observable_form(&self) -> bool {
        let mut orders = self.orders.iter().filter(|entry| entry.order > 1).peekable();
        let some = orders.peek().is_some() && self.unknowns.iter().any(|unknown| unknown.is_form());
        some && !orders.any(|entry| entry.observable.contains(&true))
    }

    /// Orders at which one unknown is not observable.
    #[must_use]
    pub fn lost_orders(&self, unknown: usize) -> Vec<usize> {
        let lost = self.orders.iter().filter(|entry| entry.observable.get(unknown) == Some(&false));
        lost.map(|entry| entry.order).collect()
    }

    fn lost(&self, of: impl Fn(Quantity) -> bool) -> Vec<usize> {
        let any_lost = |entry: &&OrderAssessment| {
            self.unknowns.iter().zip(&entry.observable).any(|(quantity, seen)| of(*quantity) && !seen)
        };
        self.orders.iter().filter(any_lost).map(|entry| entry.order).collect()
    }
}

/// Form and motion at one station.
///
/// Order 0 is the mean level, which displacement sensors do not share: 0 unless the method knows better. The default has nothing, and a
/// separator states what it knows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Separation {
    /// The sections it gives the form of.
    pub sections: Vec<SectionAt>,
    /// What was solved for; forms first, in the order of `sections`.
    pub unknowns: Vec<Quantity>,
    /// Estimates `[order][unknown]` from order 0; NaN where not observable.
    pub estimate: Vec<Complex64>,
    /// Variance E|δ|² that noise gives each estimate `[order][unknown]`; NaN where not known. [`variance_of`](Self::variance_of) has what the
    /// data do not decide besides.
    pub variance: Vec<f64>,
    /// Covariance E[δ δᴴ] of the motions among `unknowns`, `[order][motion][motion]` from order 0; what is not observable means
    /// nothing. `None` where it is not known.
    pub motion_covariance: Option<Vec<Complex64>>,
    /// Covariance E[δ δᴴ] of the forms among `unknowns`, `[order][form][form]` from order 0: sections of a station
    /// share the errors of its motion. What is not observable means nothing. `None` where it is not known.
    pub form_covariance: Option<Vec<Complex64>>,
    /// Real degrees of freedom behind `variance` at an order that was evaluated by itself, or of the readings that all orders have it from; 0 where
    /// it is taken as exact. [`degrees_of_freedom`](Self::degrees_of_freedom) gives those of any order.
    pub freedom: usize,
    /// Which orders share them.
    pub variance_from: VarianceFrom,
    /// Other estimates `[order][unknown]` that agree with the readings as well, less `estimate`: one of them is true, and
    /// the data do not decide which; none where the data decide.
    pub equivalents: Vec<Vec<Complex64>>,
    /// Whether it is observable with the layout, `[order][unknown]`.
    pub observable: Vec<bool>,
    /// Where x and y are the axis's displacement, in mm along the spindle: 0 where tilt is observable, the
    /// sensors' plane where it is not.
    pub motion_z_mm: f64,
    /// By how much forms that were declared within a bound, and taken as 0, may move each unknown, peak to valley over a turn, in
    /// its unit; not in `variance`. Empty where no bound was declared.
    pub form_bound: Vec<f64>,
    /// What the fit leaves of the readings.
    pub residual: Residual,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// How small changes of the averaged readings move the estimates: δ estimate = operator · δ readings.
///
/// With it, two methods' results on the same readings can be compared: their errors are not independent.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Readings an order: the channels of all profiles of the station, in their order.
    pub readings: usize,
    /// `[order][unknown][reading]` from order 0; 0 where not observable. Forms of a clockwise part are meant
    /// before they are conjugated.
    pub operator: Vec<Complex64>,
}

/// A circle of the part.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionAt {
    /// Its id in the rig.
    pub id: String,
    /// Its place along the spindle, in mm.
    pub z_mm: f64,
    /// Where nothing is known of it: a keyway, a stretch without readings. Every value leaves these out.
    pub gaps: Gaps,
    /// The gaps as the rig declares them: `gaps` are longer by what marks and edges leave open.
    pub declared_gaps: Gaps,
    /// Share of its readings that the form was computed from.
    pub used: f64,
    /// Form above the highest order, which no value has, as far as it shows: root mean square in µm.
    pub absent_um: f64,
}

impl SectionAt {
    /// A circle that was measured all around.
    #[must_use]
    pub fn whole(id: impl Into<String>, z_mm: f64) -> Self {
        Self { id: id.into(), z_mm, gaps: Gaps::default(), declared_gaps: Gaps::default(), used: 1.0, absent_um: 0.0 }
    }

    /// Share of the profile that was there: of so many equal angles, and of the readings.
    #[must_use]
    pub fn coverage(&self, angles: usize) -> f64 {
        self.gaps.coverage(angles).min(self.used)
    }
}

impl Separation {
    /// The line along which all motion is, where that is neither x nor y.
    #[must_use]
    pub fn azimuth(&self) -> Option<Azimuth> {
        self.unknowns.iter().find_map(|unknown| unknown.azimuth())
    }

    /// Highest order held.
    #[must_use]
    pub fn max_order(&self) -> usize {
        (self.estimate.len() / self.unknowns.len().max(1)).saturating_sub(1)
    }

    /// The weighted mean of estimates that agree with the readings equally well, with their distances from it; the rest is that of the first.
    /// An order is observable where it is in all of them.
    #[must_use]
    pub fn mixture(weights: &[f64], equivalents: &[Self]) -> Option<Self> {
        let mut mixture = equivalents.first()?.clone();
        let alike = |one: &Self| one.unknowns == mixture.unknowns && one.estimate.len() == mixture.estimate.len();
        if !equivalents.iter().all(alike) {
            return None;
        }
        for index in 0..mixture.estimate.len() {
            let each = || weights.iter().zip(equivalents);
            mixture.observable[index] = equivalents.iter().all(|one| one.observable[index]);
            mixture.estimate[index] = each().map(|(weight, one)| one.estimate[index] * *weight).sum();
            mixture.variance[index] = each().map(|(weight, one)| one.variance[index] * *weight).sum();
        }
        let distances = equivalents.iter().map(|one| {
            let entries = one.estimate.iter().zip(&mixture.estimate).map(|(one, mean)| one - mean);
            entries.collect()
        });
        mixture.equivalents = distances.collect();
        for (index, entry) in mixture.motion_covariance.iter_mut().flatten().enumerate() {
            let of = |one: &Self| one.motion_covariance.as_ref().and_then(|joint| joint.get(index)).copied();
            *entry = weights.iter().zip(equivalents).map(|(weight, one)| of(one).unwrap_or_default() * *weight).sum();
        }
        // What the data do not decide is no error that sections share.
        mixture.form_covariance = mixture.form_covariance.filter(|_| equivalents.len() < 2);
        Some(mixture)
    }

    /// Real degrees of freedom behind the variance of an order; 0 where it is taken as exact.
    #[must_use]
    pub fn degrees_of_freedom(&self, order: usize) -> usize {
        match self.variance_from {
            VarianceFrom::OrdersBeside => self.freedom * (2 * orders_beside(order) + 1),
            VarianceFrom::Readings => self.freedom,
        }
    }

    /// Factors by order that make errors with the stated variance as wide as the variance is badly known: Student's 95
    /// % quantile over that of a normal distribution.
    #[must_use]
    pub fn widening(&self) -> Vec<f64> {
        (0..=self.max_order()).map(|order| student_95(self.degrees_of_freedom(order) as f64) / NORMAL_95).collect()
    }

    /// The estimates as if the data decided for them, and those of each equivalent.
    #[must_use]
    pub fn decided(&self) -> (Self, Vec<Self>) {
        let own = Self { equivalents: Vec::new(), ..self.clone() };
        let moved = |distance: &Vec<Complex64>| {
            let estimate = own.estimate.iter().zip(distance).map(|(value, distance)| value + distance).collect();
            Self { estimate, ..own.clone() }
        };
        let equivalents = self.equivalents.iter().map(moved).collect();
        (own, equivalents)
    }

    /// Variance of an estimate `[order][unknown]` with the largest squared distance of the equivalents, so that each of them lies within one
    /// standard uncertainty; NaN where not known.
    #[must_use]
    pub fn variance_of(&self, place: usize) -> f64 {
        let noise = self.variance.get(place).copied().unwrap_or(f64::NAN);
        noise + largest(self.equivalents.iter().filter_map(|distance| distance.get(place).copied()))
    }

    /// Variance by order from 0 that noise gives one unknown.
    pub fn noise_variance(&self, unknown: usize) -> impl Iterator<Item = f64> + '_ {
        self.variance.iter().skip(unknown).step_by(self.unknowns.len().max(1)).copied()
    }

    /// Coefficients of one unknown by order from 0, in each of the equivalents; 0 where not observable.
    pub fn equivalent_coefficients(&self, unknown: usize) -> impl Iterator<Item = Vec<Complex64>> + '_ {
        let width = self.unknowns.len();
        self.equivalents.iter().map(move |distance| {
            let distances = distance.iter().skip(unknown).step_by(width.max(1));
            let distances = distances.map(|value| if value.is_finite() { *value } else { Complex64::ZERO });
            self.coefficients(unknown).zip(distances).map(|(value, distance)| value + distance).collect()
        })
    }

    /// Index of an unknown.
    #[must_use]
    pub fn position(&self, quantity: Quantity) -> Option<usize> {
        self.unknowns.iter().position(|unknown| *unknown == quantity)
    }

    /// Coefficients of one unknown by order from 0, with 0 where not observable.
    pub fn coefficients(&self, unknown: usize) -> impl Iterator<Item = Complex64> + '_ {
        let width = self.unknowns.len();
        let picked = self.estimate.iter().skip(unknown).step_by(width.max(1));
        let seen = self.observable.iter().skip(unknown).step_by(width.max(1));
        picked.zip(seen).map(|(value, seen)| if *seen { *value } else { Complex64::ZERO })
    }

    /// Whether no order (from 1) of an unknown is observable.
    #[must_use]
    pub fn is_lost(&self, unknown: usize) -> bool {
        let width = self.unknowns.len();
        let mut seen = self.observable.iter().skip(unknown).step_by(width.max(1)).skip(1);
        self.max_order() > 0 && !seen.any(|seen| *seen)
    }

    /// Whether no order (from 2) of any section's form is observable, nor any motion: readings are then form and motion together.
    #[must_use]
    pub fn has_no_observable_form(&self) -> bool {
        let width = self.unknowns.len();
        let seen =
            |unknown: usize| self.observable.iter().skip(unknown).step_by(width.max(1)).skip(2).any(|seen| *seen);
        self.max_order() > 1 && self.unknowns.iter().any(|unknown| unknown.is_form()) && !(0..width).any(seen)
    }

    /// [`form_bound`](Self::form_bound) of an unknown; 0 where none was declared.
    #[must_use]
    pub fn bound_of(&self, unknown: usize) -> f64 {
        self.form_bound.get(unknown).copied().unwrap_or(0.0)
    }

    /// √E|δ|² of an estimate `[order][unknown]`, with what declared forms may add: each part of a harmonic is then as likely
    /// anywhere within half of the bound. NaN where no variance is known.
    #[must_use]
    pub fn coefficient_std(&self, place: usize) -> f64 {
        let bound = self.bound_of(place % self.unknowns.len().max(1));
        (self.variance_of(place) + bound * bound / 6.0).sqrt()
    }

    /// Orders (from 1) at which one unknown is not observable.
    #[must_use]
    pub fn lost_orders(&self, unknown: usize) -> Vec<usize> {
        let width = self.unknowns.len();
        let seen = self.observable.iter().skip(unknown).step_by(width.max(1)).enumerate();
        seen.filter(|(order, seen)| *order > 0 && !**seen).map(|(order, _)| order).collect()
    }

    /// Standard uncertainty of one unknown at any one angle, from the covariance of the averages and the bounds of declared forms,
    /// as likely anywhere within them.
    ///
    /// With errors that do not favour a phase and do not couple orders, Var Re Σ δₙ e^{inα} = ½ Σ E|δₙ|², the same at
    /// every angle. NaN where no variance is known.
    #[must_use]
    pub fn angle_std(&self, unknown: usize) -> f64 {
        if self.is_lost(unknown) {
            return f64::NAN;
        }
        let width = self.unknowns.len();
        let seen = self.observable.iter().skip(unknown).step_by(width.max(1));
        let seen = seen.enumerate().skip(1).filter(|(_, seen)| **seen);
        let sum: f64 = seen.map(|(order, _)| self.variance_of(order * width + unknown)).sum();
        let bound = self.bound_of(unknown);
        (0.5 * sum + bound * bound / 12.0).sqrt()
    }
}

/// The largest square; NaN where one is not known.
fn largest(distances: impl Iterator<Item = Complex64>) -> f64 {
    let squares = distances.map(|distance| distance.norm_sqr());
    squares.fold(0.0, |largest, square| if square <= largest { largest } else { square })
}
