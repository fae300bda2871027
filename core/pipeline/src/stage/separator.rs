//! Separation: from profiles to form and motion.

use super::points::PointSeparator;
use crate::effects::EffectCatalogue;
use runout_closed_loop::{Effect, Setting, Settings, diagnosis::Diagnosis, foresight::Foresight};
use runout_error::{Result, fault::Fault};
use runout_turning::{
    profile::Profile,
    rig::Rig,
    separation::{Assessment, Sensitivity, Separation},
    spread::Projection,
};

/// A separator, by what it takes.
pub enum Separator {
    /// Profiles of all setups, one station at a time.
    Stations(Box<dyn StationSeparator>),
    /// All points at once.
    Points(Box<dyn PointSeparator>),
}

/// Separates the profiles of one station. Built for one rig, which it has checked.
pub trait StationSeparator: Send + Sync {
    /// What is observable with its rig, for orders 1 to `max_order`.
    ///
    /// # Errors
    /// When the rig does not fit the method.
    fn assess(&self, max_order: usize) -> std::result::Result<Assessment, Fault>;

    /// Form and motion of one station.
    ///
    /// # Errors
    /// When the profiles do not fit the rig.
    fn separate(&self, station: &Station) -> Result<Separation>;

    /// How its estimates follow from the readings of one station; `None` where that is not known.
    ///
    /// # Errors
    /// When the profiles do not fit the rig.
    fn sensitivity(&self, station: &Station) -> Result<Option<Sensitivity>>;

    /// What it has to say to who watches the run, since it was last asked.
    fn messages(&self) -> Vec<String> {
        Vec::new()
    }

    /// How motion of the axis follows from the readings of one setup (an index into the rig's); `None` where they show none.
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
    /// [`Model::changes`]: runout_closed_loop::Model::changes
    fn changes(&self, _effect: usize, _applied: &[Setting]) -> Vec<String> {
        Vec::new()
    }

    /// Memory that the loop takes for a station like this one beside its profiles, about, in bytes.
    fn bytes(&self, _station: &Station) -> u64 {
        0
    }

    /// Runs the loop on all stations at once; `settings` count effects as [`effects`](Self::effects) does. The profiles may lose
    /// their [`split`](Profile::split), which is large and which nothing else needs.
    ///
    /// # Errors
    /// When the profiles do not fit the rig.
    fn diagnose(&self, stations: &mut [Station], settings: &Settings) -> Result<StationDiagnosis>;
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

/// The fault of a separator without its rig.
fn rig_needed() -> Fault {
    Fault::at("plugin", "this separator needs a [rig]").help("describe sensors and setups in [rig]")
}

/// The rig of a pipeline, or the fault that says it is missing.
///
/// # Errors
/// When there is none.
pub fn require_rig(rig: Option<&Rig>) -> std::result::Result<&Rig, Fault> {
    rig.ok_or_else(rig_needed)
}
