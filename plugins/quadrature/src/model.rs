//! The separator `quadrature`: a model of a quadrature signal for the closed loop.
//!
//! The pair (cosine, sine) = R·(cos θ, (1 + ε)·sin(θ + α)) + (x₀, y₀), seen at its own phase φ, has to first order the radius
//!
//! r(φ) = R·(1 + ε/2) + x₀ cos φ + y₀ sin φ − (ε R/2) cos 2φ + (α R/2) sin 2φ
//!
//! (Heydemann, Appl. Opt. 20 (1981) 3382, expanded). What first order leaves out is below ε²R and x₀²/R: 0.1 counts for
//! errors of 1 % on 500 counts. Orders from 3 have no such simple cause: signals that are no sines.

use std::f64::consts::TAU;

use runout_core::{
    Error, Result,
    model::{
        Effect, Parameter,
        linear_terms::{Declared, LinearFit, LinearTerms, Observations, Term},
    },
    pipeline::{
        error::{Fault, within},
        registry::{Context, StageConfig},
    },
    points::Points,
    stage::{Conclusion, PointModel, Separator},
};
use schemars::JsonSchema;
use serde::Deserialize;

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
    8
}

/// Blocks and orders beyond these say nothing more.
const MOST_BLOCKS: usize = 1_000;
const HIGHEST_ORDER: usize = 50;

impl StageConfig for QuadratureConfig {
    type Stage = Separator;

    const NAME: &'static str = "quadrature";
    const ABOUT: &'static str = "offset, gain ratio, angle and harmonics of a quadrature signal, for `diagnose`";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Model(Box::new(self.model()?)))
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

const UNIT: &str = "counts";
/// What could usually be expected, relative to the radius: 1 % of offset, gain ratio and angle.
const USUAL: f64 = 0.01;

impl Quadrature {
    /// What a signal of a radius may lack, by order from 1.
    fn effects_on(&self, radius: f64) -> Vec<Effect> {
        let usual = USUAL * radius;
        let pair = |id: String, [first, second]: [(&str, &str, f64); 2]| {
            let parameter = |(name, unit, tolerance): (&str, &str, f64)| Parameter {
                name: name.into(),
                unit: unit.into(),
                tolerance,
            };
            Effect { id, target: None, parameters: vec![parameter(first), parameter(second)] }
        };
        let wave = |size: f64| [("cosine", UNIT, size), ("sine", UNIT, size)];
        let mut effects = vec![
            pair("quadrature-offset".into(), wave(usual)),
            pair("quadrature-gain-and-angle".into(), [("gain_ratio_less_1", "", USUAL), ("angle_error", "rad", USUAL)]),
        ];
        effects.extend((3..=self.0.max_order).map(|order| pair(format!("harmonic-{order}"), wave(0.1 * usual))));
        effects
    }
}

impl PointModel for Quadrature {
    fn effects(&self) -> Vec<Effect> {
        self.effects_on(1.0)
    }

    fn terms(&self, points: &Points) -> Result<LinearTerms> {
        let phase: Vec<f64> = points.column("phase_deg")?.iter().map(|phase| phase.to_radians()).collect();
        let radius = points.column("radius_counts")?;
        let refuse = |problem: String| Error::new("fit", points.input.display().to_string(), problem);
        if phase.len() < 2 * self.0.blocks {
            let problem = format!("it has {} samples for {} blocks", phase.len(), self.0.blocks);
            return Err(refuse(problem).help("ask for fewer `blocks`"));
        }
        let mean = radius.iter().sum::<f64>() / radius.len() as f64;
        if mean <= 0.0 {
            return Err(refuse(format!("its mean radius is {mean}: there is no circle")));
        }
        let wave = |order: usize, size: f64, function: fn(f64) -> f64| -> Vec<f64> {
            phase.iter().map(|phase| size * function(order as f64 * phase)).collect()
        };
        let terms = (1..).zip(self.effects_on(mean)).map(|(order, effect)| {
            let [cosine, sine] = if order == 2 { [-0.5 * mean, 0.5 * mean] } else { [1.0; 2] };
            Term {
                effect,
                columns: vec![wave(order, cosine, f64::cos), wave(order, sine, f64::sin)],
                rank: usize::from(order > 2),
            }
        });
        let observations = Observations {
            values: radius.to_vec(),
            unit: UNIT.into(),
            std: None,
            group: blocks(&phase, self.0.blocks),
            groups: (1..=self.0.blocks).map(|block| format!("block {block}")).collect(),
        };
        let circle = Declared { name: "radius".into(), unit: UNIT.into(), column: vec![1.0; phase.len()] };
        LinearTerms::new(observations, vec![circle], terms.collect())
    }

    fn conclude(&self, points: &Points, _fit: &LinearFit) -> Result<Conclusion> {
        let samples = points.column("phase_deg")?.len();
        let blocks = format!(
            "left out one after the other: {} blocks of {} or {} samples next to each other in phase",
            self.0.blocks,
            samples / self.0.blocks,
            samples.div_ceil(self.0.blocks)
        );
        let evidence = "the noise is not known from elsewhere and samples count as independent: evidence and standard \
            uncertainties flatter, and the blocks left out decide";
        Ok(Conclusion { shape: None, remarks: vec![blocks, evidence.to_owned()] })
    }
}

/// The block of each sample: equal counts, in the order of the phase.
fn blocks(phase: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..phase.len()).collect();
    order.sort_by(|a, b| phase[*a].rem_euclid(TAU).total_cmp(&phase[*b].rem_euclid(TAU)));
    let mut group = vec![0; phase.len()];
    for (position, sample) in order.into_iter().enumerate() {
        group[sample] = position * count / phase.len();
    }
    group
}
