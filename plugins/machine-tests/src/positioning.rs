//! The separator `positioning`: accuracy and repeatability of positioning of one axis (ISO 230-2:2014, clause 3; linear axes up to 2000 mm, and rotary
//! axes).
//!
//! Of target i, approached n times from each side (+, −), with mean deviations x̄ and standard deviations s:
//!
//! | symbol | value |
//! | --- | --- |
//! | `B`, `B_mean` | reversal value: largest and mean of Bᵢ = x̄ᵢ₊ − x̄ᵢ₋, B by its absolute value |
//! | `E+`, `E-` | systematic deviation in one direction: range of x̄ᵢ |
//! | `E` | bidirectional: range of all x̄ᵢ₊ and x̄ᵢ₋ |
//! | `M` | mean bidirectional deviation: range of (x̄ᵢ₊ + x̄ᵢ₋)/2 |
//! | `R+`, `R-` | repeatability in one direction: largest 4 sᵢ |
//! | `R` | bidirectional: largest of 2 sᵢ₊ + 2 sᵢ₋ + \|Bᵢ\|, 4 sᵢ₊ and 4 sᵢ₋ |
//! | `A+`, `A-` | accuracy in one direction: range of x̄ᵢ + 2 sᵢ and x̄ᵢ − 2 sᵢ |
//! | `A` | bidirectional: the same over both directions |
//!
//! Uncertainties are those that the runs show: what changes a whole run, what changes it along the travel, and what changes at each target; `scale_std_ppm` adds that of the measuring
//! instrument and of the temperature, which grows with the travel (ISO/TR 230-9).

use runout_core::{
    Result,
    draws::seed,
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    stage::{Outcome, PointSeparator, Separator},
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    draws::{Computed, Draw, Machine, with_uncertainty, without_noise},
    runs::{Approaches, Noise, mean, std},
};

/// Runs that the standard asks for.
const RUNS: usize = 5;
/// Runs are off as a whole where their means scatter by so many times what the noise at single targets makes.
const OFF: f64 = 3.0;
/// They drift where their means go with their number, by this correlation, which chance makes once in a hundred of five runs.
const TREND: f64 = 0.93;
const FEWEST_FOR_A_TREND: usize = 4;

/// `[separate] plugin = "positioning"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PositioningConfig {
    /// The axis, as the values name it: "X", "C".
    pub axis: String,
    /// Whether it is a rotary axis: its columns are then `target_deg` and `deviation_arcsec`.
    #[serde(default)]
    pub rotary: bool,
    /// Standard uncertainty of the scale, by the instrument's certificate and the temperatures: µm/m, of a rotary axis 10⁻⁶ of the angle.
    #[serde(default)]
    pub scale_std_ppm: f64,
}

impl StageConfig for PositioningConfig {
    type Stage = Separator;

    const NAME: &'static str = "positioning";
    const ABOUT: &'static str = "accuracy and repeatability of positioning of one axis by ISO 230-2: A, E, R, B, M";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if !(self.scale_std_ppm.is_finite() && self.scale_std_ppm >= 0.0) {
            return Err(Fault::at("scale_std_ppm", format!("expected at least 0, found {}", self.scale_std_ppm)));
        }
        Ok(Separator::Points(Box::new(Positioning(self))))
    }
}

struct Positioning(PositioningConfig);

const LINEAR: [PointColumn; 3] = [
    PointColumn::needed("target_mm", Number, "mm", "commanded position"),
    PointColumn::needed("deviation_um", Number, "um", "actual less commanded position").measured(),
    DIRECTION,
];
const ROTARY: [PointColumn; 3] = [
    PointColumn::needed("target_deg", Number, "deg", "commanded angle"),
    PointColumn::needed("deviation_arcsec", Number, "arcsec", "actual less commanded angle").measured(),
    DIRECTION,
];
const DIRECTION: PointColumn = PointColumn::optional(
    "direction",
    Number,
    "",
    "1 where the target was approached in the positive direction, -1 in the negative one; without it by the row before",
);

impl Positioning {
    fn own_columns(&self) -> &'static [PointColumn; 3] {
        if self.0.rotary { &ROTARY } else { &LINEAR }
    }

    fn table(&self) -> TableSpec {
        let [target, deviation, _] = self.own_columns();
        let unit = deviation.unit;
        let column = |name: &str, about: &str| ColumnSpec::number(format!("{name}_{unit}"), unit, about);
        let of = |name: &str| format!("{name}_{unit}");
        TableSpec::new(
            "positioning",
            "deviations of the targets over their runs",
            vec![
                ColumnSpec::name("direction", "side of the approach: + or -"),
                ColumnSpec::number(target.name, target.unit, target.about).repeating(),
                column("mean", "mean deviation over the runs"),
                column("std", "standard uncertainty of the mean, from the runs"),
                column("spread", "standard deviation of one approach"),
                column("low", "mean less two standard deviations"),
                column("high", "mean and two standard deviations"),
            ],
        )
        .figure(
            Figure::lines(
                "positioning",
                "Positioning",
                target.name,
                [
                    Measure::new(of("mean")).with_std(of("std")).with_symbol("mean"),
                    Measure::new(of("low")).with_symbol("mean − 2s"),
                    Measure::new(of("high")).with_symbol("mean + 2s"),
                ],
            )
            .curves(["direction"]),
        )
    }
}

impl PointSeparator for Positioning {
    fn columns(&self) -> Vec<PointColumn> {
        self.own_columns().to_vec()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![self.table()]
    }

    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        let [_, deviation, _] = self.own_columns();
        let symbols = ["A", "E", "R", "B", "B_mean", "M", "A+", "E+", "R+", "A-", "E-", "R-"];
        symbols.map(|symbol| (symbol, deviation.unit)).to_vec()
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let [target, deviation, _] = self.own_columns();
        let approaches = Approaches::of(points, target.name, deviation.name)?;
        let cells = Cells::of(&approaches);
        let named = |(symbol, value, about): (String, f64, &'static str)| {
            let is_key = matches!(symbol.as_str(), "A" | "E" | "R" | "B" | "M") || approaches.sides.len() == 1;
            Computed { symbol, value, about, is_key, least: 0.0 }
        };
        let computed: Vec<Computed> = cells.values(&approaches.sides).into_iter().map(named).collect();
        // ppm of mm is nm; of degrees, 0.0036 arc seconds.
        let scale = self.0.scale_std_ppm * if self.0.rotary { 3.6e-3 } else { 1e-3 };
        let noise = approaches.noise();
        let least = cells.without_noise(&noise);
        let error = |machine: Machine, draw: &mut Draw| {
            let cells = if machine == Machine::Least { &least } else { &cells };
            let (truth, again) = cells.measured_again(&noise, draw);
            let of = |cells: &Cells| cells.values(&approaches.sides).into_iter().map(|(_, value, _)| value);
            // Noise raises ranges, and the values are less by that. The scale is one unknown number: the machine is what was found, less it.
            let scaled = of(&cells.clone().tilted(&approaches.targets, scale * draw.normal()));
            let errors = of(&again).zip(of(&truth)).zip(scaled.zip(of(cells)));
            errors.map(|((again, truth), (scaled, found))| (again - truth) - (scaled - found)).collect()
        };
        let seed = seed(&["positioning", &self.0.axis]);
        let mut values = with_uncertainty(&computed, deviation.unit, seed, error);
        if noise.own_std == 0.0 {
            // Copies show no uncertainty.
            values.iter_mut().for_each(|value| value.uncertainty = None);
        }
        Ok(Outcome {
            convention: format!(
                "deviation is actual less commanded position of {}; + is an approach in the positive direction",
                self.0.axis
            ),
            tables: vec![self.rows(&approaches, &cells)?],
            values: values.into_iter().map(|value| value.of(&self.0.axis)).collect(),
            remarks: remarks(&approaches, &noise, deviation.unit),
            ..Outcome::default()
        })
    }
}

impl Positioning {
    fn rows(&self, approaches: &Approaches, cells: &Cells) -> Result<TableRows> {
        let spec = self.table();
        let each = || {
            let sides = 0..approaches.sides.len();
            sides.flat_map(|side| (0..approaches.targets.len()).map(move |target| (target, side)))
        };
        let number = |of: &dyn Fn(usize, usize) -> f64| numbers(each().map(|(target, side)| of(target, side)));
        let runs = |target: usize, side: usize| approaches.deviations[target][side].len() as f64;
        let rows = spec.rows(vec![
            texts(each().map(|(_, side)| if approaches.sides[side] > 0 { "+" } else { "-" })),
            number(&|target, _| approaches.targets[target]),
            number(&|target, side| cells.mean[target][side]),
            number(&|target, side| cells.std[target][side] / runs(target, side).sqrt()),
            number(&|target, side| cells.std[target][side]),
            number(&|target, side| cells.mean[target][side] - 2.0 * cells.std[target][side]),
            number(&|target, side| cells.mean[target][side] + 2.0 * cells.std[target][side]),
        ])?;
        Ok(TableRows { table: spec.name, rows })
    }
}

/// What the user should know of the runs.
fn remarks(approaches: &Approaches, noise: &Noise, unit: &str) -> Vec<String> {
    let mut remarks = Vec::new();
    let runs = noise.runs;
    if runs < RUNS {
        remarks.push(format!(
            "{runs} runs: ISO 230-2 asks for {RUNS} from each side; repeatability of so few is uncertain"
        ));
    }
    let most = approaches.deviations.iter().flatten().map(Vec::len).max().unwrap_or(0);
    if most > runs {
        remarks.push(format!("targets were approached {runs} to {most} times from a side"));
    }
    if noise.own_std == 0.0 {
        remarks.push("the runs are identical: copies show no uncertainty".into());
    }
    let std = noise.own_std / ((approaches.targets.len() * approaches.sides.len()) as f64).sqrt();
    let trend = noise.trend();
    if noise.common_std > OFF * std && std > 0.0 {
        let change = noise.course.last().zip(noise.course.first()).map_or(0.0, |(last, first)| last - first);
        remarks.push(if runs >= FEWEST_FOR_A_TREND && trend.abs() > TREND {
            format!("the runs drift: the last one lies {change:+.2} {unit} from the first one on average over all targets; R and A contain it")
        } else {
            format!("runs differ as a whole, by a standard deviation of {:.2} {unit}; R and A contain it", noise.common_std)
        });
    }
    remarks.extend(approaches.outliers(noise.own_std, unit));
    if approaches.sides.len() == 1 {
        remarks.push(
            "all targets were approached from one side: there is no reversal value and no bidirectional value".into(),
        );
    }
    remarks
}

/// Means and standard deviations, `[target][side]`.
#[derive(Clone)]
struct Cells {
    mean: Vec<Vec<f64>>,
    std: Vec<Vec<f64>>,
}

impl Cells {
    fn of(approaches: &Approaches) -> Self {
        let each = |of: fn(&[f64]) -> f64| -> Vec<Vec<f64>> {
            approaches.deviations.iter().map(|sides| sides.iter().map(|runs| of(runs)).collect()).collect()
        };
        Self { mean: each(mean), std: each(std) }
    }

    /// Means drawn together by the power that noise has in them: in both directions alike, and in the reversal.
    fn without_noise(&self, noise: &Noise) -> Self {
        let (mut drawn, count) = (self.clone(), self.mean.len() as f64);
        let sides = self.mean.first().map_or(1, Vec::len) as f64;
        let of_noise = noise.own_std.powi(2) / noise.runs as f64 / sides;
        let mut part = |of: &dyn Fn(&[f64]) -> f64, put: &dyn Fn(&mut [f64], f64)| {
            let values: Vec<f64> = self.mean.iter().map(|means| of(means)).collect();
            let centre = mean(&values);
            let variance = values.iter().map(|value| (value - centre).powi(2)).sum::<f64>() / (count - 1.0);
            let share = without_noise(variance, of_noise);
            for (means, value) in drawn.mean.iter_mut().zip(&values) {
                put(means, (share - 1.0) * (value - centre));
            }
        };
        part(&mean, &|means, by| means.iter_mut().for_each(|mean| *mean += by));
        if sides > 1.0 {
            part(&|means| 0.5 * (means[0] - means[1]), &|means, by| {
                means[0] += by;
                means[1] -= by;
            });
        }
        drawn
    }

    /// The machine that was found, and what as many runs on it would give.
    fn measured_again(&self, noise: &Noise, draw: &mut Draw) -> (Self, Self) {
        let freedom = noise.runs - 1;
        let own = noise.own_std * draw.true_std_ratio(noise.freedom_own);
        let [common, slope] = [noise.common_std, noise.slope_std].map(|std| std * draw.true_std_ratio(freedom));
        let runs: Vec<[f64; 2]> = (0..noise.runs).map(|_| [common * draw.normal(), slope * draw.normal()]).collect();
        let (mut truth, mut again) = (self.clone(), self.clone());
        for (place, along) in noise.along.iter().enumerate() {
            for side in 0..self.mean[place].len() {
                let of: Vec<f64> =
                    runs.iter().map(|[level, tilt]| level + tilt * along + own * draw.normal()).collect();
                again.mean[place][side] += mean(&of);
                again.std[place][side] = std(&of);
                truth.std[place][side] = common.hypot(slope * along).hypot(own);
            }
        }
        (truth, again)
    }

    /// The same of an instrument whose scale is longer by so much.
    fn tilted(mut self, targets: &[f64], slope: f64) -> Self {
        for (means, target) in self.mean.iter_mut().zip(targets) {
            means.iter_mut().for_each(|mean| *mean += slope * (target - targets[0]));
        }
        self
    }

    /// The values of the axis, by their symbols.
    fn values(&self, sides: &[i8]) -> Vec<(String, f64, &'static str)> {
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
