//! The exporter around a format.

use std::{fs::File, io, path::PathBuf, thread};

use runout_core::{
    Error, ErrorKind, Result,
    atomic_file::PendingFile,
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{RecordBatch, TableSpec},
};

use crate::{config::MeshConfig, mesh::Mesh, notes::Notes};

/// How a mesh becomes a file.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// Of its files, without the dot.
    pub extension: &'static str,
    /// Of its positions.
    pub unit: &'static str,
    /// Writes one mesh into an empty file.
    pub write: fn(&Mesh, &Notes, &mut File) -> io::Result<()>,
}

/// Writes the surface at true scale, and magnified where asked.
pub(crate) struct MeshExporter {
    pub(crate) format: Format,
    pub(crate) config: MeshConfig,
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
        let surface = result.surface.ok_or_else(|| {
            Error::new("write", self.config.path.display().to_string(), "the run built no surface to draw")
        })?;
        let draw = |target: &Target| Mesh::new(surface, target.scale, self.config.capped, self.config.colour_range_um);
        let (meshes, checksum) = thread::scope(|scope| {
            let checksum = scope.spawn(|| surface.checksum());
            let meshes: Result<Vec<Mesh>> = self.files.iter().map(draw).collect();
            (meshes, checksum.join())
        });
        let checksum = checksum.map_err(|_| {
            Error::new("draw", "the surface", "the thread of its checksum stopped").of(ErrorKind::Interrupted)
        })?;
        for (Target { place, file, .. }, mesh) in self.files.iter_mut().zip(meshes?) {
            let notes = Notes::new(&self.format, &mesh, surface, &checksum, result);
            (self.format.write)(&mesh, &notes, file).map_err(|error| place.caused(error))?;
        }
        // Closed: some systems do not rename what is open.
        Ok(self.files.into_iter().map(|Target { place, .. }| place).collect())
    }
}
