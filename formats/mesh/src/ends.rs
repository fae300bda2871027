//! Vertices of the flat ends of a mesh.

use crate::{cap::Cap, wall::Wall};

/// Radius of a cap's own ring over that of the rim: so near that the end looks sharp, and far enough that single precision
/// keeps the two apart.
const INNER: f64 = 0.995;

impl Cap {
    /// Positions in mm of its own vertices, all of which have its normal: a ring, angle by angle, and the centre.
    pub fn vertices<'m>(&self, wall: &'m Wall) -> impl Iterator<Item = [f64; 3]> + use<'m> {
        let inside = wall.rim(self.ring).map(|[x, y, z]| [INNER * x, INNER * y, z]);
        inside.chain([[0.0, 0.0, self.z_mm]])
    }
}
