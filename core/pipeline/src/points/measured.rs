//! Tests of measured points that no method is needed for: whether readings are there twice, and whether a column was measured at all.

use std::collections::HashMap;

use runout_consistency::{Check, Test};
use runout_error::{Error, ErrorKind, Result};
use runout_numerics::number::significant;

use super::{PointColumn, Points, coarse::coarser_than_noise};

/// Readings in a row that come again elsewhere are a copy from so many on.
const STRETCH: usize = 8;
/// So many readings in a row that come again elsewhere in a column of coarse resolution are a copy: fewer also come again in sound readings.
const COARSE_STRETCH: usize = 40;
/// A resolution is coarse from this share of the range on.
const COARSE: f64 = 1e-3;
/// Part of the last digit by which readings may be off it.
const ON_GRID: f64 = 1e-3;
/// Rows that are copies matter from this share of all on, or from so many stretches.
const MATTERS: f64 = 0.1;
const LONG: usize = 2;
/// Numbers beyond this are nothing that was measured, in any unit; sums of their squares leave the range of numbers.
const LARGEST: f64 = 1e100;
/// Ranges of readings in µm that machines and their parts have: below, numbers are in mm, above, in nm.
const USUAL_UM: [f64; 2] = [0.01, 2e4];
/// Fewest rows that show whether a column varies.
const FEWEST_ROWS: usize = 6;
/// A column that stays at one number for so many times as long as usual is stuck there.
const STUCK: usize = 40;
/// A number that stands so many times, so many ranges of the others beyond them, is a code.
const CODES: usize = 2;
const BEYOND: f64 = 20.0;
/// From one unit of length to the next, and how much parts of one measurement differ in size besides.
const BETWEEN_UNITS: f64 = 1e3;
const USUAL_RATIO: f64 = 3.0;

/// Parts of one measurement (sets, setups, diagonals) of which some are a thousand times larger or smaller than all others, each by its name and
/// size: their numbers are in another unit. `remedy` says what to do.
#[must_use]
pub fn unlike_units(parts: &[(String, f64)], remedy: &str) -> Option<Check> {
    let near = |ratio: f64| (BETWEEN_UNITS / USUAL_RATIO..BETWEEN_UNITS * USUAL_RATIO).contains(&ratio);
    let mut sorted: Vec<&(String, f64)> = parts.iter().collect();
    sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
    let nearest = |cut: usize| sorted[cut].1 / sorted[cut - 1].1;
    let farthest = sorted.last()?.1 / sorted[0].1;
    let cut = (1..sorted.len()).find(|cut| near(nearest(*cut)) && near(farthest))?;
    let (low, high) = sorted.split_at(cut);
    let (odd, others, how) = if low.len() < high.len() { (low, high, "smaller") } else { (high, low, "larger") };
    let names = |parts: &[&(String, f64)]| parts.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    let beside = if others.len() > odd.len() { "the others".to_owned() } else { names(others) };
    let finding = || {
        format!(
            "the readings of {} are {:.0} times {how} than those of {beside}: some have another unit (millimetres, µm, nanometres): {remedy}",
            names(odd),
            nearest(cut)
        )
    };
    Some(Check::new(Test::Measured, format!("unit of {}", names(odd)), nearest(cut), &[], 0.0).finding(finding))
}

/// Refuses numbers that are nothing that was measured.
///
/// # Errors
/// The first one, with its row.
pub fn refuse_impossible(points: &Points) -> Result<()> {
    for column in &points.columns {
        if let Some(row) = column.values.iter().position(|value| value.abs() > LARGEST) {
            let problem = format!("`{}` is {:e} in row {}", column.name, column.values[row], row + 1);
            let error = Error::new("separate", points.input.display().to_string(), problem);
            return Err(error
                .of(ErrorKind::UnsuitableData)
                .help("a code for a missing value is no reading: leave the row out"));
        }
    }
    Ok(())
}

/// What the readings themselves say, whatever the method is: `columns` are those that it takes.
#[must_use]
pub fn checks(points: &Points, columns: &[PointColumn]) -> Vec<Check> {
    let measured: Vec<(&PointColumn, &[f64])> = columns
        .iter()
        .filter(|column| column.measured)
        .filter_map(|column| Some((column, points.column(column.name).ok()?)))
        .collect();
    let stuck: Vec<Check> = measured.iter().filter_map(|(column, values)| stuck(column.name, values)).collect();
    let moves = |name: &str| stuck.iter().all(|check| check.of != name);
    let copies = measured
        .iter()
        .filter(|(column, _)| moves(column.name))
        .find_map(|(column, values)| copied(column.name, values));
    let codes = measured.iter().filter_map(|(column, values)| code(column.name, values));
    let codes: Vec<Check> = codes.collect();
    let coarse = coarser_than_noise(points, columns, &measured);
    let of_columns = unmeasured(&measured).into_iter().chain(stuck).chain(codes).chain(coarse);
    copies.into_iter().chain(equal_columns(&measured)).chain(of_columns).collect()
}

/// One number that stands several times at an end of a column, far beyond all others: a code for a missing value.
fn code(name: &str, values: &[f64]) -> Option<Check> {
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], one| [low.min(one), high.max(one)])
    };
    let known = || values.iter().copied().filter(|one| one.is_finite());
    let [low, high] = ends(&mut known());
    [low, high].into_iter().find_map(|end| {
        let is_end = |one: f64| one.total_cmp(&end).is_eq();
        let rows = known().filter(|one| is_end(*one)).count();
        let [low, high] = ends(&mut known().filter(|one| !is_end(*one)));
        let apart = if end < low { low - end } else { end - high };
        (rows >= CODES && high > low && apart > BEYOND * (high - low)).then(|| {
            Check::new(Test::Measured, name, apart / (high - low), &[], 0.0).finding(|| {
                format!("`{name}` is {end} in {rows} rows, and from {low} to {high} in all others: a code for a missing value is no reading, leave these rows out")
            })
        })
    })
}

/// Columns whose numbers look as if they had another unit than their name says.
#[must_use]
pub fn units(points: &Points, columns: &[PointColumn]) -> Vec<String> {
    let doubtful = |column: &PointColumn| {
        let values = points.column(column.name).ok()?;
        let (low, high) =
            values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), one| (low.min(*one), high.max(*one)));
        let range = high - low;
        let unit = if range < USUAL_UM[0] { "mm" } else { "nm" };
        (range > 0.0 && !(USUAL_UM[0]..=USUAL_UM[1]).contains(&range)).then(|| {
            format!("`{}` ranges over {} µm in all: are its numbers in {unit}?", column.name, significant(range, 2))
        })
    };
    columns.iter().filter(|column| column.measured && column.unit == "um").filter_map(doubtful).collect()
}

/// Readings that come again digit by digit: their noise is that of the first ones, and no scatter shows it.
fn copied(name: &str, values: &[f64]) -> Option<Check> {
    let stretch = if is_coarse(values) { COARSE_STRETCH } else { STRETCH };
    let bits: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
    let varies = |window: &[u64]| {
        let mut distinct = window.to_vec();
        distinct.sort_unstable();
        distinct.dedup();
        4 * distinct.len() >= 3 * window.len()
    };
    let mut known: HashMap<&[u64], usize> = HashMap::new();
    let mut is_copy = vec![false; values.len()];
    let mut first = None;
    for (row, window) in bits.windows(stretch).enumerate().filter(|(_, window)| varies(window)) {
        let earlier = *known.entry(window).or_insert(row);
        if row >= earlier + stretch {
            is_copy[row..row + stretch].fill(true);
            first.get_or_insert([earlier, row]);
        }
    }
    // Each reading twice, one after the other.
    let doubled = bits.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let copies = is_copy.iter().filter(|is_copy| **is_copy).count();
    let count = values.len();
    // What is written with many digits and comes again at such length is a copy, however short beside the whole.
    let is_long = |copies: usize| !is_coarse(values) && copies >= LONG * stretch;
    let enough = |copies: usize| is_long(copies) || (copies >= stretch && copies as f64 >= MATTERS * count as f64);
    let words = match first {
        Some([earlier, row]) if enough(copies) => format!(
            "{copies} of {count} readings `{name}` are equal to earlier ones in the same order, digit by digit, from row {} on to those from row {} on",
            row + 1,
            earlier + 1
        ),
        _ if enough(doubled) && !is_coarse(values) => {
            format!("{doubled} of {count} readings `{name}` are equal to the one before, digit by digit")
        }
        _ => return None,
    };
    let share = copies.max(doubled) as f64 / count as f64;
    let found = || format!("{words}: they are copies, or without noise, and show none; leave copies out");
    Some(Check::new(Test::Measured, name, share, &[], 0.0).finding(found))
}

/// Whether readings are written with few digits beside their range, or are of one or two numbers.
fn is_coarse(values: &[f64]) -> bool {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    let [low, _, .., high] = sorted[..] else { return true };
    let digit = 10_f64.powf((COARSE * (high - low)).log10().ceil());
    sorted.iter().all(|value| (value / digit - (value / digit).round()).abs() < ON_GRID)
}

/// A column that stays at one number for long and varies elsewhere. What is written with few digits may stand still by right.
fn stuck(name: &str, values: &[f64]) -> Option<Check> {
    if is_coarse(values) {
        return None;
    }
    let runs: Vec<&[f64]> = values.chunk_by(|a, b| a.to_bits() == b.to_bits()).collect();
    let mut lengths: Vec<usize> = runs.iter().map(|run| run.len()).collect();
    lengths.sort_unstable();
    let usual = lengths.get(lengths.len() / 2).copied().unwrap_or_default();
    let mut row = 0;
    for run in &runs {
        if run.len() < values.len() && run.len() >= STUCK * usual && run.len() as f64 >= MATTERS * values.len() as f64 {
            let found = || {
                format!(
                    "`{name}` is {} in each of {} rows, from row {} on: it was stuck there, and what is said by it does not hold",
                    run[0],
                    run.len(),
                    row + 1
                )
            };
            return Some(
                Check::new(Test::Measured, name, run.len() as f64 / values.len() as f64, &[], 0.0).finding(found),
            );
        }
        row += run.len();
    }
    None
}

/// Columns that are equal digit by digit, but for a few rows.
fn equal_columns(measured: &[(&PointColumn, &[f64])]) -> Option<Check> {
    let pairs = measured.iter().enumerate().flat_map(|(at, one)| measured[..at].iter().map(move |other| (other, one)));
    let mut equal = pairs.filter(|((_, one), (_, other))| {
        let same = one.iter().zip(*other).filter(|(a, b)| a.to_bits() == b.to_bits()).count();
        one.len() >= FEWEST_ROWS && same as f64 >= (1.0 - MATTERS) * one.len() as f64 && !is_coarse(one)
    });
    let ((one, _), (other, _)) = equal.next()?;
    let found = || format!("`{}` and `{}` are equal digit by digit: one of them is a copy", one.name, other.name);
    Some(Check::new(Test::Measured, one.name, 1.0, &[], 0.0).finding(found))
}

/// Columns that hold one number, where others vary.
fn unmeasured(measured: &[(&PointColumn, &[f64])]) -> Vec<Check> {
    let is_constant = |values: &[f64]| values.windows(2).all(|pair| pair[0].to_bits() == pair[1].to_bits());
    let enough = |values: &[f64]| values.len() >= FEWEST_ROWS;
    let any_varies = measured.iter().any(|(_, values)| enough(values) && !is_constant(values));
    let dead = measured.iter().filter(|(_, values)| any_varies && is_constant(values));
    dead.map(|(column, values)| {
        let found = || {
            let remedy = if column.optional { "; leave the column out" } else { "" };
            format!(
                "`{}` is {} in every row: it was not measured, and what is said by it does not hold{remedy}",
                column.name,
                values.first().copied().unwrap_or_default()
            )
        };
        Check::new(Test::Measured, column.name, 0.0, &[], 0.0).finding(found)
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::{Column, PointKind::Number};

    const COLUMNS: [PointColumn; 3] = [
        PointColumn::needed("place_mm", Number, "mm", "place"),
        PointColumn::needed("dx_mm", Number, "mm", "reading").measured(),
        PointColumn::needed("dz_mm", Number, "mm", "reading").measured(),
    ];

    /// Readings that look like noise, and places that come again.
    fn reading(row: usize) -> f64 {
        ((row * row * 7919 + row * 104_729) % 99_991) as f64 * 1e-7
    }

    fn findings(dx: impl Fn(usize) -> f64, dz: impl Fn(usize) -> f64, count: usize) -> Vec<String> {
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        let columns = vec![
            column("place_mm", (0..count).map(|row| (row % 20) as f64).collect()),
            column("dx_mm", (0..count).map(dx).collect()),
            column("dz_mm", (0..count).map(dz).collect()),
        ];
        let points = Points { columns, ..Points::default() };
        checks(&points, &COLUMNS).into_iter().filter(Check::refutes).map(|check| check.finding).collect()
    }

    #[test]
    fn numbers_in_another_unit_are_asked_about() {
        let columns = [PointColumn::needed("deviation_um", Number, "um", "reading").measured()];
        let said = |scale: f64| {
            let values = (0..50).map(|row| scale * reading(row)).collect();
            let points = Points { columns: vec![Column { name: "deviation_um".into(), values }], ..Points::default() };
            units(&points, &columns)
        };
        // Readings to 0.01: of some µm, in mm, and in nm.
        assert!(said(1e3).is_empty() && said(1e5).is_empty(), "{:?}", said(1e3));
        assert!(said(0.5)[0].contains("are its numbers in mm?"), "{:?}", said(0.5));
        assert!(said(1e7)[0].contains("are its numbers in nm?"), "{:?}", said(1e7));
    }

    #[test]
    fn copies_and_dead_channels_are_named_and_sound_readings_are_not() {
        let sound = |row: usize| reading(row + 1000);
        assert_eq!(findings(reading, sound, 200), [""; 0]);
        // A pass that was stored twice, and each reading twice.
        let twice = findings(|row| reading(row % 100), sound, 200);
        assert!(
            twice.len() == 1 && twice[0].contains("100 of 200") && twice[0].contains("from row 101 on"),
            "{twice:?}"
        );
        let doubled = findings(|row| reading(row / 2), sound, 200);
        assert!(doubled.len() == 1 && doubled[0].contains("equal to the one before"), "{doubled:?}");
        // One reading of a few that comes again, and repeats that a coarse resolution makes equal.
        assert_eq!(findings(|row| if row == 50 { reading(20) } else { reading(row) }, sound, 200), [""; 0]);
        assert_eq!(findings(|row| ((row % 20) * 3 % 17) as f64 * 1e-3, |row| 1e-3 * (row % 7) as f64, 40), [""; 0]);
        let impossible =
            Points { columns: vec![Column { name: "dx_mm".into(), values: vec![0.1, -1e300] }], ..Points::default() };
        let refused = refuse_impossible(&impossible).unwrap_err().to_string();
        assert!(refused.contains("`dx_mm` is -1e300 in row 2"), "{refused}");
        let coded = findings(|row| if row % 60 == 3 { -9999.0 } else { reading(row) }, sound, 200);
        assert!(coded.len() == 1 && coded[0].contains("`dx_mm` is -9999 in 4 rows"), "{coded:?}");
        // The same of a grid of which few places are taken.
        assert_eq!(findings(|row| ((row % 20) * 37 % 191) as f64 * 1e-3, sound, 40), [""; 0]);
        let stuck = findings(reading, |row| if row < 120 { sound(row) } else { sound(120) }, 200);
        assert!(stuck.len() == 1 && stuck[0].contains("80 rows, from row 121 on"), "{stuck:?}");
        let equal = findings(reading, reading, 200);
        assert!(equal.len() == 1 && equal[0].contains("`dx_mm` and `dz_mm` are equal"), "{equal:?}");
        let of = |sizes: &[f64]| {
            let parts: Vec<_> = sizes.iter().zip(1..).map(|(size, set)| (format!("set {set}"), *size)).collect();
            unlike_units(&parts, "convert their file").map(|check| check.finding).unwrap_or_default()
        };
        assert!(of(&[1.1, 950.0, 0.8]).contains("set 2 are 864 times larger than those of the others: some"));
        assert!(of(&[1.1, 1e-3, 0.8]).contains("set 2 are 800 times smaller") && of(&[1.1, 25.0, 0.8]).is_empty());
        assert!(of(&[1.1, 950.0, 800.0, 0.8]).contains("set 3, set 2 are 727 times larger than those of set 4, set 1"));
        assert!(of(&[1.1]).is_empty() && of(&[1.1, 0.0]).is_empty() && of(&[1.1, f64::NAN]).is_empty());
        let dead = findings(reading, |_| 0.0123, 200);
        assert!(dead.len() == 1 && dead[0].contains("`dz_mm` is 0.0123 in every row"), "{dead:?}");
        assert_eq!(findings(|_| 0.0, |_| 0.0, 200), [""; 0]);
    }
}
