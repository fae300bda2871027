//! The general separator: any rig, one complex least-squares problem an order.

use runout_core::{
    Result,
    closed_loop::foresight::Foresight,
    effects::EffectCatalogue,
    fault::Fault,
    pipeline::{Context, StageConfig},
    rig::Rig,
    separation::{Assessment, Sensitivity, Separation},
    spread::Projection,
    stage::{Separator, Station, StationModel, StationSeparator, require_rig},
};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    face_notes,
    keys::{checked_gain, yes},
    station::separate,
};
use crate::{
    diagnose::DeclaredSpindle,
    layout::Layout,
    plan,
    selection::Selection,
    solve::{Operators, Readings, Solver, projection, whitening},
};

/// How readings are weighed against each other where there are more than unknowns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Weighting {
    /// By their covariance over the turns, order by order; equally where there is no scatter to measure.
    #[default]
    TurnCovariance,
    /// Equally.
    None,
}

/// `plugin = "harmonic-least-squares"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HarmonicLeastSquaresConfig {
    /// Sensors to use; without it, all of the rig.
    #[serde(default)]
    pub sensors: Option<Vec<String>>,
    /// Setups to use; without it, all of the rig.
    #[serde(default)]
    pub setups: Option<Vec<String>>,
    /// Whether readings follow exact geometry (a line meets the displaced profile) or the linear equations.
    #[serde(default = "yes")]
    pub second_order: bool,
    /// How readings are weighed.
    #[serde(default)]
    pub weighting: Weighting,
    /// An order is lost where form or motion would carry more than this many times the readings' noise; without it,
    /// where it is not observable with the layout.
    #[serde(default)]
    pub max_noise_gain: Option<f64>,
}

impl StageConfig for HarmonicLeastSquaresConfig {
    type Stage = Separator;

    const NAME: &'static str = "harmonic-least-squares";
    const ABOUT: &'static str = "any rig: least squares order by order, weighted by the scatter over the turns";

    fn check(self, context: &Context) -> std::result::Result<Separator, Fault> {
        let rig = require_rig(context.rig)?;
        let whole = |rig: &Rig| ((0..rig.sensors.len()).collect(), (0..rig.setups.len()).collect());
        let selection = Selection::named(rig, self.sensors.as_deref(), self.setups.as_deref(), whole)?;
        let max_noise_gain = checked_gain(self.max_noise_gain)?.unwrap_or(f64::INFINITY);
        let separator = HarmonicLeastSquares::of(selection, self.second_order, self.weighting, max_noise_gain);
        Ok(Separator::Stations(Box::new(separator)))
    }
}

/// The general separator, for one rig.
#[derive(Debug, Clone)]
pub struct HarmonicLeastSquares {
    selection: Selection,
    layout: Layout,
    second_order: bool,
    weighting: Weighting,
}

impl HarmonicLeastSquares {
    /// For one rig, with every order that is observable with it.
    #[must_use]
    pub fn new(rig: &Rig, second_order: bool, weighting: Weighting) -> Self {
        Self::of(Selection::whole(rig), second_order, weighting, f64::INFINITY)
    }

    /// For a part of a rig, without the orders whose noise gain is above a limit.
    #[must_use]
    pub fn of(selection: Selection, second_order: bool, weighting: Weighting, max_noise_gain: f64) -> Self {
        let layout = Layout::new(&selection.rig, false).limited_to(max_noise_gain);
        Self { selection, layout, second_order, weighting }
    }

    fn solver(&self) -> Solver<'_> {
        Solver { selection: &self.selection, layout: &self.layout, second_order: self.second_order }
    }
}

impl StationSeparator for HarmonicLeastSquares {
    fn assess(&self, max_order: usize) -> std::result::Result<Assessment, Fault> {
        let mut assessment = self.layout.assess(max_order);
        assessment.notes.extend(face_notes(&self.selection.rig, &assessment));
        self.selection.note_unused(&mut assessment);
        Ok(assessment)
    }

    fn separate(&self, station: &Station) -> Result<Separation> {
        separate(&self.solver(), station, |readings| operators(&self.layout, readings, self.weighting))
    }

    fn sensitivity(&self, station: &Station) -> Result<Option<Sensitivity>> {
        self.solver().sensitivity(station, |readings| operators(&self.layout, readings, self.weighting)).map(Some)
    }

    fn projection(&self, setup: usize) -> Option<Projection> {
        projection(&self.selection, &self.layout, setup)
    }

    fn foresee(&self, effects: &EffectCatalogue) -> Option<Result<Foresight>> {
        Some(plan::foresee(&self.selection, &self.layout, self.second_order, effects.of()))
    }

    fn model(&self, effects: &EffectCatalogue) -> Option<Box<dyn StationModel>> {
        let (selection, layout) = (self.selection.clone(), self.layout.clone());
        Some(Box::new(DeclaredSpindle::new(selection, layout, self.second_order, effects)))
    }
}

/// Least-squares operators of all orders.
fn operators(layout: &Layout, readings: &Readings, weighting: Weighting) -> Operators {
    let weights = match weighting {
        Weighting::TurnCovariance => whitening(readings),
        Weighting::None => None,
    };
    Operators::least_squares(layout, readings.max_order, weights)
}
