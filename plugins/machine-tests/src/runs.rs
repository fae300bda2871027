//! Approaches of target positions: which target, from which side, in which run.

use runout_core::{Error, ErrorKind, Result, points::Points};

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

    /// The same of some rows; `of_what` names them in an error.
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
        let side = match direction {
            Some(column) => {
                stated(column).map_err(|problem| refuse(problem, "1 is the positive direction, -1 the negative one"))?
            }
            None => followed(given),
        };
        let mut targets = given.to_vec();
        targets.sort_by(f64::total_cmp);
        let travel = targets.last().zip(targets.first()).map_or(0.0, |(last, first)| last - first);
        targets.dedup_by(|next, kept| *next - *kept <= SAME_TARGET * travel);
        if targets.len() < 2 {
            let found = format!("expected at least 2 target positions, found {}", targets.len());
            return Err(refuse(found, "name the commanded position of each row in the column of targets"));
        }
        let sides: Vec<i8> = [1, -1].into_iter().filter(|one| side.contains(one)).collect();
        let mut deviations = vec![vec![Vec::new(); sides.len()]; targets.len()];
        for ((at, side), deviation) in given.iter().zip(&side).zip(deviation) {
            let nearest = targets.partition_point(|target| *target < at - 0.5 * SAME_TARGET * travel);
            let place = nearest.min(targets.len() - 1);
            let column = sides.iter().position(|one| one == side).unwrap_or(0);
            deviations[place][column].push(*deviation);
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
                        "approach each target equally often from each side; ISO 230-2 asks for 5 times",
                    ));
                }
            }
        }
        Ok(Self { targets, sides, deviations })
    }

    /// Fewest approaches of a target from a side.
    pub(crate) fn fewest_runs(&self) -> usize {
        self.deviations.iter().flatten().map(Vec::len).min().unwrap_or(0)
    }

    /// What changes from run to run.
    pub(crate) fn noise(&self) -> Noise {
        let runs = self.fewest_runs();
        let (low, high) = (self.targets[0], self.targets[self.targets.len() - 1]);
        let along: Vec<f64> = self.targets.iter().map(|target| 2.0 * (target - low) / (high - low) - 1.0).collect();
        let middle = mean(&along);
        let along: Vec<f64> = along.iter().map(|place| place - middle).collect();
        let sides = self.sides.len();
        let cells = (self.targets.len() * sides) as f64;
        let squares_along = along.iter().map(|place| place * place).sum::<f64>() * sides as f64;
        let (mut common, mut slope, mut own) = (Vec::new(), 0.0, 0.0);
        for run in 0..runs {
            let left = |place: usize, side: usize| {
                let cell = &self.deviations[place][side];
                cell[run] - mean(&cell[..runs])
            };
            let each = || (0..along.len()).flat_map(|place| (0..sides).map(move |side| (place, side)));
            let level = each().map(|(place, side)| left(place, side)).sum::<f64>() / cells;
            let tilt = each().map(|(place, side)| along[place] * left(place, side)).sum::<f64>() / squares_along;
            own += each().map(|(place, side)| (left(place, side) - level - tilt * along[place]).powi(2)).sum::<f64>();
            slope += tilt * tilt;
            common.push(level);
        }
        let freedom = runs - 1;
        let freedom_own = ((cells - 2.0) as usize).max(1) * freedom;
        let of_runs = |squares: f64| (squares / freedom as f64).sqrt();
        Noise {
            copies: self
                .deviations
                .iter()
                .flatten()
                .all(|runs| runs.iter().all(|one| one.to_bits() == runs[0].to_bits())),
            common_std: of_runs(common.iter().map(|level| level * level).sum()),
            slope_std: of_runs(slope),
            own_std: (own / freedom_own as f64).sqrt(),
            course: common,
            along,
            runs,
            freedom_own,
        }
    }
}

/// What changes from run to run: by one deviation at all targets, by one that grows along the travel, and at each target by itself.
pub(crate) struct Noise {
    /// Deviation of each run at all targets, from the mean of the runs.
    pub course: Vec<f64>,
    pub common_std: f64,
    /// At the ends of the travel.
    pub slope_std: f64,
    pub own_std: f64,
    /// Places along the travel: two apart at its ends, 0 on average.
    pub along: Vec<f64>,
    pub runs: usize,
    pub freedom_own: usize,
    /// Whether the runs are equal, digit by digit.
    pub copies: bool,
}

impl Noise {
    /// Correlation of the runs' deviations with their number.
    pub(crate) fn trend(&self) -> f64 {
        let middle = 0.5 * (self.runs as f64 - 1.0);
        let each = || self.course.iter().enumerate().map(|(run, level)| (run as f64 - middle, level));
        let along: f64 = each().map(|(run, level)| run * level).sum();
        let [runs, levels] =
            [each().map(|(run, _)| run * run).sum::<f64>(), each().map(|(_, level)| level * level).sum()];
        if levels > 0.0 { along / (runs * levels).sqrt() } else { 0.0 }
    }
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

/// Sides by the target before: the same target twice running was passed and approached from the other side, and a single step back begins a run anew,
/// approached as its next target is.
fn followed(targets: &[f64]) -> Vec<i8> {
    let step = |row: usize| {
        let next = targets.get(row).zip(targets.get(row.wrapping_sub(1)));
        next.map_or(0, |(at, before)| i8::from(at > before) - i8::from(at < before))
    };
    let mut sides: Vec<i8> = Vec::with_capacity(targets.len());
    for row in 0..targets.len() {
        let before = sides.last().copied().unwrap_or(-1);
        let (into, out) = (step(row), step(row + 1));
        let begins = row == 0 || (into == -before && out == before);
        sides.push(match if begins { out } else { into } {
            0 => -before,
            side => side,
        });
    }
    sides
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of a sample, about its mean.
pub(crate) fn std(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::followed;

    #[test]
    fn sides_follow_from_the_order_of_the_targets() {
        // Up, passed at the end, down, passed at the beginning, up.
        assert_eq!(followed(&[0.0, 1.0, 2.0, 2.0, 1.0, 0.0, 0.0, 1.0]), [1, 1, 1, -1, -1, -1, 1, 1]);
        // Up, back to the beginning, up.
        assert_eq!(followed(&[0.0, 1.0, 2.0, 0.0, 1.0, 2.0]), [1; 6]);
        // Up and down without the last target twice.
        assert_eq!(followed(&[0.0, 1.0, 2.0, 1.0, 0.0, 1.0]), [1, 1, 1, -1, -1, 1]);
    }
}
