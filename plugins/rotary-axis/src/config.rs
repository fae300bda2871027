//! The configuration of `[separate] plugin = "rotary-axis"`.

use nalgebra::Vector3;
use runout_core::{
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::Separator,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::axis::Axis;

/// `[separate] plugin = "rotary-axis"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryAxisConfig {
    /// The rotary axis. Its command is the column `a_deg`, `b_deg` or `c_deg`.
    #[serde(default)]
    pub axis: Axis,
    /// The balls, in the table's frame. The nominal axis runs through the origin.
    pub balls: Vec<Ball>,
    /// Standard uncertainty of one coordinate of one row, in µm. A column `std_um` overrides it; without both the scatter of
    /// repeats is taken.
    #[serde(default)]
    pub std_um: Option<f64>,
    /// Whether component errors are free at each command; `false` declares that there are none.
    #[serde(default = "default_component_errors")]
    pub component_errors: bool,
    /// Further points of the table for which the compensation is given.
    #[serde(default)]
    pub tool_points: Vec<Ball>,
    /// Component errors at evenly spaced nodes, and location errors, as tables.
    #[serde(default)]
    pub curves: Option<Curves>,
}

/// Nodes of the component curves.
#[derive(Debug, Clone, Copy, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curves {
    /// Distance of the nodes, in °: the turn, or the range of the commands, is divided evenly, as near to it as possible.
    pub pitch_deg: f64,
}

fn default_component_errors() -> bool {
    true
}

/// A ball, or a point of the table.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// Its name, as in the column `ball`.
    pub id: String,
    /// Nominal place at command 0, from the nominal axis, in mm.
    pub x_mm: f64,
    /// As `x_mm`.
    pub y_mm: f64,
    /// As `x_mm`.
    pub z_mm: f64,
}

impl Ball {
    pub(crate) fn place(&self) -> [f64; 3] {
        [self.x_mm, self.y_mm, self.z_mm]
    }
}

/// Location and component errors of a rotary axis: all balls, commands and repeats in one weighted least-squares fit.
#[derive(Debug, Clone)]
pub struct RotaryAxis(pub(crate) RotaryAxisConfig);

/// Balls closer than this are one, in mm.
const APART_MM: f64 = 1e-3;

impl StageConfig for RotaryAxisConfig {
    type Stage = Separator;

    const NAME: &'static str = "rotary-axis";
    const ABOUT: &'static str = "location and component errors of a rotary axis from an R-test, by one weighted fit";

    fn check(self, _context: &Context) -> Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.separator()?)))
    }
}

impl RotaryAxisConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn separator(self) -> Result<RotaryAxis, Fault> {
        if let Some(std) = self.std_um.filter(|std| !(std.is_finite() && *std > 0.0)) {
            return Err(Fault::at("std_um", format!("the uncertainty must be above 0 µm, found {std}")));
        }
        if let Some(Curves { pitch_deg }) = self.curves
            && !(0.01..=180.0).contains(&pitch_deg)
        {
            let fault = Fault::at("pitch_deg", format!("distances of nodes are from 0.01 to 180°, found {pitch_deg}"));
            return Err(fault.under("curves"));
        }
        if self.balls.is_empty() {
            return Err(Fault::at("balls", "expected at least one ball"));
        }
        let points = [("balls", &self.balls), ("tool_points", &self.tool_points)];
        for (key, points) in points {
            for (index, point) in points.iter().enumerate() {
                if let Some(value) = point.place().into_iter().find(|value| !value.is_finite()) {
                    return Err(Fault::here(format!("expected a place in mm, found {value}")).under_item(key, index));
                }
                if points[..index].iter().any(|known| known.id == point.id) {
                    let fault = Fault::at("id", format!("`{}` is there twice", point.id));
                    return Err(fault.under_item(key, index));
                }
            }
        }
        for (index, ball) in self.balls.iter().enumerate() {
            let apart = |other: &Ball| (Vector3::from(ball.place()) - Vector3::from(other.place())).norm();
            if let Some(other) = self.balls[..index].iter().find(|other| apart(other) < APART_MM) {
                let fault = Fault::here(format!("`{}` has the place of `{}`", ball.id, other.id));
                return Err(fault.under_item("balls", index));
            }
        }
        Ok(RotaryAxis(self))
    }

    /// A ball's place about an axis along z.
    pub(crate) fn ball(&self, index: usize) -> Vector3<f64> {
        self.axis.inward(self.balls[index].place())
    }
}
