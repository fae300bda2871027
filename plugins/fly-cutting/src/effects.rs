//! What the declared cut may lack: parameters, what they apply, and their partials.

use std::f64::consts::TAU;

use runout_core::{
    Complex64,
    closed_loop::{Effect, Parameter, Setting},
};

use crate::{
    heights::Heights,
    passes::{Applied, Cut, FIRST_ORDER, Line, ORDERS, PassTurns, Surface, legendre},
};

/// An effect of the library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Missing {
    /// The map is of a surface that was tilted: a plane.
    WorkpieceTilt,
    /// The table rises and falls along the feed.
    TableStraightness,
    /// The feed is not the declared one.
    FeedScale,
    /// The radius of the nose is not the declared one.
    NoseRadius,
    /// A line in the height of the tool, by its place among those that were found.
    SpindleLine(usize),
    /// A line in the tilt about x.
    TiltLine,
    /// Motion that repeats with the turn: a shape along y that all passes have.
    SynchronousMotion,
    /// The map is turned about its normal.
    MapRotation,
    /// The radius of the cutter is not the declared one.
    CutterRadius,
}

/// Id of all lines.
pub(crate) const SPINDLE_LINE: &str = "spindle-line";
/// Lines in the height of the tool that are looked for.
pub(crate) const MOST_LINES: usize = 3;

/// All effects.
pub(crate) const MISSING: [Missing; 8 + MOST_LINES] = [
    Missing::WorkpieceTilt,
    Missing::TableStraightness,
    Missing::FeedScale,
    Missing::NoseRadius,
    Missing::SpindleLine(0),
    Missing::SpindleLine(1),
    Missing::SpindleLine(2),
    Missing::TiltLine,
    Missing::SynchronousMotion,
    Missing::MapRotation,
    Missing::CutterRadius,
];

impl Missing {
    /// Id and what it does, for lists.
    pub(crate) fn about(self) -> (&'static str, &'static str) {
        match self {
            Self::WorkpieceTilt => ("workpiece-tilt", "a height map is of a surface that was tilted: a plane"),
            Self::TableStraightness => {
                ("table-straightness", "the table of a fly cutter rises and falls along the feed")
            }
            Self::FeedScale => ("feed-scale", "the feed of a cut is not the declared one"),
            Self::NoseRadius => ("nose-radius", "the radius of a tool's nose is not the declared one"),
            Self::SpindleLine(_) | Self::TiltLine => {
                (SPINDLE_LINE, "a line of the spindle leaves stripes on the surface that it cuts")
            }
            Self::SynchronousMotion => {
                ("synchronous-motion", "motion that repeats with the turn gives all passes one shape")
            }
            Self::MapRotation => {
                ("map-rotation", "a height map is turned about its normal against the feed of its cut")
            }
            Self::CutterRadius => ("cutter-radius", "the radius of a fly cutter is not the declared one"),
        }
    }

    /// Id, target and parameters.
    pub(crate) fn effect(self) -> Effect {
        let parameter =
            |name: &str, unit: &str, tolerance: f64| Parameter { name: name.into(), unit: unit.into(), tolerance };
        let line = |amplitude: Parameter| {
            vec![parameter("frequency_ratio", "1/rev", 1.0), amplitude, parameter("phase", "deg", 180.0)]
        };
        let orders = || {
            let orders = FIRST_ORDER..FIRST_ORDER + ORDERS;
            orders.map(|order| parameter(&format!("order_{order}"), "nm", 100.0)).collect()
        };
        let (targets, parameters) = match self {
            Self::WorkpieceTilt => (vec![], vec![parameter("x", "urad", 100.0), parameter("y", "urad", 100.0)]),
            Self::TableStraightness | Self::SynchronousMotion => (vec![], orders()),
            Self::FeedScale => (vec![], vec![parameter("scale", "um/m", 1000.0)]),
            Self::NoseRadius => (vec![], vec![parameter("change", "mm", 0.5)]),
            Self::MapRotation => (vec![], vec![parameter("angle", "urad", 1000.0)]),
            Self::CutterRadius => (vec![], vec![parameter("change", "mm", 1.0)]),
            Self::SpindleLine(0) => (vec![], line(parameter("amplitude", "nm", 5.0))),
            Self::SpindleLine(number) => {
                (vec![format!("line {}", number + 1)], line(parameter("amplitude", "nm", 5.0)))
            }
            Self::TiltLine => (vec!["tilt-x".to_owned()], line(parameter("amplitude", "urad", 0.1))),
        };
        Effect { id: self.about().0.into(), targets, parameters }
    }

    /// Whether it is a line, and whether that is of the tilt about x.
    pub(crate) fn line(self) -> Option<bool> {
        match self {
            Self::SpindleLine(_) => Some(false),
            Self::TiltLine => Some(true),
            _ => None,
        }
    }

    /// Puts values of it on a cut.
    pub(crate) fn apply(self, values: &[f64], applied: &mut Applied) {
        match (self, values) {
            (Self::WorkpieceTilt, [x, y]) => applied.tilt_urad = [*x, *y],
            (Self::TableStraightness, values) => {
                applied.table_nm.iter_mut().zip(values).for_each(|(size, value)| *size = *value);
            }
            (Self::SynchronousMotion, values) => {
                applied.shape_nm.iter_mut().zip(values).for_each(|(size, value)| *size = *value);
            }
            (Self::FeedScale, [scale]) => applied.feed_scale = 1e-6 * scale,
            (Self::NoseRadius, [change]) => applied.radius_mm = *change,
            (Self::MapRotation, [angle]) => applied.rotation = 1e-6 * angle,
            (Self::CutterRadius, [change]) => applied.cutter_mm = *change,
            (Self::SpindleLine(_) | Self::TiltLine, [ratio, amplitude, phase_deg]) => applied.lines.push(Line {
                ratio: *ratio,
                amplitude: *amplitude,
                phase: phase_deg.to_radians(),
                tilts: self == Self::TiltLine,
            }),
            _ => {}
        }
    }

    /// Change of the surface with each of its parameters at `values`, in nm per unit, `[parameter][point]`. Where passes meet, the
    /// lowest one counts: the change is that of the pass that remains.
    pub(crate) fn partials(self, values: &[f64], cut: &Cut, heights: &Heights, surface: &Surface) -> Vec<Vec<f64>> {
        let count = self.effect().parameters.len();
        let mut columns = vec![Vec::with_capacity(heights.len()); count];
        let mut applied = Applied::none();
        self.apply(values, &mut applied);
        let line = applied.lines.first().map(|line| (*line, PassTurns::of(line.ratio, &surface.pass)));
        for row in &heights.rows {
            let of_row = line.as_ref().map_or(Complex64::ZERO, |(line, _)| Complex64::cis(line.at(0.0, row)));
            for point in row.points.clone() {
                let (pass, beside_mm) = (f64::from(surface.pass[point]), surface.beside_mm[point]);
                let mut add =
                    |values: &[f64]| columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
                // Change of the height with the place of the pass, in nm/mm.
                let moved = || -cut.slope(beside_mm) * row.cosine;
                match self {
                    // µrad times mm is nm.
                    Self::WorkpieceTilt => add(&[heights.x_mm[point], row.y_mm]),
                    Self::TableStraightness => add(&legendre(cut.table_at(pass, row))),
                    Self::SynchronousMotion => add(&cut.across(row)),
                    Self::FeedScale => {
                        let turns = pass + row.angle / TAU;
                        add(&[1e-6 * moved() * cut.declared_mm * turns]);
                    }
                    Self::MapRotation => {
                        let (sine, cosine) = cut.applied.rotation.sin_cos();
                        let turned_mm = cosine * row.y_mm + heights.x_mm[point] * (sine - cosine * row.angle.tan());
                        add(&[1e-6 * moved() * turned_mm]);
                    }
                    // d/dr of √(r² − y²) − r.
                    Self::CutterRadius => {
                        let r = cut.cutter_mm;
                        add(&[moved() * (r / (r * r - row.y_mm * row.y_mm).sqrt() - 1.0)]);
                    }
                    Self::NoseRadius => {
                        let square = beside_mm * beside_mm;
                        let depth_mm = (cut.nose_mm * cut.nose_mm - square).sqrt();
                        // 1 − R/√(R² − d²), without cancellation.
                        add(&[-1e6 * square / (depth_mm * (depth_mm + cut.nose_mm))]);
                    }
                    Self::SpindleLine(_) | Self::TiltLine => {
                        let Some((line, turns)) = &line else { continue };
                        let lever = line.lever(row);
                        let unit = turns.at(surface.pass[point]) * of_row;
                        let turned = -line.amplitude * lever * unit.im;
                        add(&[TAU * (pass + row.angle / TAU) * turned, lever * unit.re, turned.to_radians()]);
                    }
                }
            }
        }
        columns
    }
}

/// Everything that is applied, and the line of each effect that is one.
pub(crate) fn applied(settings: &[Setting]) -> Applied {
    let mut applied = Applied::none();
    for setting in settings {
        if let Some(missing) = MISSING.get(setting.effect) {
            missing.apply(&setting.values, &mut applied);
        }
    }
    applied
}

/// Values of a line with an amplitude that is not negative and a phase within ±180°.
pub(crate) fn tidy([ratio, amplitude, phase_deg]: [f64; 3]) -> [f64; 3] {
    let phase = if amplitude < 0.0 { phase_deg + 180.0 } else { phase_deg };
    [ratio, amplitude.abs(), phase - 360.0 * (phase / 360.0).round()]
}
