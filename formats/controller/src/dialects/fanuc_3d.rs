//! FANUC Series 30i: three-dimensional error compensation.
//!
//! A-79351E, page 3: boxes over the three basic axes, Cx, Cy and Cz at their vertices, linear along each axis between them. No public text that was
//! found has the layout of a data file: this one is a table, for the screen of the control or a builder's program.

use super::{
    Comments, Dialect, Written,
    fanuc_pitch::{fits, value_step},
    few_enough,
};
use crate::{
    chain::{AxisCurves, Chain, LETTERS, SQUARENESS},
    config::{ControllerConfig, Moves},
};

/// Largest value at a vertex; no public text was found that says it.
const LARGEST: u32 = 127;

pub(super) struct Fanuc3d(pub ControllerConfig);

/// The linear axes, and the step of a value of each, in mm.
struct Boxes<'a> {
    axes: [&'a AxisCurves; 3],
    steps_mm: [f64; 3],
}

impl Boxes<'_> {
    /// The values at a vertex, by the indices of its nodes.
    fn values(&self, chain: &Chain, node: [usize; 3]) -> [i64; 3] {
        let error = chain.error_um([0, 1, 2].map(|axis| self.axes[axis].nodes[node[axis]].position));
        [0, 1, 2].map(|axis| (-1e-3 * error[axis] / self.steps_mm[axis]).round() as i64)
    }
}

impl Fanuc3d {
    fn boxes<'a>(&self, chain: &'a Chain) -> Result<Boxes<'a>, String> {
        let axis = |letter: &str| {
            chain.axis(letter).ok_or_else(|| format!("there is no curve of the axis {letter}: boxes have three axes"))
        };
        let step = |letter: &str| value_step(&self.0, letter);
        Ok(Boxes { axes: [axis("X")?, axis("Y")?, axis("Z")?], steps_mm: [step("X")?, step("Y")?, step("Z")?] })
    }
}

impl Dialect for Fanuc3d {
    fn comments(&self) -> Comments {
        Comments::First("#")
    }

    fn holds(&self, symbol: &str) -> bool {
        SQUARENESS.iter().any(|(known, ..)| *known == symbol) || (symbol.len() == 3 && LETTERS.contains(&&symbol[2..3]))
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let boxes = self.boxes(chain)?;
        let counts = boxes.axes.map(|axis| axis.nodes.len());
        few_enough(counts.iter().product(), self.0.most_points.unwrap_or(usize::MAX), "the grid of vertices")?;
        let mut lines = vec!["number,x_mm,y_mm,z_mm,cx,cy,cz".to_owned()];
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    let node = [x, y, z];
                    let at = [0, 1, 2].map(|axis| boxes.axes[axis].nodes[node[axis]].position);
                    let values = boxes.values(chain, node);
                    for value in values {
                        fits(&self.0, value, LARGEST, &format!("the vertex X {} Y {} Z {}", at[0], at[1], at[2]))?;
                    }
                    let [x_mm, y_mm, z_mm] = at.map(|at| format!("{at:.6}"));
                    let [cx, cy, cz] = values;
                    lines.push(format!("{},{x_mm},{y_mm},{z_mm},{cx},{cy},{cz}", lines.len()));
                }
            }
        }
        let moves = if self.0.positive_moves == Some(Moves::Positive) { "positive" } else { "negative" };
        let [x, y, z] = [0, 1, 2].map(|axis| {
            format!("{} of {} points every {:.6} mm", LETTERS[axis], counts[axis], boxes.axes[axis].step())
        });
        let notes = vec![
            "a table of values, not a data file of the control: no public text has its layout; enter them as the control's manual says".to_owned(),
            format!(
                "values in detection units times a magnification of {}; a positive value has to move the axis in its {moves} direction: `positive_moves`",
                self.0.magnification
            ),
            format!("vertices: {x}; {y}; {z}; X runs fastest; beyond the outer vertices nothing is stated"),
            "forward and reverse are equal: the curves do not tell directions apart".to_owned(),
        ];
        Ok(Written::one(lines, notes))
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        let Ok(boxes) = self.boxes(chain) else { return [0.0; 3] };
        let place = [0, 1, 2].map(|axis| {
            let (of, last) = (boxes.axes[axis], boxes.axes[axis].nodes.len() - 1);
            let place = ((place_mm[axis] - of.ends()[0]) / of.step()).clamp(0.0, last as f64);
            let low = (place.floor() as usize).min(last - 1);
            (low, place - low as f64)
        });
        let mut adds = [0.0; 3];
        for corner in 0..8_usize {
            let high = [0, 1, 2].map(|axis| corner >> axis & 1);
            let share: f64 =
                (0..3).map(|axis| if high[axis] == 1 { place[axis].1 } else { 1.0 - place[axis].1 }).product();
            let values = boxes.values(chain, [0, 1, 2].map(|axis| place[axis].0 + high[axis]));
            (0..3).for_each(|axis| adds[axis] += 1e3 * share * boxes.steps_mm[axis] * values[axis] as f64);
        }
        adds
    }
}
