//! Wavefront OBJ meshes.
//!
//! Millimetres, z along the spindle, or upwards on a height map, as measured. Vertices carry their colour (sRGB, 0 to 1)
//! after their position, as MeshLab reads it. Where a magnified mesh is asked for, it is a second file (`NAME-x1000.obj`).

mod text;

use std::{
    fs::File,
    io::{self, Write},
};

use runout_core::pipeline::Registry;
use runout_mesh::{COLOUR_STEPS, Cap, Format, Mesh, Notes, UNMEASURED, Wall, in_order, palette, processors};

use text::Text;

/// Adds the exporter `obj`.
pub fn register(registry: &mut Registry) {
    let about = "writes the surface as a Wavefront OBJ mesh in mm, coloured by deviation";
    Format { name: "obj", about, extension: "obj", unit: "mm", write }.register(registry);
}

/// Rings that one thread writes out at a time: a megabyte of text with 2560 angles.
const TOGETHER: usize = 4;

/// Writes comments, vertices with their normals row by row, and triangles band by band.
///
/// Each vertex has one normal, of the same number: readers that distinguish vertices by both find the same solid.
fn write(mesh: &Mesh, notes: &Notes, file: &mut File) -> io::Result<()> {
    let mut bytes = Vec::new();
    let mut text = Text::behind(&mut bytes);
    for line in notes.lines() {
        text.raw("# ").raw(&line).raw("\n");
    }
    text.raw(match mesh {
        Mesh::Wall(_) => "# axes: z along the spindle, x at the part's 0 deg\n",
        Mesh::Sheet(_) => "# axes: x along rows, y from row to row, z upwards\n",
    });
    text.raw("o ").raw(&object_name(&notes.title)).raw("\n");
    file.write_all(&bytes)?;
    let colours: [String; COLOUR_STEPS] = palette().map(colour_text);
    in_order(mesh.rows(), TOGETHER, processors(), file, |row, bytes| {
        let mut text = Text::behind(bytes);
        mesh.row(row, |vertices| {
            for lane in 0..vertices.count {
                let [position_mm, normal] =
                    [&vertices.position_mm, &vertices.normal].map(|of| of.map(|axis| axis[lane]));
                text.raw("v").vector(position_mm).raw(&colours[vertices.colour[lane]]);
                text.raw("vn").vector(normal).raw("\n");
            }
        });
    })?;
    let caps: Vec<(&Wall, Cap)> =
        mesh.wall().into_iter().flat_map(|wall| wall.caps().into_iter().map(move |cap| (wall, cap))).collect();
    let mut bytes = Vec::new();
    let mut text = Text::behind(&mut bytes);
    for (wall, cap) in &caps {
        for position_mm in cap.vertices(wall) {
            text.raw("v").vector(position_mm).raw(&colour_text(UNMEASURED));
            text.raw("vn").vector([0.0, 0.0, cap.normal_z]).raw("\n");
        }
    }
    file.write_all(&bytes)?;
    in_order(mesh.rows() - 1, TOGETHER, processors(), file, |row, bytes| {
        let mut text = Text::behind(bytes);
        mesh.band(row, |triangle| face(&mut text, triangle));
    })?;
    let mut bytes = Vec::new();
    let mut text = Text::behind(&mut bytes);
    let angles = mesh.columns() as u32;
    for (index, (_, cap)) in caps.iter().enumerate() {
        let own = mesh.vertex_count() + index * Cap::vertex_count(mesh.columns());
        cap.triangles(angles, own as u32).for_each(|triangle| face(&mut text, triangle));
    }
    file.write_all(&bytes)
}

/// A triangle's line. OBJ counts from 1.
fn face(text: &mut Text, triangle: [u32; 3]) {
    text.raw("f");
    for vertex in triangle {
        text.corner(vertex + 1, vertex + 1);
    }
    text.raw("\n");
}

/// Names of objects hold no blanks.
fn object_name(title: &str) -> String {
    let name: String =
        title.chars().map(|letter| if letter.is_whitespace() || letter.is_control() { '_' } else { letter }).collect();
    if name.is_empty() { "surface".into() } else { name }
}

/// " r g b" and the line's end; four digits keep every one of 256 steps apart.
fn colour_text(srgb: [u8; 3]) -> String {
    let [r, g, b] = srgb.map(|channel| f64::from(channel) / 255.0);
    format!(" {r:.4} {g:.4} {b:.4}\n")
}
