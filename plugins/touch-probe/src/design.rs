//! The model: what each touch reads, column by column.
//!
//! reading − ring radius = mean + centring of the setup + Σ L_n e^{in(θ − probe)} + Σ F_n e^{in(θ − ring)}, real parts, n ≥ 2.

use nalgebra::DMatrix;
use runout_core::{
    consistency::rows::Rows,
    numerics::least_squares::{LeastNorm, least_norm},
};

use crate::{
    config::TouchProbeConfig,
    effects::Missing,
    touches::{Touch, Touches},
    waves::{Part, angles, wave},
};

/// Singular value, as a share of the largest, below which the touches do not show a combination of parameters: directions are evenly spaced
/// but for what the stylus is off by, and such a combination would have ten thousand times the noise.
const UNSEEN: f64 = 1e-4;

/// A parameter of the model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Parameter {
    /// Mean pre-travel and stylus.
    Mean,
    /// Centre of the ring in a setup, along x or y.
    Centre { setup: usize, axis: usize },
    /// Lobing of an order, in the probe's frame. `shared`: with the form of the ring, which the setups do not separate from it.
    Lobing { order: usize, part: Part, shared: bool },
    /// Form of the ring of an order, in the ring's frame.
    Form { order: usize, part: Part },
    /// A parameter of an effect.
    Effect { effect: usize },
}

/// What is fitted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Content {
    /// Orders of lobing above those of the configuration.
    pub more_lobing: Vec<usize>,
    /// Orders of ring form above those of the configuration.
    pub more_form: Vec<usize>,
    /// Other effects, indices.
    pub effects: Vec<usize>,
}

impl Content {
    /// What is declared.
    pub(crate) fn declared() -> Self {
        Self { more_lobing: Vec::new(), more_form: Vec::new(), effects: Vec::new() }
    }
}

/// Parameters with their columns, not weighted, in µm.
#[derive(Debug, Clone)]
pub(crate) struct Design {
    pub parameters: Vec<Parameter>,
    pub columns: Vec<Vec<f64>>,
}

impl Design {
    /// The model of touches.
    pub(crate) fn new(config: &TouchProbeConfig, touches: &Touches, missing: &[Missing], content: &Content) -> Self {
        let Touches { all, setups, .. } = touches;
        let mut design = Self { parameters: Vec::new(), columns: Vec::new() };
        design.add(Parameter::Mean, all.iter().map(|_| 1.0).collect());
        for setup in setups.iter().copied() {
            for (axis, part) in [Part::Cosine, Part::Sine].into_iter().enumerate() {
                let entry = |touch: &Touch| if touch.setup == setup { wave(1, part, touch.angle) } else { 0.0 };
                design.add(Parameter::Centre { setup, axis }, all.iter().map(entry).collect());
            }
        }
        let angles: Vec<[f64; 2]> = all.iter().map(|touch| angles(config, touch)).collect();
        let base = 2..=config.max_order;
        for order in base.clone().chain(content.more_lobing.iter().copied()) {
            let shared = base.contains(&order) && !config.separates(setups, order);
            for part in [Part::Cosine, Part::Sine] {
                let column = angles.iter().map(|[probe, _]| wave(order, part, *probe)).collect();
                design.add(Parameter::Lobing { order, part, shared }, column);
            }
        }
        let form = base.filter(|order| config.separates(setups, *order));
        for order in form.chain(content.more_form.iter().copied()) {
            for part in [Part::Cosine, Part::Sine] {
                let column = angles.iter().map(|[_, ring]| wave(order, part, *ring)).collect();
                design.add(Parameter::Form { order, part }, column);
            }
        }
        for effect in &content.effects {
            for column in missing[*effect].columns(config, touches) {
                design.add(Parameter::Effect { effect: *effect }, column);
            }
        }
        design
    }

    /// A wave that is 0 at all touches but for their rounding (the sine of order 8 in 16 directions) would be a parameter of any size.
    fn add(&mut self, parameter: Parameter, mut column: Vec<f64>) {
        let is_wave = matches!(parameter, Parameter::Lobing { .. } | Parameter::Form { .. });
        if is_wave && column.iter().all(|entry| entry.abs() < UNSEEN) {
            column.fill(0.0);
        }
        self.parameters.push(parameter);
        self.columns.push(column);
    }

    /// Place of a parameter.
    pub(crate) fn place(&self, wanted: &Parameter) -> Option<usize> {
        self.parameters.iter().position(|parameter| parameter == wanted)
    }

    /// Places of the cosine and sine of lobing or form of an order.
    pub(crate) fn pair(&self, wanted: impl Fn(&Parameter) -> Option<usize>, order: usize) -> Option<[usize; 2]> {
        let first = self.parameters.iter().position(|parameter| wanted(parameter) == Some(order))?;
        Some([first, first + 1])
    }
}

/// The order of lobing that a parameter is of.
pub(crate) fn lobing_order(parameter: &Parameter) -> Option<usize> {
    match parameter {
        Parameter::Lobing { order, .. } => Some(*order),
        _ => None,
    }
}

/// The order of ring form that a parameter is of.
pub(crate) fn form_order(parameter: &Parameter) -> Option<usize> {
    match parameter {
        Parameter::Form { order, .. } => Some(*order),
        _ => None,
    }
}

/// Where the noise of a touch is known from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Noise {
    /// Stated.
    Stated,
    /// From repeats, with so many degrees of freedom.
    Repeats(usize),
    /// From what the fit leaves only.
    Residual,
}

/// A fit.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub design: Design,
    pub solved: LeastNorm,
    /// Variance by which covariances are multiplied, of a touch of weight 1: the noise's, and more where more than noise is left.
    pub variance: f64,
    /// χ² per degree of freedom, where the noise is known.
    pub chi2_per_dof: f64,
    /// The residual of each touch, in µm.
    pub residual_um: Vec<f64>,
    /// Touches that are not like the others.
    pub unlike: Option<Rows>,
}

/// Standard deviation of each touch in µm, and where it is known from.
#[derive(Debug, Clone)]
pub(crate) struct Weights {
    pub std_um: Vec<f64>,
    pub noise: Noise,
}

impl Weights {
    /// Root mean square of them.
    pub(crate) fn rms_um(&self) -> f64 {
        (self.std_um.iter().map(|std| std * std).sum::<f64>() / self.std_um.len().max(1) as f64).sqrt()
    }
}

impl Design {
    /// Fits some touches (indices; all of them in order where they are all) to readings in µm.
    pub(crate) fn fit(&self, readings_um: &[f64], weights: &Weights, used: &[usize]) -> Fitted {
        let columns = weighted(&self.columns, weights, used);
        let values: Vec<f64> = used.iter().map(|row| readings_um[*row] / weights.std_um[*row]).collect();
        let solved = least_norm(&columns, &values, UNSEEN);
        let chi2: f64 = solved.residual.iter().map(|value| value * value).sum();
        let level = if solved.dof > 0 { chi2 / solved.dof as f64 } else { f64::NAN };
        let residual_um = solved.residual.iter().zip(used).map(|(value, row)| value * weights.std_um[*row]).collect();
        let (design, unlike) = (self.clone(), None);
        let mut fitted = Fitted { design, solved, variance: 1.0, chi2_per_dof: f64::NAN, residual_um, unlike };
        fitted.level(weights, level);
        fitted
    }
}

/// Columns of some touches in units of their standard deviation.
fn weighted(columns: &[Vec<f64>], weights: &Weights, used: &[usize]) -> Vec<Vec<f64>> {
    let weigh = |column: &Vec<f64>| used.iter().map(|row| column[*row] / weights.std_um[*row]).collect();
    columns.iter().map(weigh).collect()
}

impl Fitted {
    /// The design's columns of some touches, in units of their standard deviation.
    pub(crate) fn weighted(&self, weights: &Weights, used: &[usize]) -> Vec<Vec<f64>> {
        weighted(&self.design.columns, weights, used)
    }

    /// Takes the variance from the residual per degree of freedom, in units of the noise where that is known.
    pub(crate) fn level(&mut self, weights: &Weights, level: f64) {
        self.variance = match weights.noise {
            Noise::Residual => level,
            // With no degree of freedom left, the stated noise is all that is known.
            _ if self.solved.dof == 0 => 1.0,
            _ => level.max(1.0),
        };
        self.chi2_per_dof = if weights.noise == Noise::Residual { f64::NAN } else { level };
    }

    /// Covariance of parameters, in their units.
    pub(crate) fn covariance(&self, one: usize, other: usize) -> f64 {
        self.variance * self.solved.covariance[(one, other)]
    }

    /// Covariance of some parameters.
    pub(crate) fn covariance_of(&self, places: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(places.len(), places.len(), |row, column| self.covariance(places[row], places[column]))
    }

    /// Whether the parameters are observable with the touches.
    pub(crate) fn is_observable(&self, places: &[usize]) -> bool {
        places.iter().all(|place| !self.solved.lost[*place])
    }
}
pub(crate) fn name(config: &TouchProbeConfig, parameter: &Parameter) -> String {
    let part = |part: &Part| if *part == Part::Cosine { "cosine" } else { "sine" };
    match parameter {
        Parameter::Mean => "mean pre-travel".into(),
        Parameter::Centre { setup, axis } => format!("centre {} of {}", ["x", "y"][*axis], config.setups[*setup].id),
        Parameter::Lobing { order, part: of, shared: false } => format!("lobing {order} {}", part(of)),
        Parameter::Lobing { order, part: of, shared: true } => format!("lobing and ring form {order} {}", part(of)),
        Parameter::Form { order, part: of } => format!("ring form {order} {}", part(of)),
        Parameter::Effect { effect } => format!("effect {effect}"),
    }
}
