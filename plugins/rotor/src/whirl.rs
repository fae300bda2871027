//! How the shaft moves in a mode: direction of whirl, and shape.

use faer::{Mat, Side, c64};

use crate::{equations::Node, modal::Mode};

/// Direction of whirl.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whirl {
    /// Orbits run in the direction of rotation.
    Forward,
    /// Against it.
    Backward,
    /// Forward at some places of the shaft, backward at others.
    Mixed,
    /// Orbits are lines.
    Planar,
    /// The model does not say where x and y are.
    Unknown,
}

impl Whirl {
    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Backward => "backward",
            Self::Mixed => "mixed",
            Self::Planar => "planar",
            Self::Unknown => "unknown",
        }
    }
}

/// Orbits with a minor axis below so much of the largest displacement are lines.
const LINE: f64 = 1e-6;
/// Orbits of less than so much of the largest area do not decide on the direction.
const SMALL: f64 = 1e-3;

/// Amplitudes along x and y at each node.
fn amplitudes(shape: &[c64], nodes: &[Node]) -> Vec<(c64, c64)> {
    let at = |dof: Option<usize>| dof.and_then(|dof| shape.get(dof)).copied().unwrap_or(c64::new(0.0, 0.0));
    nodes.iter().map(|node| (at(node.x), at(node.y))).collect()
}

/// Direction of whirl of a mode: that of the orbits, seen against +z with rotation from x towards y.
#[must_use]
pub fn whirl(shape: &[c64], nodes: &[Node]) -> Whirl {
    let places = amplitudes(shape, nodes);
    if places.is_empty() {
        return Whirl::Unknown;
    }
    // x = Re X·e^{iωt}: the area that the orbit sweeps a cycle is π·Im(X·Y*), positive from x towards y.
    let areas: Vec<f64> = places.iter().map(|(x, y)| (x * y.conj()).im).collect();
    let largest = areas.iter().fold(0.0, |most: f64, area| most.max(area.abs()));
    let size = places.iter().map(|(x, y)| x.norm_sqr() + y.norm_sqr()).fold(0.0, f64::max);
    if largest <= LINE * size {
        return Whirl::Planar;
    }
    let [forward, backward] = [1.0, -1.0].map(|sign| areas.iter().any(|area| sign * area > SMALL * largest));
    match (forward, backward) {
        (true, true) => Whirl::Mixed,
        (true, false) => Whirl::Forward,
        _ => Whirl::Backward,
    }
}

/// The shape at the instant of its largest displacement, largest radius 1: x and y at each node. Without nodes, each degree of
/// freedom as x.
#[must_use]
pub(crate) fn shape(mode: &Mode, nodes: &[Node]) -> Vec<(f64, f64)> {
    let zero = c64::new(0.0, 0.0);
    let places = match nodes {
        [] => mode.shape.iter().map(|value| (*value, zero)).collect(),
        nodes => amplitudes(&mode.shape, nodes),
    };
    // Σ Re(X·e^{iψ})² + Re(Y·e^{iψ})² is largest where the sum of squares is real and positive.
    let sum: c64 = places.iter().map(|(x, y)| x * x + y * y).sum();
    let turn = c64::from_polar(1.0, -0.5 * sum.arg());
    let at_instant: Vec<(f64, f64)> = places.iter().map(|(x, y)| ((x * turn).re, (y * turn).re)).collect();
    let radius = |(x, y): &(f64, f64)| x.hypot(*y);
    let Some((x, y)) = at_instant.iter().max_by(|a, b| radius(a).total_cmp(&radius(b))).copied() else {
        return Vec::new();
    };
    let largest = x.hypot(y);
    if largest == 0.0 {
        return at_instant;
    }
    let scale = if if x.abs() >= y.abs() { x < 0.0 } else { y < 0.0 } { -largest } else { largest };
    at_instant.into_iter().map(|(x, y)| (x / scale, y / scale)).collect()
}

/// Frequencies closer than this are one, relative.
const SAME: f64 = 1e-7;

/// Turns modes of one frequency so that the first moves along x as far as it can: with equal planes, any mixture of both is a
/// mode, and a solver gives an accidental one.
pub(crate) fn align(modes: &mut [Mode], nodes: &[Node]) {
    let mut start = 0;
    while start < modes.len() {
        let first = modes[start].eigenvalue;
        let same =
            modes[start..].iter().take_while(|mode| (mode.eigenvalue - first).norm() < SAME * first.norm()).count();
        if same > 1 {
            align_one(&mut modes[start..start + same], nodes);
        }
        start += same.max(1);
    }
}

fn align_one(modes: &mut [Mode], nodes: &[Node]) {
    let count = modes.len();
    let places: Vec<Vec<(c64, c64)>> = modes.iter().map(|mode| amplitudes(&mode.shape, nodes)).collect();
    let sum = |pick: fn(&(c64, c64), &(c64, c64)) -> c64| {
        Mat::<c64>::from_fn(count, count, |row, column| {
            places[row].iter().zip(&places[column]).map(|(a, b)| pick(a, b)).sum()
        })
    };
    let along_x = sum(|a, b| a.0.conj() * b.0);
    let whole = sum(|a, b| a.0.conj() * b.0 + a.1.conj() * b.1);
    // The largest share of x: eigenvectors of L⁻¹·X·L⁻ᴴ, transformed back by L⁻ᴴ.
    let Ok(factor) = whole.llt(Side::Lower) else { return };
    let lower = factor.L();
    let mut half = along_x;
    lower.solve_lower_triangular_in_place(half.as_mut());
    let mut reduced = half.adjoint().to_owned();
    lower.solve_lower_triangular_in_place(reduced.as_mut());
    let Ok(eigen) = reduced.self_adjoint_eigen(Side::Lower) else { return };
    let mut mixing = eigen.U().to_owned();
    lower.adjoint().solve_upper_triangular_in_place(mixing.as_mut());
    if mixing.col_iter().any(|column| column.iter().any(|value| !value.re.is_finite() || !value.im.is_finite())) {
        return;
    }
    let dofs = modes[0].shape.len();
    let shapes: Vec<Vec<c64>> = (0..count)
        .rev()
        .map(|column| {
            (0..dofs).map(|dof| (0..count).map(|row| mixing[(row, column)] * modes[row].shape[dof]).sum()).collect()
        })
        .collect();
    for (mode, shape) in modes.iter_mut().zip(shapes) {
        mode.shape = shape;
    }
}
