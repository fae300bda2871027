//! A format of meshes.

use std::{fs::File, io};

use crate::{mesh::Mesh, notes::Notes};

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
