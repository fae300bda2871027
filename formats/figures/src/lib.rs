//! Figures: the exporter `figures`, which draws the figures that a result's tables declare, as SVG and PNG.
//!
//! Its path is a folder that receives one file a figure and format, named by the figure's id (`form.svg`, `form.png`), and
//! `surface.svg`, `surface.png` where the result has a surface (`form-surface` where a table has a figure `surface`). A figure has one panel a station, of at most `panels` stations.
//! [`fragment`] draws the same figures for a page of HTML.

mod draw;
mod fragment;

pub use fragment::fragment;

use std::path::{Path, PathBuf};

use runout_core::{
    Error, Result,
    atomic_file::PendingFile,
    fault::Fault,
    pipeline::{Context, Plugin, Registry, StageConfig},
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{RecordBatch, TableSpec, panels::Panels},
};
use schemars::JsonSchema;
use serde::Deserialize;

/// Adds the exporter `figures`.
pub fn register(registry: &mut Registry) {
    registry.exporters.add(Plugin::of::<FiguresConfig>());
}

/// `[[export]] plugin = "figures"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FiguresConfig {
    /// Folder for the figures. Made where it is missing.
    pub path: PathBuf,
    /// The formats: `svg` for print, `png` for pages and mails. Both without it.
    #[serde(default = "all_formats")]
    pub formats: Vec<Format>,
    /// Panels of a figure, at most: with more stations, panels are spread evenly over them. 12 without it.
    #[serde(default = "default_panels")]
    pub panels: usize,
}

/// A format of figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// Scalable Vector Graphics.
    Svg,
    /// Portable Network Graphics, two pixels a point.
    Png,
}

impl Format {
    fn ending(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}

fn all_formats() -> Vec<Format> {
    vec![Format::Svg, Format::Png]
}

fn default_panels() -> usize {
    12
}

/// Panels that one picture can show.
const MOST_PANELS: usize = 100;

impl StageConfig for FiguresConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "figures";
    const ABOUT: &'static str = "figures of a result as SVG and PNG";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a folder"));
        }
        if !(1..=MOST_PANELS).contains(&self.panels) {
            return Err(Fault::at("panels", format!("expected 1 to {MOST_PANELS} panels, found {}", self.panels)));
        }
        let mut formats = self.formats;
        formats.dedup();
        if formats.is_empty() {
            return Err(Fault::at("formats", "expected a format, found none").help("`svg`, `png`, or both"));
        }
        Ok(Box::new(Figures { folder: context.path(&self.path), formats, panels: self.panels }))
    }
}

/// The exporter `figures`.
#[derive(Debug, Clone)]
struct Figures {
    folder: PathBuf,
    formats: Vec<Format>,
    panels: usize,
}

/// Id of the figure of the surface, and its id where a table declares a figure of that one.
const SURFACE: [&str; 2] = ["surface", "form-surface"];

fn surface_id(tables: &[TableSpec]) -> &'static str {
    let declared = tables.iter().flat_map(|table| &table.figures).any(|figure| figure.id == SURFACE[0]);
    SURFACE[usize::from(declared)]
}

impl Figures {
    fn files(&self, id: &str) -> Vec<(PathBuf, Format)> {
        let file = |format: &Format| (self.folder.join(format!("{id}.{}", format.ending())), *format);
        self.formats.iter().map(file).collect()
    }

    /// Draws one figure in all formats.
    fn write(&self, id: &str, scene: &draw::Scene) -> Result<Vec<PendingFile>> {
        let write = |(path, format): (PathBuf, Format)| {
            let bytes = match format {
                Format::Svg => draw::svg(scene).into_bytes(),
                Format::Png => draw::png(scene).map_err(|problem| Error::new("draw", shown(&path), problem))?,
            };
            let file = PendingFile::new(path)?;
            std::fs::write(file.path(), bytes).map_err(|error| file.failure(error))?;
            Ok(file)
        };
        self.files(id).into_iter().map(write).collect()
    }
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

impl Exporter for Figures {
    fn takes(&self) -> Takes {
        Takes::TablesAndSurface
    }

    fn outputs(&self, tables: &[TableSpec]) -> Vec<PathBuf> {
        let ids = tables.iter().flat_map(|table| &table.figures).map(|figure| figure.id.as_str());
        ids.chain([surface_id(tables)]).flat_map(|id| self.files(id)).map(|(path, _)| path).collect()
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        if self.folder.is_file() {
            let error = Error::new("write to", shown(&self.folder), "there is a file of that name");
            return Err(error.help("name a folder"));
        }
        let mut figures = Vec::new();
        for table in &result.tables {
            for figure in &table.figures {
                figures.push(Panels::new(table, figure, self.panels)?);
            }
        }
        Ok(Box::new(Drawing { place: self.clone(), figures, surface: surface_id(&result.tables) }))
    }
}

/// Figures whose rows are coming.
struct Drawing {
    place: Figures,
    figures: Vec<Panels>,
    /// Id of the figure of the surface.
    surface: &'static str,
}

impl Export for Drawing {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        self.figures.iter_mut().for_each(|figure| figure.take(&table.name, rows));
        Ok(())
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let mut complete = Vec::new();
        for figure in &self.figures {
            match draw::figure(figure) {
                Some(scene) => complete.extend(self.place.write(&figure.id, &scene)?),
                None => self.place.remove_outdated(&figure.id)?,
            }
        }
        match result.surface {
            Some(surface) => complete.extend(self.place.write(self.surface, &draw::surface(surface))?),
            None => self.place.remove_outdated(self.surface)?,
        }
        Ok(complete)
    }
}

impl Figures {
    /// An earlier run's figure beside this run's would be taken for this run's.
    fn remove_outdated(&self, id: &str) -> Result<()> {
        for (path, _) in self.files(id).into_iter().filter(|(path, _)| path.is_file()) {
            std::fs::remove_file(&path).map_err(|error| Error::new("remove the outdated", shown(&path), error))?;
        }
        Ok(())
    }
}
