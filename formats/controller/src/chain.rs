//! The error of a chain of linear axes with component curves, to first order.

use runout_core::{
    component_curves::{Carries, ComponentCurves, Node, is_rotary, symbols},
    numerics::least_squares::Basis,
};

/// Location errors between linear axes: symbol, axis along which the tool is displaced, axis whose position displaces it, sign.
pub(crate) const SQUARENESS: [(&str, usize, usize, f64); 3] =
    [("EC0Y", 0, 1, -1.0), ("EB0Z", 0, 2, 1.0), ("EA0Z", 1, 2, -1.0)];
/// The linear axes.
pub(crate) const LETTERS: [&str; 3] = ["X", "Y", "Z"];

/// Index of a linear axis.
pub(crate) fn index(axis: &str) -> Option<usize> {
    LETTERS.iter().position(|letter| *letter == axis)
}

/// An axis with its nodes.
#[derive(Debug, Clone)]
pub(crate) struct AxisCurves {
    pub letter: String,
    pub carries: Carries,
    pub nodes: Vec<Node>,
    pub rotary: bool,
}

/// A machine as its curves describe it. What is not observable is 0.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    /// From the base to the tool.
    pub axes: Vec<AxisCurves>,
    pub location: Vec<(String, f64)>,
    /// Curves that are nowhere observable.
    pub unknown: Vec<String>,
}

impl Chain {
    /// Of curves. The reason where they cannot be used.
    pub(crate) fn new(curves: &ComponentCurves) -> Result<Self, String> {
        let mut unknown = Vec::new();
        let mut axes = Vec::new();
        for letter in curves.axes() {
            let mut nodes: Vec<Node> = curves.of_axis(letter).into_iter().cloned().collect();
            for (error, symbol) in symbols(letter).into_iter().enumerate() {
                let lost = nodes.iter().filter(|node| node.errors[error].is_nan()).count();
                if lost == nodes.len() {
                    nodes.iter_mut().for_each(|node| node.errors[error] = 0.0);
                    unknown.push(symbol);
                } else if lost > 0 {
                    return Err(format!(
                        "{symbol} is not observable at {lost} of {} nodes: take a wider pitch",
                        nodes.len()
                    ));
                }
            }
            if nodes.len() < 2 {
                return Err(format!("the axis {letter} has fewer than 2 nodes"));
            }
            let carries = nodes[0].carries;
            axes.push(AxisCurves { letter: letter.to_owned(), carries, nodes, rotary: is_rotary(letter) });
        }
        let mut location = Vec::new();
        for error in &curves.location {
            if error.value.is_nan() {
                unknown.push(error.symbol.clone());
            } else {
                location.push((error.symbol.clone(), error.value));
            }
        }
        Ok(Self { axes, location, unknown })
    }

    /// Symbols of all errors that are not 0.
    pub(crate) fn errors(&self) -> Vec<String> {
        let mut all = Vec::new();
        for axis in &self.axes {
            for (error, symbol) in symbols(&axis.letter).into_iter().enumerate() {
                if axis.nodes.iter().any(|node| node.errors[error].abs() > 0.0) {
                    all.push(symbol);
                }
            }
        }
        all.extend(self.location.iter().filter(|(_, value)| value.abs() > 0.0).map(|(symbol, _)| symbol.clone()));
        all
    }

    /// The chain without some errors, which are named by their symbols.
    pub(crate) fn without(&self, left_out: &[String]) -> Self {
        let mut kept = self.clone();
        for axis in &mut kept.axes {
            for (error, symbol) in symbols(&axis.letter).into_iter().enumerate() {
                if left_out.contains(&symbol) {
                    axis.nodes.iter_mut().for_each(|node| node.errors[error] = 0.0);
                }
            }
        }
        kept.location.retain(|(symbol, _)| !left_out.contains(symbol));
        kept
    }

    /// A location error; 0 where there is none.
    pub(crate) fn location(&self, symbol: &str) -> f64 {
        self.location.iter().find(|(known, _)| known == symbol).map_or(0.0, |(_, value)| *value)
    }

    pub(crate) fn axis(&self, letter: &str) -> Option<&AxisCurves> {
        self.axes.iter().find(|axis| axis.letter == letter)
    }

    /// Where a squareness error counts from: the middle of the axis whose position displaces the tool.
    pub(crate) fn middle_mm(&self, axis: usize) -> f64 {
        let other = self.axes.iter().find(|other| !other.rotary && index(&other.letter) != Some(axis));
        other.map_or(0.0, |other| other.nodes[0].at_mm[axis])
    }

    /// Error of the tool at a place of the linear axes, in µm.
    pub(crate) fn error_um(&self, place_mm: [f64; 3]) -> [f64; 3] {
        let mut error = [0.0; 3];
        let linear: Vec<(usize, &AxisCurves)> =
            self.axes.iter().filter_map(|axis| Some((index(&axis.letter)?, axis))).collect();
        for (position, (own, axis)) in linear.iter().enumerate() {
            let of = axis.at(place_mm[*own]);
            let mut arm = [0.0; 3];
            for (carried, _) in &linear[position + 1..] {
                arm[*carried] = place_mm[*carried] - axis.nodes[0].at_mm[*carried];
            }
            let turned = cross([of[3], of[4], of[5]], arm);
            (0..3).for_each(|along| error[along] += of[along] + 1e-3 * turned[along]);
        }
        for (symbol, moved, with, sign) in SQUARENESS {
            error[moved] += sign * 1e-3 * self.location(symbol) * (place_mm[with] - self.middle_mm(with));
        }
        error
    }

    /// Places over the volume of the linear axes, each in the middle of an equal part, in mm.
    pub(crate) fn places_mm(&self) -> Vec<[f64; 3]> {
        let at = |axis: usize| -> Vec<f64> {
            let own = self.axis(LETTERS[axis]);
            own.map_or_else(
                || vec![self.middle_mm(axis)],
                |own| {
                    let [from, to] = own.ends();
                    (0..SHARES).map(|share| from + (to - from) * (share as f64 + 0.5) / SHARES as f64).collect()
                },
            )
        };
        let [x, y, z] = [0, 1, 2].map(at);
        let mut all = Vec::new();
        for x in &x {
            for y in &y {
                all.extend(z.iter().map(|z| [*x, *y, *z]));
            }
        }
        all
    }
}

/// Places along each axis of a prediction: no multiple of usual numbers of nodes.
const SHARES: usize = 13;

impl AxisCurves {
    pub(crate) fn ends(&self) -> [f64; 2] {
        [self.nodes[0].position, self.nodes[self.nodes.len() - 1].position]
    }

    /// Distance of the nodes, which are even.
    pub(crate) fn step(&self) -> f64 {
        let [from, to] = self.ends();
        (to - from) / (self.nodes.len() - 1) as f64
    }

    /// The six errors at a position: linear between nodes, those of the ends beyond.
    pub(crate) fn at(&self, position: f64) -> [f64; 6] {
        let upper = self.nodes.iter().position(|node| node.position >= position).unwrap_or(self.nodes.len() - 1).max(1);
        let (low, high) = (&self.nodes[upper - 1], &self.nodes[upper]);
        let share = ((position - low.position) / (high.position - low.position)).clamp(0.0, 1.0);
        std::array::from_fn(|error| low.errors[error] * (1.0 - share) + high.errors[error] * share)
    }
}

/// a × b.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        a[next] * b[last] - a[last] * b[next]
    })
}

/// Root mean square length of errors at places, in µm, less the rigid motion that fits best: that is how the work lies on the table.
pub(crate) fn free_rms_um(places_mm: &[[f64; 3]], errors_um: &[[f64; 3]]) -> f64 {
    let count = places_mm.len().max(1) as f64;
    let middle = [0, 1, 2].map(|axis| places_mm.iter().map(|place| place[axis]).sum::<f64>() / count);
    let column = |motion: usize| -> Vec<f64> {
        let mut unit = [0.0; 3];
        unit[motion % 3] = 1.0;
        let of = |place: &[f64; 3]| {
            let arm = [0, 1, 2].map(|axis| 1e-3 * (place[axis] - middle[axis]));
            if motion < 3 { unit } else { cross(unit, arm) }
        };
        places_mm.iter().flat_map(of).collect()
    };
    let mut left: Vec<f64> = errors_um.iter().copied().flatten().collect();
    Basis::of((0..6).map(column).collect()).remove_from(&mut left);
    (left.iter().map(|error| error * error).sum::<f64>() / count).sqrt()
}
