//! The separator `rotary-path`: a rotary axis that turns while linear axes follow a ball (ISO 10791-6, tests BK1 to BK4), read by an R-test.
//!
//! | symbol | value |
//! | --- | --- |
//! | `radial`, `tangential`, `axial` | range of the deviation along this direction over the path, of the means of both directions of rotation |
//! | `radial+`, `radial-` … | range of the means of one direction of rotation |
//! | `radial-reversal` … | largest difference of the two directions at one command |
//! | `x`, `y`, `z` and the like | of BK3 and BK4, whose paths are no circle about one axis: along the machine's axes |
//!
//! Radial is away from the rotary axis, axial along it, tangential in its positive direction of rotation, at the commanded place of the ball. The axis runs through the
//! origin of `balls`.

use runout_core::{
    Error, ErrorKind, Result,
    draws::{Draw, MeasuredAgain, Truth, seed},
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{
        PointColumn,
        PointKind::{Label, Number},
        Points,
    },
    stage::{Outcome, PointSeparator, Separator},
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    cells::{Cells, Terms, remarks},
    draws::{Computed, with_uncertainty},
    repeated,
    runs::Approaches,
};

/// `[separate] plugin = "rotary-path"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryPathConfig {
    /// The test, as the standard names it.
    pub test: Test,
    /// The axis whose command is the place on the path: "A", "B" or "C".
    pub axis: RotaryAxis,
    /// Places of the balls at command 0 of the axis, which runs through the origin.
    pub balls: Vec<Ball>,
}

/// A test of ISO 10791-6.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum Test {
    /// A rotary axis and two linear axes: the swivelling one.
    #[serde(rename = "BK1")]
    Bk1,
    /// A rotary axis and two linear axes: the table.
    #[serde(rename = "BK2")]
    Bk2,
    /// A path with more axes.
    #[serde(rename = "BK3")]
    Bk3,
    /// Both rotary axes and all linear axes.
    #[serde(rename = "BK4")]
    Bk4,
}

/// A rotary axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum RotaryAxis {
    /// About X.
    A,
    /// About Y.
    B,
    /// About Z.
    C,
}

/// A ball.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// Its name in the column `ball`.
    pub id: String,
    /// Place at command 0, in mm.
    pub x_mm: f64,
    /// Place at command 0, in mm.
    pub y_mm: f64,
    /// Place at command 0, in mm.
    pub z_mm: f64,
}

impl Test {
    fn name(self) -> &'static str {
        match self {
            Self::Bk1 => "BK1",
            Self::Bk2 => "BK2",
            Self::Bk3 => "BK3",
            Self::Bk4 => "BK4",
        }
    }

    fn is_circle(self) -> bool {
        matches!(self, Self::Bk1 | Self::Bk2)
    }

    fn directions(self) -> [&'static str; 3] {
        if self.is_circle() { ["radial", "tangential", "axial"] } else { ["x", "y", "z"] }
    }
}

impl RotaryAxis {
    fn index(self) -> usize {
        self as usize
    }

    fn command(self) -> &'static str {
        ["a_deg", "b_deg", "c_deg"][self.index()]
    }
}

/// A ball nearer to the axis than this has no radial direction, in mm.
const NEAREST_MM: f64 = 1e-3;

impl Ball {
    /// Unit vectors away from the axis and along its rotation, at command 0, in the plane of the next two axes.
    fn radial(&self, axis: RotaryAxis) -> Option<[f64; 2]> {
        let place = [self.x_mm, self.y_mm, self.z_mm];
        let (first, second) = (place[(axis.index() + 1) % 3], place[(axis.index() + 2) % 3]);
        let radius = first.hypot(second);
        (radius > NEAREST_MM).then(|| [first / radius, second / radius])
    }
}

impl StageConfig for RotaryPathConfig {
    type Stage = Separator;

    const NAME: &'static str = "rotary-path";
    const ABOUT: &'static str = "paths of a rotary axis and linear axes by ISO 10791-6, BK1 to BK4: radial, tangential and axial deviation of an R-test";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if self.balls.is_empty() {
            return Err(Fault::at("balls", "expected at least one ball"));
        }
        for (index, ball) in self.balls.iter().enumerate() {
            if ![ball.x_mm, ball.y_mm, ball.z_mm].iter().all(|place| place.is_finite()) {
                return Err(Fault::at("balls", format!("expected numbers for the place of {}", ball.id)));
            }
            if self.balls[..index].iter().any(|other| other.id == ball.id) {
                return Err(Fault::at("balls", format!("two balls are named {}", ball.id)));
            }
            if self.test.is_circle() && ball.radial(self.axis).is_none() {
                return Err(Fault::at("balls", format!("{} is on the axis: it has no radial direction", ball.id)));
            }
        }
        Ok(Separator::Points(Box::new(RotaryPath(self))))
    }
}

struct RotaryPath(RotaryPathConfig);

/// Deviations of one ball along one direction.
struct BallCourse {
    ball: String,
    direction: &'static str,
    approaches: Approaches,
    cells: Cells,
}

/// Ranges are of means over the passes: what changes from pass to pass is in their uncertainty.
const TERMS: Terms =
    Terms { unit: "um", runs: 2, standard: "an interval", contain: "the ± of the ranges contains it" };
/// Values of positioning that a course has, and their names: of ranges, not of positions.
const NAMES: [(&str, &str, &str); 4] = [
    ("E", "", "range over the path, both directions of rotation"),
    ("E+", "+", "range over the path, positive rotation"),
    ("E-", "-", "range over the path, negative rotation"),
    ("B", "-reversal", "largest difference of the two directions of rotation"),
];

impl RotaryPath {
    fn courses(&self, points: &Points) -> Result<Vec<BallCourse>> {
        let refuse = |problem: String, help: &str| {
            Error::new("evaluate", points.input.display().to_string(), problem)
                .of(ErrorKind::UnsuitableData)
                .help(help.to_owned())
        };
        let labels = points.labels("ball").unwrap_or_default();
        let known = |id: &String| self.0.balls.iter().any(|ball| ball.id == *id);
        if let Some(odd) = labels.iter().find(|id| !known(id)) {
            return Err(refuse(
                format!("the ball `{odd}` is none of `balls`"),
                "name its place at command 0 in `balls`",
            ));
        }
        let command = points.column(self.0.axis.command())?;
        let direction = points.column("direction").ok();
        let measured = [points.column("dx_mm")?, points.column("dy_mm")?, points.column("dz_mm")?];
        let mut courses = Vec::new();
        for ball in &self.0.balls {
            let rows: Vec<usize> = (0..labels.len()).filter(|row| labels[*row] == ball.id).collect();
            if rows.is_empty() {
                continue;
            }
            let pick = |column: &[f64]| -> Vec<f64> { rows.iter().map(|row| column[*row]).collect() };
            let (targets, side) = (pick(command), direction.map(pick));
            for (index, name) in self.0.test.directions().into_iter().enumerate() {
                let deviations: Vec<f64> = rows
                    .iter()
                    .map(|row| 1e3 * self.along(ball, index, command[*row], measured.map(|column| column[*row])))
                    .collect();
                let what = format!("ball {}", ball.id);
                let approaches = Approaches::of_rows(points, &what, &targets, side.as_deref(), &deviations)?;
                let cells = Cells::of(&approaches);
                courses.push(BallCourse { ball: ball.id.clone(), direction: name, approaches, cells });
            }
        }
        if courses.is_empty() {
            return Err(refuse("there is no row of a ball".into(), "each row is a reading of a ball at a command"));
        }
        Ok(courses)
    }

    /// A deviation along a direction of the test.
    fn along(&self, ball: &Ball, direction: usize, command_deg: f64, measured: [f64; 3]) -> f64 {
        let axis = self.0.axis;
        let (true, Some([first, second])) = (self.0.test.is_circle(), ball.radial(axis)) else {
            return measured[direction];
        };
        let (sin, cos) = command_deg.to_radians().sin_cos();
        let radial = [first * cos - second * sin, first * sin + second * cos];
        let (one, two) = (measured[(axis.index() + 1) % 3], measured[(axis.index() + 2) % 3]);
        match direction {
            0 => radial[0] * one + radial[1] * two,
            1 => radial[0] * two - radial[1] * one,
            _ => measured[axis.index()],
        }
    }

    fn table(&self) -> TableSpec {
        let command = self.0.axis.command();
        TableSpec::new(
            "rotary_path",
            "deviation over the path, mean of the passes of each direction of rotation",
            vec![
                ColumnSpec::name("ball", "id of the ball"),
                ColumnSpec::name("component", "direction of the deviation"),
                ColumnSpec::name("direction", "+ positive, - negative rotation"),
                ColumnSpec::number(command, "deg", "command of the axis").repeating(),
                ColumnSpec::number("mean_um", "um", "mean deviation over the passes"),
                ColumnSpec::number("std_um", "um", "standard uncertainty of the mean, from the passes"),
            ],
        )
        .figure(
            Figure::lines("rotary-path", "Path of the axis", command, [Measure::new("mean_um").with_std("std_um")])
                .panels(["ball", "component"])
                .curves(["direction"]),
        )
    }

    fn rows(&self, courses: &[BallCourse]) -> Result<TableRows> {
        let spec = self.table();
        let mut each: Vec<(&BallCourse, usize, usize)> = Vec::new();
        for course in courses {
            for side in 0..course.approaches.sides.len() {
                each.extend((0..course.approaches.targets.len()).map(|target| (course, side, target)));
            }
        }
        let number = |of: &dyn Fn(&BallCourse, usize, usize) -> f64| {
            numbers(each.iter().map(|(course, side, target)| of(course, *side, *target)))
        };
        let rows = spec.rows(vec![
            texts(each.iter().map(|(course, ..)| course.ball.as_str())),
            texts(each.iter().map(|(course, ..)| course.direction)),
            texts(each.iter().map(|(course, side, _)| if course.approaches.sides[*side] > 0 { "+" } else { "-" })),
            number(&|course, _, target| course.approaches.targets[target]),
            number(&|course, side, target| course.cells.mean[target][side]),
            number(&|course, side, target| {
                course.cells.std[target][side] / (course.approaches.deviations[target][side].len() as f64).sqrt()
            }),
        ])?;
        Ok(TableRows { table: spec.name, rows })
    }
}

/// Symbols of all tests.
const SYMBOLS: [&str; 24] = [
    "radial",
    "radial+",
    "radial-",
    "radial-reversal",
    "tangential",
    "tangential+",
    "tangential-",
    "tangential-reversal",
    "axial",
    "axial+",
    "axial-",
    "axial-reversal",
    "x",
    "x+",
    "x-",
    "x-reversal",
    "y",
    "y+",
    "y-",
    "y-reversal",
    "z",
    "z+",
    "z-",
    "z-reversal",
];

impl PointSeparator for RotaryPath {
    fn columns(&self) -> Vec<PointColumn> {
        let place = |name: &'static str, about: &'static str| PointColumn::needed(name, Number, "mm", about).measured();
        vec![
            PointColumn::needed("ball", Label, "", "id of the ball, one of `balls`"),
            PointColumn::needed(self.0.axis.command(), Number, "deg", "command of the axis"),
            place("dx_mm", "actual less nominal place of the ball along the machine's x"),
            place("dy_mm", "actual less nominal place of the ball along the machine's y"),
            place("dz_mm", "actual less nominal place of the ball along the machine's z"),
            PointColumn::optional(
                "direction",
                Number,
                "",
                "1 positive rotation, -1 negative; without it by the row before",
            ),
        ]
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![self.table()]
    }

    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        let of = if self.0.test.is_circle() { &SYMBOLS[..12] } else { &SYMBOLS[12..] };
        of.iter().map(|symbol| (*symbol, "um")).collect()
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let courses = self.courses(points)?;
        let test = self.0.test.name();
        let (mut values, mut said, mut checks) = (Vec::new(), Vec::new(), Vec::new());
        for course in &courses {
            let (approaches, cells) = (&course.approaches, &course.cells);
            let noise = approaches.noise();
            let least = cells.levelled(&noise, approaches.targets.len());
            let all = cells.values(&approaches.sides);
            let used: Vec<(usize, &(&str, &str, &str))> = NAMES
                .iter()
                .filter_map(|name| Some((all.iter().position(|(symbol, ..)| symbol == name.0)?, name)))
                .collect();
            let computed: Vec<Computed> = used
                .iter()
                .map(|(at, (known, end, about))| Computed {
                    symbol: format!("{}{end}", course.direction),
                    value: all[*at].1,
                    about,
                    is_key: *known == "E" || approaches.sides.len() == 1,
                    least: 0.0,
                })
                .collect();
            let measure = |truth: Truth, draw: &mut Draw| {
                let cells = cells.may_be(truth, &least, &noise, draw);
                let all = cells.again(approaches, &noise, 0.0, draw);
                let [truth, error] = [all.truth, all.error].map(|all| used.iter().map(|(at, _)| all[*at]).collect());
                MeasuredAgain { truth, error }
            };
            let seed = seed(&["rotary-path", test, &course.ball, course.direction]);
            let found = with_uncertainty(&computed, "um", seed, measure);
            values.extend(found.into_iter().map(|mut value| {
                if noise.copies {
                    value.uncertainty = None;
                }
                value.source = format!("{} of the {} deviation (ISO 10791-6, {test})", value.source, course.direction);
                value.of(&course.ball)
            }));
            let of = format!("{} {}", course.ball, course.direction);
            let found = remarks(approaches, &noise, &TERMS);
            said.extend(found.into_iter().map(|remark| format!("{of}: {remark}")));
            let found = repeated::approaches(approaches, &noise.along, ["°", "µm"]);
            checks.extend(found.into_iter().map(|check| check.within(&of)));
        }
        let outcome = Outcome {
            convention: format!(
                "{test}: deviation is actual less nominal place of the ball; radial is away from the axis, tangential along its positive rotation; + is positive rotation"
            ),
            tables: vec![self.rows(&courses)?],
            values,
            checks,
            remarks: said,
            ..Outcome::default()
        };
        Ok(outcome.refuted())
    }
}
