//! What effects are looked for at: orders, periods, times.

use crate::campaign::Campaign;

/// Places along an axis that a period needs.
const FEWEST_LEVELS: usize = 8;
/// Waves over the travel from which an error is periodic: longer ones are Legendre polynomials and the field.
const FEWEST_WAVES: f64 = 3.0;
/// Leads of ball screws are not below this, in mm.
const SHORTEST_MM: f64 = 4.0;
/// Periods a resolved one (1/travel), and at most.
const OVERSAMPLED: f64 = 3.0;
const MOST_PERIODS: f64 = 1500.0;
/// Readings before and after a step at least, and times that are tried first.
const FEWEST_READINGS: usize = 4;
const MOST_TIMES: usize = 300;

/// What an effect is looked for at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// It has no shape.
    None,
    /// Order of a polynomial.
    Order(usize),
    /// A period in mm.
    Period { mm: f64, declared: bool },
    /// The share of the campaign before it.
    From(f64),
}

impl Shape {
    /// Whether it is one of many along a line, of which the best is refined.
    pub(crate) fn is_searched(self) -> bool {
        matches!(self, Self::Period { declared: false, .. } | Self::From(_))
    }

    /// The number that names it.
    pub(crate) fn value(self) -> Option<f64> {
        match self {
            Self::None => None,
            Self::Order(order) => Some(order as f64),
            Self::Period { mm, .. } => Some(mm),
            Self::From(time) => Some(time),
        }
    }

    /// In words, after the effect's name.
    pub(crate) fn words(self) -> String {
        match self {
            Self::Order(order) => format!(" order {order}"),
            Self::Period { mm, .. } => format!(" period {mm:.2} mm"),
            Self::None | Self::From(_) => String::new(),
        }
    }
}

/// Steps of the frequency (1/mm) at which periods of an axis are tried.
pub(crate) fn frequency_step(campaign: &Campaign, axis: usize) -> f64 {
    1.0 / (OVERSAMPLED * 2.0 * campaign.volume.half_mm[axis])
}

/// Periods of an axis that are tried, in mm, longest first; none where the axis was not read at enough places.
pub(crate) fn periods_mm(campaign: &Campaign, axis: usize) -> Vec<f64> {
    let travel_mm = 2.0 * campaign.volume.half_mm[axis];
    let mut levels: Vec<f64> = campaign.places_mm.iter().map(|place| place[axis]).collect();
    levels.sort_by(f64::total_cmp);
    let mut gaps: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.retain(|gap| *gap > 1e-3 * travel_mm / levels.len() as f64);
    if gaps.len() + 1 < FEWEST_LEVELS || !campaign.measured.contains(&axis) {
        return Vec::new();
    }
    gaps.sort_by(f64::total_cmp);
    let shortest_mm = SHORTEST_MM.min(2.0 * gaps[gaps.len() / 2]);
    let step = frequency_step(campaign, axis);
    let first = FEWEST_WAVES * OVERSAMPLED;
    let last = (1.0 / (shortest_mm * step)).min(first + MOST_PERIODS);
    (first as usize..=last as usize).map(|index| 1.0 / (index as f64 * step)).collect()
}

/// Times between readings, as shares of the campaign.
fn gaps(campaign: &Campaign) -> Vec<f64> {
    let mut time = campaign.time.clone();
    time.sort_by(f64::total_cmp);
    let inner = FEWEST_READINGS - 1..time.len().saturating_sub(FEWEST_READINGS);
    inner.filter(|row| time[row + 1] > time[*row]).map(|row| f64::midpoint(time[row], time[row + 1])).collect()
}

/// Times of a step that are tried first.
pub(crate) fn times(campaign: &Campaign) -> Vec<f64> {
    let all = gaps(campaign);
    all.iter().step_by(all.len().div_ceil(MOST_TIMES).max(1)).copied().collect()
}

/// Times of a step near one.
pub(crate) fn times_near(campaign: &Campaign, time: f64) -> Vec<f64> {
    let all = gaps(campaign);
    let every = all.len().div_ceil(MOST_TIMES).max(1);
    let place = all.partition_point(|other| *other < time);
    all[place.saturating_sub(every)..(place + every).min(all.len())].to_vec()
}
