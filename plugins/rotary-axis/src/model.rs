//! The separator `r-test`: a model of an R-test on the C axis for the closed loop.
//!
//! How the axis stands (two offsets and two errors of perpendicularity, E_X0C, E_Y0C, E_A0C and E_B0C of ISO 230-7) and how the
//! ball stands on the table move the ball by a level and one harmonic of C in each coordinate:
//!
//! d_j(C) = d_j0 + a_j cos C + b_j sin C,  j = x, y, z.
//!
//! Higher harmonics are error motions of the axis at the ball: radial and axial motion, and the three angles times the ball's lever arms. One
//! ball does not separate these, so that no error motion value of the axis follows.

use runout_core::{
    Error, Result,
    closed_loop::{
        Effect, Fit, Parameter, Remainder,
        linear_terms::{Declared, LinearFit, LinearTerms, Observations, Term},
    },
    fault::{Fault, within},
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    stage::{LinearModel, Outcome, PointModel, PointSeparator, Separator, residual_table, separate_declared},
    summary::Value,
    table::TableSpec,
};
use schemars::JsonSchema;
use serde::Deserialize;

/// `[separate] plugin = "r-test"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RTestConfig {
    /// Standard uncertainty of one coordinate of one point, in µm.
    pub std_um: f64,
    /// Only points at this command of the A axis are used: the A axis stands otherwise at another.
    pub a_deg: f64,
    /// Highest harmonic of C that may be in the error motion.
    #[serde(default = "default_max_order")]
    pub max_order: usize,
}

fn default_max_order() -> usize {
    3
}

const HIGHEST_ORDER: usize = 50;
/// Commands closer than this are the same, in degrees: half the last digit of most controls.
const SAME_COMMAND_DEG: f64 = 5e-4;
/// Fewer points a coordinate are few: two for each parameter of three harmonics.
const FEW_POINTS: usize = 14;

impl StageConfig for RTestConfig {
    type Stage = Separator;

    const NAME: &'static str = "r-test";
    const ABOUT: &'static str = "installation and harmonics of a C axis by an R-test";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.model()?)))
    }
}

impl RTestConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn model(self) -> std::result::Result<RTest, Fault> {
        if !(self.std_um.is_finite() && self.std_um > 0.0) {
            return Err(Fault::at("std_um", format!("the uncertainty must be above 0 µm, found {}", self.std_um)));
        }
        if !self.a_deg.is_finite() {
            return Err(Fault::at("a_deg", format!("expected an angle, found {}", self.a_deg)));
        }
        within("max_order", "an order", self.max_order, 2..=HIGHEST_ORDER)?;
        Ok(RTest(self))
    }
}

/// The installation of the C axis, and what may be missing.
#[derive(Debug, Clone)]
pub struct RTest(RTestConfig);

const COORDINATES: [(&str, &str); 3] = [("x", "dx_mm"), ("y", "dy_mm"), ("z", "dz_mm")];

impl RTest {
    /// C commands of the points used, with their places in the file.
    fn used(&self, points: &Points) -> Result<Vec<(usize, f64)>> {
        let at = |a: &f64| (a - self.0.a_deg).abs() < SAME_COMMAND_DEG;
        let both = points.column("a_deg")?.iter().zip(points.column("c_deg")?).enumerate();
        let used: Vec<_> = both.filter(|(_, (a, _))| at(a)).map(|(index, (_, c))| (index, *c)).collect();
        if used.is_empty() {
            let problem = format!("no point is at A = {}°", self.0.a_deg);
            let help = "`a_deg` names the command of the A axis whose points are used";
            return Err(Error::new("fit", points.input.display().to_string(), problem).help(help));
        }
        Ok(used)
    }
}

const COLUMNS: [PointColumn; 5] = [
    PointColumn::needed("a_deg", Number, "deg", "command of the A axis"),
    PointColumn::needed("c_deg", Number, "deg", "command of the C axis"),
    PointColumn::needed("dx_mm", Number, "mm", "actual less nominal place of the ball along x").measured(),
    PointColumn::needed("dy_mm", Number, "mm", "actual less nominal place of the ball along y").measured(),
    PointColumn::needed("dz_mm", Number, "mm", "actual less nominal place of the ball along z").measured(),
];

impl PointSeparator for RTest {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![residual_table("um")]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        separate_declared(self, points)
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl LinearModel for RTest {
    fn candidates(&self) -> Vec<Effect> {
        let harmonic = |order: usize| {
            let names = COORDINATES.iter().flat_map(|(name, _)| [format!("{name}_cosine"), format!("{name}_sine")]);
            let parameters = names.map(|name| Parameter { name, unit: "um".into(), tolerance: 10.0 }).collect();
            Effect { id: format!("harmonic-{order}"), targets: Vec::new(), parameters }
        };
        let drift = COORDINATES.map(|(name, _)| Parameter { name: name.into(), unit: "um".into(), tolerance: 5.0 });
        let drift = Effect { id: "thermal-drift".into(), targets: Vec::new(), parameters: drift.into() };
        (2..=self.0.max_order).map(harmonic).chain([drift]).collect()
    }

    fn terms(&self, points: &Points) -> Result<LinearTerms> {
        let used = self.used(points)?;
        let count = used.len();
        let mut values = Vec::with_capacity(3 * count);
        for (_, name) in COORDINATES {
            let column = points.column(name)?;
            values.extend(used.iter().filter_map(|(index, _)| column.get(*index)).map(|millimetres| 1e3 * millimetres));
        }
        // Coordinate by coordinate: a wave of C in one of them.
        let wave = |coordinate: usize, order: usize, function: fn(f64) -> f64| -> Vec<f64> {
            let mut column = vec![0.0; 3 * count];
            let places = column.iter_mut().skip(coordinate * count);
            places.zip(&used).for_each(|(entry, (_, c))| *entry = function(order as f64 * c.to_radians()));
            column
        };
        let declared = COORDINATES.iter().enumerate().flat_map(|(coordinate, (name, _))| {
            let one = |what: &str, order, function| {
                let column = wave(coordinate, order, function);
                Declared { name: format!("{name} {what}"), unit: "um".into(), column }
            };
            [one("level", 0, f64::cos), one("cos C", 1, f64::cos), one("sin C", 1, f64::sin)]
        });
        // From the first point to the last one, in the order of the file.
        let course = |coordinate: usize| -> Vec<f64> {
            let share = |point: usize| point as f64 / (count.max(2) - 1) as f64;
            (0..3 * count).map(|row| if row / count == coordinate { share(row % count) } else { 0.0 }).collect()
        };
        let terms = (2..).zip(self.candidates()).map(|(order, effect)| {
            let columns: Vec<Vec<f64>> = if order > self.0.max_order {
                (0..3).map(course).collect()
            } else {
                let waves = |coordinate| [wave(coordinate, order, f64::cos), wave(coordinate, order, f64::sin)];
                (0..3).flat_map(waves).collect()
            };
            Term { effect, columns, rank: 0 }
        });
        let observations = Observations {
            values,
            unit: "um".into(),
            std: Some(self.0.std_um),
            group: (0..3).flat_map(|_| 0..count).collect(),
            groups: used.iter().map(|(_, c)| format!("C = {c}°")).collect(),
            ..Observations::default()
        };
        let object = points.input.display();
        let model = LinearTerms::new(observations, declared.collect(), terms.collect())
            .map_err(|error| Error::caused("fit the installation to", object.to_string(), error))?;
        let highest = self.0.max_order;
        Ok(model.ending_at(format!("harmonic-{highest}"), format!("`separate.max_order` is {highest}")))
    }

    fn outcome(&self, points: &Points, fit: &LinearFit) -> Result<Outcome> {
        let used = self.used(points)?;
        let Remainder { rms, dof, held_out_rms, .. } = fit.remainder();
        let all = points.column("a_deg")?.len();
        let mut remarks = vec![format!("{} of {all} points are used, those at A = {}°", used.len(), self.0.a_deg)];
        let [low, high] =
            used.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, c)| [low.min(*c), high.max(*c)]);
        if used.len() < FEW_POINTS {
            remarks.push(format!(
                "{} points a coordinate (C = {low}° to {high}°) are few: too few degrees of freedom ({dof}) to test the stated \
                 noise of {} µm by the residual of {rms:.2} µm rms",
                used.len(),
                self.0.std_um
            ));
        }
        if *held_out_rms > 2.0 * self.0.std_um {
            let why = if used.len() < FEW_POINTS {
                "with the others alone its place is mostly extrapolated, so leaving out compares models here but does not \
                 confirm one"
            } else {
                "the model lacks something, the stated uncertainty is too small, or a column has another unit than its name"
            };
            remarks.push(format!(
                "a point left out is predicted to {held_out_rms:.1} µm rms only, {:.1} times the stated uncertainty: {why}",
                held_out_rms / self.0.std_um
            ));
        }
        let about = "level or first harmonic of C of the ball's deviation: installation of the axis and of the ball";
        let values = fit
            .values()
            .into_iter()
            .map(|found| Value::new(&found.value, found.number, found.std, &found.unit, about).key());
        let convention = "actual less nominal place of the ball, in machine coordinates".into();
        Ok(Outcome { convention, values: values.collect(), remarks, ..Outcome::default() })
    }
}
