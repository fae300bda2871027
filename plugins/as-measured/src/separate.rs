//! The separator `as-measured`.

use runout_core::{
    Result,
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{
        PointColumn,
        PointKind::{Number, Trace, TraceKind},
        Points,
    },
    stage::{EvaluableKind, Outcome, PointSeparator, Separator, residual_table},
    surface::Surface,
    table::TableSpec,
};

use crate::{
    config::{AsMeasuredConfig, Object},
    map, profile, stages, wall,
};

/// Points as they were measured.
#[derive(Debug, Clone)]
pub struct AsMeasured(AsMeasuredConfig);

impl AsMeasuredConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn separator(self) -> std::result::Result<AsMeasured, Fault> {
        self.checked()?;
        Ok(AsMeasured(self))
    }
}

impl StageConfig for AsMeasuredConfig {
    type Stage = Separator;

    const NAME: &'static str = "as-measured";
    const ABOUT: &'static str =
        "nothing is separated: values of a height map, a profile, a circle or a cylinder as measured";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.separator()?)))
    }
}

const MAP: [PointColumn; 3] = [
    PointColumn::needed("x_mm", Number, "mm", "place along the rows"),
    PointColumn::needed("y_mm", Number, "mm", "place from row to row"),
    PointColumn::needed("height_nm", Number, "nm", "height, out of the material positive"),
];

const PROFILE: [PointColumn; 4] = [
    PointColumn::needed("x_mm", Number, "mm", "place along the profile"),
    PointColumn::needed("height_nm", Number, "nm", "height, out of the material positive"),
    PointColumn::optional("y_mm", Number, "mm", "place across the profile, the same for all points"),
    PointColumn::optional("std_nm", Number, "nm", "standard uncertainty of a height"),
];

const WALL: [PointColumn; 6] = [
    PointColumn::needed("angle_deg", Number, "deg", "angle about the axis"),
    PointColumn::optional("radius_mm", Number, "mm", "distance from the axis; or deviation_um").measured(),
    PointColumn::optional("deviation_um", Number, "um", "distance from the axis less the nominal radius").measured(),
    PointColumn::optional("z_mm", Number, "mm", "height along the axis"),
    PointColumn::optional("trace", Trace, "", "name of the circle, whose points follow one another"),
    PointColumn::optional("kind", TraceKind, "", "what the trace runs along: circle, helix, generatrix"),
];

impl PointSeparator for AsMeasured {
    fn columns(&self) -> Vec<PointColumn> {
        match self.0.object {
            Object::HeightMap => MAP.into(),
            Object::Profile => PROFILE.into(),
            Object::Roundness | Object::Cylinder => WALL.into(),
        }
    }

    fn tables(&self) -> Vec<TableSpec> {
        match self.0.object {
            Object::HeightMap => vec![map::table(), stages::table(), stages::filling_table()],
            Object::Profile => vec![profile::table(), stages::table()],
            Object::Roundness | Object::Cylinder => vec![residual_table("um").optional()],
        }
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        match self.0.object {
            Object::HeightMap => map::outcome(points, &self.0),
            Object::Profile => profile::outcome(points, &self.0),
            Object::Roundness | Object::Cylinder => {
                let (placed, separator) = wall::circles(points, &self.0)?;
                separator.separate(&placed)
            }
        }
    }

    fn evaluables(&self) -> Vec<EvaluableKind> {
        match self.0.object {
            Object::HeightMap => vec![EvaluableKind::HeightMap],
            Object::Profile => vec![EvaluableKind::OpenProfile],
            Object::Roundness => vec![EvaluableKind::ClosedProfiles],
            Object::Cylinder => vec![EvaluableKind::ClosedProfiles, EvaluableKind::OpenProfile],
        }
    }

    fn is_one_section(&self) -> bool {
        self.0.object == Object::Roundness
    }

    fn is_for_areal_values(&self) -> bool {
        self.0.object == Object::HeightMap
    }

    fn needs_surface(&self) -> bool {
        self.0.object == Object::Cylinder
    }

    fn remarks(&self, points: &Points, surface: Option<&Surface>) -> Result<Vec<String>> {
        if matches!(self.0.object, Object::HeightMap | Object::Profile) {
            return Ok(Vec::new());
        }
        let (placed, separator) = wall::circles(points, &self.0)?;
        separator.remarks(&placed, surface)
    }

    fn notes(&self) -> Vec<String> {
        let of = match self.0.object {
            Object::HeightMap | Object::Profile => {
                "errors of the instrument, of its reference and of its lateral scales"
            }
            Object::Roundness | Object::Cylinder => "error motion of the spindle or the machine that measured",
        };
        vec![format!("nothing is separated: {of} are in the values, and in no ±")]
    }
}
