//! What a test says, and what follows from it.

use std::fmt::Write as _;

use runout_numerics::statistics::student_95;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Chance of a test on sound data below which it is a finding: it is said, and neither "at the noise floor" nor "explained" is.
/// With at most four tests of a domain, less than 2 % of sound campaigns have one.
pub const FINDING: f64 = 0.005;
/// Chance below which uncertainty is widened: blocks that disagree by less than what is said still count.
pub const WIDENING: f64 = 0.05;
/// Chance below which uncertainty is widened, for three blocks or fewer, whose scatter is known badly.
const WIDENING_OF_FEW: f64 = 0.02;
/// Blocks that are few.
const FEW: usize = 3;

/// Chance below which uncertainty is widened, of so many blocks.
#[must_use]
pub fn widening(blocks: usize) -> f64 {
    if blocks <= FEW { WIDENING_OF_FEW } else { WIDENING }
}

/// A test of the data on themselves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub struct Check {
    /// Which test.
    pub test: Test,
    /// The part of the data that it is of, as a station; empty for the whole.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// What was tested: a value, an effect, an order, a block, a channel.
    pub of: String,
    /// The test's statistic: a ratio of variances, or χ² per degree of freedom, where nothing else is said.
    pub statistic: f64,
    /// Its degrees of freedom, above and below; the second is absent where the noise is known.
    pub dof: Vec<f64>,
    /// Chance of such a statistic on sound data, corrected for the number tested together.
    pub p: f64,
    /// Factor on the standard uncertainties concerned; 1 where none is changed.
    pub factor: f64,
    /// What it found, in words; empty where nothing.
    pub finding: String,
    /// What was done.
    pub did: Action,
}

/// The tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Test {
    /// The residual as a whole against the noise.
    Residual,
    /// Independent blocks against each other.
    Blocks,
    /// Correlation along the declared order.
    Order,
    /// Groups of one noise level against each other.
    Alike,
    /// Parts that may be offset against each other.
    Shift,
    /// Regions that were left out of the fit and predicted.
    LeftOut,
    /// Single readings.
    Rows,
    /// The course of the turns of a recording.
    Turns,
    /// Repeats against the fit's residual.
    Repeats,
    /// Whether something was measured at all.
    Measured,
}

/// What follows from a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// Nothing: the data agree.
    Nothing,
    /// Standard uncertainties were widened by `factor`.
    Widened,
    /// An effect was refused.
    Refused,
    /// A row, block, order or component was named.
    Named,
    /// It bars the verdicts `at-noise-floor` and `explained`.
    Verdict,
}

impl Test {
    /// Its name, as files have it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Residual => "residual",
            Self::Blocks => "blocks",
            Self::Order => "order",
            Self::Alike => "alike",
            Self::Shift => "shift",
            Self::LeftOut => "left-out",
            Self::Rows => "rows",
            Self::Turns => "turns",
            Self::Repeats => "repeats",
            Self::Measured => "measured",
        }
    }
}

impl Action {
    /// Its name, as files have it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Widened => "widened",
            Self::Refused => "refused",
            Self::Named => "named",
            Self::Verdict => "verdict",
        }
    }
}

impl Check {
    /// A test that found nothing. `dof` are its degrees of freedom above and, where the noise is not known, below.
    #[must_use]
    pub fn new(test: Test, of: impl Into<String>, statistic: f64, dof: &[f64], p: f64) -> Self {
        Self {
            test,
            part: String::new(),
            of: of.into(),
            statistic: if statistic.is_finite() { statistic } else { f64::MAX },
            dof: dof.iter().copied().filter(|dof| dof.is_finite()).collect(),
            p: p.min(1.0),
            factor: 1.0,
            finding: String::new(),
            did: Action::Nothing,
        }
    }

    /// With what it found, where its chance is below that of a [finding](FINDING), and that this bars the verdict.
    #[must_use]
    pub fn finding(mut self, words: impl FnOnce() -> String) -> Self {
        if self.p < FINDING {
            self.finding = words();
            self.did = Action::Verdict;
        }
        self
    }

    /// With a factor on standard uncertainties.
    #[must_use]
    pub fn widening(mut self, factor: f64) -> Self {
        if factor > 1.0 {
            self.factor = factor;
            if self.did == Action::Nothing {
                self.did = Action::Widened;
            }
        }
        self
    }

    /// Names what is no reason to doubt the rest.
    #[must_use]
    pub fn named(mut self) -> Self {
        if self.did == Action::Verdict {
            self.did = Action::Named;
        }
        self
    }

    /// Of one of so many parts that are tested alike: what chance makes of all of them is no finding.
    #[must_use]
    pub fn among(mut self, parts: usize) -> Self {
        self.p = (self.p * parts.max(1) as f64).min(1.0);
        if self.p >= FINDING {
            self.finding.clear();
            self.did = if self.factor > 1.0 { Action::Widened } else { Action::Nothing };
        }
        self
    }

    /// Names the part that the check belongs to, one of several: a station, for example.
    #[must_use]
    pub fn within(mut self, part: &str) -> Self {
        // A setup at a station is "setup/station".
        self.part = if self.part.is_empty() { part.to_owned() } else { format!("{}/{part}", self.part) };
        if !self.finding.is_empty() {
            self.finding = format!("{part}: {}", self.finding);
        }
        self
    }

    /// Whether the data refute what is said of them: a finding that no wider uncertainty answers in full.
    #[must_use]
    pub fn refutes(&self) -> bool {
        self.did == Action::Verdict
    }

    /// Whether it bars the verdicts `at-noise-floor` and `explained`: a finding, unless it only names.
    #[must_use]
    pub fn bars_verdict(&self) -> bool {
        !self.finding.is_empty() && matches!(self.did, Action::Verdict | Action::Widened)
    }
}

/// What refutes the values that `checks` are of: the findings, in one sentence. Nothing where none refutes.
#[must_use]
pub fn refuted_by(checks: &[Check]) -> Option<String> {
    let mut refuting: Vec<&Check> = checks.iter().filter(|check| check.refutes()).collect();
    refuting.sort_by(|a, b| a.p.total_cmp(&b.p));
    let mut said = String::new();
    for (index, check) in refuting.iter().take(MOST_SAID).enumerate() {
        let _ = write!(said, "{}{}", if index > 0 { "; " } else { "" }, check.finding);
    }
    if refuting.len() > MOST_SAID {
        let _ = write!(said, "; and {} more", refuting.len() - MOST_SAID);
    }
    (!said.is_empty()).then_some(said)
}

/// Findings in one sentence at most.
const MOST_SAID: usize = 3;

/// All findings in words, the least likely first; of many of one test, the first ones and how many more there are.
#[must_use]
pub fn findings(checks: &[Check]) -> Vec<String> {
    let mut found: Vec<&Check> = checks.iter().filter(|check| !check.finding.is_empty()).collect();
    found.sort_by(|a, b| a.test.cmp(&b.test).then(a.p.total_cmp(&b.p)));
    let of_test = |same: &[&Check]| -> Vec<String> {
        let mut said: Vec<String> = same.iter().take(MOST_SAID).map(|check| check.finding.clone()).collect();
        if same.len() > MOST_SAID {
            let more = same.len() - MOST_SAID;
            said.push(format!(
                "{more} more findings of the test {}: the table consistency has all",
                same[0].test.name()
            ));
        }
        said
    };
    found.chunk_by(|a, b| a.test == b.test).flat_map(of_test).collect()
}

/// A chance in words: "p 0.003", "p < 1e-99".
#[must_use]
pub fn chance(p: f64) -> String {
    if p < 1e-99 {
        "p < 1e-99".into()
    } else if p < 1e-3 {
        format!("p {p:.0e}")
    } else {
        format!("p {p:.3}")
    }
}

/// Factor on a standard uncertainty whose half width of 95 % becomes `spread` times Student's with `freedom` degrees, where it was
/// the normal one's.
#[must_use]
pub fn factor(spread: f64, freedom: f64) -> f64 {
    spread * student_95(freedom.max(1.0)) / student_95(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn findings_bar_the_verdict_and_are_said_once() {
        let of =
            |p: f64| Check::new(Test::Blocks, "radius", 9.0, &[3.0, f64::INFINITY], p).finding(|| format!("p {p}"));
        assert_eq!(of(0.02).did, Action::Nothing);
        assert_eq!((of(0.001).did, of(0.001).dof.len()), (Action::Verdict, 1));
        assert_eq!(refuted_by(&[of(0.02)]), None);
        let many = [0.001, 1e-9, 0.002, 0.003, 0.1].map(of);
        assert_eq!(refuted_by(&many).as_deref(), Some("p 0.000000001; p 0.001; p 0.002; and 1 more"));
        let placed = of(1e-4).within("station s1");
        assert_eq!((placed.part.as_str(), placed.finding.as_str()), ("station s1", "station s1: p 0.0001"));
        assert_eq!(findings(&many).len(), 4);
        assert_eq!(of(0.02).widening(1.4).did, Action::Widened);
        assert!(!of(1e-4).named().refutes());
        assert_eq!((of(1e-4).among(10).did, of(1e-4).widening(2.0).among(60).did), (Action::Verdict, Action::Widened));
        assert_eq!([chance(0.0), chance(2.3e-5), chance(0.0123)], ["p < 1e-99", "p 2e-5", "p 0.012"]);
    }
}
