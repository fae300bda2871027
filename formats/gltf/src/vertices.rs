//! The binary chunk: one buffer, one stretch of it an attribute.

use std::{io, ops::Range};

use runout_mesh::{COLOUR_STEPS, Mesh, UNMEASURED, linear, palette};

/// Where each attribute lies in the binary chunk, in bytes. All of them begin at multiples of 4.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Vertices of wall and caps.
    pub vertices: usize,
    /// Three a triangle.
    pub indices: usize,
}

/// Bytes of a position or a normal.
const VECTOR: usize = 12;
/// Bytes of a colour, a deviation or an index.
const WORD: usize = 4;

impl Layout {
    /// Of a mesh.
    ///
    /// # Errors
    /// When it does not fit into a GLB, whose lengths have 32 bits.
    pub fn of(mesh: &Mesh) -> io::Result<Self> {
        let (rings, angles, caps) = (mesh.rings(), mesh.angles(), mesh.caps().len());
        let vertices = rings * angles + caps * (angles + 1);
        let indices = 6 * (rings - 1) * angles + 3 * caps * angles;
        let layout = Self { vertices, indices };
        if layout.bytes() >= u32::MAX as usize {
            return Err(io::Error::other("a GLB holds at most 4 GiB; take fewer angles or a larger step_mm"));
        }
        Ok(layout)
    }

    /// `POSITION`.
    pub fn positions(&self) -> Range<usize> {
        0..VECTOR * self.vertices
    }

    /// `NORMAL`.
    pub fn normals(&self) -> Range<usize> {
        follow(&self.positions(), VECTOR * self.vertices)
    }

    /// `COLOR_0`.
    pub fn colours(&self) -> Range<usize> {
        follow(&self.normals(), WORD * self.vertices)
    }

    /// `_DEVIATION_UM`.
    pub fn deviations(&self) -> Range<usize> {
        follow(&self.colours(), WORD * self.vertices)
    }

    /// Triangles.
    pub fn triangles(&self) -> Range<usize> {
        follow(&self.deviations(), WORD * self.indices)
    }

    /// Of the whole chunk.
    pub fn bytes(&self) -> usize {
        self.triangles().end
    }
}

fn follow(before: &Range<usize>, length: usize) -> Range<usize> {
    before.end..before.end + length
}

/// Smallest and largest position, of the numbers as written.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Smallest x, y and z.
    pub min: [f32; 3],
    /// Largest x, y and z.
    pub max: [f32; 3],
}

/// The attributes of consecutive vertices, yet to be written.
struct Cursor<'a> {
    positions: std::slice::ChunksExactMut<'a, u8>,
    normals: std::slice::ChunksExactMut<'a, u8>,
    colours: std::slice::ChunksExactMut<'a, u8>,
    deviations: std::slice::ChunksExactMut<'a, u8>,
    bounds: Bounds,
}

impl Cursor<'_> {
    #[inline]
    fn push(&mut self, position_mm: [f64; 3], normal: [f64; 3], colour: [u8; 4], deviation_um: f64) {
        let position = y_up(position_mm.map(|value| 1e-3 * value));
        for (axis, value) in position.iter().enumerate() {
            self.bounds.min[axis] = self.bounds.min[axis].min(*value);
            self.bounds.max[axis] = self.bounds.max[axis].max(*value);
        }
        put(self.positions.next(), &bytes(position));
        put(self.normals.next(), &bytes(y_up(normal)));
        put(self.colours.next(), &colour);
        put(self.deviations.next(), &(deviation_um as f32).to_le_bytes());
    }
}

/// From z up to y up, a turn about x.
fn y_up([x, y, z]: [f64; 3]) -> [f32; 3] {
    [x as f32, z as f32, -y as f32]
}

fn bytes(vector: [f32; 3]) -> [u8; VECTOR] {
    let [x, y, z] = vector.map(f32::to_le_bytes);
    [x[0], x[1], x[2], x[3], y[0], y[1], y[2], y[3], z[0], z[1], z[2], z[3]]
}

fn put(place: Option<&mut [u8]>, bytes: &[u8]) {
    // The layout counts as many places as there are vertices.
    if let Some(place) = place {
        place.copy_from_slice(bytes);
    }
}

/// Fills the chunk: the wall ring by ring, then each cap's rim and centre, then the triangles.
pub fn fill(mesh: &Mesh, layout: &Layout) -> (Vec<u8>, Bounds) {
    let mut chunk = vec![0_u8; layout.bytes()];
    let (positions, rest) = chunk.split_at_mut(layout.positions().end);
    let (normals, rest) = rest.split_at_mut(layout.normals().len());
    let (colours, rest) = rest.split_at_mut(layout.colours().len());
    let (deviations, triangles) = rest.split_at_mut(layout.deviations().len());
    let mut cursor = Cursor {
        positions: positions.chunks_exact_mut(VECTOR),
        normals: normals.chunks_exact_mut(VECTOR),
        colours: colours.chunks_exact_mut(WORD),
        deviations: deviations.chunks_exact_mut(WORD),
        bounds: Bounds { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] },
    };
    let colours: [[u8; 4]; COLOUR_STEPS] = palette().map(linear_rgba);
    for ring in 0..mesh.rings() {
        mesh.ring(ring, |vertex| {
            cursor.push(vertex.position_mm, vertex.normal, colours[vertex.colour], vertex.deviation_um);
        });
    }
    for cap in mesh.caps() {
        // glTF has no "not measured": a cap's deviation is 0 and its colour says so.
        for position in mesh.rim(cap.ring).chain([[0.0, 0.0, cap.z_mm]]) {
            cursor.push(position, [0.0, 0.0, cap.normal_z], linear_rgba(UNMEASURED), 0.0);
        }
    }
    let bounds = cursor.bounds;
    let mut places = triangles.chunks_exact_mut(3 * WORD);
    let mut put_triangle = |[a, b, c]: [u32; 3]| {
        if let Some(place) = places.next() {
            place[0..4].copy_from_slice(&a.to_le_bytes());
            place[4..8].copy_from_slice(&b.to_le_bytes());
            place[8..12].copy_from_slice(&c.to_le_bytes());
        }
    };
    for ring in 0..mesh.rings() - 1 {
        for [one, other] in mesh.band(ring) {
            put_triangle(one);
            put_triangle(other);
        }
    }
    let angles = mesh.angles() as u32;
    for (index, cap) in mesh.caps().iter().enumerate() {
        let rim = mesh.rings() as u32 * angles + index as u32 * (angles + 1);
        cap.triangles(angles, rim + angles, rim).for_each(&mut put_triangle);
    }
    (chunk, bounds)
}

/// glTF wants COLOR_0 in linear light (2.0 specification, 3.9.2).
fn linear_rgba(srgb: [u8; 3]) -> [u8; 4] {
    let [r, g, b] = srgb.map(|channel| (255.0 * linear(channel)).round() as u8);
    [r, g, b, u8::MAX]
}
