//! The rotary axis' letter: names of its errors and columns, and the cyclic renaming to an axis along z.
//!
//! All equations are of an axis along z (C). For A the coordinates (y, z, x) of the machine take the places of (x, y, z), for B
//! (z, x, y): a cyclic change, which keeps frames right-handed.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The axis: A turns about X, B about Y, C about Z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema, Default)]
pub enum Axis {
    /// About X.
    A,
    /// About Y.
    B,
    /// About Z.
    #[default]
    C,
}

/// Letters of the machine's coordinates and of the rotations about them.
const LINEAR: [char; 3] = ['X', 'Y', 'Z'];
const ANGULAR: [char; 3] = ['A', 'B', 'C'];

impl Axis {
    /// The machine's coordinate (0, 1, 2) in each place of (x, y, z) of an axis along z.
    #[must_use]
    pub fn order(self) -> [usize; 3] {
        match self {
            Self::A => [1, 2, 0],
            Self::B => [2, 0, 1],
            Self::C => [0, 1, 2],
        }
    }

    /// Its letter.
    #[must_use]
    pub fn letter(self) -> char {
        ANGULAR[self.order()[2]]
    }

    /// The column of its command.
    #[must_use]
    pub fn command(self) -> &'static str {
        match self {
            Self::A => "a_deg",
            Self::B => "b_deg",
            Self::C => "c_deg",
        }
    }

    /// From the machine's coordinates to those of an axis along z.
    #[must_use]
    pub fn inward(self, machine: [f64; 3]) -> Vector3<f64> {
        Vector3::from(self.order().map(|coordinate| machine[coordinate]))
    }

    /// Back to the machine's.
    #[must_use]
    pub fn outward(self, along_z: &Vector3<f64>) -> [f64; 3] {
        let mut machine = [0.0; 3];
        for (place, coordinate) in self.order().into_iter().enumerate() {
            machine[coordinate] = along_z[place];
        }
        machine
    }

    /// Symbols of the location errors (ISO 230-1), in the places of (x, y, θx, θy) of an axis along z: EX0C, EY0C, EA0C, EB0C.
    #[must_use]
    pub fn location_symbols(self) -> [String; 4] {
        let [first, second, _] = self.order();
        let symbol = |letter: char| format!("E{letter}0{}", self.letter());
        [LINEAR[first], LINEAR[second], ANGULAR[first], ANGULAR[second]].map(symbol)
    }

    /// Symbols of the component errors in the machine's order: EXC, EYC, EZC, EAC, EBC, ECC.
    #[must_use]
    pub fn component_symbols(self) -> [String; 6] {
        let symbol = |letter: char| format!("E{letter}{}", self.letter());
        let [x, y, z] = LINEAR.map(symbol);
        let [a, b, c] = ANGULAR.map(symbol);
        [x, y, z, a, b, c]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn renaming_is_cyclic_and_goes_back() {
        for axis in [Axis::A, Axis::B, Axis::C] {
            let machine = [1.0, 2.0, 3.0];
            assert!(axis.outward(&axis.inward(machine)).iter().zip(machine).all(|(a, b)| (a - b).abs() < 1e-15));
            let basis = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|unit| axis.inward(unit));
            assert_eq!(basis[0].cross(&basis[1]), basis[2]);
        }
        assert_eq!(Axis::C.location_symbols(), ["EX0C", "EY0C", "EA0C", "EB0C"]);
        assert_eq!(Axis::A.location_symbols(), ["EY0A", "EZ0A", "EB0A", "EC0A"]);
        assert_eq!(Axis::B.location_symbols(), ["EZ0B", "EX0B", "EC0B", "EA0B"]);
        assert_eq!(Axis::A.component_symbols(), ["EXA", "EYA", "EZA", "EAA", "EBA", "ECA"]);
    }
}
