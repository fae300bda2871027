//! The loader `height-map`.

use std::path::{Path, PathBuf};

use runout_core::{
    Error, ErrorKind, Result,
    fault::Fault,
    height_grid::HeightGrid,
    length_unit::micrometres,
    pipeline::{Context, StageConfig},
    points::Points,
    stage::{Loader, Request, Source, SourceKind},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    input::Input,
    map::{Map, Wanted},
    sdf, sur, text, x3p,
};

/// `[load] plugin = "height-map"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeightMapConfig {
    /// File with heights on a grid, or a profile, relative to the TOML: X3P (ISO 25178-72), SDF (ISO 25178-71), SUR (Digital Surf), HDF5 (runout-surface,
    /// version 1), or text (`x y z`, or a row of heights a line). Its first bytes decide.
    pub path: PathBuf,
    /// Name or number, from 1, of the map in a file of several; without it the first one.
    #[serde(default)]
    pub layer: Option<String>,
    /// Unit of the heights of a file that names none; of text also that of its coordinates: m, mm, um, nm, in, mil.
    #[serde(default)]
    pub unit: Option<String>,
    /// Distance of the columns of a matrix as text that does not give it, in mm.
    #[serde(default)]
    pub step_x_mm: Option<f64>,
    /// Distance of its rows, in mm; without it that of its columns.
    #[serde(default)]
    pub step_y_mm: Option<f64>,
    /// HDF5: follows external links, virtual data sets and data in other files, all of which are then inputs.
    #[serde(default)]
    pub follow_links: bool,
}

impl StageConfig for HeightMapConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "height-map";
    const ABOUT: &'static str = "heights of a surface on a grid, or a profile: X3P, SDF, SUR, HDF5, text";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a file"));
        }
        if let Some(unit) = self.unit.as_deref().filter(|unit| micrometres(unit).is_none()) {
            return Err(Fault::at("unit", format!("`{unit}` is no unit of length")).help("m, mm, um, nm, in, mil"));
        }
        for (key, step) in [("step_x_mm", self.step_x_mm), ("step_y_mm", self.step_y_mm)] {
            if let Some(step) = step.filter(|step| !(step.is_finite() && *step > 0.0)) {
                return Err(Fault::at(key, format!("expected a distance above 0 mm, found {step}")));
            }
        }
        let wanted = Wanted { layer: self.layer, unit: self.unit, step_mm: [self.step_x_mm, self.step_y_mm] };
        Ok(Box::new(MapFile { path: context.path(&self.path), wanted, follow_links: self.follow_links }))
    }
}

struct MapFile {
    path: PathBuf,
    wanted: Wanted,
    follow_links: bool,
}

impl Loader for MapFile {
    fn kind(&self) -> SourceKind {
        SourceKind::Points
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        let needed = wanted.columns.iter().filter(|column| !column.optional);
        if let Some(other) = needed.into_iter().find(|column| !HeightGrid::COLUMNS[..3].contains(&column.name)) {
            let problem = format!("a height map has no column `{}` ({})", other.name, other.about);
            let help =
                "its points have x_mm, y_mm and height_nm; the separators `as-measured` and `fly-cutting` take these";
            return Err(Error::new("read", self.path.display().to_string(), problem).help(help));
        }
        let input = Input::new(&self.path)?;
        if is_hdf5(&input.start(8)?) {
            return runout_hdf5::height_map_points(&self.path, self.follow_links).map(Source::Points);
        }
        let map = read_other(&input, &self.wanted)?;
        let points = Points { opened: vec![input.file], ..Points::of_grid(map.grid, self.path.clone()) };
        Ok(Source::Points(Points { remarks: map.remarks, ..points }))
    }
}

fn is_hdf5(start: &[u8]) -> bool {
    start == b"\x89HDF\r\n\x1a\n"
}

/// Whether a file begins as a map of another program: X3P, SDF or SUR. Text is not recognised by its first bytes.
///
/// # Errors
/// When it cannot be read.
pub fn is_map(path: &Path) -> Result<bool> {
    let input = Input::new(path)?;
    let start = input.start(12)?;
    Ok(sdf::is_one(&start) || sur::is_one(&start) || (x3p::is_one(&start) && x3p::is_in(&input)?))
}

/// Reads a map of any format.
///
/// # Errors
/// When the file is of none of the formats, damaged, holds no heights, or does not say what `wanted` leaves open.
pub fn read(path: &Path, wanted: &Wanted) -> Result<Map> {
    let input = Input::new(path)?;
    if is_hdf5(&input.start(8)?) {
        let grid = runout_hdf5::read_height_map(path)?;
        return Ok(Map {
            format: "HDF5",
            grid,
            layers: vec!["height_nm".into()],
            about: Vec::new(),
            remarks: Vec::new(),
        });
    }
    read_other(&input, wanted)
}

fn read_other(input: &Input, wanted: &Wanted) -> Result<Map> {
    let start = input.start(12)?;
    let map = if x3p::is_one(&start) {
        x3p::read(input, wanted)
    } else if sdf::is_one(&start) {
        sdf::read(input)
    } else if sur::is_one(&start) {
        sur::read(input, wanted)
    } else {
        text::read(input, wanted)
    }?;
    let all = map.grid.height_nm.len();
    match all - map.grid.holes() {
        measured @ 0..2 => {
            let problem = format!("{measured} of {all} points have a height");
            Err(Error::new("read", &input.shown, problem).of(ErrorKind::InsufficientData))
        }
        _ => Ok(map),
    }
}
