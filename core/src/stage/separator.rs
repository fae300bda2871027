//! Separation: from profiles or points to form and motion.

use crate::{
    Result,
    model::linear_terms::{LinearFit, LinearTerms},
    model::{Effect, Setting, closed_loop::Settings, diagnosis::Diagnosis, foresight::Foresight},
    pipeline::{effects::EffectCatalogue, error::Fault},
    points::Points,
    profile::Profile,
    rig::Rig,
    separation::{Assessment, Sensitivity, Separation},
    spread::Projection,
    straightness::Straightness,
    surface::Surface,
    table::Table,
};

/// A separator, by what it takes.
pub enum Separator {
    /// Profiles of all setups, one station at a time.
    Stations(Box<dyn StationSeparator>),
    /// All points at once.
    Points(Box<dyn PointSeparator>),
    /// All points at once, and only for the closed loop: there is no form to separate.
    Model(Box<dyn PointModel>),
    /// All traces along an axis at once.
    Traces(Box<dyn TraceSeparator>),
}

/// Separates the profiles of one station. Built for one rig, which it has checked.
pub trait StationSeparator: Send + Sync {
    /// What it can tell with its rig, for orders 1 to `max_order`.
    ///
    /// # Errors
    /// When the rig does not fit the method.
    fn assess(&self, max_order: usize) -> std::result::Result<Assessment, Fault>;

    /// Form and motion of one station.
    ///
    /// # Errors
    /// When the profiles do not fit the rig.
    fn separate(&self, station: &Station) -> Result<Separation>;

    /// How its estimates follow from the readings of one station.
    ///
    /// # Errors
    /// When the profiles do not fit the rig.
    fn sensitivity(&self, station: &Station) -> Result<Sensitivity>;

    /// How motion of the axis follows from the readings of one setup (an index into the rig's); `None` where these tell none.
    fn projection(&self, _setup: usize) -> Option<Projection> {
        None
    }

    /// Which effects the closed loop could find with its rig, in a campaign of usual size; `None` where the method has no
    /// model of effects.
    fn foresee(&self, _effects: &EffectCatalogue) -> Option<Result<Foresight>> {
        None
    }

    /// Its model for the closed loop, which may lack those of these effects that are of its domain; `None` where the method
    /// has no such model.
    fn model(&self, _effects: &EffectCatalogue) -> Option<Box<dyn StationModel>> {
        None
    }
}

/// A model of one rig's turns for the closed loop.
pub trait StationModel: Send + Sync {
    /// What it may lack, at each target.
    fn effects(&self) -> &[Effect];

    /// Lines of TOML that declare an effect in the rig, at the values that are applied ([`Model::changes`]).
    ///
    /// [`Model::changes`]: crate::model::Model::changes
    fn changes(&self, _effect: usize, _applied: &[Setting]) -> Vec<String> {
        Vec::new()
    }

    /// Runs the loop on all stations at once; `settings` count effects as [`effects`](Self::effects) does.
    ///
    /// # Errors
    /// When the profiles do not fit the rig.
    fn diagnose(&self, stations: &[Station], settings: &Settings) -> Result<StationDiagnosis>;
}

/// What the closed loop found, with form and motion before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct StationDiagnosis {
    /// What was found.
    pub diagnosis: Diagnosis,
    /// Form and motion of the declared model, one entry a station.
    pub before: Vec<Separation>,
    /// Of the final one.
    pub after: Vec<Separation>,
}

/// One axial station, measured in every setup of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// Its name.
    pub name: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// One profile a setup, in the rig's order.
    pub profiles: Vec<Profile>,
}

/// Separates measured points as a whole, for example circles from the cylinder that they lie on.
pub trait PointSeparator: Send + Sync {
    /// One separation a section, in the order of z, named by the section's id.
    ///
    /// # Errors
    /// When the points do not hold what the method needs.
    fn separate(&self, points: &Points) -> Result<Vec<Separation>>;

    /// Radius of the cylinder that the deviations of [`separate`](Self::separate) count from, in mm.
    ///
    /// # Errors
    /// When the points do not hold what the method needs.
    fn reference_radius_mm(&self, points: &Points) -> Result<f64>;

    /// Whether [`remarks`](Self::remarks) needs the surface.
    fn needs_surface(&self) -> bool {
        false
    }

    /// What the user should know of the whole, once it is done: what was fitted, and how well the surface predicts
    /// points that were not used.
    ///
    /// # Errors
    /// When the points do not hold what it needs.
    fn remarks(&self, _points: &Points, _surface: Option<&Surface>) -> Result<Vec<String>> {
        Ok(Vec::new())
    }

    /// Its model for the closed loop, where it has one.
    fn model(&self) -> Option<&dyn PointModel> {
        None
    }
}

/// A model of measured points for the closed loop.
pub trait PointModel: Send + Sync {
    /// What it may lack, in the order of the terms; what is usual of a parameter may depend on the points.
    fn effects(&self) -> Vec<Effect>;

    /// What is declared of these points, and the effects that this may lack.
    ///
    /// # Errors
    /// When the points do not hold what the model needs.
    fn terms(&self, points: &Points) -> Result<LinearTerms>;

    /// The name of the table that its conclusion gives, where it gives one.
    fn table(&self) -> Option<&'static str> {
        None
    }

    /// What the final fit says.
    ///
    /// # Errors
    /// When the points do not hold what it needs.
    fn conclude(&self, points: &Points, fit: &LinearFit) -> Result<Conclusion>;
}

/// What a model's final fit says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Conclusion {
    /// The form by the effects that were found, where there is one.
    pub shape: Option<Shape>,
    /// Numbers that the effects that were found give of each point, where there are any.
    pub table: Option<Table>,
    /// What the user should know.
    pub remarks: Vec<String>,
}

/// Form that a model's fit describes.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// One separation a section, in the order of z.
    pub sections: Vec<Separation>,
    /// Radius of the cylinder that it counts from, in mm.
    pub radius_mm: f64,
}

/// Separates traces along an axis into the straightness of the part and of the slide.
pub trait TraceSeparator: Send + Sync {
    /// Straightness of both.
    ///
    /// # Errors
    /// When the traces do not hold what the method needs.
    fn separate(&self, points: &Points) -> Result<Straightness>;

    /// Its model for the closed loop, where it has one.
    fn model(&self) -> Option<&dyn TraceModel> {
        None
    }
}

/// A model of traces along an axis for the closed loop.
pub trait TraceModel: Send + Sync {
    /// What it may lack, without targets: these are traces and setups, which the data name.
    fn effects(&self) -> Vec<Effect>;

    /// What it may lack with these traces, at each target.
    ///
    /// # Errors
    /// When the traces do not hold what the model needs.
    fn effects_of(&self, points: &Points) -> Result<Vec<Effect>>;

    /// Runs the loop; `settings` count effects as [`effects_of`](Self::effects_of) does.
    ///
    /// # Errors
    /// When the traces do not hold what the model needs.
    fn diagnose(&self, points: &Points, settings: &Settings) -> Result<TraceDiagnosis>;
}

/// What the closed loop found, with the straightness of the final model.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceDiagnosis {
    /// What was found.
    pub diagnosis: Diagnosis,
    /// Straightness of part and slide with the effects added.
    pub after: Straightness,
}

/// What a separator is built with besides its own configuration.
#[must_use]
pub fn rig_needed() -> Fault {
    Fault::at("plugin", "this separator needs a [rig]").help("describe sensors and setups in [rig]")
}

/// The rig of a pipeline, or the fault that says it is missing.
///
/// # Errors
/// When there is none.
pub fn require_rig(rig: Option<&Rig>) -> std::result::Result<&Rig, Fault> {
    rig.ok_or_else(rig_needed)
}
