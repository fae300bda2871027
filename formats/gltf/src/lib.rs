//! glTF binary meshes.
//!
//! One file holds one mesh: metres, +Y up as glTF demands, so that the spindle's axis z points up: (x, y, z) in mm
//! becomes (x, z, −y) / 1000. Where a magnified mesh is asked for, it is a second file (`NAME-x1000.glb`): in one scene
//! the two would hide each other, and a reader that measures a file should find one solid in it.

mod document;
mod vertices;

use std::{
    fs::File,
    io::{self, Write},
};

use runout_core::pipeline::Registry;
use runout_mesh::{Format, Mesh, Notes};

use vertices::Layout;

/// Adds the exporter `gltf`.
pub fn register(registry: &mut Registry) {
    let about = "writes the surface as a glTF binary mesh, coloured by deviation";
    Format { name: "gltf", about, extension: "glb", unit: "m", write }.register(registry);
}

/// Writes a GLB: header, JSON chunk, binary chunk (glTF 2.0 specification, 4.4).
fn write(mesh: &Mesh, notes: &Notes, file: &mut File) -> io::Result<()> {
    let layout = Layout::of(mesh);
    let mut json = document::json(&layout, notes)?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = layout.vertex_bytes() + layout.index_bytes();
    let too_long = |_| io::Error::other("a GLB has at most 4 GiB: take fewer angles or points, or a larger step_mm");
    let whole = u32::try_from(12 + 8 + json.len() + 8 + binary).map_err(too_long)?;
    let mut head = Vec::with_capacity(json.len() + 28);
    head.extend_from_slice(b"glTF");
    for number in [2, whole, json.len() as u32] {
        head.extend_from_slice(&number.to_le_bytes());
    }
    head.extend_from_slice(b"JSON");
    head.extend_from_slice(&json);
    head.extend_from_slice(&(binary as u32).to_le_bytes());
    head.extend_from_slice(b"BIN\0");
    file.write_all(&head)?;
    vertices::write(mesh, file)
}
