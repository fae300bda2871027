//! A mesh vertex by vertex and triangle by triangle, with its caps.

use crate::{cap::Cap, mesh::Mesh, wall::Wall};

/// A vertex of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Where it is drawn, magnified.
    pub position_mm: [f64; 3],
    /// Outward unit normal of what is drawn.
    pub normal: [f64; 3],
    /// True deviation; none of a cap, which is drawn and not measured.
    pub deviation_um: Option<f64>,
    /// Place in the [`palette`](crate::palette); none of a cap, which is [`UNMEASURED`](crate::UNMEASURED).
    pub colour: Option<usize>,
}

impl Mesh<'_> {
    /// Vertices and triangles, those of caps among them.
    #[must_use]
    pub fn counts(&self) -> [usize; 2] {
        let (caps, angles) = (self.wall().map_or(0, |wall| wall.caps().len()), self.columns());
        let [vertices, triangles] = [Cap::vertex_count(angles), Cap::triangle_count(angles)].map(|own| caps * own);
        [self.vertex_count() + vertices, self.triangle_count() + triangles]
    }

    /// Visits every vertex, in the order in which [`triangles`](Self::triangles) count them.
    ///
    /// # Errors
    /// The first of `visit`.
    pub fn vertices<E>(&self, mut visit: impl FnMut(&Vertex) -> Result<(), E>) -> Result<(), E> {
        for row in 0..self.rows() {
            let mut outcome = Ok(());
            self.row(row, |found| {
                for lane in 0..found.count {
                    let [position_mm, normal] = [&found.position_mm, &found.normal].map(|of| of.map(|axis| axis[lane]));
                    let (deviation_um, colour) = (Some(found.deviation_um[lane]), Some(found.colour[lane]));
                    if outcome.is_ok() {
                        outcome = visit(&Vertex { position_mm, normal, deviation_um, colour });
                    }
                }
            });
            outcome?;
        }
        if let Some(wall) = self.wall() {
            for cap in wall.caps() {
                let normal = [0.0, 0.0, cap.normal_z];
                for position_mm in cap.vertices(wall) {
                    visit(&Vertex { position_mm, normal, deviation_um: None, colour: None })?;
                }
            }
        }
        Ok(())
    }

    /// Visits every triangle, counter-clockwise seen from outside or from above.
    ///
    /// # Errors
    /// The first of `visit`.
    pub fn triangles<E>(&self, mut visit: impl FnMut([u32; 3]) -> Result<(), E>) -> Result<(), E> {
        for row in 0..self.rows() - 1 {
            let mut outcome = Ok(());
            self.band(row, |triangle| {
                if outcome.is_ok() {
                    outcome = visit(triangle);
                }
            });
            outcome?;
        }
        let caps = self.wall().map(Wall::caps).unwrap_or_default();
        for (index, cap) in caps.iter().enumerate() {
            let own = self.vertex_count() + index * Cap::vertex_count(self.columns());
            cap.triangles(self.columns() as u32, own as u32).try_for_each(&mut visit)?;
        }
        Ok(())
    }
}
