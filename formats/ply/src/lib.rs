//! PLY meshes.
//!
//! Binary, little-endian; millimetres, z along the spindle, or upwards on a height map, as measured. Vertices carry their normal, their
//! colour (sRGB) and their true deviation in µm as `quality`, MeshLab's scalar; NaN on a cap, which is drawn and not measured.
//! Where a magnified mesh is asked for, it is a second file (`NAME-x1000.ply`).

use std::{
    fs::File,
    io::{self, BufWriter, Write},
};

use runout_core::pipeline::Registry;
use runout_mesh::{Format, Mesh, Notes, UNMEASURED, palette};

/// Adds the exporter `ply`.
pub fn register(registry: &mut Registry) {
    let about = "writes the surface as a PLY mesh in mm, with colour and the deviation as quality";
    Format { name: "ply", about, extension: "ply", unit: "mm", write }.register(registry);
}

fn write(mesh: &Mesh, notes: &Notes, file: &mut File) -> io::Result<()> {
    let mut file = BufWriter::new(file);
    let [vertices, triangles] = mesh.counts();
    writeln!(file, "ply\nformat binary_little_endian 1.0")?;
    for line in notes.lines() {
        writeln!(file, "comment {line}")?;
    }
    writeln!(file, "comment quality: deviation in um, NaN where it was not measured\nelement vertex {vertices}")?;
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        writeln!(file, "property float {name}")?;
    }
    for name in ["red", "green", "blue"] {
        writeln!(file, "property uchar {name}")?;
    }
    writeln!(file, "property float quality\nelement face {triangles}")?;
    writeln!(file, "property list uchar int vertex_indices\nend_header")?;
    let colours = palette();
    mesh.vertices(|vertex| {
        for number in vertex.position_mm.into_iter().chain(vertex.normal) {
            file.write_all(&(number as f32).to_le_bytes())?;
        }
        file.write_all(&vertex.colour.map_or(UNMEASURED, |place| colours[place]))?;
        file.write_all(&(vertex.deviation_um.unwrap_or(f64::NAN) as f32).to_le_bytes())
    })?;
    mesh.triangles(|triangle| {
        file.write_all(&[3])?;
        triangle.into_iter().try_for_each(|vertex| file.write_all(&vertex.to_le_bytes()))
    })?;
    file.flush()
}
