//! The stages of a pipeline: one trait a file. A plugin implements one of them.

mod check;
mod evaluator;
mod exporter;
mod linear_model;
mod loader;
mod overview;
mod plan;
mod points;
mod preprocessor;
mod separator;
mod simulator;

pub use check::{Check, Planned, captures_sampled, speeds_of};
pub use evaluator::{Evaluation, Evaluator, OwnValues};
pub use exporter::{About, Completed, Export, Exporter, ResultInfo, Takes};
pub use linear_model::{diagnose_linear, residual_table, separate_declared};
pub use loader::{Loader, Request, Source, SourceKind};
pub use overview::{Overview, Part, Section};
pub use plan::{LayoutScore, NoiseGain, PointAddition, PointPlan};
pub use points::{LinearModel, Outcome, PointDiagnosis, PointModel, PointSeparator, far_below_noise};
pub(crate) use preprocessor::Corrected;
pub use preprocessor::{AverageRequest, Averager, Conditioner, Corrector, Preprocessor, sample_rate_hz};
pub use runout_evaluate::evaluable::{AxisMotion, Evaluable, EvaluableKind, Form, MotionErrors, OpenProfile, PlaneMap};
pub use separator::{Separator, Station, StationDiagnosis, StationModel, StationSeparator, require_rig};
pub use simulator::{Simulation, Simulator};
