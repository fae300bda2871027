//! The separator `circular`: a circular path, as a ball bar or a grid encoder records it (ISO 230-4, clause 3).
//!
//! | symbol | value |
//! | --- | --- |
//! | `G+`, `G-` | circular deviation of the counter-clockwise and of the clockwise path: distance of the two concentric circles that enclose it at the least distance |
//! | `G_b` | bidirectional circular deviation: the same of both paths together |
//! | `H` | hysteresis: largest radial distance of the two paths at one angle |
//! | `D` | mean bidirectional radial deviation: radius of the least-squares circle of both paths less the nominal one |
//! | `F_max`, `F_min` | largest and smallest radial deviation from the nominal circle about the centre of the least-squares circle |
//!
//! Paths are means over the turns of each direction, at equal angles. Uncertainties are those that the turns show, order by order; `radius_std_um`, that of the instrument's length, is in D and F.

use std::f64::consts::TAU;

use runout_core::{
    Complex64, Result,
    consistency::Check,
    draws::{DrawnErrors, Draws, Interval, Measured, Uncertainty, VarianceFrom, seed},
    fault::Fault,
    numerics::fourier::Fourier,
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    profile::{orders_beside, smooth_by_order},
    stage::{Outcome, PointSeparator, Separator},
    standards::roundness::{self, Angles, Reference},
    summary::Value,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    paths::{Paths, mean_of, refused},
    repeated::{alike_series, in_order, single},
};

/// `[separate] plugin = "circular"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CircularConfig {
    /// The plane of the path, as the values name it: "XY".
    pub plane: String,
    /// Nominal radius of the path, in mm.
    pub radius_mm: f64,
    /// Standard uncertainty of the instrument's length, in µm: 0 where it was not calibrated, and D and F say nothing of the radius itself.
    #[serde(default)]
    pub radius_std_um: f64,
}

impl StageConfig for CircularConfig {
    type Stage = Separator;

    const NAME: &'static str = "circular";
    const ABOUT: &'static str =
        "circular deviation, radial deviation and hysteresis of a circular path by ISO 230-4: G, F, H, D";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if !(self.radius_mm.is_finite() && self.radius_mm > 0.0) {
            return Err(Fault::at("radius_mm", format!("expected a radius above 0 mm, found {}", self.radius_mm)));
        }
        if !(self.radius_std_um.is_finite() && self.radius_std_um >= 0.0) {
            return Err(Fault::at("radius_std_um", format!("expected at least 0 µm, found {}", self.radius_std_um)));
        }
        Ok(Separator::Points(Box::new(Circular(self))))
    }
}

struct Circular(CircularConfig);

const COLUMNS: [PointColumn; 3] = [
    PointColumn::needed(
        "angle_deg",
        Number,
        "deg",
        "angle on the path, from the first axis towards the second; it may go on over the turns",
    ),
    PointColumn::needed("deviation_um", Number, "um", "radius less the nominal one").measured(),
    PointColumn::optional(
        "direction",
        Number,
        "",
        "1 where the path is counter-clockwise, -1 where it is clockwise; without it by the angles",
    ),
];

impl PointSeparator for Circular {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![table()]
    }

    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        ["G_b", "H", "G+", "G-", "D", "F_max", "F_min"].map(|symbol| (symbol, "um")).to_vec()
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let paths = Paths::of(points)?;
        let of_means: Vec<Vec<f64>> = paths.turns.iter().map(|turns| mean_of(turns)).collect();
        let values = self
            .values(&paths, &of_means)
            .ok_or_else(|| refused(points, "its points have no reference circle".into()))?;
        let mut remarks = paths.remarks.clone();
        let several = paths.turns.iter().all(|turns| turns.len() > 1);
        let noise = Noise::of(&paths.turns, paths.angles);
        let copies = several && noise.is_none();
        if copies {
            remarks.push("the turns are identical: copies show no uncertainty".into());
        }
        let known = if several && !copies { self.known(&paths, &of_means, &noise) } else { Vec::new() };
        if !several {
            remarks.push(
                "one turn in a direction: nothing shows its uncertainty; record two or more turns in each direction"
                    .into(),
            );
        }
        if paths.signs.len() == 1 {
            remarks.push(
                "the path was recorded in one direction: there is no hysteresis and no bidirectional value".into(),
            );
        }
        let mut checks = low_orders(&paths);
        checks.extend(unlike(&paths));
        checks.extend(turns_alike(&paths, &noise));
        let named = |(index, (symbol, value, about)): (usize, (String, f64, &'static str))| {
            let known = known.get(index).and_then(|known| known.at(value));
            let known =
                known.map(|known| if symbol.starts_with(['D', 'F']) { self.of_any_length(known) } else { known });
            let named = Value { uncertainty: known, ..Value::new(&symbol, value, f64::NAN, "um", about) };
            let named = named.of(&self.0.plane);
            if symbol.starts_with('G') || symbol == "H" { named.key() } else { named }
        };
        let outcome = Outcome {
            convention: format!(
                "deviation is radius less the nominal one of {} mm; + is counter-clockwise, from the first axis of {} towards the second",
                self.0.radius_mm, self.0.plane
            ),
            tables: vec![rows(&paths, &of_means)?],
            values: values.into_iter().enumerate().map(named).collect(),
            checks,
            remarks,
            ..Outcome::default()
        };
        Ok(outcome.refuted())
    }
}

impl Circular {
    /// What is known of each of the values: both paths are drawn together, each with its own errors; H, which is of their difference alone, with that.
    fn known(&self, paths: &Paths, means: &[Vec<f64>], noise: &Noise) -> Vec<Interval> {
        let turns: Vec<f64> = paths.turns.iter().map(|turns| turns.len() as f64).collect();
        let each: Vec<(&str, &[f64], f64)> = (paths.signs.iter().zip(means).zip(&turns))
            .map(|((sign, mean), turns)| (if *sign > 0 { "+" } else { "-" }, mean.as_slice(), turns.recip()))
            .collect();
        let numbers = |means: &[Vec<f64>]| -> Vec<f64> {
            self.values(paths, means).into_iter().flatten().map(|(_, value, _)| value).collect()
        };
        let mut known = self.drawn(paths, &each, noise, numbers);
        if let ([first, second], Some(hysteresis)) = (means, known.get_mut(HYSTERESIS)) {
            let apart: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
            let of_both = turns.iter().map(|turns| turns.recip()).sum();
            let widest = |apart: &[Vec<f64>]| vec![apart[0].iter().fold(0.0_f64, |most, one| most.max(one.abs()))];
            if let Some(own) = self.drawn(paths, &[("difference", &apart, of_both)], noise, widest).pop() {
                *hysteresis = own;
            }
        }
        known
    }

    /// What is known of values of profiles around the path: the name of each, its readings and the variance of a mean beside that of a turn.
    fn drawn(
        &self,
        paths: &Paths,
        of: &[(&str, &[f64], f64)],
        noise: &Noise,
        values: impl Fn(&[Vec<f64>]) -> Vec<f64> + Sync,
    ) -> Vec<Interval> {
        let mut fourier = Fourier::new(paths.angles);
        let mut measured = Vec::new();
        let mut sources = Vec::new();
        for (name, profile, of_mean) in of {
            let mut harmonics = vec![Complex64::ZERO; noise.variance.len()];
            fourier.analyse(profile.iter().copied(), &mut harmonics);
            let variance: Vec<f64> = noise.variance.iter().map(|variance| variance * of_mean).collect();
            let seed = seed(&["circular", &self.0.plane, name]);
            sources.push(vec![(seed, variance.iter().map(|variance| variance.sqrt().into()).collect())]);
            let (squares, variance_from) = (noise.squares.clone(), VarianceFrom::OrdersBeside);
            measured.push(Measured { harmonics, variance, squares, variance_from, lowest: 0 });
        }
        let Some(draws) = Draws::of(&measured, sources, seed(&["circular", &self.0.plane, "+"])) else {
            return Vec::new();
        };
        let profiles = draws.profiles(|_| Complex64::ONE, paths.angles, |_, _| ());
        profiles.values(|kind, errors, found| {
            let of_profile = |(profile, errors): (&Vec<f64>, &DrawnErrors)| {
                let mut sum = Vec::with_capacity(profile.len());
                errors.added_to(profile, &mut sum);
                sum
            };
            let undisturbed = profiles.undisturbed_um(kind);
            found.extend(match errors {
                None => values(undisturbed),
                Some(errors) => values(&undisturbed.iter().zip(errors).map(of_profile).collect::<Vec<_>>()),
            });
        })
    }

    /// The uncertainty of a value that has the instrument's length in it.
    fn of_any_length(&self, known: Uncertainty) -> Uncertainty {
        let std = known.std.hypot(self.0.radius_std_um);
        let factor = if known.std > 0.0 { std / known.std } else { 1.0 };
        Uncertainty { std, ..known.widened(factor) }
    }

    /// The values of paths; nothing where they have no reference circle.
    fn values(&self, paths: &Paths, means: &[Vec<f64>]) -> Option<Vec<(String, f64, &'static str)>> {
        let mut points = roundness::Points::default();
        let count = paths.angles;
        let one = || (0..count).map(move |angle| TAU * angle as f64 / count as f64);
        let zone = |points: &roundness::Points| Some(points.values(&points.reference(Reference::MinimumZone)?).ront_um);
        let mut values = Vec::new();
        for (sign, path_um) in paths.signs.iter().zip(means) {
            points.set_profile(&Angles::equal(count), path_um, self.0.radius_mm);
            let name = format!("G{}", if *sign > 0 { '+' } else { '-' });
            values.push((
                name,
                zone(&points)?,
                "circular deviation of one direction, about the minimum zone circles (ISO 230-4)",
            ));
        }
        let together: Vec<f64> = means.concat();
        let angles: Angles = (0..means.len()).flat_map(|_| one()).collect();
        points.set_profile(&angles, &together, self.0.radius_mm);
        let circle = points.reference(Reference::LeastSquares)?;
        let about: Vec<f64> = points.deviations_um(&circle).collect();
        if let [first, second] = means {
            values.insert(0, ("G_b".into(), zone(&points)?, "bidirectional circular deviation (ISO 230-4)"));
            let [ahead, behind] = [&about[..first.len()], &about[first.len()..first.len() + second.len()]];
            let widest = ahead.iter().zip(behind).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            values.insert(HYSTERESIS, ("H".into(), widest, "circular hysteresis (ISO 230-4)"));
        }
        // The circle about the least-squares centre that the nominal one is.
        let deviation = circle.deviation_um;
        values.push(("D".into(), deviation, "mean bidirectional radial deviation (ISO 230-4)"));
        let from_nominal = || about.iter().map(|one| one + deviation);
        values.push((
            "F_max".into(),
            from_nominal().fold(f64::NEG_INFINITY, f64::max),
            "largest radial deviation (ISO 230-4)",
        ));
        values.push((
            "F_min".into(),
            from_nominal().fold(f64::INFINITY, f64::min),
            "smallest radial deviation (ISO 230-4)",
        ));
        Some(values)
    }
}

/// Place of H among the values.
const HYSTERESIS: usize = 1;

/// Radius, centre and lobes of each turn over the turns of its direction, order by order: they drift, or one turn is unlike the others.
fn low_orders(paths: &Paths) -> Vec<Check> {
    let mut fourier = Fourier::new(paths.angles);
    let mut harmonics = vec![Complex64::ZERO; HIGHEST_OF_TURNS + 1];
    let mut of_turn = |turn: &Vec<f64>| {
        fourier.analyse(turn.iter().copied(), &mut harmonics);
        harmonics.clone()
    };
    let found: Vec<Vec<Vec<Complex64>>> =
        paths.turns.iter().map(|turns| turns.iter().map(&mut of_turn).collect()).collect();
    let mut checks = Vec::new();
    for order in 0..=HIGHEST_OF_TURNS {
        let mut series: Vec<(String, Vec<f64>)> = Vec::new();
        for (turns, sign) in found.iter().zip(&paths.signs) {
            let path = if *sign > 0 { '+' } else { '-' };
            let mut add = |name: &str, of: fn(&Complex64) -> f64| {
                series.push((format!("{name} of {path} turn"), turns.iter().map(|turn| of(&turn[order])).collect()));
            };
            if order == 0 {
                add("radius", |one| one.re);
            } else {
                add(&format!("order {order} cosine"), |one| one.re);
                add(&format!("order {order} sine"), |one| one.im);
            }
        }
        let series: Vec<(&str, &[f64])> = series.iter().map(|(name, of)| (name.as_str(), of.as_slice())).collect();
        if order == 0 || series.iter().all(|(_, of)| of.len() >= FEWEST_TURNS) {
            let found = in_order("the turns", &series, "µm").into_iter();
            checks.extend(found.map(|check| check.among(PARTS_OF_TURNS)));
        }
    }
    checks
}

/// Single readings that are not like those of the other turns at their angle.
fn unlike(paths: &Paths) -> Option<Check> {
    let at_angles = |turns: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        (0..paths.angles).map(|angle| turns.iter().map(|turn| turn[angle]).collect()).collect()
    };
    let places: Vec<Vec<f64>> = paths.turns.iter().flat_map(at_angles).collect();
    let named = |place: usize, number: usize| {
        let path = if paths.signs[place / paths.angles] > 0 { '+' } else { '-' };
        let angle_deg = 360.0 * (place % paths.angles) as f64 / paths.angles as f64;
        format!("turn {number} of the {path} path at {angle_deg}°")
    };
    single(&places, named, "µm")
}

/// Turns that are farther from the mean of their direction than others: a path that begins or ends within them.
fn turns_alike(paths: &Paths, noise: &Noise) -> Vec<Check> {
    let of_path = |(turns, sign): (&Vec<Vec<f64>>, &i8)| {
        let path = if *sign > 0 { '+' } else { '-' };
        let name = |number: usize| format!("turn {} of the {path} path", number + 1);
        let series: Vec<(String, &[f64])> =
            turns.iter().enumerate().map(|(number, turn)| (name(number), turn.as_slice())).collect();
        alike_series("turns", &series, noise.freedom()).into_iter().map(|check| check.among(2))
    };
    paths.turns.iter().zip(&paths.signs).flat_map(of_path).collect()
}

/// Orders of a turn that warming up changes: radius, centre, squareness and gains of the axes.
const HIGHEST_OF_TURNS: usize = 3;
/// Turns of a direction from which on more than their radius is judged.
const FEWEST_TURNS: usize = 4;
/// Orders, and series of each that may be one motion: so many parts may differ by chance.
const PARTS_OF_TURNS: usize = 4 * (HIGHEST_OF_TURNS + 1);
/// Variance below which turns are copies: of rounding.
const IDENTICAL_UM2: f64 = 1e-24;

/// What changes from turn to turn, by order.
struct Noise {
    /// Variance of one turn's coefficient, real and imaginary part together, from order 0; the same in both directions.
    variance: Vec<f64>,
    /// Squares behind each.
    squares: Vec<usize>,
}

impl Noise {
    fn of(turns: &[Vec<Vec<f64>>], angles: usize) -> Self {
        let mut fourier = Fourier::new(angles);
        let mut sums = vec![Complex64::ZERO; fourier.max_order() + 1];
        let mut harmonics = sums.clone();
        let freedom: usize = turns.iter().map(|turns| turns.len() - 1).sum();
        for turns in turns {
            let mean = mean_of(turns);
            for turn in turns {
                fourier.analyse(turn.iter().zip(&mean).map(|(turn, mean)| turn - mean), &mut harmonics);
                sums.iter_mut().zip(&harmonics).for_each(|(sum, harmonic)| *sum += harmonic.norm_sqr());
            }
        }
        smooth_by_order(&mut sums, 1);
        let squares = (0..sums.len()).map(|order| 2 * freedom * (2 * orders_beside(order) + 1)).collect();
        Self { variance: sums.into_iter().map(|sum| sum.re / freedom.max(1) as f64).collect(), squares }
    }

    /// Independent readings that a turn counts for: of white noise all (Satterthwaite).
    fn freedom(&self) -> f64 {
        let sum = |of: fn(f64) -> f64| self.variance.iter().map(|variance| of(*variance)).sum::<f64>();
        2.0 * sum(|variance| variance).powi(2) / sum(|variance| variance * variance).max(f64::MIN_POSITIVE)
    }

    /// Whether nothing changes: no two recorded turns are alike.
    fn is_none(&self) -> bool {
        self.variance.iter().all(|variance| *variance < IDENTICAL_UM2)
    }
}

fn table() -> TableSpec {
    TableSpec::new(
        "path",
        "radial deviation of the path, mean of the turns of each direction",
        vec![
            ColumnSpec::name("direction", "+ counter-clockwise, - clockwise"),
            ColumnSpec::number("angle_deg", "deg", "angle on the path").repeating(),
            ColumnSpec::number("deviation_um", "um", "radius less the nominal one, about the centre of the recording"),
        ],
    )
    .figure(Figure::polar("path", "Circular path", "angle_deg", [Measure::new("deviation_um")]).curves(["direction"]))
}

fn rows(paths: &Paths, means: &[Vec<f64>]) -> Result<TableRows> {
    let spec = table();
    let each = || {
        paths
            .signs
            .iter()
            .zip(means)
            .flat_map(|(sign, path)| path.iter().enumerate().map(move |(angle, value)| (*sign, angle, *value)))
    };
    let rows = spec.rows(vec![
        texts(each().map(|(sign, ..)| if sign > 0 { "+" } else { "-" })),
        numbers(each().map(|(_, angle, _)| 360.0 * angle as f64 / paths.angles as f64)),
        numbers(each().map(|(.., value)| value)),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}
