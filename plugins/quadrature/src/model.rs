//! The separator `quadrature`: a model of a quadrature signal for the closed loop.
//!
//! Without a reference angle the data are the radius over the pair's own phase, and each order of it has two possible causes that
//! do the opposite to the angle ([`crate::components`]). With a reference angle θ the data are both parts of z e^{−iθ}, in which
//! the components are linear, exactly, and no two of them are alike; the held-out error is that of the angle.

use std::f64::consts::TAU;

use runout_core::{
    Complex64, Error, ErrorKind, Result,
    model::{
        Effect, Fit,
        linear_terms::{Declared, LinearFit, LinearTerms, Observations, Term},
    },
    pipeline::{
        error::{Fault, within},
        registry::{Context, StageConfig},
    },
    points::{PointColumn, PointKind::Number, Points},
    stage::{
        LinearModel, Outcome, PointModel, PointSeparator, Separator,
        points::{residual_table, separate_declared, value},
    },
    table::TableSpec,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    angle::{ANGLE, Correction, angle_table},
    components::{Component, UNIT},
    signal::{Signal, least_squares},
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
    8
}

/// Blocks and orders beyond these say nothing more.
const MOST_BLOCKS: usize = 1_000;
const HIGHEST_ORDER: usize = 50;

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
/// A reference that does not follow the phase within this, in rad, is none of it.
const FAR_OFF: f64 = 0.5;
const TOLD_APART: &str = "a reference angle: the column reference_deg; or signals that are known to be sines: \
    `[diagnose] effects = [\"quadrature-offset\", \"quadrature-gain-and-angle\"]`";

/// Samples as the model takes them.
pub struct Samples {
    pub phase_rad: Vec<f64>,
    pub radius: Vec<f64>,
    /// The true angle with the phase's zero, where it is known.
    pub true_rad: Option<Vec<f64>>,
}

impl Samples {
    fn of(points: &Points) -> Result<Self> {
        let rad = |name: &str| -> Result<Vec<f64>> {
            Ok(points.column(name)?.iter().map(|degrees| degrees.to_radians()).collect())
        };
        let phase_rad = rad("phase_deg")?;
        let radius = points.column("radius_counts")?.to_vec();
        let refuse = |problem: String| Error::new("fit", points.input.display().to_string(), problem);
        let mean = radius.iter().sum::<f64>() / radius.len() as f64;
        if !(mean.is_finite() && mean > 0.0) {
            return Err(refuse(format!("its mean radius is {mean}: there is no circle")));
        }
        let true_rad = rad("reference_deg").ok().map(|reference| {
            let ahead = phase_rad.iter().zip(&reference).map(|(phase, reference)| Complex64::cis(phase - reference));
            let mean = ahead.sum::<Complex64>() / reference.len() as f64;
            // The length of the mean is 1 − σ²/2.
            if 1.0 - mean.norm() > 0.5 * FAR_OFF * FAR_OFF {
                return Err(refuse("the column reference_deg does not follow phase_deg".into())
                    .help("give the reference in degrees of the signal's own period, growing with the phase"));
            }
            Ok(reference.iter().map(|reference| reference + mean.arg()).collect())
        });
        Ok(Self { phase_rad, radius, true_rad: true_rad.transpose()? })
    }

    /// Mean of the radius, in counts.
    fn mean_radius(&self) -> f64 {
        self.radius.iter().sum::<f64>() / self.radius.len() as f64
    }

    /// Where each sample is on the circle: the true angle, or the phase.
    fn angles(&self) -> &[f64] {
        self.true_rad.as_deref().unwrap_or(&self.phase_rad)
    }

    /// The radius; with a reference both parts of z e^{−iθ}, the one along the circle behind the other.
    fn values(&self) -> Vec<f64> {
        let Some(angles) = &self.true_rad else { return self.radius.clone() };
        let z = self.radius.iter().zip(&self.phase_rad).zip(angles);
        let turned: Vec<Complex64> =
            z.map(|((radius, phase), angle)| Complex64::from_polar(*radius, phase - angle)).collect();
        turned.iter().map(|z| z.re).chain(turned.iter().map(|z| z.im)).collect()
    }

    /// What is always fitted: the radius, and with a reference the zero of the angle.
    fn declared(&self) -> Vec<Declared> {
        let count = self.phase_rad.len();
        let rows = if self.true_rad.is_some() { 2 * count } else { count };
        let part = |name: &str, of: std::ops::Range<usize>| {
            let column = (0..rows).map(|row| if of.contains(&row) { 1.0 } else { 0.0 }).collect();
            Declared { name: name.into(), unit: UNIT.into(), column }
        };
        let mut declared = vec![part("radius", 0..count)];
        if rows > count {
            declared.push(part("zero of the angle", count..rows));
        }
        declared
    }

    /// The values of a linear model, exact where it is fitted; radius, and parameters of gain ratio and quadrature angle, there.
    ///
    /// What the radius over the phase has beyond first order is taken out of it, as if all components were backward ones: of
    /// components that the radius alone does not decide, it is not known better.
    fn linearised(&self, max_order: usize) -> Result<(Vec<f64>, f64, [f64; 2])> {
        let mut values = self.values();
        let gain = Component::of_order(2)[0];
        let (radius, waves) = if self.true_rad.is_some() {
            let all = Component::all(max_order);
            let waves = all.iter().flat_map(|component| [0, 1].map(|wave| self.column(*component, wave)));
            let waves = waves.map(|column| Declared { name: "component".into(), unit: UNIT.into(), column });
            let found = least_squares(values.clone(), self.declared().into_iter().chain(waves).collect())?;
            let place = self.declared().len() + 2 * all.iter().position(|component| *component == gain).unwrap_or(0);
            (found[0], [found[place], found[place + 1]])
        } else {
            let backward: Vec<Component> = (1..=max_order).map(|order| Component::of_order(order)[0]).collect();
            let signal = Signal::fit(&self.phase_rad, &self.radius, &[], &backward, &[])?;
            if !signal.is_usable() {
                return Ok((values, self.mean_radius(), [0.0; 2]));
            }
            for (value, phase) in values.iter_mut().zip(&self.phase_rad) {
                let first_order = signal.components.iter().map(|(component, p)| {
                    let [cosine, sine] = component.across(*phase);
                    p.re * cosine + p.im * sine
                });
                *value += signal.radius + first_order.sum::<f64>() - signal.radius_at_phase(*phase);
            }
            let p =
                signal.components.iter().find(|(component, _)| *component == gain).map_or(Complex64::ZERO, |(_, p)| *p);
            (signal.radius, [p.re, p.im])
        };
        let parameters = gain.parameters(radius, waves);
        let slopes = gain.slopes(radius, parameters);
        let beyond: [f64; 2] =
            [0, 1].map(|wave| parameters[0] * slopes[0][wave] + parameters[1] * slopes[1][wave] - waves[wave]);
        for (wave, share) in beyond.into_iter().enumerate() {
            let column = self.column(gain, wave);
            values.iter_mut().zip(column).for_each(|(value, entry)| *value += share * entry);
        }
        Ok((values, radius, parameters))
    }

    /// What the cosine or the sine of a component in the radius adds to the values.
    fn column(&self, component: Component, wave: usize) -> Vec<f64> {
        let across = self.angles().iter().map(|angle| component.across(*angle)[wave]);
        let along = self.true_rad.iter().flatten().map(|angle| component.along(*angle)[wave]);
        across.chain(along).collect()
    }
}

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
        if count < 2 * self.0.blocks {
            let problem = format!("it has {count} samples for {} blocks", self.0.blocks);
            let error = Error::new("fit", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData);
            return Err(error.help("ask for fewer `blocks`"));
        }
        let (values, radius, gain_and_angle) = samples.linearised(self.0.max_order)?;
        let terms = Component::all(self.0.max_order).into_iter().map(|component| {
            let waves = [0, 1].map(|wave| samples.column(component, wave));
            let columns = component.slopes(radius, gain_and_angle).map(|[cosine, sine]| {
                waves[0].iter().zip(&waves[1]).map(|(first, second)| cosine * first + sine * second).collect()
            });
            let rank = usize::from(component.order() > 2);
            Term { effect: component.effect(radius), columns: columns.into(), rank }
        });
        let group = blocks(samples.angles(), self.0.blocks);
        let rows = values.len();
        let observations = Observations {
            group: group.into_iter().cycle().take(rows).collect(),
            values,
            unit: UNIT.into(),
            std: None,
            groups: (1..=self.0.blocks).map(|block| format!("block {block}")).collect(),
        };
        let highest = self.0.max_order;
        let limit = format!("`separate.max_order` is {highest}");
        let model = LinearTerms::new(observations, samples.declared(), terms.collect())?;
        let model = Component::of_order(highest)
            .into_iter()
            .fold(model, |model, component| model.ending_at(component.id(), limit.clone()));
        if samples.true_rad.is_some() {
            return Ok(model.judged_by(count..rows));
        }
        Ok(model.told_apart_by(TOLD_APART))
    }

    fn conclude(&self, points: &Points, fit: &LinearFit) -> Result<Outcome> {
        let samples = Samples::of(points)?;
        let count = samples.phase_rad.len();
        let blocks = format!(
            "left out one after the other: {} blocks of {} or {} samples next to each other in phase",
            self.0.blocks,
            count / self.0.blocks,
            count.div_ceil(self.0.blocks)
        );
        let evidence = "the noise is not known from elsewhere and samples count as independent: evidence and standard \
            uncertainties flatter, and the blocks left out decide";
        let correction = Correction::of(&samples, self.0.max_order, fit)?;
        let mut remarks = vec![blocks, evidence.to_owned()];
        remarks.extend(correction.remarks());
        let values = fit
            .values()
            .into_iter()
            .map(|found| value(&found.value, found.number, found.std, &found.unit, "declared part of the signal"));
        Ok(Outcome {
            convention: ANGLE.into(),
            tables: vec![correction.rows(points, &samples)?],
            values: values.collect(),
            remarks,
            ..Outcome::default()
        })
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
