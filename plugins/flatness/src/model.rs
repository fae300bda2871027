//! The separator `flatness`: heights of a plate from slopes along lines (Moody, *How to calibrate surface plates in the plant*, The Tool
//! Engineer, October 1955), by least squares over all lines together.
//!
//! A reading of a carriage of length L is (z_front − z_rear)/L + the zero of its line. Where lines cross they have one height: that is what
//! makes readings redundant. Moody distributes closing errors along the centre lines; here all readings count alike.

use runout_core::{
    Result,
    closed_loop::{
        Effect, Parameter,
        linear_terms::{Declared, LinearFit, LinearTerms, Observations, Term},
    },
    consistency::{Kind, Structure},
    draws::{Draw, MeasuredAgain, Truth, measured_again, seed, without_noise},
    fault::Fault,
    numerics::least_squares::dot,
    pipeline::{Context, StageConfig},
    points::{
        PointColumn,
        PointKind::{Label, Number},
        Points,
    },
    stage::{LinearModel, Outcome, PointModel, PointSeparator, Separator, residual_table, separate_declared},
    summary::Value,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    nodes::{Steps, refuse},
    values::{SYMBOLS, flatness, plane},
};

/// `[separate] plugin = "flatness"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlatnessConfig {
    /// Standard uncertainty of one reading, in µrad; without it, what the lines leave where they cross shows it.
    #[serde(default)]
    pub std_urad: Option<f64>,
}

impl StageConfig for FlatnessConfig {
    type Stage = Separator;

    const NAME: &'static str = "flatness";
    const ABOUT: &'static str =
        "flatness of a surface plate from slopes along lines that cross (Moody), by an autocollimator or a level";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        match self.std_urad {
            Some(std) if !(std.is_finite() && std > 0.0) => {
                Err(Fault::at("std_urad", format!("the uncertainty must be above 0 µrad, found {std}")))
            }
            _ => Ok(Separator::Points(Box::new(Flatness(self)))),
        }
    }
}

/// The heights of a plate.
#[derive(Debug, Clone)]
pub struct Flatness(FlatnessConfig);

const COLUMNS: [PointColumn; 6] = [
    PointColumn::needed("line", Label, "", "id of the line: each has a zero of its own"),
    PointColumn::needed("from_x_mm", Number, "mm", "place of the rear foot"),
    PointColumn::needed("from_y_mm", Number, "mm", "place of the rear foot"),
    PointColumn::needed("to_x_mm", Number, "mm", "place of the front foot"),
    PointColumn::needed("to_y_mm", Number, "mm", "place of the front foot"),
    PointColumn::needed("slope_urad", Number, "urad", "reading; + where the front foot is higher").measured(),
];

/// The table of heights.
fn table() -> TableSpec {
    TableSpec::new(
        "flatness",
        "heights above the least-squares plane, at the feet along each line",
        vec![
            ColumnSpec::name("line", "id of the line"),
            ColumnSpec::number("along_mm", "mm", "distance along the line, in the direction of the carriage")
                .repeating(),
            ColumnSpec::number("x_mm", "mm", "place"),
            ColumnSpec::number("y_mm", "mm", "place"),
            ColumnSpec::number("height_um", "um", "height above the least-squares plane"),
            ColumnSpec::number("std_height_um", "um", "its standard uncertainty"),
        ],
    )
    .figure(
        Figure::lines("flatness", "Flatness", "along_mm", [Measure::new("height_um").with_std("std_height_um")])
            .curves(["line"]),
    )
}

impl PointSeparator for Flatness {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![table(), residual_table("urad")]
    }

    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        SYMBOLS[..4].iter().map(|(symbol, ..)| (*symbol, "um")).collect()
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        separate_declared(self, points)
    }

    fn notes(&self) -> Vec<String> {
        vec!["a plane, and a gain of the instrument, are not observable: heights have its scale".into()]
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

/// What is fitted: heights of the nodes but three, and the zero of each line.
fn declared(steps: &Steps, datum: [usize; 3]) -> (Vec<usize>, Vec<Declared>) {
    let free: Vec<usize> = (0..steps.nodes_mm.len()).filter(|node| !datum.contains(node)).collect();
    let height = |node: &usize| {
        let entry = |(feet, length): (&[usize; 2], &f64)| {
            let share = |foot: usize| if feet[foot] == *node { 1e3 / length } else { 0.0 };
            share(1) - share(0)
        };
        let [x, y] = steps.nodes_mm[*node];
        let column = steps.feet.iter().zip(&steps.length_mm).map(entry).collect();
        Declared { name: format!("height at x {x} mm, y {y} mm"), unit: "um".into(), column }
    };
    let zero = |(line, name): (usize, &String)| {
        let column = steps.line.iter().map(|own| f64::from(u8::from(*own == line))).collect();
        Declared { name: format!("zero of line {name}"), unit: "urad".into(), column }
    };
    let all = free.iter().map(height).chain(steps.lines.iter().enumerate().map(zero)).collect();
    (free, all)
}

impl LinearModel for Flatness {
    fn candidates(&self) -> Vec<Effect> {
        let parameter = Parameter { name: "drift".into(), unit: "urad".into(), tolerance: 0.1 };
        vec![Effect { id: "reading-drift".into(), targets: Vec::new(), parameters: vec![parameter] }]
    }

    fn terms(&self, points: &Points) -> Result<LinearTerms> {
        let steps = Steps::of(points)?;
        let (_, declared) = declared(&steps, steps.datum(points)?);
        if steps.slope_urad.len() <= declared.len() {
            let problem = format!("{} readings for {} heights and zeros", steps.slope_urad.len(), declared.len());
            return Err(refuse(points, problem)
                .help("lines have to cross at common places: diagonals, edges and centre lines (Moody)"));
        }
        let term = |effect: Effect| Term { effect, columns: vec![steps.drift()], rank: 0 };
        let rows = steps.line.iter().zip(&steps.step);
        let names = rows.map(|(line, step)| format!("step {} of line {}", step + 1, steps.lines[*line])).collect();
        let observations = Observations {
            values: steps.slope_urad.clone(),
            unit: "urad".into(),
            std: self.0.std_urad,
            // A line that is left out has no zero: steps are.
            group: steps.step.clone(),
            groups: (0..=steps.step.iter().copied().max().unwrap_or(0))
                .map(|step| format!("step {}", step + 1))
                .collect(),
            structure: Structure::default()
                .divided("lines", Kind::Blocks, steps.line.clone(), steps.lines.clone())
                .along("the line", steps.line.clone(), steps.step.iter().map(|step| *step as f64).collect())
                .naming(names),
            ..Observations::default()
        };
        LinearTerms::new(observations, declared, self.candidates().into_iter().map(term).collect())
            .map_err(|error| runout_core::Error::caused("fit heights to", points.input.display().to_string(), error))
    }

    fn outcome(&self, points: &Points, fit: &LinearFit) -> Result<Outcome> {
        let steps = Steps::of(points)?;
        let (free, _) = declared(&steps, steps.datum(points)?);
        // Heights beside an effect that is fitted are less certain.
        let readings = fit.basis();
        let plane = plane(&steps.nodes_mm);
        let heights = |parameters: &[f64]| {
            let mut heights_um = vec![0.0; steps.nodes_mm.len()];
            free.iter().zip(parameters).for_each(|(node, height)| heights_um[*node] = *height);
            plane.remove_from(&mut heights_um);
            heights_um
        };
        let heights_um = heights(fit.declared());
        let left = fit.residual();
        let dof = left.len().saturating_sub(readings.rank()).max(1);
        let found_urad = (dot(&left, &left) / dof as f64).sqrt();
        // What the tests of the readings widen heights by; more than is stated is never less.
        let wider = fit.judgement().factors.iter().take(free.len()).copied().fold(1.0, f64::max);
        let (std_urad, freedom) = match self.0.std_urad {
            Some(stated) if stated >= found_urad => (wider * stated, 0),
            _ => (wider * found_urad, dof),
        };
        // What one reading does to the heights, in the order of the file, `[reading][node]`.
        let weights = readings.weights();
        let mut order: Vec<usize> = (0..left.len()).collect();
        order.sort_unstable_by_key(|reading| fit.places()[*reading]);
        let of_reading = |reading: usize| weights.iter().map(|of| of[reading]).collect::<Vec<f64>>();
        let influence: Vec<Vec<f64>> = order.into_iter().map(|reading| heights(&of_reading(reading))).collect();
        let variance: Vec<f64> = (0..heights_um.len())
            .map(|node| influence.iter().map(|of| (std_urad * of[node]).powi(2)).sum::<f64>())
            .collect();
        let power = dot(&heights_um, &heights_um) / heights_um.len() as f64;
        let least = without_noise(power, variance.iter().sum::<f64>() / variance.len() as f64);
        let measure = |truth: Truth, draw: &mut Draw| {
            let share = if truth == Truth::Least { least } else { 1.0 };
            let std = if freedom > 0 { std_urad * draw.true_std_ratio(freedom) } else { std_urad };
            let mut with_noise = |heights_um: &[f64]| {
                let mut noisy_um = heights_um.to_vec();
                for of in &influence {
                    let noise = std * draw.normal();
                    noisy_um.iter_mut().zip(of).for_each(|(height, of)| *height += noise * of);
                }
                noisy_um
            };
            let mut truth_um: Vec<f64> = heights_um.iter().map(|height| share * height).collect();
            if truth == Truth::Hidden {
                truth_um = with_noise(&truth_um);
            }
            let again_um = with_noise(&truth_um);
            let [again, truth] = [again_um, truth_um].map(|heights| flatness(&steps.nodes_mm, &plane, &heights));
            let error = again.iter().zip(truth).map(|(again, truth)| again - truth).collect();
            MeasuredAgain { truth: truth.to_vec(), error }
        };
        let numbers = flatness(&steps.nodes_mm, &plane, &heights_um);
        let known = measured_again(&numbers, seed(&["flatness"]), measure);
        let each = SYMBOLS.iter().zip(numbers).zip(known);
        let values = each.map(|(((symbol, reference, about), number), mut known)| {
            known.interval_95 = known.interval_95.map(|end| end.max(0.0));
            let value = Value { uncertainty: Some(known), ..Value::referred(symbol, number, "um", about, reference) };
            if *symbol == "FLTt" { value.key() } else { value }
        });
        Ok(Outcome {
            convention: "heights are above the least-squares plane of all places; + is out of the plate".into(),
            values: values.collect(),
            tables: vec![rows(&steps, &heights_um, &variance)?],
            notes: vec![format!("{} readings, {} heights, {} lines", left.len(), heights_um.len(), steps.lines.len())],
            ..Outcome::default()
        })
    }
}

fn rows(steps: &Steps, heights_um: &[f64], variance: &[f64]) -> Result<TableRows> {
    let each: Vec<(usize, f64, usize)> = (0..steps.lines.len())
        .flat_map(|line| steps.along(line).into_iter().map(move |(mm, node)| (line, mm, node)))
        .collect();
    let spec = table();
    let rows = spec.rows(vec![
        texts(each.iter().map(|(line, ..)| steps.lines[*line].as_str())),
        numbers(each.iter().map(|(_, along, _)| *along)),
        numbers(each.iter().map(|(.., node)| steps.nodes_mm[*node][0])),
        numbers(each.iter().map(|(.., node)| steps.nodes_mm[*node][1])),
        numbers(each.iter().map(|(.., node)| heights_um[*node])),
        numbers(each.iter().map(|(.., node)| variance[*node].sqrt())),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}
