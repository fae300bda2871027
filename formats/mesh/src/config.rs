//! What a mesh exporter's table may hold.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Deserialize;

/// Keys of every mesh exporter.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MeshConfig {
    /// The file to write; the mesh in it is at true scale.
    pub path: PathBuf,
    /// Also writes a second file beside it, `NAME-x1000` for 1000, with the deviations from the nominal radius, or the
    /// heights of a map, drawn so many times larger. Above 1, at most 1000000.
    #[serde(default)]
    pub magnification: Option<f64>,
    /// Closes both ends of a part with flat discs, so that the mesh is a solid. A height map has no ends.
    #[serde(default)]
    pub capped: bool,
    /// Deviation of the two strongest colours, ± µm; without it the largest deviation.
    #[serde(default)]
    pub colour_range_um: Option<f64>,
}

impl MeshConfig {
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
