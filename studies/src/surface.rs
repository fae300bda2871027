//! The surface of a pipeline as a picture: deviation over angle and z, unrolled.

use std::{path::Path, path::PathBuf, sync::Mutex};

use runout_core::{
    Error, Result,
    atomic_file::PendingFile,
    pipeline::{
        INCLUDE_KEY, Pipeline, Registry,
        document::{ConfigError, Sources},
        run::{self, Silent},
    },
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    surface::Surface,
    table::{RecordBatch, TableSpec},
};

use crate::plot::{self, Axes, Map};

/// Rings and angles in the picture, at most: more could not be seen.
const CELLS: [usize; 2] = [120, 360];

/// Runs a pipeline without its exporters and draws its surface as PNG.
///
/// # Errors
/// When the pipeline fails or gives no surface.
pub fn picture(pipeline: &Path) -> Result<Vec<u8>> {
    let no_exports = ["export=[]".to_owned()];
    let configured = |error: ConfigError| Error::caused("read", pipeline.display().to_string(), error);
    let sources = Sources::read(pipeline, &no_exports, INCLUDE_KEY).map_err(configured)?;
    let mut pipeline = Pipeline::from_sources(&sources, &registry()).map_err(configured)?;
    let kept = std::sync::Arc::new(Mutex::new(None));
    pipeline.exporters.push(Box::new(Keep(kept.clone())));
    run::run(&pipeline, None, &Silent)?;
    let surface = kept.lock().map_or(None, |mut kept| kept.take());
    let surface = surface.ok_or_else(|| Error::new("draw", &pipeline.title, "the run gave no surface"))?;
    plot::map(&Axes { title: &pipeline.title, x: "angle on the part / °", y: "z / mm" }, &unrolled(&surface))
        .map_err(|problem| Error::new("draw", &pipeline.title, problem))
}

/// The stages that bring a surface about; no file formats of results.
fn registry() -> Registry {
    let mut registry = Registry::default();
    for register in [
        runout_hdf5::register,
        runout_csv::register,
        runout_preprocess::register,
        runout_spindle::register,
        runout_cylinder::register,
    ] {
        register(&mut registry);
    }
    registry
}

fn unrolled(surface: &Surface) -> Map {
    let [rings, angles] = [surface.z_mm.len(), surface.angles];
    let picked = |count: usize, most: usize| -> Vec<usize> {
        let step = count.div_ceil(most);
        (0..count).step_by(step).collect()
    };
    let columns = picked(angles, CELLS[1]);
    // Pictures count rows from the top.
    let rows = picked(rings, CELLS[0]).into_iter().rev();
    let values = rows.map(|ring| columns.iter().map(|angle| surface.ring(ring)[*angle]).collect());
    let z = |index: Option<&f64>| index.copied().unwrap_or_default();
    Map { values: values.collect(), x: [0.0, 360.0], y: [z(surface.z_mm.first()), z(surface.z_mm.last())] }
}

/// An exporter that keeps the surface instead of writing it.
struct Keep(std::sync::Arc<Mutex<Option<Surface>>>);

impl Exporter for Keep {
    fn takes(&self) -> Takes {
        Takes::Surface
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        Vec::new()
    }

    fn begin(&self, _result: &ResultInfo) -> Result<Box<dyn Export>> {
        Ok(Box::new(Self(self.0.clone())))
    }
}

impl Export for Keep {
    fn rows(&mut self, _table: &TableSpec, _rows: &RecordBatch) -> Result<()> {
        Ok(())
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        if let Ok(mut kept) = self.0.lock() {
            *kept = result.surface.cloned();
        }
        Ok(Vec::new())
    }
}
