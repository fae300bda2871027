//! The stages of a pipeline: one trait a file. A plugin implements one of them.

pub mod check;
mod evaluable;
mod exporter;
mod loader;
mod overview;
mod plan;
pub mod points;
pub mod preprocessor;
pub mod separator;
mod simulator;

pub use crate::summary::NamedValue;
pub use check::{Check, Planned};
pub use evaluable::{Evaluable, EvaluableKind, Form, OpenProfile, PlaneMap};
pub use exporter::{About, Completed, Export, Exporter, ResultInfo, Takes};
pub use loader::{Loader, Request, Source, SourceKind};
pub use overview::{Overview, Part, Section};
pub use plan::{LayoutScore, NoiseGain, PointAddition, PointPlan};
pub use points::{LinearModel, Outcome, PointDiagnosis, PointModel, PointSeparator};
pub use preprocessor::{AverageRequest, Averager, Conditioner, Preprocessor};
pub use separator::{Separator, Station, StationDiagnosis, StationModel, StationSeparator};
pub use simulator::{Simulation, Simulator};
