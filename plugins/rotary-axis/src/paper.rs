//! The methods of a paper, for comparison with the weighted fit: *Identification of rotary-axis geometric errors of a dual five-axis
//! milling machine based on R-test*.
//!
//! `rotary-axis-circle-fit`: a circle through the track of one ball gives the offsets, a plane through its height the tilts.
//! `rotary-axis-three-point`: at each command the six readings P1 x, y, z, P2 x, y and P3 x give six errors.

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};
use runout_core::{
    Error, ErrorKind, Result,
    fault::{Fault, known_names},
    numerics::least_squares::least_norm,
    pipeline::{Context, StageConfig},
    points::{PointColumn, Points},
    stage::{Outcome, PointSeparator, Separator},
    table::{TableRows, TableSpec, numbers, numbers_or_null},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    axis::Axis,
    campaign::{Campaign, columns},
    config::{Ball, RotaryAxisConfig},
    kinematics::turn,
    noise::Noise,
    separate::{location_values, machine_order},
    solve::{Estimate, GAUGE, gauge},
    tables::component_table,
};

/// `[separate] plugin = "rotary-axis-circle-fit"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CircleFitConfig {
    /// The rotary axis. Its command is the column `a_deg`, `b_deg` or `c_deg`.
    #[serde(default)]
    pub axis: Axis,
    /// The balls, in the table's frame. The nominal axis runs through the origin.
    pub balls: Vec<Ball>,
    /// The ball whose track is taken; the first without it.
    #[serde(default)]
    pub ball: Option<String>,
    /// Standard uncertainty of one coordinate of one row, in µm.
    #[serde(default)]
    pub std_um: Option<f64>,
}

/// `[separate] plugin = "rotary-axis-three-point"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThreePointConfig {
    /// The rotary axis. Its command is the column `a_deg`, `b_deg` or `c_deg`.
    #[serde(default)]
    pub axis: Axis,
    /// The balls, in the table's frame, of which the first gives three readings at a command, the second two and the third one.
    pub balls: Vec<Ball>,
    /// Standard uncertainty of one coordinate of one row, in µm.
    #[serde(default)]
    pub std_um: Option<f64>,
}

/// A triple whose six equations have a smaller singular value than this beside the largest, angles times lever arm, gives nothing.
const SINGULAR: f64 = 1e-3;

fn common(axis: Axis, balls: &[Ball], std_um: Option<f64>) -> std::result::Result<RotaryAxisConfig, Fault> {
    let config = RotaryAxisConfig {
        axis,
        balls: balls.to_vec(),
        std_um,
        component_errors: true,
        tool_points: Vec::new(),
        curves: None,
    };
    config.separator().map(|checked| checked.0)
}

impl StageConfig for CircleFitConfig {
    type Stage = Separator;

    const NAME: &'static str = "rotary-axis-circle-fit";
    const ABOUT: &'static str = "location errors of a rotary axis from one ball, by a circle and a plane";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let config = common(self.axis, &self.balls, self.std_um)?;
        let ball = match &self.ball {
            None => 0,
            Some(id) => self.balls.iter().position(|ball| ball.id == *id).ok_or_else(|| {
                let known = self.balls.iter().map(|ball| ball.id.as_str());
                Fault::at("ball", format!("`balls` has no ball `{id}`")).help(known_names(id, known))
            })?,
        };
        Ok(Separator::Points(Box::new(CircleFit { config, ball })))
    }
}

impl StageConfig for ThreePointConfig {
    type Stage = Separator;

    const NAME: &'static str = "rotary-axis-three-point";
    const ABOUT: &'static str =
        "location and component errors of a rotary axis from six readings of three balls a command";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let config = common(self.axis, &self.balls, self.std_um)?;
        if self.balls.len() != 3 {
            return Err(Fault::at("balls", format!("expected three balls, found {}", self.balls.len())));
        }
        Ok(Separator::Points(Box::new(ThreePoint(config))))
    }
}

#[derive(Debug)]
struct CircleFit {
    config: RotaryAxisConfig,
    ball: usize,
}

impl PointSeparator for CircleFit {
    fn columns(&self) -> Vec<PointColumn> {
        columns(self.config.axis)
    }

    fn tables(&self) -> Vec<TableSpec> {
        Vec::new()
    }

    /// The track (x, y) = R(φ)·p + reading lies on a circle about the axis at the ball's height. Its height is
    /// z = z₀ + θx·y − θy·x, over the lever arm.
    fn separate(&self, points: &Points) -> Result<Outcome> {
        let campaign = Campaign::of(&self.config, points)?;
        let id = &self.config.balls[self.ball].id;
        let refuse = |problem: String| {
            Error::new("fit", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData)
        };
        let Some(ball) = campaign.balls.iter().position(|known| known == id) else {
            return Err(refuse(format!("no point is of {id}")));
        };
        let track: Vec<(Vector3<f64>, f64)> = campaign
            .readings
            .iter()
            .filter(|reading| reading.ball == ball)
            .map(|reading| {
                let nominal = turn(campaign.layout.phi[reading.command]) * campaign.layout.balls[ball];
                (nominal + reading.value, reading.std)
            })
            .collect();
        let failure = || refuse(format!("the track of {id} determines no circle: measure it around the turn"));
        let (circle, circle_covariance, circle_left) = circle(&track).ok_or_else(failure)?;
        let rows = |(place, std): &(Vector3<f64>, f64)| (Vector3::new(1.0, place.x, place.y) / *std, place.z / std);
        let (plane, plane_covariance, plane_left) = least_squares(track.iter().map(rows)).ok_or_else(failure)?;
        let dof = 2 * track.len() - 6;
        let left = (circle_left + plane_left) / dof.max(1) as f64;
        let known = campaign.noise != Noise::Unknown;
        let factor = if known { left.max(1.0) } else { left }.sqrt();
        let height = plane.x;
        let (tilt_x, tilt_y) = (plane.z, -plane.y);
        let estimate = |value: f64, variance: f64| Estimate { value, std: factor * variance.sqrt() };
        let location = [
            estimate(
                circle.x - tilt_y * height,
                circle_covariance[(0, 0)] + height * height * plane_covariance[(1, 1)],
            ),
            estimate(
                circle.y + tilt_x * height,
                circle_covariance[(1, 1)] + height * height * plane_covariance[(2, 2)],
            ),
            estimate(tilt_x, plane_covariance[(2, 2)]),
            estimate(tilt_y, plane_covariance[(1, 1)]),
        ];
        let notes =
            vec![format!("only {id} is used; component errors are taken as absent, and go into the location errors")];
        Ok(Outcome {
            values: location_values(self.config.axis, location),
            remarks: campaign.warnings,
            notes,
            ..Outcome::default()
        })
    }
}

/// Rows a·x = b of weight 1: x, its covariance, and the sum of squares left.
fn least_squares(rows: impl Iterator<Item = (Vector3<f64>, f64)> + Clone) -> Option<(Vector3<f64>, Matrix3<f64>, f64)> {
    let (mut columns, mut right) = (vec![Vec::new(); 3], Vec::new());
    for (row, value) in rows {
        columns.iter_mut().zip(&row).for_each(|(column, entry)| column.push(*entry));
        right.push(value);
    }
    if right.len() < 3 {
        return None;
    }
    let found = least_norm(&columns, &right, SINGULAR);
    if found.lost.contains(&true) {
        return None;
    }
    let solution = Vector3::from_column_slice(&found.coefficients);
    let covariance = Matrix3::from_fn(|row, column| found.covariance[(row, column)]);
    let left = found.residual.iter().map(|value| value * value).sum();
    Some((solution, covariance, left))
}

/// Centre and radius of the least-squares circle: distances from it, weighted, by Gauss-Newton from the algebraic circle (Kåsa).
fn circle(track: &[(Vector3<f64>, f64)]) -> Option<(Vector3<f64>, Matrix3<f64>, f64)> {
    let algebraic = track.iter().map(|(place, _)| {
        let square = place.x * place.x + place.y * place.y;
        (Vector3::new(2.0 * place.x, 2.0 * place.y, 1.0), square)
    });
    let (start, ..) = least_squares(algebraic)?;
    let mut found = Vector3::new(start.x, start.y, (start.z + start.x.powi(2) + start.y.powi(2)).sqrt());
    let mut last = None;
    for _ in 0..20 {
        let at = found;
        let rows = track.iter().map(move |(place, std)| {
            let (x, y) = (place.x - at.x, place.y - at.y);
            let distance = x.hypot(y);
            (Vector3::new(x / distance, y / distance, 1.0) / *std, (distance - at.z) / std)
        });
        let (step, covariance, left) = least_squares(rows)?;
        found += step;
        last = Some((found, covariance, left));
        if step.norm() < 1e-10 {
            break;
        }
    }
    last.filter(|(found, ..)| found.iter().all(|entry| entry.is_finite()))
}

#[derive(Debug)]
struct ThreePoint(RotaryAxisConfig);

/// Readings that are used: ball and coordinate.
const TRIPLE: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0)];

impl PointSeparator for ThreePoint {
    fn columns(&self) -> Vec<PointColumn> {
        columns(self.0.axis)
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![component_table(self.0.axis)]
    }

    fn notes(&self) -> Vec<String> {
        vec!["how the balls were placed is taken as nominal; three of nine readings a command are not used".into()]
    }

    /// At each command six readings, each the mean of its repeats, are d + ε × R(φ)·p. Location errors are the means over the
    /// distinct commands, component errors what is left, without what turns with the table.
    fn separate(&self, points: &Points) -> Result<Outcome> {
        let campaign = Campaign::of(&self.0, points)?;
        let refuse = |problem: String| {
            Error::new("fit", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData)
        };
        let [first, second, third] =
            [0, 1, 2].map(|ball| campaign.balls.iter().position(|known| *known == self.0.balls[ball].id));
        let (Some(first), Some(second), Some(third)) = (first, second, third) else {
            return Err(refuse("three balls are needed".into()));
        };
        let balls = [first, second, third];
        let commands = campaign.commands_deg.len();
        let (mut errors, mut covariances) = (Vec::new(), Vec::new());
        for command in 0..commands {
            let found = six(&campaign, balls, command).ok_or_else(|| {
                let deg = campaign.commands_deg[command];
                refuse(format!(
                    "{} = {deg}° lacks one of the six readings, or they determine no six errors",
                    self.0.axis.letter()
                ))
            })?;
            errors.push(found.0);
            covariances.push(found.1);
        }
        let patterns: Vec<SMatrix<f64, GAUGE, 6>> =
            campaign.layout.phi.iter().map(|phi| SMatrix::from_column_slice(gauge(*phi).as_slice())).collect();
        let normal: SMatrix<f64, GAUGE, GAUGE> = patterns.iter().map(|pattern| pattern * pattern.transpose()).sum();
        let inverse = normal.try_inverse().ok_or_else(|| refuse("the commands are too few".into()))?;
        let sum: SMatrix<f64, GAUGE, 1> = patterns.iter().zip(&errors).map(|(pattern, errors)| pattern * errors).sum();
        let spread: SMatrix<f64, GAUGE, GAUGE> =
            patterns.iter().zip(&covariances).map(|(pattern, own)| pattern * own * pattern.transpose()).sum();
        let coefficients = inverse * sum;
        let covariance = inverse * spread * inverse.transpose();
        let known = campaign.noise != Noise::Unknown;
        let std = |variance: f64| if known { variance.max(0.0).sqrt() } else { f64::NAN };
        let location =
            [0, 1, 3, 4].map(|index| Estimate { value: coefficients[index], std: std(covariance[(index, index)]) });
        let mut cells: Vec<Vec<Option<f64>>> = vec![Vec::new(); 12];
        for command in 0..commands {
            let pattern = &patterns[command];
            let left = errors[command] - pattern.transpose() * coefficients;
            let own: Matrix6<f64> = covariances[command];
            let crossed = own * pattern.transpose() * inverse * pattern;
            let variance = own - crossed - crossed.transpose() + pattern.transpose() * covariance * pattern;
            let at =
                [0, 1, 2, 3, 4, 5].map(|index| Estimate { value: left[index], std: std(variance[(index, index)]) });
            for (index, one) in machine_order(self.0.axis, at).into_iter().enumerate() {
                let unit = if index < 3 { 1e3 } else { 1e6 };
                cells[index].push(Some(unit * one.value));
                cells[6 + index].push(one.std.is_finite().then_some(unit * one.std));
            }
        }
        let spec = component_table(self.0.axis);
        let mut arrays = vec![numbers(campaign.commands_deg.iter().copied())];
        arrays.extend(cells.into_iter().map(numbers_or_null));
        let tables = vec![TableRows { rows: spec.rows(arrays)?, table: spec.name }];
        Ok(Outcome {
            values: location_values(self.0.axis, location),
            tables,
            remarks: campaign.warnings,
            notes: vec!["placement of the balls is taken as nominal: what it adds goes into the errors".into()],
            ..Outcome::default()
        })
    }
}

/// Six errors at a command (mm, rad) with their covariance.
fn six(campaign: &Campaign, balls: [usize; 3], command: usize) -> Option<(Vector6<f64>, Matrix6<f64>)> {
    let table = turn(campaign.layout.phi[command]);
    let lever = campaign.layout.balls.iter().map(Vector3::norm).fold(1.0, f64::max);
    let mut matrix = Matrix6::zeros();
    let mut right = Vector6::zeros();
    let mut variance = Matrix6::zeros();
    for (row, (ball, coordinate)) in TRIPLE.into_iter().enumerate() {
        let ball = balls[ball];
        let of_ball = campaign.readings.iter().filter(|reading| reading.command == command && reading.ball == ball);
        let (sum, squares, count) = of_ball.fold((0.0, 0.0, 0.0), |(sum, squares, count), reading| {
            (sum + reading.value[coordinate], squares + reading.std.powi(2), count + 1.0)
        });
        if count == 0.0 {
            return None;
        }
        right[row] = sum / count;
        variance[(row, row)] = squares / (count * count);
        // ε × r = −[r]× ε.
        let arm = -(table * campaign.layout.balls[ball]).cross_matrix() / lever;
        matrix[(row, coordinate)] = 1.0;
        matrix.fixed_view_mut::<1, 3>(row, 3).copy_from(&arm.row(coordinate));
    }
    let singular = matrix.singular_values();
    if singular.min() < SINGULAR * singular.max() {
        return None;
    }
    let mut inverse = matrix.try_inverse()?;
    for row in 3..6 {
        let mut angle = inverse.row_mut(row);
        angle /= lever;
    }
    Some((inverse * right, inverse * variance * inverse.transpose()))
}
