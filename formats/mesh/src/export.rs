//! The exporter around a format.

use std::{fs::File, path::PathBuf, thread};

use runout_core::{
    Error, ErrorKind, Result,
    atomic_file::PendingFile,
    fault::Fault,
    pipeline::Context,
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{RecordBatch, TableSpec},
};

use crate::{
    config::MeshConfig,
    format::Format,
    mesh::Mesh,
    notes::{Drawn, Notes},
    sheet::Sheet,
    wall::Wall,
};

/// A micrometre drawn as a metre.
const MOST_MAGNIFICATION: f64 = 1e6;

impl MeshConfig {
    /// Checks the values and builds the exporter of a format.
    ///
    /// # Errors
    /// The first value that cannot be.
    pub(crate) fn check(self, context: &Context, format: Format) -> std::result::Result<Box<dyn Exporter>, Fault> {
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
}

impl MeshConfig {
    fn mesh<'a>(&self, drawn: Drawn<'a>, scale: f64) -> Result<Mesh<'a>> {
        match drawn {
            Drawn::Surface(surface) => Ok(Mesh::Wall(Wall::new(surface, scale, self.capped, self.colour_range_um)?)),
            Drawn::Heights(_) if self.capped => Err(Error::new(
                "draw",
                "the height map",
                "`capped` closes the ends of a part, and a height map has none",
            )
            .help("leave `capped` out")),
            Drawn::Heights(heights) => Ok(Mesh::Sheet(Sheet::new(heights, scale, self.colour_range_um)?)),
        }
    }
}

/// Writes the surface at true scale, and magnified where asked.
struct MeshExporter {
    format: Format,
    config: MeshConfig,
}

/// Files that wait for the surface.
struct MeshExport {
    format: Format,
    config: MeshConfig,
    files: Vec<Target>,
}

struct Target {
    place: PendingFile,
    file: File,
    scale: f64,
}

impl Exporter for MeshExporter {
    fn takes(&self) -> Takes {
        Takes::Surface
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        self.config.files().into_iter().map(|(path, _)| path).collect()
    }

    fn begin(&self, _result: &ResultInfo) -> Result<Box<dyn Export>> {
        // Opened now: a folder that cannot be written to shows before the work, not after it.
        let open = |(path, scale)| {
            let place = PendingFile::new(path)?;
            let file = place.create()?;
            Ok(Target { place, file, scale })
        };
        let files: Result<Vec<_>> = self.config.files().into_iter().map(open).collect();
        Ok(Box::new(MeshExport { format: self.format, config: self.config.clone(), files: files? }))
    }
}

impl Export for MeshExport {
    fn rows(&mut self, _table: &TableSpec, _rows: &RecordBatch) -> Result<()> {
        Ok(())
    }

    fn finish(mut self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let drawn = Drawn::of(result).ok_or_else(|| {
            Error::new("write", self.config.path.display().to_string(), "the run built no surface to draw")
        })?;
        let draw = |target: &Target| self.config.mesh(drawn, target.scale);
        let (meshes, checksum) = thread::scope(|scope| {
            let checksum = scope.spawn(|| drawn.checksum());
            let meshes: Result<Vec<Mesh>> = self.files.iter().map(draw).collect();
            (meshes, checksum.join())
        });
        let checksum = checksum.map_err(|_| {
            Error::new("draw", "the surface", "the thread of its checksum stopped").of(ErrorKind::Interrupted)
        })?;
        for (Target { place, file, .. }, mesh) in self.files.iter_mut().zip(meshes?) {
            let notes = Notes::new(self.format.unit, &mesh, drawn, &checksum, result);
            (self.format.write)(&mesh, &notes, file).map_err(|error| place.caused(error))?;
        }
        // Closed: some systems do not rename what is open.
        Ok(self.files.into_iter().map(|Target { place, .. }| place).collect())
    }
}
