//! The loader `points`: measured points from text, XLSX or Parquet, for the separators of any domain.
//!
//! A row is a point. The separator says which columns it takes ([`PointColumn`]); other columns are not read. `columns` gives the
//! file's names where they differ, `where` selects rows.
//!
//! [`PointColumn`]: runout_core::points::PointColumn

mod axis;
mod parquet;
mod select;
mod sheet;
mod text;
mod unit;
mod write;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use runout_core::{
    Error, ErrorKind, Result,
    fault::Fault,
    input_file::InputFile,
    pipeline::{Context, Plugin, Registry, StageConfig},
    points::{PointColumn, Points},
    stage::{Loader, Request, Source, SourceKind},
};
use schemars::JsonSchema;
use serde::Deserialize;

pub use axis::Axis;
pub use write::write;

/// Adds the loader `points`, also under the names that it had for single domains.
pub fn register(registry: &mut Registry) {
    registry.loaders.add(Plugin::of::<PointsConfig>());
    for former in ["axial-traces", "cylinder-traces", "quadrature-samples", "r-test-points"] {
        registry.loaders.add(Plugin::former::<PointsConfig>(former));
    }
}

/// `[load] plugin = "points"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointsConfig {
    /// CSV, XLSX or Parquet file with one row a point, relative to the TOML. The separator says which columns it takes; `check` lists
    /// them. Text is separated by comma, semicolon, tab or blanks; all but the first allow a decimal comma.
    pub path: PathBuf,
    /// Names of the columns of a text without a header, in their order: `names = ["x_mm", "y_mm", "z_mm"]`.
    #[serde(default)]
    pub names: Option<Vec<String>>,
    /// Sheet of an XLSX file; without it the first one.
    #[serde(default)]
    pub sheet: Option<String>,
    /// Direction near which the axis of the part lies, of coordinates `x_mm`, `y_mm`, `z_mm` for a separator that takes places about an axis
    /// (`angle_deg`, `radius_mm`, `z_mm`). The axis is found from the points; without the key its direction too.
    #[serde(default)]
    pub axis: Option<Axis>,
    /// The file's names of columns that differ from the separator's: `columns = { "ΔX" = "dx_mm" }`. Names that differ by the unit alone
    /// (`dx_um`, `dx [µm]` for `dx_mm`) are found and converted.
    #[serde(default)]
    pub columns: BTreeMap<String, String>,
    /// Only rows with these values are read: `where = { a_deg = 0 }`.
    #[serde(default, rename = "where")]
    pub selected: BTreeMap<String, Cell>,
}

/// A value that rows are selected by.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Cell {
    /// A number; a cell is equal within a millionth.
    Number(f64),
    /// A text.
    Text(String),
}

impl StageConfig for PointsConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "points";
    const ABOUT: &'static str = "measured points from text, XLSX or Parquet, for any separator of points";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a file"));
        }
        if matches!(&self.names, Some(names) if names.is_empty() || names.iter().any(String::is_empty)) {
            return Err(Fault::at("names", "expected a name for each column"));
        }
        let mut names: Vec<&String> = self.columns.values().collect();
        names.sort_unstable();
        if let Some((name, _)) = names.iter().zip(names.iter().skip(1)).find(|(one, next)| one == next) {
            return Err(Fault::at("columns", format!("two columns of the file are named `{name}`")));
        }
        Ok(Box::new(PointFile { path: context.path(&self.path), config: self }))
    }
}

/// Reads these columns of a file.
///
/// # Errors
/// When it cannot be read, lacks a column, or a row is not what its columns say.
pub fn read(path: &Path, columns: &[PointColumn]) -> Result<Points> {
    let config = PointsConfig {
        path: path.to_path_buf(),
        names: None,
        sheet: None,
        axis: None,
        columns: BTreeMap::new(),
        selected: BTreeMap::new(),
    };
    let input = InputFile::new(path)?;
    select::points(RawTable::read(&input, &config)?, &input, &config, columns)
}

struct PointFile {
    path: PathBuf,
    config: PointsConfig,
}

impl Loader for PointFile {
    fn kind(&self) -> SourceKind {
        SourceKind::Points
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        let input = InputFile::new(&self.path)?;
        let table = RawTable::read(&input, &self.config)?;
        select::points(table, &input, &self.config, wanted.columns).map(Source::Points)
    }
}

/// The error of an attempt to read a file; what its reader cannot read is damaged, or of another format.
fn failed(shown: &str, error: impl std::error::Error + Send + Sync + 'static) -> Error {
    let error = Error::caused("read", shown, error);
    if error.kind() == ErrorKind::UnsuitableData { error.of(ErrorKind::DamagedData) } else { error }
}

/// A file's columns as they are.
struct RawTable {
    names: Vec<String>,
    columns: Vec<RawColumn>,
    rows: usize,
    /// Line of each row in a text file.
    lines: Vec<u64>,
    decimal_comma: bool,
}

/// A column as it is in a file.
enum RawColumn {
    Texts(Vec<String>),
    Numbers(Vec<f64>),
}

impl RawTable {
    fn read(input: &InputFile, config: &PointsConfig) -> Result<Self> {
        let mut start = [0; 4];
        let read = std::io::Read::read(&mut input.open()?, &mut start);
        let length = read.map_err(|error| Error::caused("read", input.path().display().to_string(), error))?;
        match &start[..length] {
            b"PAR1" => parquet::read(input),
            b"PK\x03\x04" => sheet::read(input, config.sheet.as_deref()),
            _ => text::read(input, config.names.as_deref()),
        }
    }
}
