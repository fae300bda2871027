//! What a mesh exporter's table may hold.

use std::path::PathBuf;

use runout_core::{
    pipeline::{error::Fault, registry::Context},
    stage::Exporter,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::export::{Format, MeshExporter};

/// A micrometre drawn as a metre.
const MOST_MAGNIFICATION: f64 = 1e6;

/// Keys of every mesh exporter. A format wraps them in a type of its own.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshConfig {
    /// The file to write; the mesh in it is at true scale.
    pub path: PathBuf,
    /// Also writes a second file beside it, `NAME-x1000` for 1000, with the deviations from the nominal radius drawn
    /// so many times larger. Above 1, at most 1000000.
    #[serde(default)]
    pub magnification: Option<f64>,
    /// Closes both ends with flat discs, so that the mesh is a solid.
    #[serde(default)]
    pub capped: bool,
    /// Deviation that the two strongest colours stand for, ± µm; without it the largest deviation.
    #[serde(default)]
    pub colour_range_um: Option<f64>,
}

impl MeshConfig {
    /// Checks the values and builds the exporter of a format.
    ///
    /// # Errors
    /// The first value that cannot be.
    pub fn check(self, context: &Context, format: Format) -> Result<Box<dyn Exporter>, Fault> {
        let fits = self.path.extension().is_some_and(|found| found.eq_ignore_ascii_case(format.extension));
        if !fits {
            let message =
                format!("expected a file name ending in .{}, found `{}`", format.extension, self.path.display());
            return Err(Fault::at("path", message));
        }
        if let Some(found) = self.magnification.filter(|value| !(*value > 1.0 && *value <= MOST_MAGNIFICATION)) {
            let message = format!("the magnification must be above 1 and at most {MOST_MAGNIFICATION}, found {found}");
            let fault = Fault::at("magnification", message);
            return Err(fault.help("leave it out for the mesh at true scale alone"));
        }
        if let Some(found) = self.colour_range_um.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(Fault::at("colour_range_um", format!("the range must be above 0 µm, found {found}")));
        }
        Ok(Box::new(MeshExporter { format, config: Self { path: context.path(&self.path), ..self } }))
    }

    /// The files to write, each with its scale.
    pub(crate) fn files(&self) -> Vec<(PathBuf, f64)> {
        let magnified = self.magnification.map(|scale| {
            let mut name = self.path.file_stem().unwrap_or_default().to_os_string();
            name.push(format!("-x{scale}"));
            if let Some(extension) = self.path.extension() {
                name.push(".");
                name.push(extension);
            }
            (self.path.with_file_name(name), scale)
        });
        std::iter::once((self.path.clone(), 1.0)).chain(magnified).collect()
    }
}
