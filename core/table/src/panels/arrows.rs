//! Vectors at places.

use arrow_array::RecordBatch;

use super::{
    Panels, Point,
    columns::{Names, Numbers, joined},
};

/// A vector at a place, both along the same three axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrow {
    /// The place.
    pub place: [f64; 3],
    /// The vector.
    pub vector: [f64; 3],
}

impl Panels {
    /// Takes rows of vectors; those with NaN are left out.
    pub(super) fn add_arrows(&mut self, rows: &RecordBatch) {
        let names = |columns: &[String]| columns.iter().map(|column| Names::of(rows, column)).collect::<Vec<_>>();
        let (panel_names, curve_names) = (names(&self.panel_columns), names(&self.curve_columns));
        let columns: Vec<[Option<Numbers>; 4]> = self.values.iter().map(|value| value.columns(rows)).collect();
        let [places, vectors] = &columns[..] else { return };
        let mut arrows = Vec::with_capacity(rows.num_rows());
        for row in 0..rows.num_rows() {
            let three = |of: &[Option<Numbers>; 4]| {
                [0, 1, 3].map(|column: usize| of[column].as_ref().map_or(f64::NAN, |numbers| numbers.get(row)))
            };
            let arrow = Arrow { place: three(places), vector: three(vectors) };
            if arrow.place.iter().chain(&arrow.vector).all(|number| number.is_finite()) {
                arrows.push((joined(&panel_names, row), joined(&curve_names, row), arrow));
            }
        }
        for (panel, curve, arrow) in arrows {
            let Some((panel, curves)) = self.place(&panel, &curve) else { continue };
            let curve = &mut self.drawn[panel].curves[curves[0]];
            let [x, y, third] = arrow.place;
            curve.points.push(Point { x, y, third });
            curve.arrows.push(arrow);
        }
    }
}
