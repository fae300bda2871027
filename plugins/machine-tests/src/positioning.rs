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
    draws::{Draw, Truth, seed},
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    stage::{Outcome, PointSeparator, Separator},
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    cells::{Cells, Terms, remarks, widen_by_drift},
    draws::{Computed, with_uncertainty},
    repeated,
    runs::Approaches,
};

/// Runs that the standard asks for.
const RUNS: usize = 5;

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
        let least = cells.levelled(&noise, approaches.targets.len());
        let measure = |truth: Truth, draw: &mut Draw| {
            let cells = cells.may_be(truth, &least, &noise, draw);
            let scale = scale * draw.normal();
            cells.again(&approaches, &noise, scale, draw)
        };
        let seed = seed(&["positioning", &self.0.axis]);
        let mut values = with_uncertainty(&computed, deviation.unit, seed, measure);
        if noise.copies {
            // Copies show no uncertainty.
            values.iter_mut().for_each(|value| value.uncertainty = None);
        }
        let terms = Terms { unit: deviation.unit, runs: RUNS, standard: "ISO 230-2", contain: "A and R contain it" };
        let mut checks = repeated::approaches(&approaches, &noise.along, [target.unit, deviation.unit]);
        checks.extend(widen_by_drift(&approaches, &noise, &mut values, deviation.unit));
        let outcome = Outcome {
            convention: format!(
                "deviation is actual less commanded position of {}; + is an approach in the positive direction",
                self.0.axis
            ),
            tables: vec![self.rows(&approaches, &cells)?],
            values: values.into_iter().map(|value| value.of(&self.0.axis)).collect(),
            checks,
            remarks: remarks(&approaches, &noise, &terms),
            ..Outcome::default()
        };
        Ok(outcome.refuted())
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
