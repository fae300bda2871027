//! Groups that have one noise level: orders, components, places, sensors. Too little is a finding too: a constant component, copied
//! rows, smoothed readings.

use runout_numerics::{
    number::significant,
    statistics::{chi2_above_and_below, f_tail},
};

use crate::check::{Check, FINDING, Test};

/// A group of readings, or of an order's coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// What it is: "circle C1", "order 3".
    pub name: String,
    /// Sum of squares of what the fit leaves of it.
    pub squares: f64,
    /// Its degrees of freedom: its readings less what they decide of the fit.
    pub freedom: f64,
}

/// What groups are compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Level {
    /// The other groups.
    Others,
    /// A variance, and the degrees of freedom that it is known from (infinite where it is known).
    Known {
        /// The variance.
        variance: f64,
        /// Its degrees of freedom.
        dof: f64,
    },
}

/// One group against its level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// Index of the group.
    pub group: usize,
    /// Its mean square over the level.
    pub ratio: f64,
    /// Degrees of freedom, above and below.
    pub dof: [f64; 2],
    /// Chance of as much, corrected for the number of groups and for both sides.
    pub p: f64,
}

/// Every group with degrees of freedom, against its level: F on both sides, times the number of groups.
#[must_use]
pub fn compared(groups: &[Group], level: Level) -> Vec<Compared> {
    let judged: Vec<(usize, &Group)> =
        groups.iter().enumerate().filter(|(_, group)| group.freedom > LEAST_FREEDOM).collect();
    // A group alone has no others.
    if level == Level::Others && judged.len() < 2 {
        return Vec::new();
    }
    let (squares, freedom) = judged
        .iter()
        .fold((0.0, 0.0), |(squares, freedom), (_, group)| (squares + group.squares, freedom + group.freedom));
    let one = |(index, group): &(usize, &Group)| {
        let (variance, below) = match level {
            Level::Others => ((squares - group.squares) / (freedom - group.freedom), freedom - group.freedom),
            Level::Known { variance, dof } => (variance, dof),
        };
        let ratio = group.squares / group.freedom / variance.max(f64::MIN_POSITIVE);
        let tail = if below.is_infinite() {
            let [above, under] = chi2_above_and_below(ratio * group.freedom, group.freedom);
            above.min(under)
        } else {
            // The tail on the side of the ratio is computed, the other one is its complement.
            let tail = if ratio > 1.0 {
                f_tail(ratio, group.freedom, below)
            } else {
                f_tail(ratio.recip(), below, group.freedom)
            };
            tail.min(1.0 - tail)
        };
        let p = (2.0 * tail * judged.len() as f64).min(1.0);
        Compared { group: *index, ratio, dof: [group.freedom, below], p }
    };
    judged.iter().map(one).collect()
}

/// Mean square over that of the others below which a group has none.
const CONSTANT: f64 = 1e-6;
/// Degrees of freedom from which a group is judged.
const LEAST_FREEDOM: f64 = 0.5;

/// The least likely group as a [`Check`], and every other one that is a finding: `what` the groups are, in the plural, `why` what a group
/// below the others may come from. What is a finding is none of the others for those that are judged after it.
#[must_use]
pub fn alike(what: &str, groups: &[Group], level: Level, why: &str) -> Vec<Check> {
    said(what, groups, compared(groups, level), level, why)
}

/// The least likely of groups that are [`compared`] already, and every other one that is a finding, each as a [`Check`]. `what`
/// names the groups in the plural; `why` gives what a group below the others may come from.
#[must_use]
pub fn said(what: &str, groups: &[Group], mut all: Vec<Compared>, level: Level, why: &str) -> Vec<Check> {
    let (count, mut left, mut checks) = (all.len(), groups.to_vec(), Vec::new());
    let others = if level == Level::Others { "the others" } else { "the noise" };
    while let Some(one) = least_likely(&all, level) {
        if !checks.is_empty() && one.p >= FINDING {
            break;
        }
        let name = &groups[one.group].name;
        let size = one.ratio.max(0.0).sqrt();
        checks.push(Check::new(Test::Alike, name, one.ratio, &one.dof, one.p).finding(|| {
            if one.ratio > 1.0 {
                format!("{name} has {size:.1} times the residual of {others} (of {count} {what})")
            } else {
                let size = significant(size, 2);
                format!("{name} has only {size} times the residual of {others} (of {count} {what}): {why}")
            }
        }));
        left[one.group].freedom = 0.0;
        if level == Level::Others {
            all = compared(&left, level);
        } else {
            all.retain(|other| other.group != one.group);
        }
    }
    checks
}

/// Of two groups, which are one comparison, the larger one unless the other is constant.
fn least_likely(all: &[Compared], level: Level) -> Option<Compared> {
    let least = all
        .iter()
        .copied()
        .min_by(|a, b| a.p.total_cmp(&b.p).then(b.ratio.total_cmp(&a.ratio)).then(a.group.cmp(&b.group)))?;
    let constant = all.iter().copied().find(|one| one.ratio < CONSTANT);
    if level == Level::Others && all.len() == 2 { constant.or(Some(least)) } else { Some(least) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{check::Action, testing::Random};

    fn groups(random: &mut Random, count: usize, readings: usize, sizes: &dyn Fn(usize) -> f64) -> Vec<Group> {
        let one = |group: usize, random: &mut Random| {
            let squares = (0..readings).map(|_| (sizes(group) * random.normal()).powi(2)).sum();
            Group { name: format!("part {group}"), squares, freedom: readings as f64 }
        };
        (0..count).map(|group| one(group, random)).collect()
    }

    #[test]
    fn unlike_groups_are_found_on_both_sides_and_like_ones_are_not() {
        let mut random = Random::new(5);
        let found = |random: &mut Random, level: Level, sizes: &dyn Fn(usize) -> f64| {
            let trials = 400;
            let hits = (0..trials)
                .filter(|_| alike("parts", &groups(random, 6, 12, sizes), level, "copied").iter().any(Check::refutes));
            hits.count() as f64 / f64::from(trials)
        };
        let known = Level::Known { variance: 4.0, dof: f64::INFINITY };
        for level in [Level::Others, known, Level::Known { variance: 4.0, dof: 60.0 }] {
            let clean = found(&mut random, level, &|_| 2.0);
            let large = found(&mut random, level, &|group| if group == 2 { 7.0 } else { 2.0 });
            let small = found(&mut random, level, &|group| if group == 2 { 0.3 } else { 2.0 });
            assert!(clean < 0.0125 && large > 0.95 && small > 0.95, "{level:?}: {clean} {large} {small}");
        }
        // One that is far larger makes no constant ones of the others.
        let one = groups(&mut random, 6, 12, &|group| if group == 2 { 300.0 } else { 2.0 });
        let checks = alike("parts", &one, Level::Others, "copied");
        assert!(checks.len() == 1 && checks[0].finding.starts_with("part 2 has"), "{checks:?}");
        let checks =
            alike("parts", &groups(&mut random, 6, 12, &|group| if group == 1 { 0.0 } else { 1.0 }), known, "copied");
        assert!(checks[0].finding.contains("copied") && checks[0].did == Action::Verdict, "{checks:?}");
    }

    #[test]
    fn of_two_groups_the_larger_one_is_said_unless_the_other_is_constant() {
        let of = |squares: [f64; 2]| {
            let group = |(name, squares): (&str, f64)| Group { name: name.into(), squares, freedom: 30.0 };
            let groups: Vec<Group> = ["a", "b"].into_iter().zip(squares).map(group).collect();
            let checks = alike("parts", &groups, Level::Others, "copied");
            assert_eq!(checks.len(), 1);
            checks[0].finding.clone()
        };
        assert!(of([30.0, 30_000.0]).starts_with("b has 31.6 times"), "{}", of([30.0, 30_000.0]));
        assert!(of([30_000.0, 30.0]).starts_with("a has 31.6 times"));
        assert!(of([30.0, 0.0]).starts_with("b has only"), "{}", of([30.0, 0.0]));
    }

    #[test]
    fn groups_without_freedom_are_left_out() {
        let none = Group { name: "none".into(), squares: 1.0, freedom: 0.0 };
        assert!(alike("parts", &[none.clone(), none.clone()], Level::Others, "").is_empty());
        let one = Group { name: "one".into(), squares: 1.0, freedom: 3.0 };
        assert!(alike("parts", &[none, one], Level::Others, "").is_empty());
    }
}
