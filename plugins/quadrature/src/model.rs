//! The separator `quadrature`: a model of a quadrature signal for the closed loop.
//!
//! Without a reference angle the data are the radius over the pair's own phase, and each order of it has two possible causes that
//! do the opposite to the angle ([`crate::components`]). With a reference angle θ the data are both parts of z e^{−iθ}, in which
//! the components are linear, exactly, and no two of them are alike; the held-out error is that of the angle.

use std::f64::consts::TAU;

use runout_core::{
    Error, ErrorKind, Result,
    closed_loop::{
        Effect, Fit,
        linear_terms::{LinearFit, LinearTerms, Observations, Term},
    },
    consistency::{Kind, Structure},
    fault::{Fault, within},
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    stage::{LinearModel, Outcome, PointModel, PointSeparator, Separator, residual_table, separate_declared},
    summary::Value,
    table::TableSpec,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    angle::{ANGLE, Correction, angle_table},
    components::{Component, UNIT},
    samples::Samples,
};

/// `[separate] plugin = "quadrature"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuadratureConfig {
    /// Blocks of samples next to each other in phase, as many in each: they are left out of the fit one after the other,
    /// and predicted.
    #[serde(default = "default_blocks")]
    pub blocks: usize,
    /// Highest harmonic of the phase that may be in the radius.
    #[serde(default = "default_max_order")]
    pub max_order: usize,
}

fn default_blocks() -> usize {
    100
}

fn default_max_order() -> usize {
    16
}

/// Stretches of time whose errors are independent of each other; without times every eighth sample along the phase.
const PARTS: usize = 8;
/// Blocks and orders beyond these say nothing more.
const MOST_BLOCKS: usize = 1_000;
const HIGHEST_ORDER: usize = 50;
/// Of few samples there are fewer blocks than asked for.
const SAMPLES_A_BLOCK: usize = 2;
const FEWEST_BLOCKS: usize = 2;

impl StageConfig for QuadratureConfig {
    type Stage = Separator;

    const NAME: &'static str = "quadrature";
    const ABOUT: &'static str =
        "offset, gain ratio, angle and harmonics of a quadrature signal, and its corrected angle";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.model()?)))
    }
}

impl QuadratureConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn model(self) -> std::result::Result<Quadrature, Fault> {
        within("blocks", "blocks", self.blocks, 2..=MOST_BLOCKS)?;
        within("max_order", "an order", self.max_order, 2..=HIGHEST_ORDER)?;
        Ok(Quadrature(self))
    }
}

/// The circle about the origin, and what it may lack.
#[derive(Debug, Clone)]
pub struct Quadrature(QuadratureConfig);

const COLUMNS: [PointColumn; 4] = [
    PointColumn::needed("phase_deg", Number, "deg", "angle of the pair (cosine, sine)"),
    PointColumn::needed("radius_counts", Number, "counts", "length of the pair"),
    PointColumn::optional("time_s", Number, "s", "time"),
    PointColumn::optional(
        "reference_deg",
        Number,
        "deg",
        "true angle in degrees of the signal's own period, from any zero",
    ),
];
const DISTINGUISHED_BY: &str = "a reference angle: the column reference_deg; or signals that are known to be sines: \
    `[diagnose] effects = [\"quadrature-offset\", \"quadrature-gain-and-angle\"]`";

impl PointSeparator for Quadrature {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![angle_table(), residual_table(UNIT)]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        separate_declared(self, points)
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl LinearModel for Quadrature {
    fn candidates(&self) -> Vec<Effect> {
        Component::all(self.0.max_order).into_iter().map(|component| component.effect(1.0)).collect()
    }

    fn terms(&self, points: &Points) -> Result<LinearTerms> {
        let samples = Samples::of(points)?;
        let count = samples.phase_rad.len();
        let in_blocks = self.blocks_of(count);
        if in_blocks < FEWEST_BLOCKS {
            let problem = format!("expected at least {} samples, found {count}", FEWEST_BLOCKS * SAMPLES_A_BLOCK);
            return Err(Error::new("fit", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData));
        }
        let linearised = samples.linearised(self.0.max_order)?;
        let radius = linearised.radius;
        let terms = Component::all(self.0.max_order).into_iter().map(|component| {
            let waves = [0, 1].map(|wave| linearised.column(component, wave));
            let columns = component.slopes(radius, linearised.gain_and_angle).map(|[cosine, sine]| {
                waves[0].iter().zip(waves[1]).map(|(first, second)| cosine * first + sine * second).collect()
            });
            let rank = usize::from(component.order() > 2);
            Term { effect: component.effect(radius), columns: columns.into(), rank }
        });
        let terms: Vec<Term> = terms.collect();
        let (values, declared) = (linearised.values, linearised.declared);
        let rows = values.len();
        // Both parts of a sample with a reference are of one block.
        let of_rows = |of_samples: Vec<usize>| of_samples.into_iter().cycle().take(rows).collect::<Vec<usize>>();
        let numbered =
            |what: &str, count: usize| (1..=count).map(|number| format!("{what} {number}")).collect::<Vec<_>>();
        // Blocks run over the whole phase: an effect that is not found yet is the same in all of them.
        let (name, part, of) = if let Ok(time) = points.column("time_s") {
            ("stretches of time", "stretch", in_equal_parts(time, PARTS))
        } else {
            let order = blocks(samples.angles(), count);
            ("interleaved eighths of the samples", "eighth", order.into_iter().map(|place| place % PARTS).collect())
        };
        let structure = Structure::default()
            .divided(name, Kind::Blocks, of_rows(of), numbered(part, PARTS))
            .naming((0..rows).map(|row| format!("sample {}", row % count)).collect());
        let observations = Observations {
            group: of_rows(blocks(samples.angles(), in_blocks)),
            values,
            unit: UNIT.into(),
            std: None,
            std_dof: None,
            groups: numbered("block", in_blocks),
            structure,
        };
        let highest = self.0.max_order;
        let limit = format!("`separate.max_order` is {highest}");
        let model = LinearTerms::new(observations, declared, terms)?;
        let model = Component::of_order(highest)
            .into_iter()
            .fold(model, |model, component| model.ending_at(component.id(), limit.clone()));
        if samples.true_rad.is_some() {
            return Ok(model.judged_by(count..rows));
        }
        Ok(model.distinguished_by(DISTINGUISHED_BY))
    }

    fn outcome(&self, points: &Points, fit: &LinearFit) -> Result<Outcome> {
        let samples = Samples::of(points)?;
        let count = samples.phase_rad.len();
        let in_blocks = self.blocks_of(count);
        let blocks = format!(
            "left out one after the other: {in_blocks} blocks of {} or {} samples next to each other in phase",
            count / in_blocks,
            count.div_ceil(in_blocks)
        );
        let correction = Correction::of(&samples, self.0.max_order, fit)?;
        let mut remarks = vec![blocks];
        remarks.extend(correction.remarks());
        let values = fit.values().into_iter().map(|found| {
            Value::new(&found.value, found.number, found.std, &found.unit, "declared part of the signal").key()
        });
        Ok(Outcome {
            convention: ANGLE.into(),
            tables: vec![correction.rows(points, &samples)?],
            values: values.collect(),
            remarks,
            ..Outcome::default()
        })
    }
}

impl Quadrature {
    /// Blocks of so many samples: those that are asked for, where each has samples enough.
    fn blocks_of(&self, samples: usize) -> usize {
        self.0.blocks.min(samples / SAMPLES_A_BLOCK)
    }
}

/// The block of each sample: equal counts, in the order of the phase within its turn.
fn blocks(phase: &[f64], count: usize) -> Vec<usize> {
    in_equal_parts(&phase.iter().map(|phase| phase.rem_euclid(TAU)).collect::<Vec<f64>>(), count)
}

/// The part of each sample: equal counts, in the order of a value.
fn in_equal_parts(by: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..by.len()).collect();
    order.sort_by(|a, b| by[*a].total_cmp(&by[*b]));
    let mut part = vec![0; by.len()];
    for (position, sample) in order.into_iter().enumerate() {
        part[sample] = position * count / by.len();
    }
    part
}
