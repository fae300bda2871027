//! What readings that were repeated say of themselves: the tests of [`consistency`](runout_core::consistency), which contradict values.

use runout_core::{
    consistency::{
        Action, Check, Judgement, Kind, LinearFit, Shift, Structure, Test,
        groups::{Group, Level, alike},
        judge, rows,
    },
    numerics::least_squares::Basis,
};

use crate::runs::{Approaches, mean};

/// Series that are evaluated, evenly taken of more.
const MOST_SERIES: usize = 20;
/// Parts of the travel whose scatter is compared.
const PARTS: usize = 3;

/// What the user should know, and what readings say of themselves.
#[derive(Default)]
pub(crate) struct Said {
    pub remarks: Vec<String>,
    pub checks: Vec<Check>,
}

/// Numbers that were taken one after the other, in series of their own: whether they depend on those beside them, whether they drift from the
/// first to the last, and whether a single one is unlike the others. A finding contradicts the values.
pub(crate) fn in_order(what: &str, series: &[(&str, &[f64])], unit: &str) -> Vec<Check> {
    let taken: Vec<(&str, &[f64])> =
        series.iter().step_by(series.len().div_ceil(MOST_SERIES).max(1)).copied().collect();
    contradicting(Series::of(&taken).judged(what, unit, false).checks)
}

/// Findings that no wider uncertainty answers: the values are no means.
fn contradicting(mut checks: Vec<Check>) -> Vec<Check> {
    checks.iter_mut().filter(|check| !check.finding.is_empty()).for_each(|check| check.did = Action::Verdict);
    checks
}

/// Judges numbers that were taken one after the other, in series of their own, and gives the factor on the standard uncertainty
/// of each mean, by which a dependence widens it.
pub(crate) fn means_in_order(what: &str, series: &[(&str, &[f64])], unit: &str) -> Judgement {
    Series::of(series).judged(what, unit, true)
}

/// Numbers beside the mean of their series.
struct Series<'a> {
    all: &'a [(&'a str, &'a [f64])],
    /// Of each number, its series and its place there.
    place: Vec<(usize, usize)>,
}

impl<'a> Series<'a> {
    fn of(all: &'a [(&'a str, &'a [f64])]) -> Self {
        let place = all.iter().enumerate().flat_map(|(own, (_, of))| (0..of.len()).map(move |at| (own, at)));
        Self { all, place: place.collect() }
    }

    /// A column for each series: a function of its length, and 0 elsewhere.
    fn columns(&self, of: fn(f64) -> f64) -> Vec<Vec<f64>> {
        let column = |number: usize| {
            let entry = of(self.all[number].1.len() as f64);
            self.place.iter().map(|(own, _)| if *own == number { entry } else { 0.0 }).collect()
        };
        (0..self.all.len()).map(column).collect()
    }

    /// From the first to the last number of a series, and 0 elsewhere.
    fn ramp(&self, number: usize) -> Vec<f64> {
        let steps = (self.all[number].1.len() - 1).max(1) as f64;
        self.place.iter().map(|(own, at)| if *own == number { *at as f64 / steps } else { 0.0 }).collect()
    }

    /// What a drift is compared with, and the drift of each series.
    fn levels(&self, what: &str) -> Vec<String> {
        if self.all.len() == 1 {
            return ["first", "last"].map(|end| format!("the {end} of {what}")).to_vec();
        }
        let of = |(name, _): &(&str, &[f64])| format!("the drift of {name}");
        std::iter::once("no drift".to_owned()).chain(self.all.iter().map(of)).collect()
    }

    fn judged(&self, what: &str, unit: &str, has_means: bool) -> Judgement {
        let means: Vec<f64> = self.all.iter().map(|(_, of)| mean(of)).collect();
        let residual: Vec<f64> = self.place.iter().map(|(own, at)| self.all[*own].1[*at] - means[*own]).collect();
        let drift = Shift {
            name: what.to_owned(),
            levels: self.levels(what),
            columns: (0..self.all.len()).map(|number| self.ramp(number)).collect(),
        };
        let mut structure = Structure::default()
            .along(
                what,
                self.place.iter().map(|(own, _)| *own).collect(),
                self.place.iter().map(|(_, at)| *at as f64).collect(),
            )
            .naming(self.place.iter().map(|(own, at)| format!("{} {}", self.all[*own].0, at + 1)).collect());
        structure.shifts.push(drift);
        let fit = LinearFit {
            residual: &residual,
            basis: &self.columns(|count| count.sqrt().recip()),
            names: &self.all.iter().map(|(name, _)| (*name).to_owned()).collect::<Vec<String>>(),
            weights: &if has_means { self.columns(f64::recip) } else { Vec::new() },
            noise: None,
            unit,
        };
        judge(fit, &structure)
    }
}

/// Approaches of targets: whether those of a run depend on each other along the travel, whether they scatter alike in all parts of it, and
/// single ones unlike the others of their target; beside what a whole run is off by from one side, at all targets and along the travel.
pub(crate) fn approaches(of: &Approaches, along: &[f64], [place, unit]: [&str; 2]) -> Vec<Check> {
    let (runs, targets, sides) = (of.fewest_runs(), of.targets.len(), of.sides.len());
    // Orthonormal contrasts of the runs (Helmert): of independent runs they are independent, and have no mean.
    let contrast = |number: usize, run: usize| {
        let before = (number + 1) as f64;
        let size = (before * (before + 1.0)).sqrt();
        if run <= number {
            -1.0 / size
        } else if run == number + 1 {
            before / size
        } else {
            0.0
        }
    };
    let mut readings = Vec::new();
    for number in 0..runs - 1 {
        for side in 0..sides {
            readings.extend((0..targets).map(|target| (number, side, target)));
        }
    }
    let value = |(number, side, target): &(usize, usize, usize)| {
        let cell = &of.deviations[*target][*side][..runs];
        cell.iter().enumerate().map(|(run, one)| contrast(*number, run) * one).sum::<f64>()
    };
    let column = |pass: (usize, usize), of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        readings.iter().map(|(number, side, target)| if (*number, *side) == pass { of(*target) } else { 0.0 }).collect()
    };
    let passes = (0..runs - 1).flat_map(|number| (0..sides).map(move |side| (number, side)));
    let whole = passes.flat_map(|pass| [column(pass, &|_| 1.0), column(pass, &|target| along[target])]);
    let basis = Basis::of(whole.collect());
    let mut residual: Vec<f64> = readings.iter().map(value).collect();
    basis.remove_from(&mut residual);
    let each = targets.div_ceil(PARTS);
    let part = |first: usize| {
        let last = (first + each).min(targets) - 1;
        format!("the travel from {} to {} {place}", of.targets[first], of.targets[last])
    };
    let structure = Structure::default()
        .along(
            "the travel",
            readings.iter().map(|(number, side, _)| number * sides + side).collect(),
            readings.iter().map(|(.., target)| of.targets[*target]).collect(),
        )
        .divided(
            "parts",
            Kind::Alike,
            readings.iter().map(|(.., target)| target / each).collect(),
            (0..targets).step_by(each).map(part).collect(),
        );
    let fit = LinearFit { residual: &residual, basis: basis.columns(), names: &[], weights: &[], noise: None, unit };
    let mut checks = judge(fit, &structure).checks;
    // Contrasts have no single approach.
    checks.retain(|check| check.test != Test::Rows);
    let mut checks = contradicting(checks);
    let places: Vec<Vec<f64>> = of.deviations.iter().flatten().cloned().collect();
    let named = |place: usize, number: usize| {
        let (target, side) = (of.targets[place / sides], of.sides[place % sides]);
        format!("approach {number} of target {target} in direction {side:+}")
    };
    checks.extend(single(&places, named, unit));
    checks.extend(one_after_the_other(of, unit));
    checks
}

/// Where each target is approached several times before the next one, what changes with time is among its own approaches: these, less the mean of
/// their side, in the order of the rows, depend on each other. A drift of all is one of the runs.
fn one_after_the_other(of: &Approaches, unit: &str) -> Vec<Check> {
    let in_steps = |rows: &Vec<Vec<usize>>| {
        let all = || rows.iter().flatten();
        let range = all().max().zip(all().min()).map_or(0, |(last, first)| last + 1 - first);
        range == all().count()
    };
    if !of.rows.iter().all(in_steps) {
        return Vec::new();
    }
    let of_target = |(rows, sides): (&Vec<Vec<usize>>, &Vec<Vec<f64>>)| {
        let mut all: Vec<(usize, f64)> = Vec::new();
        for (rows, deviations) in rows.iter().zip(sides) {
            let middle = mean(deviations);
            all.extend(rows.iter().zip(deviations).map(|(row, deviation)| (*row, deviation - middle)));
        }
        all.sort_by_key(|(row, _)| *row);
        all.into_iter().map(|(_, left)| left).collect::<Vec<f64>>()
    };
    let left: Vec<Vec<f64>> = of.rows.iter().zip(&of.deviations).map(of_target).collect();
    let names: Vec<String> = of.targets.iter().map(|target| format!("target {target}, approach")).collect();
    let series: Vec<(&str, &[f64])> = names.iter().map(String::as_str).zip(left.iter().map(Vec::as_slice)).collect();
    let mut checks = in_order("the approaches of a target", &series, unit);
    checks.retain(|check| check.test == Test::Order);
    checks
}

/// Single readings that are not like the others of their place, of places that were read again and again. A finding contradicts the values.
/// `named` is what a reading of a place is called, by its number.
pub(crate) fn single(places: &[Vec<f64>], named: impl Fn(usize, usize) -> String, unit: &str) -> Option<Check> {
    let of_place =
        |(place, all): (usize, &Vec<f64>)| (1..=all.len()).map(|number| named(place, number)).collect::<Vec<String>>();
    let names = places.iter().enumerate().flat_map(of_place).collect();
    let found = rows::unlike_repeats(places)?;
    contradicting(vec![found.check(&Structure::default().naming(names), unit)]).pop()
}

/// Series at the same places: whether one of them is farther from their mean than the others. Of readings that depend on each other `freedom` is less
/// than their number. A finding contradicts the values.
pub(crate) fn alike_series(what: &str, series: &[(String, &[f64])], freedom: f64) -> Vec<Check> {
    let count = series.len() as f64;
    if series.len() < FEWEST_ALIKE {
        return Vec::new();
    }
    let places = 0..series[0].1.len();
    let means: Vec<f64> = places.map(|place| series.iter().map(|(_, of)| of[place]).sum::<f64>() / count).collect();
    let group = |(name, of): &(String, &[f64])| {
        let squares = of.iter().zip(&means).map(|(one, mean)| (one - mean).powi(2)).sum::<f64>();
        // As many degrees of freedom as the series has, in place of its readings.
        let share = freedom / of.len() as f64;
        Group { name: name.clone(), squares: share * squares, freedom: freedom * (count - 1.0) / count }
    };
    let groups: Vec<Group> = series.iter().map(group).collect();
    contradicting(alike(what, &groups, Level::Others, "its noise is less, or it is smoothed"))
}

/// Two series are as far from their mean as each other.
const FEWEST_ALIKE: usize = 3;
