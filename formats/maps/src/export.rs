//! The exporters `x3p` and `sdf`, and how a map is written to a file of either.

use std::{
    ffi::OsStr,
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use runout_core::{
    Error, Result,
    atomic_file::PendingFile,
    fault::Fault,
    height_grid::HeightGrid,
    pipeline::{Context, StageConfig},
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{RecordBatch, TableSpec},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{map::NM_PER_UM, sdf, x3p};

/// `[[export]] plugin = "x3p"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct X3pConfig {
    /// The file to write, ending in `.x3p`. Of a part its wall, unrolled at the nominal radius.
    pub path: PathBuf,
}

/// `[[export]] plugin = "sdf"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SdfConfig {
    /// The file to write, ending in `.sdf`. Of a part its wall, unrolled at the nominal radius.
    pub path: PathBuf,
}

impl StageConfig for X3pConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "x3p";
    const ABOUT: &'static str = "writes the surface as X3P (ISO 25178-72), heights as f64";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        exporter(&self.path, context, Format::X3p)
    }
}

impl StageConfig for SdfConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "sdf";
    const ABOUT: &'static str = "writes the surface as SDF (ISO 25178-71), binary, heights as f64";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        exporter(&self.path, context, Format::Sdf)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    X3p,
    Sdf,
}

impl Format {
    fn of(path: &Path) -> Option<Self> {
        let extension = path.extension().and_then(OsStr::to_str)?;
        [Self::X3p, Self::Sdf].into_iter().find(|format| extension.eq_ignore_ascii_case(format.extension()))
    }

    fn extension(self) -> &'static str {
        match self {
            Self::X3p => "x3p",
            Self::Sdf => "sdf",
        }
    }

    fn write(self, grid: &HeightGrid, title: &str, file: File) -> io::Result<()> {
        let mut file = BufWriter::new(file);
        match self {
            Self::X3p => x3p::write(grid, title, &mut file)?,
            Self::Sdf => sdf::write(grid, title, &mut file)?,
        }
        file.flush()
    }
}

fn exporter(path: &Path, context: &Context, format: Format) -> std::result::Result<Box<dyn Exporter>, Fault> {
    if Format::of(path) != Some(format) {
        let message = format!("expected a file name ending in .{}, found `{}`", format.extension(), path.display());
        return Err(Fault::at("path", message));
    }
    Ok(Box::new(MapExporter { path: context.path(path), format }))
}

/// Writes a map as the format of its name's ending: `.x3p`, `.sdf`, or `.h5` (runout-surface).
///
/// # Errors
/// When the ending is another one, or the file cannot be written.
pub fn write(grid: &HeightGrid, path: &Path, title: &str) -> Result<PathBuf> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("h5")) {
        return runout_hdf5::write_height_map(grid, path, title, None);
    }
    let format = Format::of(path).ok_or_else(|| {
        let problem = "its name ends in none of the formats that maps are written as";
        Error::new("write", path.display().to_string(), problem).help("X3P (.x3p), SDF (.sdf), HDF5 (.h5)")
    })?;
    let pending = PendingFile::new(path)?;
    let file = pending.create()?;
    format.write(grid, title, file).map_err(|error| pending.caused(error))?;
    pending.commit()
}

struct MapExporter {
    path: PathBuf,
    format: Format,
}

struct MapExport {
    place: PendingFile,
    file: File,
    format: Format,
    title: String,
}

impl Exporter for MapExporter {
    fn takes(&self) -> Takes {
        Takes::Surface
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        // Opened now: a folder that cannot be written to shows before the work, not after it.
        let place = PendingFile::new(&self.path)?;
        let file = place.create()?;
        Ok(Box::new(MapExport { place, file, format: self.format, title: result.title.clone() }))
    }
}

impl Export for MapExport {
    fn rows(&mut self, _table: &TableSpec, _rows: &RecordBatch) -> Result<()> {
        Ok(())
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let unrolled;
        let grid = match (result.heights, result.surface) {
            (Some(heights), _) => heights,
            (None, Some(surface)) => {
                let map = surface.height_map()?;
                unrolled = HeightGrid {
                    columns: map.columns(),
                    step_x_mm: map.dx_mm(),
                    step_y_mm: map.dy_mm(),
                    origin_x_mm: 0.0,
                    origin_y_mm: surface.z_mm.first().copied().unwrap_or_default(),
                    std_nm: None,
                    height_nm: map.heights_um().iter().map(|height| NM_PER_UM * height).collect(),
                };
                &unrolled
            }
            (None, None) => {
                return Err(Error::new("write", self.place.path().display().to_string(), "the run built no surface"));
            }
        };
        self.format.write(grid, &self.title, self.file).map_err(|error| self.place.caused(error))?;
        Ok(vec![self.place])
    }
}
