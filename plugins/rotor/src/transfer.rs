//! Equations of motion as points, which is how loader and separator exchange them: one trace a matrix, one row an element that is
//! not zero. A trace `places` says where displacements are. Rows and columns count from 1.

use faer::Mat;
use runout_core::{
    Error, Result,
    points::{Column, PointColumn, PointKind, Points, Trace},
};

use crate::{
    equations::{Equations, Node, Role},
    model::MOST_DEGREES_OF_FREEDOM,
};

const MATRIX: &str = "matrix";
const ROW: &str = "row";
const COLUMN: &str = "column";
const VALUE: &str = "value";
const PLACES: &str = "places";

/// The columns of equations of motion.
#[must_use]
pub(crate) fn columns() -> Vec<PointColumn> {
    vec![
        PointColumn::needed(
            MATRIX,
            PointKind::Trace,
            "",
            "stiffness, mass, gyroscopic (at 1 rad/s), damping or circulatory; or places",
        ),
        PointColumn::needed(
            ROW,
            PointKind::Number,
            "",
            "row from 1; of places the degree of freedom, 0 for one that is held",
        ),
        PointColumn::needed(COLUMN, PointKind::Number, "", "column from 1; of places 1 for x, 2 for y"),
        PointColumn::needed(VALUE, PointKind::Number, "", "element in SI units; of places z in mm"),
    ]
}

/// Equations as points.
#[must_use]
pub(crate) fn to_points(equations: &Equations) -> Points {
    let mut rows = Rows::default();
    for role in Role::ALL {
        let matrix = equations.matrix(role);
        for row in 0..equations.size() {
            for column in 0..equations.size() {
                if matrix[(row, column)] != 0.0 {
                    rows.push(row + 1, column + 1, matrix[(row, column)]);
                }
            }
        }
        rows.end(role.name());
    }
    for Node { z_mm, x, y } in &equations.nodes {
        rows.push(x.map_or(0, |dof| dof + 1), 1, *z_mm);
        rows.push(y.map_or(0, |dof| dof + 1), 2, *z_mm);
    }
    rows.end(PLACES);
    rows.points
}

/// Rows of points, matrix by matrix.
#[derive(Default)]
struct Rows {
    points: Points,
}

impl Rows {
    fn push(&mut self, row: usize, column: usize, value: f64) {
        if self.points.columns.is_empty() {
            self.points.columns =
                [ROW, COLUMN, VALUE].map(|name| Column { name: name.into(), values: Vec::new() }).into();
        }
        for (list, number) in self.points.columns.iter_mut().zip([row as f64, column as f64, value]) {
            list.values.push(number);
        }
    }

    fn end(&mut self, name: &str) {
        let start = self.points.traces.last().map_or(0, |trace| trace.points.end);
        let end = self.points.columns.first().map_or(0, |column| column.values.len());
        if end > start {
            self.points.traces.push(Trace { id: name.into(), kind: name.into(), points: start..end });
        }
    }
}

/// Points as equations.
///
/// # Errors
/// When an index is no whole number in its range, a matrix is unknown, or the matrices are no equations of motion.
pub(crate) fn from_points(points: &Points) -> Result<Equations> {
    let object = points.input.display().to_string();
    let [rows, columns, values] = [points.column(ROW)?, points.column(COLUMN)?, points.column(VALUE)?];
    let mut size = 0;
    for trace in &points.traces {
        for index in trace.points.clone() {
            let least = i32::from(trace.id != PLACES);
            for number in [rows[index], columns[index]] {
                if number.fract() != 0.0 || !(f64::from(least)..=MOST_DEGREES_OF_FREEDOM as f64).contains(&number) {
                    let expected = format!("expected whole numbers from {least} to {MOST_DEGREES_OF_FREEDOM}");
                    let problem = format!("{expected} for rows and columns, found {number}");
                    return Err(Error::new("read", format!("{object}, matrix {}", trace.id), problem));
                }
            }
            if trace.id != PLACES {
                size = size.max(rows[index] as usize).max(columns[index] as usize);
            }
        }
    }
    let mut matrices = Vec::new();
    let mut nodes = Vec::new();
    for trace in &points.traces {
        let elements = trace.points.clone().map(|index| (rows[index] as usize, columns[index] as usize, values[index]));
        if trace.id == PLACES {
            nodes =
                places(elements, size).map_err(|problem| Error::new("read", format!("{object}, places"), problem))?;
        } else if let Some(role) = Role::ALL.into_iter().find(|role| role.name() == trace.id) {
            let mut matrix = Mat::zeros(size, size);
            elements.for_each(|(row, column, value)| matrix[(row - 1, column - 1)] += value);
            matrices.push((role, matrix));
        } else {
            let known: Vec<&str> = Role::ALL.iter().map(|role| role.name()).collect();
            let problem = format!("unknown matrix; expected {} or {PLACES}", known.join(", "));
            return Err(Error::new("read", format!("{object}, matrix {}", trace.id), problem));
        }
    }
    Equations::new(&object, matrices, nodes)
}

/// Nodes in the order of z.
fn places(elements: impl Iterator<Item = (usize, usize, f64)>, size: usize) -> std::result::Result<Vec<Node>, String> {
    let mut nodes: Vec<Node> = Vec::new();
    for (dof, direction, z_mm) in elements {
        if dof > size {
            return Err(format!("expected degrees of freedom up to {size}, found {dof}"));
        }
        let at = nodes.iter().position(|node| node.z_mm.total_cmp(&z_mm).is_eq()).unwrap_or_else(|| {
            nodes.push(Node { z_mm, x: None, y: None });
            nodes.len() - 1
        });
        match direction {
            1 => nodes[at].x = dof.checked_sub(1),
            2 => nodes[at].y = dof.checked_sub(1),
            other => return Err(format!("expected 1 (x) or 2 (y) in the column `{COLUMN}`, found {other}")),
        }
    }
    nodes.sort_by(|a, b| a.z_mm.total_cmp(&b.z_mm));
    Ok(nodes)
}
