//! Flat ends that close a mesh.

/// A flat end, from the axis to a ring. Drawn, not measured.
///
/// It shares the rim's vertices with the wall, so that the solid is closed by its very indices and is one piece for every
/// reader, also for those that take vertices of one place and different normals for different ones. The rim keeps the wall's
/// normals; a ring of the cap's own, just inside the rim, has those of the flat end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cap {
    /// The ring that it closes.
    pub ring: usize,
    /// Where its centre lies on the axis, in mm.
    pub z_mm: f64,
    /// Its normal along z: −1 at the first ring, +1 at the last.
    pub normal_z: f64,
}

impl Cap {
    /// How many vertices of its own it has on so many angles.
    #[must_use]
    pub fn vertex_count(angles: usize) -> usize {
        angles + 1
    }

    /// How many triangles it has on so many angles.
    #[must_use]
    pub fn triangle_count(angles: usize) -> usize {
        3 * angles
    }

    /// Its triangles, counter-clockwise seen from outside; `own` is the first of its own vertices.
    pub fn triangles(&self, angles: u32, own: u32) -> impl Iterator<Item = [u32; 3]> + use<> {
        let (up, rim, centre) = (self.normal_z > 0.0, self.ring as u32 * angles, own + angles);
        (0..angles).flat_map(move |here| {
            let next = if here + 1 == angles { 0 } else { here + 1 };
            let between = [[rim + here, rim + next, own + next], [rim + here, own + next, own + here]];
            let fan = [centre, own + here, own + next];
            [between[0], between[1], fan].map(|[a, b, c]| if up { [a, b, c] } else { [a, c, b] })
        })
    }
}
