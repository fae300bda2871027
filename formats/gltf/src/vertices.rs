//! The binary chunk: vertices, all attributes of one side by side, then triangles.
//!
//! It is made beside the writing, in portions that stay in the caches: a chunk held whole would first have to be given its
//! memory page by page, which takes longer than filling it.

use std::io::{self, Write};

use runout_mesh::{COLOUR_STEPS, Cap, LANES, Mesh, UNMEASURED, Vertices, Wall, in_order, linear, palette, processors};

/// Bytes from one vertex to the next.
pub(crate) const STRIDE: usize = 32;
/// Where each attribute lies within a vertex, in bytes.
pub(crate) const POSITION: usize = 0;
/// See [`POSITION`].
pub(crate) const NORMAL: usize = 12;
/// See [`POSITION`].
pub(crate) const COLOUR: usize = 24;
/// See [`POSITION`].
pub(crate) const DEVIATION: usize = 28;
/// Bytes of an index.
const INDEX: usize = 4;
/// Bytes that are handed on at a time, about.
const PORTION: usize = 1 << 20;

/// What the binary chunk holds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout {
    /// Vertices of wall and caps, or of a sheet.
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
    pub(crate) fn of(mesh: &Mesh) -> Self {
        let caps = mesh.wall().map_or(0, |wall| wall.caps().len());
        let angles = mesh.columns();
        // Rounding keeps the order, so that these are the extremes of what is written; the turn swaps those of one axis.
        let corners = mesh.bounds_mm().map(|corner| y_up(corner.map(metres)));
        let [min, max] =
            [f32::min, f32::max].map(|of| std::array::from_fn(|axis| of(corners[0][axis], corners[1][axis])));
        Self {
            vertices: mesh.vertex_count() + caps * Cap::vertex_count(angles),
            indices: 3 * (mesh.triangle_count() + caps * Cap::triangle_count(angles)),
            min,
            max,
        }
    }

    /// Bytes of all vertices.
    pub(crate) fn vertex_bytes(&self) -> usize {
        STRIDE * self.vertices
    }

    /// Bytes of all triangles.
    pub(crate) fn index_bytes(&self) -> usize {
        INDEX * self.indices
    }
}

fn metres(mm: f64) -> f32 {
    (1e-3 * mm) as f32
}

/// From z up to y up: a turn about x.
fn y_up([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, z, -y]
}

/// Writes the chunk: wall or sheet row by row, then each cap's own vertices, then the triangles.
pub(crate) fn write(mesh: &Mesh, to: &mut impl Write) -> io::Result<()> {
    let colours: [[u8; 4]; COLOUR_STEPS] = palette().map(linear_rgba);
    let together = PORTION / (STRIDE * mesh.columns());
    // Writing keeps a processor as busy as making what is written.
    let threads = processors().saturating_sub(1);
    in_order(mesh.rows(), together, threads, to, |row, bytes| {
        mesh.row(row, |vertices| put_vertices(bytes, vertices, &colours));
    })?;
    match mesh {
        Mesh::Wall(wall) => write_rest_of_wall(wall, together, threads, to),
        Mesh::Sheet(sheet) => in_order(sheet.rows() - 1, together, threads, to, |row, bytes| {
            sheet.band(row, |triangle| bytes.extend_from_slice(triangle.map(u32::to_le_bytes).as_flattened()));
        }),
    }
}

/// Vertices of caps, then all triangles.
fn write_rest_of_wall(wall: &Wall, together: usize, threads: usize, to: &mut impl Write) -> io::Result<()> {
    let caps = wall.caps();
    let mut bytes = Vec::new();
    for cap in &caps {
        // glTF has no "not measured": a cap's deviation is 0 and its colour says so.
        let normal = [0.0, 0.0, cap.normal_z];
        for position_mm in cap.vertices(wall) {
            put_vertices(&mut bytes, &Vertices::one(position_mm, normal), &[linear_rgba(UNMEASURED)]);
        }
    }
    to.write_all(&bytes)?;
    // Every band's triangles are the first one's, so many rings on.
    let band: Vec<u32> = wall.band(0).flatten().flatten().collect();
    in_order(wall.rings() - 1, together, threads, to, |ring, bytes| {
        let (begin, on) = (bytes.len(), (ring * wall.angles()) as u32);
        bytes.resize(begin + INDEX * band.len(), 0);
        for (place, vertex) in bytes[begin..].as_chunks_mut().0.iter_mut().zip(&band) {
            *place = (vertex + on).to_le_bytes();
        }
    })?;
    bytes.clear();
    let angles = wall.angles() as u32;
    for (index, cap) in caps.iter().enumerate() {
        let own = wall.rings() * wall.angles() + index * Cap::vertex_count(wall.angles());
        let triangles = cap.triangles(angles, own as u32);
        triangles.for_each(|triangle| bytes.extend_from_slice(triangle.map(u32::to_le_bytes).as_flattened()));
    }
    to.write_all(&bytes)
}

/// Not inlined: together with the arithmetic before it, the compiler shuffles single numbers between wide registers, and a
/// mesh takes half as long again.
#[inline(never)]
fn put_vertices(bytes: &mut Vec<u8>, vertices: &Vertices, colours: &[[u8; 4]]) {
    let [x, y, z] = vertices.position_mm.map(|axis| axis.map(metres));
    let normal = vertices.normal.map(|axis| axis.map(|part| part as f32));
    let deviation = vertices.deviation_um.map(|deviation| deviation as f32);
    let mut records = [[[0; 4]; STRIDE / 4]; LANES];
    for (lane, record) in records.iter_mut().enumerate() {
        let [position, normal] = [[x, y, z], normal].map(|vector| y_up(vector.map(|axis| axis[lane])));
        record[..NORMAL / 4].copy_from_slice(&position.map(f32::to_le_bytes));
        record[NORMAL / 4..COLOUR / 4].copy_from_slice(&normal.map(f32::to_le_bytes));
        record[COLOUR / 4] = colours[vertices.colour[lane]];
        record[DEVIATION / 4] = deviation[lane].to_le_bytes();
    }
    bytes.extend_from_slice(records[..vertices.count].as_flattened().as_flattened());
}

/// glTF wants COLOR_0 in linear light (2.0 specification, 3.9.2).
fn linear_rgba(srgb: [u8; 3]) -> [u8; 4] {
    let [r, g, b] = srgb.map(|channel| (255.0 * linear(channel)).round() as u8);
    [r, g, b, u8::MAX]
}
