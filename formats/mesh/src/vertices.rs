//! Vertices on their way into a file.

/// Vertices that are worked out side by side.
pub const LANES: usize = 8;

/// Neighbouring points of a ring, worked out side by side: those of the places below `count` are some.
#[derive(Debug, Clone, PartialEq)]
pub struct Vertices {
    /// At most [`LANES`].
    pub count: usize,
    /// Where they are drawn, magnified: x, y and z of each.
    pub position_mm: [[f64; LANES]; 3],
    /// Outward unit normals of what is drawn.
    pub normal: [[f64; LANES]; 3],
    /// True deviations, whatever the magnification.
    pub deviation_um: [f64; LANES],
    /// Places in the [`palette`](crate::palette).
    pub colour: [usize; LANES],
}

impl Vertices {
    /// One point.
    #[must_use]
    pub fn one(position_mm: [f64; 3], normal: [f64; 3]) -> Self {
        let first = |value| std::array::from_fn(|lane| if lane == 0 { value } else { 0.0 });
        Self {
            count: 1,
            position_mm: position_mm.map(first),
            normal: normal.map(first),
            deviation_um: [0.0; LANES],
            colour: [0; LANES],
        }
    }
}
