//! The binary chunk: vertices, all attributes of one side by side, then triangles.
//!
//! It is made on all processors, in portions that stay in their caches: a chunk held whole would first have to be given its
//! memory page by page, which takes longer than filling it.

use std::io::{self, Write};

use runout_mesh::{COLOUR_STEPS, Mesh, UNMEASURED, Vertex, in_order, linear, palette};

/// Bytes from one vertex to the next.
pub const STRIDE: usize = 32;
/// Where each attribute lies within a vertex, in bytes.
pub const POSITION: usize = 0;
/// See [`POSITION`].
pub const NORMAL: usize = 12;
/// See [`POSITION`].
pub const COLOUR: usize = 24;
/// See [`POSITION`].
pub const DEVIATION: usize = 28;
/// Bytes of an index.
const INDEX: usize = 4;
/// Bytes that are handed on at a time, about.
const PORTION: usize = 1 << 18;

/// What the binary chunk holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Vertices of wall and caps.
    pub vertices: usize,
    /// Three a triangle.
    pub indices: usize,
    /// Smallest x, y and z, of the numbers as written.
    pub min: [f32; 3],
    /// Largest x, y and z.
    pub max: [f32; 3],
}

impl Layout {
    /// Of a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        let (rings, angles, caps) = (mesh.rings(), mesh.angles(), mesh.caps().len());
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let centres = mesh.caps().into_iter().map(|cap| [0.0, 0.0, cap.z_mm]);
        (0..rings).flat_map(|ring| mesh.rim(ring)).chain(centres).for_each(|position| {
            for axis in 0..3 {
                // Comparisons compile to single instructions; f64::min has to look after NaN, which a mesh never holds.
                low[axis] = if position[axis] < low[axis] { position[axis] } else { low[axis] };
                high[axis] = if position[axis] > high[axis] { position[axis] } else { high[axis] };
            }
        });
        // Rounding keeps the order, so that these are the extremes of what is written; the turn swaps those of one axis.
        let corners = [metres_y_up(low), metres_y_up(high)];
        let [min, max] =
            [f32::min, f32::max].map(|of| std::array::from_fn(|axis| of(corners[0][axis], corners[1][axis])));
        Self {
            vertices: rings * angles + caps * (angles + 1),
            indices: 6 * (rings - 1) * angles + 3 * caps * angles,
            min,
            max,
        }
    }

    /// Bytes of all vertices.
    pub fn vertex_bytes(&self) -> usize {
        STRIDE * self.vertices
    }

    /// Bytes of all triangles.
    pub fn index_bytes(&self) -> usize {
        INDEX * self.indices
    }
}

/// From mm with z up to metres with y up: a turn about x.
fn metres_y_up([x, y, z]: [f64; 3]) -> [f32; 3] {
    y_up([1e-3 * x, 1e-3 * y, 1e-3 * z])
}

fn y_up([x, y, z]: [f64; 3]) -> [f32; 3] {
    [x as f32, z as f32, -y as f32]
}

/// Writes the chunk: the wall ring by ring, then each cap's rim and centre, then the triangles.
pub fn write(mesh: &Mesh, to: &mut impl Write) -> io::Result<()> {
    let colours: [[u8; 4]; COLOUR_STEPS] = palette().map(linear_rgba);
    let together = PORTION / (STRIDE * mesh.angles());
    in_order(mesh.rings(), together, to, |ring, bytes| {
        mesh.ring(ring, |vertex| put_vertex(bytes, &vertex, colours[vertex.colour]));
    })?;
    let caps = mesh.caps();
    let mut bytes = Vec::new();
    for cap in &caps {
        // glTF has no "not measured": a cap's deviation is 0 and its colour says so.
        let normal = [0.0, 0.0, cap.normal_z];
        for position_mm in mesh.rim(cap.ring).chain([[0.0, 0.0, cap.z_mm]]) {
            let vertex = Vertex { position_mm, normal, deviation_um: 0.0, colour: 0 };
            put_vertex(&mut bytes, &vertex, linear_rgba(UNMEASURED));
        }
    }
    to.write_all(&bytes)?;
    in_order(mesh.rings() - 1, together, to, |ring, bytes| {
        for triangle in mesh.band(ring).flatten() {
            put_triangle(bytes, triangle);
        }
    })?;
    bytes.clear();
    let angles = mesh.angles() as u32;
    for (index, cap) in caps.iter().enumerate() {
        let rim = mesh.rings() as u32 * angles + index as u32 * (angles + 1);
        cap.triangles(angles, rim + angles, rim).for_each(|triangle| put_triangle(&mut bytes, triangle));
    }
    to.write_all(&bytes)
}

#[inline]
fn put_vertex(bytes: &mut Vec<u8>, vertex: &Vertex, colour: [u8; 4]) {
    let mut record = [0; STRIDE];
    put_vector(&mut record[POSITION..NORMAL], metres_y_up(vertex.position_mm));
    put_vector(&mut record[NORMAL..COLOUR], y_up(vertex.normal));
    record[COLOUR..DEVIATION].copy_from_slice(&colour);
    record[DEVIATION..].copy_from_slice(&(vertex.deviation_um as f32).to_le_bytes());
    bytes.extend_from_slice(&record);
}

#[inline]
fn put_triangle(bytes: &mut Vec<u8>, triangle: [u32; 3]) {
    let mut record = [0; 3 * INDEX];
    for (place, vertex) in record.chunks_exact_mut(INDEX).zip(triangle) {
        place.copy_from_slice(&vertex.to_le_bytes());
    }
    bytes.extend_from_slice(&record);
}

#[inline]
fn put_vector(place: &mut [u8], vector: [f32; 3]) {
    for (place, value) in place.chunks_exact_mut(4).zip(vector) {
        place.copy_from_slice(&value.to_le_bytes());
    }
}

/// glTF wants COLOR_0 in linear light (2.0 specification, 3.9.2).
fn linear_rgba(srgb: [u8; 3]) -> [u8; 4] {
    let [r, g, b] = srgb.map(|channel| (255.0 * linear(channel)).round() as u8);
    [r, g, b, u8::MAX]
}
