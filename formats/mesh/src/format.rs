//! A format of meshes.

use std::{fs::File, io};

use runout_core::pipeline::{Context, Plugin, Registry};

use crate::{config::MeshConfig, mesh::Mesh, notes::Notes};

/// How a mesh becomes a file.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// Of its exporter.
    pub name: &'static str,
    /// What its exporter does.
    pub about: &'static str,
    /// Of its files, without the dot.
    pub extension: &'static str,
    /// Of its positions.
    pub unit: &'static str,
    /// Writes one mesh into an empty file.
    pub write: fn(&Mesh, &Notes, &mut File) -> io::Result<()>,
}

impl Format {
    /// Adds its exporter.
    pub fn register(self, registry: &mut Registry) {
        let check = move |config: MeshConfig, context: &Context| config.check(context, self);
        registry.exporters.add(Plugin::made(self.name, self.about, check));
    }
}
