//! Noise of one reading from repeats: their scatter after a smooth drift in time, and a step if there is one, that are common to all places.

use nalgebra::{DMatrix, DVector};
use runout_core::{consistency::in_time::InTime, numerics::statistics::f_tail};

use crate::terms::legendre;

/// What is known of the noise.
#[derive(Debug, Clone, PartialEq)]
pub enum Noise {
    /// The column `std_um`, of each reading.
    Column(Vec<f64>),
    /// The key `std_um`.
    Stated(f64),
    /// Scatter of repeats, of each coordinate.
    Repeats {
        /// Standard deviation of x, y, z; NaN of components that were not measured.
        std_um: [f64; 3],
        /// Degrees of freedom of each.
        dof: usize,
    },
    /// Nothing: the nugget is noise.
    Unknown,
}

/// Degrees of freedom of each component below which repeats say nothing; and from which each component has its own noise.
const FEWEST: [usize; 2] = [4, 10];
/// Chance of as different scatter below which components with fewer degrees of freedom are not pooled.
const UNLIKE: f64 = 0.01;
/// Highest order of the drift, and degrees of freedom that each order asks for.
const ORDERS: [usize; 2] = [6, 12];
/// Times of a step that are tried, and the chance of noise doing as much, times their number, below which there is one.
const STEPS: usize = 200;
const STEP_CHANCE: f64 = 1e-6;
/// Scatter below this share of the deviations is that of copied rows.
const COPIED: f64 = 1e-9;
/// Scatter below this share of the deviations is rounding: it shows nothing of time.
const ROUNDED: f64 = 1e-5;

/// Readings of places that were read more than once: what they differ by within a place, after a drift and a step that are common to all.
pub(crate) struct Repeats {
    /// Readings of each place.
    members: Vec<Vec<usize>>,
    /// Each measured component less its mean at the place, place by place.
    within: Vec<DVector<f64>>,
    /// Each measured component less its mean at the place, drift and step.
    left: Vec<DVector<f64>>,
    /// Drift and step, orthonormal.
    basis: Vec<DVector<f64>>,
    /// Degrees of freedom of a component.
    dof: usize,
    /// Sum of squares of all readings.
    size_um2: f64,
}

impl Repeats {
    /// Of the measured components; `None` where they are too few.
    #[must_use]
    pub(crate) fn of(
        place_of: &[usize],
        places: usize,
        readings_um: &[[f64; 3]],
        measured: &[usize],
        time: &[f64],
    ) -> Option<Self> {
        let mut members = vec![Vec::new(); places];
        place_of.iter().enumerate().for_each(|(row, place)| members[*place].push(row));
        members.retain(|rows| rows.len() > 1);
        let rows: Vec<usize> = members.iter().flatten().copied().collect();
        let free = rows.len() - members.len();
        if free < FEWEST[0] {
            return None;
        }
        let fields = measured.len();
        let orders = ORDERS[0].min(free / ORDERS[1]);
        let function = |row: usize, column: usize| match measured.get(column) {
            Some(axis) => readings_um[row][*axis],
            None => legendre(column + 1 - fields, 2.0 * time[row] - 1.0),
        };
        let mut all = DMatrix::<f64>::zeros(rows.len(), fields + orders);
        let mut at = 0;
        for group in &members {
            for column in 0..fields + orders {
                let mean = group.iter().map(|row| function(*row, column)).sum::<f64>() / group.len() as f64;
                for (index, row) in group.iter().enumerate() {
                    all[(at + index, column)] = function(*row, column) - mean;
                }
            }
            at += group.len();
        }
        let mut basis: Vec<DVector<f64>> = Vec::new();
        for column in fields..fields + orders {
            basis.extend(outside(all.column(column).into_owned(), &basis));
        }
        let left_of = |basis: &[DVector<f64>]| -> Vec<DVector<f64>> {
            (0..fields).map(|field| without(all.column(field).into_owned(), basis)).collect()
        };
        let sizes: Vec<usize> = members.iter().map(Vec::len).collect();
        let times: Vec<f64> = rows.iter().map(|row| time[*row]).collect();
        basis.extend(step(&left_of(&basis), &sizes, &times, &basis, free));
        let dof = free.saturating_sub(basis.len());
        let size_um2 = readings_um.iter().flatten().filter(|value| value.is_finite()).map(|value| value * value).sum();
        (dof >= FEWEST[0]).then(|| Self { within: left_of(&[]), left: left_of(&basis), members, basis, dof, size_um2 })
    }

    /// Noise of a reading of the measured components.
    #[must_use]
    pub(crate) fn noise(&self, measured: &[usize]) -> Noise {
        let squares: Vec<f64> = self.left.iter().map(DVector::norm_squared).collect();
        let copied = |squares: f64| squares <= COPIED * COPIED * self.size_um2;
        if copied(squares.iter().sum()) {
            return Noise::Unknown;
        }
        let dof = self.dof;
        let mut std_um = [f64::NAN; 3];
        for (axis, own) in measured.iter().zip(&squares) {
            // Where they are few, components with about the same scatter have one noise. One that repeats exactly has that of the others.
            let is_pooled = |other: &&f64| {
                let ratio = (*other / own).max(own / *other);
                let alike = dof < FEWEST[1] && 2.0 * f_tail(ratio, dof as f64, dof as f64) > UNLIKE;
                copied(*own) || alike || ratio <= 1.0
            };
            let pooled: Vec<f64> = squares.iter().copied().filter(|other| is_pooled(&other)).collect();
            std_um[*axis] = (pooled.iter().sum::<f64>() / (pooled.len() * dof) as f64).sqrt();
        }
        Noise::Repeats { std_um, dof }
    }

    /// Errors of the measured components that depend on each other in time: where a drift and a step do not explain those of all components,
    /// they are part of them.
    #[must_use]
    pub(crate) fn correlated(&self, time: &[f64]) -> Vec<Option<InTime>> {
        let mut next = 0;
        let place = |readings: &Vec<usize>| {
            next += readings.len();
            (next - readings.len()..next).collect::<Vec<usize>>()
        };
        let places: Vec<Vec<usize>> = self.members.iter().map(place).collect();
        let times: Vec<f64> = self.members.iter().flatten().map(|row| time[*row]).collect();
        let columns: Vec<Vec<f64>> = self.basis.iter().map(|column| column.as_slice().to_vec()).collect();
        let of = |left: &DVector<f64>, columns: &[Vec<f64>]| {
            let is_rounding = left.norm_squared() <= ROUNDED * ROUNDED * self.size_um2;
            if is_rounding { None } else { InTime::of(&places, &times, left.as_slice(), columns) }
        };
        if self.left.iter().all(|left| of(left, &columns).is_none()) {
            return vec![None; self.left.len()];
        }
        self.within.iter().map(|within| of(within, &[])).collect()
    }
}

fn without(mut column: DVector<f64>, basis: &[DVector<f64>]) -> DVector<f64> {
    for known in basis {
        let share = known.dot(&column);
        column.axpy(-share, known, 1.0);
    }
    column
}

/// The direction of a column outside a basis, if any.
fn outside(column: DVector<f64>, basis: &[DVector<f64>]) -> Option<DVector<f64>> {
    let whole = column.norm();
    let left = without(column, basis);
    let size = left.norm();
    (size > 1e-6 * whole.max(1e-12) && whole > 1e-9).then(|| left / size)
}

/// A step of all components in time, beside a drift that is taken out: its direction, where noise does not do as much. Readings are of places
/// of so many readings each, at times.
fn step(
    left: &[DVector<f64>],
    sizes: &[usize],
    times: &[f64],
    basis: &[DVector<f64>],
    free: usize,
) -> Option<DVector<f64>> {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let gaps: Vec<f64> =
        sorted.windows(2).filter(|pair| pair[1] > pair[0]).map(|pair| f64::midpoint(pair[0], pair[1])).collect();
    let at = |from: f64| {
        let mut column =
            DVector::from_iterator(times.len(), times.iter().map(|time| f64::from(u8::from(*time > from))));
        let mut first = 0;
        for size in sizes {
            let mut own = column.rows_mut(first, *size);
            let mean = own.mean();
            own.add_scalar_mut(-mean);
            first += size;
        }
        let direction = outside(column, basis)?;
        let taken: f64 = left.iter().map(|left| left.dot(&direction).powi(2)).sum();
        Some((taken, from, direction))
    };
    let best = |gaps: &[f64], every: usize| {
        gaps.iter().step_by(every).filter_map(|from| at(*from)).max_by(|one, other| one.0.total_cmp(&other.0))
    };
    let every = gaps.len().div_ceil(STEPS).max(1);
    let start = best(&gaps, every)?.1;
    let place = gaps.partition_point(|gap| *gap < start);
    let (taken, _, direction) = best(&gaps[place.saturating_sub(every)..(place + every).min(gaps.len())], 1)?;
    let whole: f64 = left.iter().map(DVector::norm_squared).sum();
    let fields = left.len() as f64;
    let dof = fields * free.checked_sub(basis.len() + 2)? as f64;
    let chance = f_tail(taken / fields / ((whole - taken) / dof), fields, dof);
    (chance * (gaps.len() as f64) < STEP_CHANCE).then_some(direction)
}
