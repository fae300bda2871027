//! The stages of a pipeline: one trait a file. A plugin implements one of them.

pub mod exporter;
pub mod loader;
pub mod preprocessor;
pub mod separator;
pub mod simulator;

pub use exporter::{Export, Exporter, StraightnessExporter, TableExporter};
pub use loader::{Loader, Source, SourceKind};
pub use preprocessor::{Averager, Conditioner, Preprocessor, Wanted};
pub use separator::{
    Conclusion, PointModel, PointSeparator, Separator, Shape, Station, StationDiagnosis, StationModel,
    StationSeparator, TraceDiagnosis, TraceModel, TraceSeparator,
};
pub use simulator::Simulator;
