//! STL meshes.
//!
//! Binary; millimetres, z along the spindle, or upwards on a height map, as measured. The format holds triangles and 80 bytes of text: unit,
//! scale and the beginning of the surface's checksum. It has no colours. With `capped = true` it is a solid, for printing.
//! Where a magnified mesh is asked for, it is a second file (`NAME-x1000.stl`).

use std::{
    fs::File,
    io::{self, BufWriter, Write},
};

use runout_core::pipeline::Registry;
use runout_mesh::{Format, Mesh, Notes};

/// Adds the exporter `stl`.
pub fn register(registry: &mut Registry) {
    let about = "writes the surface as a binary STL mesh in mm, without colours";
    Format { name: "stl", about, extension: "stl", unit: "mm", write }.register(registry);
}

/// Bytes of the text at the beginning.
const HEADER: usize = 80;

fn write(mesh: &Mesh, notes: &Notes, file: &mut File) -> io::Result<()> {
    let mut file = BufWriter::new(file);
    // A text that begins with "solid" is taken for the other kind of STL.
    let checksum: String = notes.checksum.chars().take(32).collect();
    let mut header = format!("{}, {}, x{}, {checksum}", notes.program, notes.unit, notes.scale).into_bytes();
    header.resize(HEADER, b' ');
    file.write_all(&header)?;
    let [vertices, triangles] = mesh.counts();
    let count = u32::try_from(triangles).map_err(|_| io::Error::other("STL counts triangles with 32 bits"))?;
    file.write_all(&count.to_le_bytes())?;
    let mut positions: Vec<[f32; 3]> = Vec::with_capacity(vertices);
    mesh.vertices(|vertex| {
        positions.push(vertex.position_mm.map(|place| place as f32));
        Ok::<(), io::Error>(())
    })?;
    mesh.triangles(|triangle| {
        let corners = triangle.map(|vertex| positions[vertex as usize]);
        for vector in std::iter::once(normal(corners)).chain(corners) {
            vector.into_iter().try_for_each(|number| file.write_all(&number.to_le_bytes()))?;
        }
        file.write_all(&[0; 2])
    })?;
    file.flush()
}

/// The unit normal of a triangle, counter-clockwise seen from where it points to; 0 of one without an area.
fn normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|corner| corner.map(f64::from));
    let [[ux, uy, uz], [vx, vy, vz]] = [b, c].map(|to| [to[0] - a[0], to[1] - a[1], to[2] - a[2]]);
    let cross = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    let length = cross.iter().map(|part| part * part).sum::<f64>().sqrt();
    cross.map(|part| if length > 0.0 { (part / length) as f32 } else { 0.0 })
}
