//! Means and standard deviations of approaches, the values of ISO 230-2 of them, and what is to be said of the runs.

use std::borrow::Cow;

use runout_core::{
    consistency::{Action, Check, Test},
    draws::{Draw, MeasuredAgain, Truth},
    numerics::{number::significant, statistics::chi2_tail},
    summary::Value,
};

use crate::runs::{Approaches, Noise, Runs, mean, std};

/// How remarks name what a test has.
pub(crate) struct Terms {
    pub unit: &'static str,
    /// Runs that its standard asks for.
    pub runs: usize,
    pub standard: &'static str,
    /// What contains a change from run to run.
    pub contain: &'static str,
}

/// What the user should know of the runs.
pub(crate) fn remarks(approaches: &Approaches, noise: &Noise, terms: &Terms) -> Vec<String> {
    let Terms { unit, runs: asked, standard, contain } = terms;
    let mut remarks = Vec::new();
    let runs = noise.runs;
    if runs < *asked {
        remarks.push(format!(
            "{runs} runs: {standard} asks for {asked} from each side; repeatability of so few is uncertain"
        ));
    }
    let most = approaches.deviations.iter().flatten().map(Vec::len).max().unwrap_or(0);
    if most > runs {
        remarks.push(format!("targets were approached {runs} to {most} times from a side"));
    }
    if noise.copies {
        remarks.push("the runs are identical: copies show no uncertainty".into());
    }
    let change = noise.course.last().zip(noise.course.first()).map_or(0.0, |(last, first)| last - first);
    match noise.of_whole_runs(approaches.targets.len() * approaches.sides.len()) {
        Runs::Alike => {}
        Runs::Drift => remarks.push(format!(
            "the runs drift: the last one lies {change:+.2} {unit} from the first one on average over all targets; {contain}"
        )),
        Runs::Differ => remarks.push(format!(
            "runs differ as a whole, by a standard deviation of {:.2} {unit}; {contain}",
            noise.common_std()
        )),
    }
    if approaches.sides.len() == 1 {
        remarks.push(
            "all targets were approached from one side: there is no reversal value and no bidirectional value".into(),
        );
    }
    remarks
}

/// Widens what is known of values by what they would change without the drift of the means, where the runs drift, and says so of each that this
/// matters for. The scatter of the runs has the drift, by the definition of repeatability. `values` are those of [`Cells::values`], in that order.
pub(crate) fn widen_by_drift(approaches: &Approaches, noise: &Noise, values: &mut [Value], unit: &str) -> Vec<Check> {
    if noise.of_whole_runs(approaches.targets.len() * approaches.sides.len()) != Runs::Drift {
        return Vec::new();
    }
    let without = Cells { mean: Cells::of(&approaches.without_drift()).mean, ..Cells::of(approaches) };
    let changed = values.iter_mut().zip(without.values(&approaches.sides));
    let check = |(value, (symbol, without, _)): (&mut Value, (String, f64, &str))| {
        let (found, known) = (value.value, value.uncertainty.as_mut()?);
        let change = found - without;
        let factor = known.std.hypot(change) / known.std;
        let ratio = (change / known.std).powi(2);
        known.std *= factor;
        known.interval_95 = known.interval_95.map(|end| (found + factor * (end - found)).max(0.0));
        let check = Check::new(Test::Order, format!("{symbol} without drift"), ratio, &[1.0], chi2_tail(ratio, 1.0));
        let mut check = check.widening(factor).finding(|| {
            let [found, without] = [found, without].map(|value| significant(value, 3));
            format!("the runs drift, also between the approaches from both sides and along the travel: without it, {symbol} would be {without}, not {found} {unit}; the interval contains both")
        });
        if check.did == Action::Verdict {
            check.did = Action::Widened;
        }
        Some(check)
    };
    changed.filter_map(check).collect()
}

/// Means and standard deviations, `[target][side]`.
#[derive(Clone)]
pub(crate) struct Cells {
    pub mean: Vec<Vec<f64>>,
    pub std: Vec<Vec<f64>>,
}

impl Cells {
    pub(crate) fn of(approaches: &Approaches) -> Self {
        let each = |of: fn(&[f64]) -> f64| -> Vec<Vec<f64>> {
            approaches.deviations.iter().map(|sides| sides.iter().map(|runs| of(runs)).collect()).collect()
        };
        Self { mean: each(mean), std: each(std) }
    }

    /// Range of all means.
    pub(crate) fn size(&self) -> f64 {
        let mut ends = Ends::default();
        self.mean.iter().flatten().for_each(|mean| ends.take(*mean));
        ends.range()
    }

    /// Means without the parts of their highest and lowest ones that noise may have made: in both directions alike, and in the reversal. Noise raises ranges
    /// and largest values of what is left the most. `among` is the number of targets whose largest one is looked for: of so many normal numbers hardly one
    /// is beyond √(2 ln 2n) standard deviations.
    pub(crate) fn levelled(&self, noise: &Noise, among: usize) -> Self {
        let mut levelled = self.clone();
        let sides = self.mean.first().map_or(1, Vec::len) as f64;
        let reach = (2.0 * (2.0 * among as f64).ln()).sqrt();
        let by = reach * noise.own_std / (noise.runs as f64 * sides).sqrt();
        let mut part = |of: &dyn Fn(&[f64]) -> f64, put: &dyn Fn(&mut [f64], f64)| {
            let values: Vec<f64> = self.mean.iter().map(|means| of(means)).collect();
            let mut ends = Ends::default();
            values.iter().for_each(|value| ends.take(*value));
            let by = by.min(0.5 * ends.range());
            for (means, value) in levelled.mean.iter_mut().zip(&values) {
                put(means, value.clamp(ends.0[0] + by, (ends.0[1] - by).max(ends.0[0] + by)) - value);
            }
        };
        part(&mean, &|means, by| means.iter_mut().for_each(|mean| *mean += by));
        if sides > 1.0 {
            part(&|means| 0.5 * (means[0] - means[1]), &|means, by| {
                means[0] += by;
                means[1] -= by;
            });
        }
        levelled
    }

    /// What the machine may be: this is what was found.
    pub(crate) fn may_be<'a>(&'a self, truth: Truth, least: &'a Self, noise: &Noise, draw: &mut Draw) -> Cow<'a, Self> {
        match truth {
            Truth::Least => Cow::Borrowed(least),
            Truth::Most => Cow::Borrowed(self),
            Truth::Hidden => Cow::Owned(Self { mean: self.measured_again(noise, draw).1.mean, std: self.std.clone() }),
        }
    }

    /// The machine that was found, and what as many runs on it would give.
    pub(crate) fn measured_again(&self, noise: &Noise, draw: &mut Draw) -> (Self, Self) {
        let freedom = noise.runs - 1;
        let own = noise.own_std * draw.true_std_ratio(noise.freedom_own);
        let mut wider = |parts: [[f64; 2]; 2]| {
            parts.map(|part| {
                let ratio = draw.true_std_ratio(freedom);
                part.map(|std| std * ratio)
            })
        };
        let (common, apart) = (wider(noise.common), wider(noise.apart));
        let mut drawn = |parts: [[f64; 2]; 2]| {
            let [one, other] = parts.map(|part| {
                let normal = draw.normal();
                part.map(|std| std * normal)
            });
            [one[0] + other[0], one[1] + other[1]]
        };
        let runs: Vec<[[f64; 2]; 2]> = (0..noise.runs).map(|_| [drawn(common), drawn(apart)]).collect();
        let (mut truth, mut again) = (self.clone(), self.clone());
        for (place, along) in noise.along.iter().enumerate() {
            let off = |[level, tilt]: [f64; 2]| level + tilt * along;
            let size = |[one, other]: [[f64; 2]; 2]| off(one).hypot(off(other));
            for side in 0..self.mean[place].len() {
                let sign = if side == 0 { 1.0 } else { -1.0 };
                let mut of = |[common, apart]: &[[f64; 2]; 2]| off(*common) + sign * off(*apart) + own * draw.normal();
                let of: Vec<f64> = runs.iter().map(&mut of).collect();
                again.mean[place][side] += mean(&of);
                again.std[place][side] = std(&of);
                truth.std[place][side] = size(common).hypot(size(apart)).hypot(own);
            }
        }
        (truth, again)
    }

    /// The values where the machine is measured again: `scale` is the drawn error of the instrument's scale.
    pub(crate) fn again(&self, approaches: &Approaches, noise: &Noise, scale: f64, draw: &mut Draw) -> MeasuredAgain {
        let (truth, again) = self.measured_again(noise, draw);
        let of = |cells: &Self| -> Vec<f64> {
            cells.values(&approaches.sides).into_iter().map(|(_, value, _)| value).collect()
        };
        // Noise raises ranges, and the values are less by that. The scale is one unknown number: the machine is what was found, less it.
        let scaled = of(&self.clone().tilted(&approaches.targets, scale));
        let by_scale: Vec<f64> = scaled.iter().zip(of(self)).map(|(scaled, found)| scaled - found).collect();
        let truth: Vec<f64> = of(&truth).iter().zip(by_scale).map(|(truth, by_scale)| truth + by_scale).collect();
        MeasuredAgain { error: of(&again).iter().zip(&truth).map(|(again, truth)| again - truth).collect(), truth }
    }

    /// The cells of an instrument whose scale is longer by `slope`.
    pub(crate) fn tilted(mut self, targets: &[f64], slope: f64) -> Self {
        for (means, target) in self.mean.iter_mut().zip(targets) {
            means.iter_mut().for_each(|mean| *mean += slope * (target - targets[0]));
        }
        self
    }

    /// The values of the axis, by their symbols.
    pub(crate) fn values(&self, sides: &[i8]) -> Vec<(String, f64, &'static str)> {
        let mut values = Vec::new();
        let mut all = [Ends::default(), Ends::default()];
        for (side, sign) in sides.iter().enumerate() {
            let sign = if *sign > 0 { '+' } else { '-' };
            let [mut means, mut bands] = [Ends::default(), Ends::default()];
            let mut widest: f64 = 0.0;
            for (mean, std) in self.mean.iter().zip(&self.std) {
                let (mean, std) = (mean[side], std[side]);
                means.take(mean);
                bands.take(mean - 2.0 * std);
                bands.take(mean + 2.0 * std);
                widest = widest.max(4.0 * std);
            }
            all[0].join(&means);
            all[1].join(&bands);
            values.push((format!("A{sign}"), bands.range(), "unidirectional accuracy of positioning (ISO 230-2)"));
            values.push((
                format!("E{sign}"),
                means.range(),
                "unidirectional systematic positional deviation (ISO 230-2)",
            ));
            values.push((format!("R{sign}"), widest, "unidirectional repeatability of positioning (ISO 230-2)"));
        }
        if sides.len() == 2 {
            let mut middle = Ends::default();
            let (mut largest, mut sum, mut repeatability) = (0.0_f64, 0.0, 0.0_f64);
            for (mean, std) in self.mean.iter().zip(&self.std) {
                let reversal = mean[0] - mean[1];
                middle.take(0.5 * (mean[0] + mean[1]));
                largest = largest.max(reversal.abs());
                sum += reversal;
                let band = 2.0 * (std[0] + std[1]) + reversal.abs();
                repeatability = repeatability.max(band).max(4.0 * std[0]).max(4.0 * std[1]);
            }
            let mean = (sum / self.mean.len() as f64).abs();
            let of_both = [
                ("A", all[1].range(), "bidirectional accuracy of positioning (ISO 230-2)"),
                ("E", all[0].range(), "bidirectional systematic positional deviation (ISO 230-2)"),
                ("R", repeatability, "bidirectional repeatability of positioning (ISO 230-2)"),
                ("B", largest, "reversal value, the largest of all targets (ISO 230-2)"),
                ("B_mean", mean, "mean reversal value, without its sign (ISO 230-2)"),
                ("M", middle.range(), "mean bidirectional positional deviation (ISO 230-2)"),
            ];
            values.splice(0..0, of_both.map(|(symbol, value, about)| (symbol.to_owned(), value, about)));
        }
        values
    }
}

/// The lowest and the highest of values.
struct Ends([f64; 2]);

impl Default for Ends {
    fn default() -> Self {
        Self([f64::INFINITY, f64::NEG_INFINITY])
    }
}

impl Ends {
    fn take(&mut self, value: f64) {
        self.0 = [self.0[0].min(value), self.0[1].max(value)];
    }

    fn join(&mut self, other: &Self) {
        other.0.iter().for_each(|end| self.take(*end));
    }

    fn range(&self) -> f64 {
        self.0[1] - self.0[0]
    }
}
