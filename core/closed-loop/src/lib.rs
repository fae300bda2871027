//! The closed loop: what a declared model leaves of the data, traced to what it lacks.
//!
//! A [`Model`] fits everything that it declares and gives the residual; it knows *effects* that it could have besides, each
//! with parameters and a signature, the derivative of the residual by each parameter. [`diagnose`] finds which
//! of them the data ask for, adds them, and says what it cannot know. Nothing here knows what is measured.
//!
//! ```
//! use runout_closed_loop::{
//!     Effect, Parameter, Settings, diagnose,
//!     diagnosis::Verdict,
//!     linear_terms::{Declared, LinearTerms, Observations, Term},
//! };
//!
//! // A level of 5 µm is declared; the readings also drift by 0.3 µm each, in noise of 0.1 µm.
//! let time: Vec<f64> = (0..40).map(f64::from).collect();
//! let observations = Observations {
//!     values: time.iter().map(|t| 5.0 + 0.3 * t + 0.1 * (7.0 * t).sin()).collect(),
//!     unit: "um".into(),
//!     std: Some(0.1),
//!     group: (0..40).map(|reading| reading % 5).collect(),
//!     groups: (0..5).map(|group| format!("group {group}")).collect(),
//!     ..Observations::default()
//! };
//! let level = Declared { name: "level".into(), unit: "um".into(), column: vec![1.0; 40] };
//! let rate = Parameter { name: "rate".into(), unit: "um".into(), tolerance: 0.1 };
//! let drift = Effect { id: "drift".into(), targets: Vec::new(), parameters: vec![rate] };
//! let terms = vec![Term { effect: drift, columns: vec![time], rank: 0 }];
//! let model = LinearTerms::new(observations, vec![level], terms)?;
//!
//! let diagnosis = diagnose(&model, &Settings::default())?.diagnosis;
//! assert_eq!(diagnosis.verdict, Verdict::Explained);
//! assert_eq!(diagnosis.added[0].effect, "drift");
//! assert!((diagnosis.added[0].parameters[0].value - 0.3).abs() < 0.01);
//! # Ok::<(), runout_error::Error>(())
//! ```

mod candidates;
mod combinations;
mod confounded;
pub mod correction;
pub mod diagnosis;
pub mod evidence;
pub mod fit;
pub mod foresight;
mod found;
mod judgement;
mod keyed;
pub mod linear_terms;
mod mistakes;
mod parts;
mod report;
mod search;
mod taken_back;
pub mod tested;

use std::sync::Arc;

pub use search::{Closed, Settings, diagnose};

use self::diagnosis::{Estimated, Unexplained};
use runout_consistency::{Check, Partition, Structure};
use runout_error::Result;

/// A declared model of a measurement, and what it could lack.
pub trait Model: Sync {
    /// A fit of it.
    type Fit: Fit;

    /// What it could lack, one entry an effect and target.
    fn effects(&self) -> &[Effect];

    /// Fits everything that is declared, with some effects applied: fully, not only to first order.
    ///
    /// # Errors
    /// When the data do not fit the model, or a parameter is beyond all bounds.
    fn fit(&self, applied: &[Setting]) -> Result<Self::Fit>;

    /// When an effect's turn comes: those of a higher rank are tried only where the evidence supports none of a lower one. A part's
    /// place comes before its size, and its size before its form, which counts from them.
    fn rank(&self, _effect: usize) -> usize {
        0
    }

    /// Whether an effect can have these values: a low-pass cannot amplify.
    fn is_possible(&self, _effect: usize, _values: &[f64]) -> bool {
        true
    }

    /// How unusual an effect with these values is: its largest parameter, in tolerances. A factor counts by its logarithm.
    fn size(&self, effect: usize, values: &[f64]) -> f64 {
        in_tolerances(&self.effects()[effect].parameters, values)
    }

    /// What ends a list of effects (orders, lines) of which this one is the last, in words: "order 8 is the highest".
    fn last_of_list(&self, _effect: usize) -> Option<String> {
        None
    }

    /// Values of an effect that its search begins at, beside what is applied, and its fit; all 0 without them. A model that is far from
    /// linear in an effect searches them itself.
    fn start(&self, _effect: usize, _fit: &Self::Fit, _applied: &[Setting]) -> Option<Vec<f64>> {
        None
    }

    /// Other values of what is applied behind the first `known`, from which a refit may explain more now that another effect is there: of a model that
    /// is far from linear.
    fn elsewhere(&self, _fit: &Self::Fit, _applied: &[Setting], _known: usize) -> Vec<Vec<Setting>> {
        Vec::new()
    }

    /// The model on all data, for the final results: what the loop holds out is part of them.
    fn whole(&self) -> &Self {
        self
    }

    /// Whether a fit takes all processors itself; else candidates are tried side by side.
    fn is_spread(&self) -> bool {
        false
    }

    /// What would declare an effect at the values that are `applied`: lines of TOML, a key of the measurement's declaration
    /// and the value to put there each (`setups.1.part_deg = 100.184`). Nothing where there is no key for it.
    fn changes(&self, _effect: usize, _applied: &[Setting]) -> Vec<String> {
        Vec::new()
    }

    /// Whether data beside those of the residual's rms show an effect: single turns beside their average.
    fn is_seen_besides(&self, _effect: usize) -> bool {
        false
    }

    /// Whether an effect is one of a long list of effects that are alike, each of a part of the data: a few of them only are tried at a time.
    fn is_one_of_many(&self, _effect: usize) -> bool {
        false
    }

    /// Whether an effect is a mistake in the declaration: it is there or not, and is looked for before any other.
    fn is_mistake(&self, _effect: usize) -> bool {
        false
    }

    /// Mistakes in the declaration that may explain the residual with some effects applied, the likeliest first: each entry is
    /// one mistake, or several that were made together. Asked for only where far more than noise is left.
    fn suspected_mistakes(&self, _applied: &[Setting]) -> Vec<Vec<usize>> {
        Vec::new()
    }

    /// Effects that take the place of one that acts on the whole, where it is not the same in all its parts: one a part.
    fn parts(&self, _effect: usize) -> Vec<usize> {
        Vec::new()
    }

    /// An effect's parameters as people say them.
    fn present(&self, _effect: usize, estimated: Vec<Estimated>) -> Vec<Estimated> {
        estimated
    }
}

/// A model fitted to its data.
pub trait Fit: Sync {
    /// The residual, and what is known of it.
    fn remainder(&self) -> &Remainder;

    /// How the residual changes with each parameter of an effect (an index into [`Model::effects`]), at the values that are
    /// applied, or at none: `[parameter][residual]`, per unit of the parameter. Everything that the model fits anyway is
    /// already taken out of it.
    fn signature(&self, effect: usize) -> Vec<Vec<f64>>;

    /// A vector of the residual's coordinates in those of the readings that [`Remainder::structure`] is of, where these are others:
    /// contrasts between traces, means over neighbours. It is linear.
    fn tested(&self, vector: &[f64]) -> Vec<f64> {
        vector.to_vec()
    }
    /// Entries of the residual that each of these readings is a mean of: the factor by which its variance is smaller.
    fn averaged(&self) -> f64 {
        1.0
    }
    /// The orthonormal columns of what is declared, in the coordinates of [`tested`](Self::tested); nothing where these leave it out.
    fn declared_columns(&self) -> &[Vec<f64>] {
        &[]
    }
    /// Independent blocks of the residual's own entries, for effects that [`tested`](Self::tested) does not show.
    fn blocks_of_entries(&self) -> Option<Partition> {
        None
    }
    /// Frequencies or other places at which an effect was looked for: it is as many candidates.
    fn tried(&self, _effect: usize) -> usize {
        1
    }
    /// Whether an effect compares readings with others than before: a shift along the order of the readings.
    fn moves_readings(&self, _effect: usize) -> bool {
        false
    }
    /// Chance of the gain of an effect, with the values that were `found`, among those of the other members of its family
    /// ([`runout_consistency::keys::among_family`]): what they explain of what it leaves, `left`.
    fn among_family(&self, _effect: usize, _found: &[f64], _left: &[f64]) -> Option<f64> {
        None
    }
    /// Standard uncertainties of a fitted effect's parameters where the tests make them larger than the size of the residual does.
    fn tested_std(&self, _effect: usize) -> Vec<f64> {
        Vec::new()
    }
    /// The tests of the fit on its own data, beside those of single effects.
    fn consistency(&self) -> Vec<Check> {
        Vec::new()
    }

    /// How the results (form, motion) change with each parameter of an effect: root mean square, per unit of it.
    fn bias(&self, effect: usize) -> Vec<Bias>;

    /// The result that counts most (form), in one unit, NaN where it is not observable; always of one length. Where the data
    /// do not decide between effects, it stays as near as possible to that of the declared model.
    fn results(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Replaces all results by their weighted mean over equivalent fits, between which the data do not decide, and adds to
    /// their uncertainty how far these are from it. `weights` are this fit's and then those of `others`; their sum is 1.
    fn mix(&mut self, _weights: &[f64], _others: Vec<Self>)
    where
        Self: Sized,
    {
    }

    /// Values that users read, with their standard uncertainty where it is known.
    fn values(&self) -> Vec<LookedAt>;

    /// Takes into its results' uncertainty what is not known of the parameters of these effects, one after the other:
    /// their covariance `[parameter][parameter]`.
    fn widen(&mut self, _effects: &[usize], _covariance: &[Vec<f64>]) {}

    /// What the declaration leaves open within bounds (a form that is taken as 0): it is in the residual without being noise.
    fn open_within_bounds(&self) -> Vec<OpenWithinBound> {
        Vec::new()
    }

    /// Groups of the data (circles, blocks, captures) of which far more is left than of the others, whether or not the noise is
    /// known ([`evidence::far_worse`]).
    fn far_worse(&self) -> Vec<Unexplained> {
        Vec::new()
    }

    /// Where something is left that the noise does not explain.
    fn unexplained(&self) -> Vec<Unexplained> {
        Vec::new()
    }

    /// What measurement would distinguish effects of a confounded set.
    fn distinguished_by(&self, _effects: &[usize]) -> Option<String> {
        None
    }
}

/// Something that a declared model may lack, at one target.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Its id, in kebab-case.
    pub id: String,
    /// Where it acts: the id of a sensor or a setup, or of two; nothing for the whole.
    pub targets: Vec<String>,
    /// What it is described by.
    pub parameters: Vec<Parameter>,
}

/// A number that describes an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// What could usually be expected of it, in its unit: the standard deviation of its prior.
    pub tolerance: f64,
}

/// The largest of an effect's values, in the tolerances of its parameters.
#[must_use]
pub fn in_tolerances(parameters: &[Parameter], values: &[f64]) -> f64 {
    values.iter().zip(parameters).map(|(value, known)| value.abs() / known.tolerance).fold(0.0, f64::max)
}

/// An effect with values of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Index into [`Model::effects`].
    pub effect: usize,
    /// One value a parameter.
    pub values: Vec<f64>,
}

/// What a fit leaves of the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Remainder {
    /// In standard deviations of its noise, projected to where nothing that is fitted can reach; of mean square 1 for each
    /// degree of freedom where only noise is left.
    pub residual: Vec<f64>,
    /// What is declared of the readings that `residual` is of; entry by entry.
    pub structure: Arc<Structure>,
    /// Its degrees of freedom.
    pub dof: usize,
    /// Root mean square of the residual, in the data's unit.
    pub rms: f64,
    /// Its value expected from noise, in the data's unit; NaN where the noise is not known from elsewhere: then
    /// `residual` is in the data's unit.
    pub noise_floor: f64,
    /// Root mean square of what the fit leaves of data that it has not seen, in the data's unit.
    pub held_out_rms: f64,
    /// Its value expected from noise, in the data's unit: the noise of the held-out data and that of their prediction from the
    /// data fitted. NaN where the noise is not known.
    pub held_out_expected_rms: f64,
    /// Weighted sum of squares of the residual on held-out data.
    pub held_out_chi2: f64,
    /// Share of χ² that is expected from disturbances which the model knows to be in the data beyond noise, and whose course it
    /// does not know: an effect that explains no more than this may be one of them. 0 without any.
    pub disturbed_chi2: f64,
    /// Unit of the data.
    pub unit: String,
}

impl Remainder {
    /// Sum of squares of the residual.
    #[must_use]
    pub fn chi2(&self) -> f64 {
        self.residual.iter().map(|value| value * value).sum()
    }

    /// χ² per degree of freedom.
    #[must_use]
    pub fn chi2_per_dof(&self) -> f64 {
        self.chi2() / self.dof.max(1) as f64
    }

    /// Whether the noise is known from elsewhere than from the fit.
    #[must_use]
    pub fn noise_is_known(&self) -> bool {
        self.noise_floor.is_finite()
    }
}

/// A quantity that is declared within a bound and not fitted, as it may stand in [`Remainder::residual`].
#[derive(Debug, Clone, PartialEq)]
pub struct OpenWithinBound {
    /// Its harmonics, of which one takes up the whole bound: cosine and sine, each of one standard uncertainty.
    pub harmonics: Vec<[Vec<f64>; 2]>,
}

/// What one unit of a parameter does to a result.
#[derive(Debug, Clone, PartialEq)]
pub struct Bias {
    /// Which result: "form", "motion".
    pub on: String,
    /// Root mean square.
    pub value: f64,
    /// Of the result per that of the parameter: "um/mm".
    pub unit: String,
}

/// A value that users read.
#[derive(Debug, Clone, PartialEq)]
pub struct LookedAt {
    /// Its symbol or name.
    pub value: String,
    /// The section, where it has one.
    pub section: Option<String>,
    /// The number.
    pub number: f64,
    /// Its standard uncertainty; NaN where not known.
    pub std: f64,
    /// Its unit.
    pub unit: String,
}
