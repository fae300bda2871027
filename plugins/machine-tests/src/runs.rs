//! Approaches of target positions: which target, from which side, in which run.

use runout_core::{
    Error, ErrorKind, Result,
    numerics::least_squares::{Basis, dot},
    points::Points,
};

/// Runs are off as a whole where their means scatter by so many times what the noise at single targets makes.
const OFF: f64 = 3.0;
/// They drift where their means go with their number, by this correlation, which chance makes once in fifty of five runs; or where so many of them
/// rise or fall one after the other, which chance makes once in sixty.
const TREND: f64 = 0.93;
const FEWEST_FOR_A_TREND: usize = 4;
const FEWEST_IN_TURN: usize = 5;
/// Degree of a drift in the number of the row.
const DRIFT_DEGREE: i32 = 3;
/// Two targets are one where they differ by less than this share of the travel: commands are written with few digits.
const SAME_TARGET: f64 = 1e-7;

/// Deviations of one axis, by target and side of the approach.
pub(crate) struct Approaches {
    /// Target positions, ascending.
    pub targets: Vec<f64>,
    /// Sides: +1 approached in the positive direction, −1 in the negative one.
    pub sides: Vec<i8>,
    /// `[target][side][run]`.
    pub deviations: Vec<Vec<Vec<f64>>>,
    /// The row of each, counted among those of the axis.
    pub rows: Vec<Vec<Vec<usize>>>,
}

impl Approaches {
    /// Sorts points. Without a column `direction` the side follows from the target before, in the order of the rows.
    ///
    /// # Errors
    /// When there are fewer than two targets, a target was approached less than twice from a side, or a direction is neither 1 nor −1.
    pub(crate) fn of(points: &Points, target: &str, deviation: &str) -> Result<Self> {
        let direction = points.column("direction").ok();
        Self::of_rows(points, "", points.column(target)?, direction, points.column(deviation)?)
    }

    /// Sorts some rows; `of_what` names them in an error. Without `direction` the side follows from the target before, in the order of the rows.
    pub(crate) fn of_rows(
        points: &Points,
        of_what: &str,
        given: &[f64],
        direction: Option<&[f64]>,
        deviation: &[f64],
    ) -> Result<Self> {
        let refuse = |problem: String, help: &str| {
            let problem = if of_what.is_empty() { problem } else { format!("{of_what}: {problem}") };
            Error::new("evaluate", points.input.display().to_string(), problem)
                .of(ErrorKind::InsufficientData)
                .help(help.to_owned())
        };
        let mut targets = given.to_vec();
        targets.sort_by(f64::total_cmp);
        let travel = targets.last().zip(targets.first()).map_or(0.0, |(last, first)| last - first);
        targets.dedup_by(|next, kept| *next - *kept <= SAME_TARGET * travel);
        if targets.len() < 2 {
            let found = format!("expected at least 2 target positions, found {}", targets.len());
            return Err(refuse(found, "name the commanded position of each row in the column of targets"));
        }
        let side = match direction {
            Some(column) => {
                stated(column).map_err(|problem| refuse(problem, "1 is the positive direction, -1 the negative one"))?
            }
            None => followed(given, SAME_TARGET * travel).map_err(|problem| {
                refuse(
                    problem,
                    "add the column `direction`, 1 or -1, or keep the rows in the order in which they were measured",
                )
            })?,
        };
        let sides: Vec<i8> = [1, -1].into_iter().filter(|one| side.contains(one)).collect();
        let mut deviations = vec![vec![Vec::new(); sides.len()]; targets.len()];
        let mut rows = vec![vec![Vec::new(); sides.len()]; targets.len()];
        for (row, ((at, side), deviation)) in given.iter().zip(&side).zip(deviation).enumerate() {
            let nearest = targets.partition_point(|target| *target < at - 0.5 * SAME_TARGET * travel);
            let place = nearest.min(targets.len() - 1);
            let column = sides.iter().position(|one| one == side).unwrap_or(0);
            deviations[place][column].push(*deviation);
            rows[place][column].push(row);
        }
        for (target, of_target) in targets.iter().zip(&deviations) {
            for (side, runs) in sides.iter().zip(of_target) {
                if runs.len() < 2 {
                    let found = format!(
                        "expected at least 2 approaches of target {target} in direction {side:+}, found {}",
                        runs.len()
                    );
                    return Err(refuse(
                        found,
                        "targets are commanded positions, the same in all runs; approach each equally often from each side, by ISO 230-2 5 times",
                    ));
                }
            }
        }
        Ok(Self { targets, sides, deviations, rows })
    }

    /// Fewest approaches of a target from a side.
    pub(crate) fn fewest_runs(&self) -> usize {
        self.deviations.iter().flatten().map(Vec::len).min().unwrap_or(0)
    }

    /// The approaches less what changes alike at all targets with the number of the row, but for its mean: a polynomial, by what
    /// each target and side shows of it from run to run.
    pub(crate) fn without_drift(&self) -> Self {
        let count = self.rows.iter().flatten().map(Vec::len).sum::<usize>();
        let time = |row: usize| 2.0 * row as f64 / count as f64 - 1.0;
        let cells = || self.rows.iter().flatten().zip(self.deviations.iter().flatten());
        let centred = |of: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
            let cell = |(rows, deviations): (&Vec<usize>, &Vec<f64>)| {
                let values: Vec<f64> = rows.iter().zip(deviations).map(|(row, one)| of(*row, *one)).collect();
                let middle = mean(&values);
                values.into_iter().map(move |value| value - middle).collect::<Vec<f64>>()
            };
            cells().flat_map(cell).collect()
        };
        let powers = Basis::of((1..=DRIFT_DEGREE).map(|power| centred(&|row, _| time(row).powi(power))).collect());
        let found = centred(&|_, deviation| deviation);
        let size: Vec<f64> = powers.weights().iter().map(|weights| dot(weights, &found)).collect();
        let drift =
            |row: usize| (1..=DRIFT_DEGREE).zip(&size).map(|(power, size)| size * time(row).powi(power)).sum::<f64>();
        let middle = (0..count).map(drift).sum::<f64>() / count as f64;
        let mut without = self.deviations.clone();
        for (deviation, row) in without.iter_mut().flatten().flatten().zip(self.rows.iter().flatten().flatten()) {
            *deviation -= drift(*row) - middle;
        }
        Self { targets: self.targets.clone(), sides: self.sides.clone(), deviations: without, rows: self.rows.clone() }
    }

    /// What changes from run to run.
    pub(crate) fn noise(&self) -> Noise {
        let runs = self.fewest_runs();
        let (low, high) = (self.targets[0], self.targets[self.targets.len() - 1]);
        let along: Vec<f64> = self.targets.iter().map(|target| 2.0 * (target - low) / (high - low) - 1.0).collect();
        let middle = mean(&along);
        let along: Vec<f64> = along.iter().map(|place| place - middle).collect();
        let sides = self.sides.len();
        let cells = self.targets.len() * sides;
        let squares_along = along.iter().map(|place| place * place).sum::<f64>();
        let (mut course, mut own) = (Vec::new(), 0.0);
        // Level and tilt of what both sides of a run have in common, and of half of what they are apart by.
        let (mut common, mut apart) = (Vec::new(), Vec::new());
        for run in 0..runs {
            let of_side = |side: usize| {
                let left = |place: usize| {
                    let cell = &self.deviations[place][side];
                    cell[run] - mean(&cell[..runs])
                };
                let level = (0..along.len()).map(left).sum::<f64>() / along.len() as f64;
                let tilt = (0..along.len()).map(|place| along[place] * left(place)).sum::<f64>() / squares_along;
                let squares =
                    (0..along.len()).map(|place| (left(place) - level - tilt * along[place]).powi(2)).sum::<f64>();
                ([level, tilt], squares)
            };
            let each: Vec<([f64; 2], f64)> = (0..sides).map(of_side).collect();
            own += each.iter().map(|(_, squares)| squares).sum::<f64>();
            let [first, last] = [each[0].0, each[sides - 1].0];
            common.push([0, 1].map(|part| 0.5 * (first[part] + last[part])));
            apart.push([0, 1].map(|part| 0.5 * (first[part] - last[part])));
            course.push(0.5 * (first[0] + last[0]));
        }
        let freedom = runs - 1;
        let freedom_own = (cells - 2 * sides).max(1) * freedom;
        let own_variance = own / freedom_own as f64;
        // What noise at single targets makes of level and tilt.
        let of_own = [cells as f64, sides as f64 * squares_along].map(|weight| own_variance / weight);
        Noise {
            copies: self
                .deviations
                .iter()
                .flatten()
                .all(|runs| runs.iter().all(|one| one.to_bits() == runs[0].to_bits())),
            common: principal(&common, of_own),
            apart: principal(&apart, of_own),
            own_std: own_variance.sqrt(),
            course,
            along,
            runs,
            freedom_own,
        }
    }
}

/// What changes from run to run: at all targets alike, by what grows along the travel, both for the two sides together and against each other, and at
/// each target by itself.
pub(crate) struct Noise {
    /// Deviation of each run at all targets, from the mean of the runs.
    pub course: Vec<f64>,
    /// What a run is off by as a whole, of the mean of both sides: two parts that do not depend on each other, each the level and what grows along the
    /// travel to its ends, of one standard deviation.
    pub common: [[f64; 2]; 2],
    /// Half of what the two sides of a run are apart by as a whole: two parts that do not depend on each other, each the level
    /// and what grows along the travel to its ends, of one standard deviation.
    pub apart: [[f64; 2]; 2],
    pub own_std: f64,
    /// Places along the travel: two apart at its ends, 0 on average.
    pub along: Vec<f64>,
    pub runs: usize,
    pub freedom_own: usize,
    /// Whether the runs are equal, digit by digit.
    pub copies: bool,
}

/// What runs do as a whole, at all targets alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Runs {
    Alike,
    Differ,
    Drift,
}

impl Noise {
    /// What the runs do as a whole, each the mean of so many approaches.
    pub(crate) fn of_whole_runs(&self, approaches: usize) -> Runs {
        let std = self.own_std / (approaches as f64).sqrt();
        if !(self.common_std() > OFF * std && std > 0.0) {
            return Runs::Alike;
        }
        let steps = || self.course.windows(2).map(|pair| pair[1] - pair[0]);
        let in_turn = steps().all(|step| step > 0.0) || steps().all(|step| step < 0.0);
        let drifts =
            (self.runs >= FEWEST_FOR_A_TREND && self.trend().abs() > TREND) || (self.runs >= FEWEST_IN_TURN && in_turn);
        if drifts { Runs::Drift } else { Runs::Differ }
    }

    /// Standard deviation of the level of a run.
    pub(crate) fn common_std(&self) -> f64 {
        let [one, other] = self.common;
        one[0].hypot(other[0])
    }

    /// Correlation of the runs' deviations with their number.
    fn trend(&self) -> f64 {
        let middle = 0.5 * (self.runs as f64 - 1.0);
        let each = || self.course.iter().enumerate().map(|(run, level)| (run as f64 - middle, level));
        let along: f64 = each().map(|(run, level)| run * level).sum();
        let [runs, levels] =
            [each().map(|(run, _)| run * run).sum::<f64>(), each().map(|(_, level)| level * level).sum()];
        if levels > 0.0 { along / (runs * levels).sqrt() } else { 0.0 }
    }
}

/// Principal components of levels and tilts about 0, less these variances of noise: a scale that changes from run to run changes both alike.
fn principal(runs: &[[f64; 2]], of_noise: [f64; 2]) -> [[f64; 2]; 2] {
    let freedom = (runs.len() - 1) as f64;
    let product = |a: usize, b: usize| runs.iter().map(|run| run[a] * run[b]).sum::<f64>() / freedom;
    let (level, tilt, both) = (product(0, 0) - of_noise[0], product(1, 1) - of_noise[1], product(0, 1));
    let (sin, cos) = (0.5 * (2.0 * both).atan2(level - tilt)).sin_cos();
    [[cos, sin], [-sin, cos]].map(|[along, across]| {
        let variance = level * along * along + 2.0 * both * along * across + tilt * across * across;
        [along, across].map(|share| share * variance.max(0.0).sqrt())
    })
}

/// Sides as a file states them.
pub(crate) fn stated(column: &[f64]) -> std::result::Result<Vec<i8>, String> {
    let side = |(row, value): (usize, &f64)| match *value {
        1.0 => Ok(1),
        -1.0 => Ok(-1),
        other => Err(format!("row {}: expected a direction of 1 or -1, found {other}", row + 1)),
    };
    column.iter().enumerate().map(side).collect()
}

/// Sides by the target before: where the path turns, a target twice running was passed and approached from the other side, and a single step back
/// begins a run anew, approached as its next target is. A target that follows itself elsewhere says nothing of its side, as in a table that was sorted.
fn followed(targets: &[f64], same: f64) -> std::result::Result<Vec<i8>, String> {
    let step = |row: usize| {
        let next = targets.get(row).zip(targets.get(row.wrapping_sub(1)));
        next.map_or(0, |(at, before)| i8::from(at - before > same) - i8::from(before - at > same))
    };
    let mut sides: Vec<i8> = Vec::with_capacity(targets.len());
    for row in 0..targets.len() {
        let before = sides.last().copied().unwrap_or(-1);
        let (into, out) = (step(row), step(row + 1));
        let is_last = row + 1 == targets.len();
        if row > 0 && into == 0 && (step(row - 1) == 0 || !(is_last || out == -step(row - 1))) {
            return Err(format!(
                "row {}: target {} follows itself where the path does not turn: nothing says from which side it was approached",
                row + 1,
                targets[row]
            ));
        }
        let begins = row == 0 || (into == -before && out == before);
        sides.push(match if begins { out } else { into } {
            0 => -before,
            side => side,
        });
    }
    Ok(sides)
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of a sample, about its mean.
pub(crate) fn std(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt()
}
