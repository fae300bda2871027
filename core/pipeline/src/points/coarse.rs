//! Whether the steps in which readings are displayed are coarser than their noise.

use std::collections::HashMap;

use runout_consistency::{Check, Test};
use runout_numerics::number::significant;

use super::{PointColumn, Points};

/// Rounded readings have a standard deviation below this share of the step where their noise is below half of it: how large it is, they do not show.
const HIDDEN: f64 = 0.6;
/// Fewest degrees of freedom of repeats that show it.
const FEWEST: usize = 8;
/// Rows that are examined, at most: a map has a million heights, and each row takes memory.
const MOST_ROWS: usize = 50_000;
/// Part of a step by which readings may be off it.
const ON_STEP: f64 = 1e-6;
/// Powers of ten below the largest reading at which steps are looked for.
const DECIMALS: i32 = 6;

/// Columns of readings whose repeats differ by less than the steps of the display.
pub(super) fn coarser_than_noise(
    points: &Points,
    columns: &[PointColumn],
    measured: &[(&PointColumn, &[f64])],
) -> Vec<Check> {
    let check = |(column, values): &(&PointColumn, &[f64])| {
        let step = step(values)?;
        let (std, freedom) = repeats(points, columns, values)?;
        (std > 0.0 && std < HIDDEN * step).then(|| {
            Check::new(Test::Measured, column.name, std / step, &[freedom as f64], 0.0).finding(|| {
                let std = significant(std, 2);
                format!(
                    "`{}` has steps of {step}, and repeats of one place differ by {std} (standard deviation): the steps hide the noise, and a mean of \
                     repeats may be off by half a step. Read with a finer display",
                    column.name
                )
            })
        })
    };
    measured.iter().filter_map(check).collect()
}

/// The largest of 1, 2 and 5 times a power of ten that all readings are multiples of.
fn step(values: &[f64]) -> Option<f64> {
    let known = || values.iter().filter(|value| value.is_finite());
    let largest = known().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let highest = if largest > 0.0 { largest.log10().floor() as i32 } else { return None };
    let steps = (0..=DECIMALS).flat_map(|below| [5.0, 2.0, 1.0].map(|digit| (digit, highest - below)));
    // Powers of ten below 1 are no numbers of a computer, their reciprocals are.
    let per_step = |(digit, power): (f64, i32)| {
        if power < 0 { 10_f64.powi(-power) / digit } else { 1.0 / (digit * 10_f64.powi(power)) }
    };
    steps
        .map(per_step)
        .find(|per_step| known().all(|value| (value * per_step - (value * per_step).round()).abs() < ON_STEP))
        .map(f64::recip)
}

/// The least standard deviation of repeats, and its degrees of freedom: of rows that agree in all columns that hold no readings, or in all but one of them,
/// which may count the repeats.
fn repeats(points: &Points, columns: &[PointColumn], values: &[f64]) -> Option<(f64, usize)> {
    let places: Vec<Vec<u64>> =
        columns.iter().filter(|column| !column.measured).filter_map(|column| place(points, column)).collect();
    let without = |left_out: Option<usize>| {
        let key = |row: usize| -> Vec<u64> {
            places.iter().enumerate().filter(|(of, _)| Some(*of) != left_out).map(|(_, place)| place[row]).collect()
        };
        let mut groups: HashMap<Vec<u64>, [f64; 3]> = HashMap::new();
        for (row, value) in values.iter().enumerate().take(MOST_ROWS).filter(|(_, value)| value.is_finite()) {
            // Welford's sums: count, mean, squares about it.
            let [count, mean, squares] = groups.entry(key(row)).or_default();
            *count += 1.0;
            let off = value - *mean;
            *mean += off / *count;
            *squares += off * (value - *mean);
        }
        let [freedom, squares] = groups
            .values()
            .fold([0.0; 2], |[freedom, sum], [count, _, squares]| [freedom + count - 1.0, sum + squares]);
        (freedom >= FEWEST as f64).then(|| ((squares / freedom).sqrt(), freedom as usize))
    };
    let all = std::iter::once(None).chain((0..places.len()).map(Some));
    all.filter_map(without).filter(|(std, _)| *std > 0.0).min_by(|one, other| one.0.total_cmp(&other.0))
}

/// A column that holds no readings, as numbers to compare.
fn place(points: &Points, column: &PointColumn) -> Option<Vec<u64>> {
    if let Some(labels) = points.labels(column.name) {
        let mut numbers: HashMap<&str, u64> = HashMap::new();
        return Some(
            (labels.iter())
                .map(|label| {
                    let next = numbers.len() as u64;
                    *numbers.entry(label).or_insert(next)
                })
                .collect(),
        );
    }
    let values = points.column(column.name).ok()?;
    Some(values.iter().map(|value| value.to_bits()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::{Column, PointKind::Number};

    const COLUMNS: [PointColumn; 3] = [
        PointColumn::needed("target_mm", Number, "mm", "place"),
        PointColumn::needed("deviation_um", Number, "um", "reading").measured(),
        PointColumn::optional("run", Number, "", "number of the run"),
    ];

    /// What is said of five runs at ten targets, with this noise, read in steps.
    fn said(noise: f64, step: f64) -> Vec<String> {
        let mut state = 7_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut reading = |target: usize| {
            let true_um = 3.0 * (0.7 * target as f64).sin() + noise * (0..12).map(|_| uniform()).sum::<f64>();
            (true_um / step).round() * step
        };
        let rows: Vec<(usize, usize)> = (0..5).flat_map(|run| (0..10).map(move |target| (run, target))).collect();
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        let columns = vec![
            column("target_mm", rows.iter().map(|(_, target)| 50.0 * *target as f64).collect()),
            column("deviation_um", rows.iter().map(|(_, target)| reading(*target)).collect()),
            column("run", rows.iter().map(|(run, _)| *run as f64).collect()),
        ];
        let points = Points { columns, ..Points::default() };
        let measured = [(&COLUMNS[1], points.column("deviation_um").unwrap_or_default())];
        coarser_than_noise(&points, &COLUMNS, &measured).into_iter().map(|check| check.finding).collect()
    }

    #[test]
    fn steps_that_hide_the_noise_are_said() {
        let coarse = said(0.1, 0.5);
        assert!(coarse.len() == 1 && coarse[0].contains("`deviation_um` has steps of 0.5,"), "{coarse:?}");
        // Of noise of a step and more, readings show how large it is; where nothing differs, nothing is said.
        assert!(said(0.5, 0.5).is_empty() && said(0.1, 1e-3).is_empty() && said(0.0, 0.1).is_empty());
    }
}
