//! The separator `diagonals`: positioning along body and face diagonals of the volume (ISO 230-6), by the values of ISO 230-2 for each.
//!
//! | symbol | value |
//! | --- | --- |
//! | `A`, `E`, `R`, `B`, `M` … | of each diagonal: as [`positioning`](crate::PositioningConfig) |
//! | `E_d`, `B_d`, `R_d`, `A_d` | largest E, B, R and A of the body diagonals, and of the face diagonals |
//!
//! A diagonal is named by the directions in which it runs: `PPP`, `NPP`, `PNP`, `PPN` of the body, and with a `0` for the axis that stands on a face: `PP0`,
//! `NP0`, `P0P`. All were measured by one instrument: `scale_std_ppm` is one unknown number for all. ISO 230-6 has no value over all diagonals but the largest; it gives no
//! error of a single axis.

use runout_core::{
    Error, ErrorKind, Result,
    consistency::Check,
    draws::{Draw, MeasuredAgain, Truth, seed},
    fault::Fault,
    pipeline::{Context, StageConfig},
    points::{
        PointColumn,
        PointKind::{Label, Number},
        Points,
        measured::unlike_units,
    },
    stage::{Outcome, PointSeparator, Separator},
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers, texts},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    cells::{Cells, Terms, remarks, widen_by_drift},
    draws::{Computed, with_uncertainty},
    repeated,
    runs::{Approaches, Noise},
};

/// `[separate] plugin = "diagonals"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiagonalsConfig {
    /// Standard uncertainty of the scale, by the instrument's certificate and the temperatures, in µm/m.
    #[serde(default)]
    pub scale_std_ppm: f64,
}

impl StageConfig for DiagonalsConfig {
    type Stage = Separator;

    const NAME: &'static str = "diagonals";
    const ABOUT: &'static str =
        "positioning along body and face diagonals by ISO 230-6: E, B, R, A, M of each, the largest of all";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        if !(self.scale_std_ppm.is_finite() && self.scale_std_ppm >= 0.0) {
            return Err(Fault::at("scale_std_ppm", format!("expected at least 0, found {}", self.scale_std_ppm)));
        }
        Ok(Separator::Points(Box::new(Diagonals(self))))
    }
}

struct Diagonals(DiagonalsConfig);

const COLUMNS: [PointColumn; 4] = [
    PointColumn::needed("diagonal", Label, "", "the diagonal: PPP, NPP, PNP, PPN, or PP0, NP0, P0P … on a face"),
    PointColumn::needed("target_mm", Number, "mm", "commanded distance along the diagonal from its beginning"),
    PointColumn::needed("deviation_um", Number, "um", "actual less commanded distance").measured(),
    PointColumn::optional(
        "direction",
        Number,
        "",
        "1 where the target was approached ahead along the diagonal, -1 back; without it by the row before",
    ),
];

/// Values of which the largest of all diagonals is one of its own, by what they are of each.
const LARGEST: [(&str, &str, &str); 4] = [
    ("E", "E_d", "largest bidirectional systematic deviation of these diagonals (ISO 230-6)"),
    ("B", "B_d", "largest reversal value of these diagonals (ISO 230-6)"),
    ("R", "R_d", "largest bidirectional repeatability of these diagonals (ISO 230-6)"),
    ("A", "A_d", "largest bidirectional accuracy of these diagonals (ISO 230-6)"),
];
const SYMBOLS: [&str; 16] =
    ["A", "E", "R", "B", "B_mean", "M", "A+", "E+", "R+", "A-", "E-", "R-", "E_d", "B_d", "R_d", "A_d"];
/// Two runs show the noise; ISO 230-6 was not at hand for the number that it asks for.
const TERMS: Terms = Terms { unit: "um", runs: 2, standard: "ISO 230-6", contain: "A and R contain it" };
const BODY: &str = "body diagonals";
const FACES: &str = "face diagonals";

/// One diagonal.
struct Diagonal {
    id: String,
    approaches: Approaches,
    cells: Cells,
    /// Its means without what noise alone may make.
    least: Cells,
    noise: Noise,
}

impl Diagonal {
    fn is_of(&self, kind: &str) -> bool {
        (kind == FACES) == self.id.contains('0')
    }

    /// By so much noise moves one of its values at most, in µm: three standard deviations of the difference of two means.
    fn reach(&self) -> f64 {
        let of_runs = self.noise.common.iter().chain(&self.noise.apart).flatten().map(|std| std * std).sum::<f64>();
        let run = of_runs.sqrt().hypot(self.noise.own_std);
        3.0 * std::f64::consts::SQRT_2 * run / (self.noise.runs as f64).sqrt()
    }

    fn values(&self) -> Vec<(String, f64, &'static str)> {
        self.cells.values(&self.approaches.sides)
    }
}

/// Whether a name is three directions of which at most one is none.
fn is_diagonal(id: &str) -> bool {
    id.len() == 3
        && id.bytes().all(|letter| matches!(letter, b'P' | b'N' | b'0'))
        && id.bytes().filter(|letter| *letter == b'0').count() < 2
}

fn diagonals(points: &Points) -> Result<Vec<Diagonal>> {
    let refuse = |problem: String, help: &str| {
        Error::new("evaluate", points.input.display().to_string(), problem)
            .of(ErrorKind::UnsuitableData)
            .help(help.to_owned())
    };
    let labels = points.labels("diagonal").unwrap_or_default();
    let mut ids: Vec<&String> = labels.iter().collect();
    ids.sort();
    ids.dedup();
    if let Some(odd) = ids.iter().find(|id| !is_diagonal(id)) {
        let help = "name the directions of X, Y and Z: P positive, N negative, 0 where an axis stands: PPP, NPP, PP0";
        return Err(refuse(format!("`{odd}` is no diagonal"), help));
    }
    if ids.is_empty() {
        return Err(refuse("there is no row".into(), "each row is an approach of a target of a diagonal"));
    }
    let (target, deviation) = (points.column("target_mm")?, points.column("deviation_um")?);
    let direction = points.column("direction").ok();
    let of = |id: &String| {
        let rows: Vec<usize> = (0..labels.len()).filter(|row| labels[*row] == *id).collect();
        let pick = |column: &[f64]| -> Vec<f64> { rows.iter().filter_map(|row| column.get(*row)).copied().collect() };
        let direction = direction.map(pick);
        let approaches = Approaches::of_rows(points, id, &pick(target), direction.as_deref(), &pick(deviation))?;
        let (cells, noise) = (Cells::of(&approaches), approaches.noise());
        let among = approaches.targets.len() * ids.len();
        let least = cells.levelled(&noise, among);
        Ok(Diagonal { id: id.clone(), approaches, cells, least, noise })
    };
    ids.iter().copied().map(of).collect()
}

/// Kinds of which there are diagonals with both directions.
fn kinds(all: &[Diagonal]) -> Vec<&'static str> {
    let both = |kind: &&str| all.iter().any(|one| one.is_of(kind) && one.approaches.sides.len() == 2);
    [BODY, FACES].into_iter().filter(both).collect()
}

/// Of each kind and each of the largest values: the diagonals, and the place of the value among those of each.
fn members<'a>(all: &'a [Diagonal], kinds: &[&str]) -> Vec<Vec<(usize, usize, &'a Diagonal)>> {
    let place = |one: &Diagonal, symbol: &str| one.values().iter().position(|(known, ..)| known == symbol);
    let mut found = Vec::new();
    for kind in kinds {
        for (symbol, ..) in LARGEST {
            let of = all.iter().enumerate().filter(|(_, one)| one.is_of(kind));
            found.push(of.filter_map(|(index, one)| Some((index, place(one, symbol)?, one))).collect());
        }
    }
    found
}

fn largest(of: impl Iterator<Item = f64>) -> f64 {
    of.fold(f64::NEG_INFINITY, f64::max)
}

impl PointSeparator for Diagonals {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![table()]
    }

    fn symbols(&self) -> Vec<(&'static str, &'static str)> {
        SYMBOLS.map(|symbol| (symbol, "um")).to_vec()
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let all = diagonals(points)?;
        let kinds = kinds(&all);
        let found: Vec<Vec<f64>> =
            all.iter().map(|one| one.values().into_iter().map(|value| value.1).collect()).collect();
        let mut computed: Vec<Computed> = Vec::new();
        let mut of = Vec::new();
        for one in &all {
            for (symbol, value, about) in one.values() {
                let is_key = matches!(symbol.as_str(), "E" | "B") || one.approaches.sides.len() == 1;
                computed.push(Computed { symbol, value, about, is_key, least: 0.0 });
                of.push(one.id.clone());
            }
        }
        let members = members(&all, &kinds);
        let both: Vec<f64> =
            members.iter().map(|of| largest(of.iter().map(|(index, place, _)| found[*index][*place]))).collect();
        for (kind, values) in kinds.iter().zip(both.chunks(LARGEST.len())) {
            for ((_, symbol, about), value) in LARGEST.iter().zip(values) {
                computed.push(Computed { symbol: (*symbol).into(), value: *value, about, is_key: true, least: 0.0 });
                of.push((*kind).to_owned());
            }
        }
        let measure = |truth: Truth, draw: &mut Draw| self.again(&all, &members, &found, truth, draw);
        let mut values = with_uncertainty(&computed, "um", seed(&["diagonals"]), measure);
        let copied = |of: &str| {
            let silent = |one: &Diagonal| one.noise.copies;
            all.iter().any(|one| (one.id == of || one.is_of(of)) && silent(one))
        };
        // Copies show no uncertainty.
        values.iter_mut().zip(&of).filter(|(_, of)| copied(of)).for_each(|(value, _)| value.uncertainty = None);
        let mut said: Vec<String> = Vec::new();
        for one in &all {
            said.extend(
                remarks(&one.approaches, &one.noise, &TERMS).into_iter().map(|remark| format!("{}: {remark}", one.id)),
            );
        }
        said.extend(missing(&all));
        let sizes = all.iter().map(|one| (format!("diagonal {}", one.id), one.cells.size()));
        let mut checks: Vec<Check> =
            unlike_units(&sizes.collect::<Vec<(String, f64)>>(), "convert their file").into_iter().collect();
        let mut first = 0;
        for one in &all {
            let last = first + one.values().len();
            let mut found = repeated::approaches(&one.approaches, &one.noise.along, ["mm", "µm"]);
            found.extend(widen_by_drift(&one.approaches, &one.noise, &mut values[first..last], "µm"));
            checks.extend(found.into_iter().map(|check| check.within(&one.id)));
            first = last;
        }
        let place_of: Vec<usize> =
            all.iter().scan(0, |first, one| Some(std::mem::replace(first, *first + one.values().len()))).collect();
        let outcome = Outcome {
            convention:
                "deviation is actual less commanded distance along the diagonal; + is an approach ahead along it".into(),
            tables: vec![rows(&all)?],
            values: values.into_iter().zip(of).map(|(value, of)| value.of(&of)).collect(),
            checks,
            remarks: said,
            ..Outcome::default()
        };
        let mut outcome = outcome.refuted();
        let (each, largest) = outcome.values.split_at_mut(first);
        for (value, members) in largest.iter_mut().zip(&members) {
            let own = members.iter().map(|(index, place, _)| &each[place_of[*index] + place]);
            value.refuted_by = own.clone().find_map(|one| one.refuted_by.clone());
            // What widens the value of the diagonal that it is of widens it.
            let top = own.max_by(|a, b| a.value.total_cmp(&b.value)).and_then(|one| one.uncertainty.as_ref());
            if let (Some(known), Some(top)) = (value.uncertainty.as_mut(), top) {
                known.std = known.std.max(top.std);
                let [low, high] = known.interval_95;
                known.interval_95 = [low.min(top.interval_95[0]), high.max(top.interval_95[1])];
            }
        }
        Ok(outcome)
    }
}

impl Diagonals {
    fn again(
        &self,
        all: &[Diagonal],
        members: &[Vec<(usize, usize, &Diagonal)>],
        found: &[Vec<f64>],
        truth: Truth,
        draw: &mut Draw,
    ) -> MeasuredAgain {
        // µm/m of mm is nm.
        let scale = 1e-3 * self.0.scale_std_ppm * draw.normal();
        let mut drawn = |one: &Diagonal| {
            let cells = one.cells.may_be(truth, &one.least, &one.noise, draw);
            cells.again(&one.approaches, &one.noise, scale, draw)
        };
        let drawn: Vec<MeasuredAgain> = all.iter().map(&mut drawn).collect();
        let is_least = truth == Truth::Least;
        let mut each = MeasuredAgain {
            truth: drawn.iter().flat_map(|one| one.truth.iter().copied()).collect(),
            error: drawn.iter().flat_map(|one| one.error.iter().copied()).collect(),
        };
        for of in members {
            let top = largest(of.iter().map(|(index, place, _)| found[*index][*place]));
            let truth = largest(of.iter().map(|(index, place, _)| drawn[*index].truth[*place]));
            let error = if is_least {
                // Any of those that noise may have kept from being the largest: the one that it raises most.
                let near = of.iter().filter(|(index, place, one)| found[*index][*place] + one.reach() >= top);
                largest(near.map(|(index, place, _)| drawn[*index].error[*place]))
            } else {
                largest(of.iter().map(|(index, place, _)| drawn[*index].truth[*place] + drawn[*index].error[*place]))
                    - truth
            };
            each.truth.push(truth);
            each.error.push(error);
        }
        each
    }
}

/// Which diagonals a volume has besides.
fn missing(all: &[Diagonal]) -> Option<String> {
    let body = all.iter().filter(|one| one.is_of(BODY)).count();
    (body > 0 && body < 4).then(|| format!("{body} of the 4 body diagonals: E_d is the largest of these"))
}

fn table() -> TableSpec {
    TableSpec::new(
        "diagonals",
        "deviations of the targets of each diagonal over their runs",
        vec![
            ColumnSpec::name("diagonal", "directions of X, Y and Z: P, N or 0"),
            ColumnSpec::name("direction", "side of the approach: + or -"),
            ColumnSpec::number("target_mm", "mm", "commanded distance along the diagonal").repeating(),
            ColumnSpec::number("mean_um", "um", "mean deviation over the runs"),
            ColumnSpec::number("std_um", "um", "standard uncertainty of the mean, from the runs"),
            ColumnSpec::number("spread_um", "um", "standard deviation of one approach"),
        ],
    )
    .figure(
        Figure::lines("diagonals", "Diagonals", "target_mm", [Measure::new("mean_um").with_std("std_um")])
            .panels(["diagonal"])
            .curves(["direction"]),
    )
}

fn rows(all: &[Diagonal]) -> Result<TableRows> {
    let spec = table();
    let mut each: Vec<(&Diagonal, usize, usize)> = Vec::new();
    for one in all {
        for side in 0..one.approaches.sides.len() {
            each.extend((0..one.approaches.targets.len()).map(|target| (one, side, target)));
        }
    }
    let number = |of: &dyn Fn(&Diagonal, usize, usize) -> f64| {
        numbers(each.iter().map(|(one, side, target)| of(one, *side, *target)))
    };
    let rows = spec.rows(vec![
        texts(each.iter().map(|(one, ..)| one.id.as_str())),
        texts(each.iter().map(|(one, side, _)| if one.approaches.sides[*side] > 0 { "+" } else { "-" })),
        number(&|one, _, target| one.approaches.targets[target]),
        number(&|one, side, target| one.cells.mean[target][side]),
        number(&|one, side, target| {
            one.cells.std[target][side] / (one.approaches.deviations[target][side].len() as f64).sqrt()
        }),
        number(&|one, side, target| one.cells.std[target][side]),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}
