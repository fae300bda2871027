//! From rows of a table to distinct places, their readings and their noise.

use std::collections::HashMap;

use faer::Mat;
use nalgebra::{DMatrix, DVector};
use runout_core::{
    Error, Result,
    consistency::{Check, in_time::InTime},
    points::{PointColumn, PointKind::Number, Points, mistakes},
};

pub(crate) use crate::measured::COMPONENTS;
use crate::{
    joint::{Data, Observed, Within},
    measured::{Measured, looks_wrong},
    noise::{Noise, Repeats},
    shared_errors::SharedErrors,
    span::Span,
    terms::{Term, Volume},
};

/// Commands that differ by less than this, in mm, are one place.
const SAME_MM: f64 = 1e-6;

/// Columns of a campaign.
pub(crate) const COLUMNS: [PointColumn; 9] = [
    PointColumn::needed("x_mm", Number, "mm", "command of X"),
    PointColumn::needed("y_mm", Number, "mm", "command of Y"),
    PointColumn::needed("z_mm", Number, "mm", "command of Z"),
    PointColumn::optional(
        "dx_um",
        Number,
        "um",
        "actual less commanded place along x; absent or empty where it was not measured",
    )
    .measured(),
    PointColumn::optional(
        "dy_um",
        Number,
        "um",
        "actual less commanded place along y; absent or empty where it was not measured",
    )
    .measured(),
    PointColumn::optional(
        "dz_um",
        Number,
        "um",
        "actual less commanded place along z; absent or empty where it was not measured",
    )
    .measured(),
    PointColumn::optional("time_s", Number, "s", "time; without it the rows are in the order of time, evenly"),
    PointColumn::optional("repeat", Number, "", "number of the pass"),
    PointColumn::optional("std_um", Number, "um", "standard uncertainty of one coordinate of this row"),
];

/// Readings of a campaign.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// The file.
    pub file: String,
    /// Distinct places, in mm, in the order of their first readings.
    pub places_mm: Vec<[f64; 3]>,
    /// Place of each reading.
    pub place_of: Vec<usize>,
    /// Deviations of each reading, in µm; NaN of components that were not measured.
    pub readings_um: Vec<[f64; 3]>,
    /// Components that were measured: 0 dx, 1 dy, 2 dz. Each is a field of the fit.
    pub measured: Vec<usize>,
    /// Time of each reading, 0 at the first and 1 at the last.
    pub time: Vec<f64>,
    /// Whether the file gives times.
    pub timed: bool,
    /// Number of the pass of each reading, counted where the file does not say it.
    pub repeat: Vec<usize>,
    /// What is known of the noise.
    pub noise: Noise,
    /// Errors of each component that depend on each other in time.
    pub correlated: [Option<InTime>; 3],
    /// The measured volume.
    pub volume: Volume,
    /// The line, plane or space that the places span.
    pub span: Span,
    /// What looks wrong.
    pub remarks: Vec<String>,
    /// Components that are absent.
    pub notes: Vec<String>,
    /// Components that count as not measured.
    pub checks: Vec<Check>,
}

impl Campaign {
    /// The readings of points.
    ///
    /// # Errors
    /// When a column is missing, or a number cannot be.
    pub fn of(points: &Points, std_um: Option<f64>, tool_mm: [f64; 3], chain: [usize; 3]) -> Result<Self> {
        let file = points.input.display().to_string();
        let refuse = |problem: String| Error::new("read", &file, problem);
        let optional = |name: &str| points.columns.iter().find(|column| column.name == name);
        let commands = [points.column("x_mm")?, points.column("y_mm")?, points.column("z_mm")?];
        let count = commands[0].len();
        for column in &points.columns {
            if let Some(row) = column.values.iter().position(|value| !value.is_finite()) {
                let problem = format!("row {} of the column `{}` is no finite number", row + 1, column.name);
                return Err(refuse(problem));
            }
        }
        if count == 0 {
            return Err(refuse("it has no reading".into()));
        }
        let rows: Vec<[f64; 3]> = (0..count).map(|row| commands.map(|column| column[row])).collect();
        let (places_mm, place_of) = distinct(&rows);
        let Measured { axes: measured, readings_um, notes, mut checks } = Measured::of(points, &rows)?;
        let time = scaled(optional("time_s").map(|column| column.values.as_slice()), count);
        let repeat = match optional("repeat") {
            Some(column) => column
                .values
                .iter()
                .enumerate()
                .map(|(row, value)| {
                    let problem =
                        || refuse(format!("row {}: `repeat` is a whole number from 0, found {value}", row + 1));
                    if *value >= 0.0 && value.fract() == 0.0 { Ok(*value as usize) } else { Err(problem()) }
                })
                .collect::<Result<Vec<usize>>>()?,
            None => occurrences(&place_of, places_mm.len()),
        };
        let last = repeat.iter().copied().max().unwrap_or(0);
        let rows_of = |pass: usize| (0..count).filter(|row| repeat[*row] == pass).collect::<Vec<usize>>();
        let passes: Vec<(String, Vec<usize>)> = (0..=last.min(count))
            .map(|pass| (format!("pass {pass}"), rows_of(pass)))
            .filter(|(_, rows)| !rows.is_empty())
            .collect();
        checks.extend(mistakes::passes(&place_of, &passes, &readings_um));
        let stated = optional("std_um").map(|column| column.values.as_slice());
        if let Some(row) = stated.and_then(|values| values.iter().position(|value| *value <= 0.0)) {
            return Err(refuse(format!("row {} of the column `std_um` must be above 0 µm", row + 1)));
        }
        let mut remarks = looks_wrong(&rows, &readings_um, &measured);
        remarks.extend(points.copies());
        let repeats = Repeats::of(&place_of, places_mm.len(), &readings_um, &measured, &time);
        let mut noise = match (stated, std_um) {
            (Some(stated), _) => Noise::Column(stated.to_vec()),
            (None, Some(std_um)) => Noise::Stated(std_um),
            (None, None) => repeats.as_ref().map_or(Noise::Unknown, |repeats| repeats.noise(&measured)),
        };
        let mut correlated = [None; 3];
        let in_time = repeats.filter(|_| noise != Noise::Unknown).map(|repeats| repeats.correlated(&time));
        for (axis, found) in measured.iter().zip(in_time.unwrap_or_default()) {
            correlated[*axis] = found;
            if let (Some(found), Noise::Repeats { std_um, .. }) = (&correlated[*axis], &mut noise) {
                std_um[*axis] = found.independent.sqrt();
            }
            checks.extend(
                correlated[*axis].map(|found| found.check(COMPONENTS[*axis], measured.len(), "µm", 1.0).named()),
            );
        }
        if place_of.len() > places_mm.len() && noise == Noise::Unknown {
            remarks.push(format!(
                "{} readings are at a place that was read before; they are too few, or copies, and do not give the noise: readings of \
                 one place are averaged",
                place_of.len() - places_mm.len()
            ));
        }
        let timed = optional("time_s").is_some();
        let volume = Volume::around(&places_mm, tool_mm, chain);
        let span = Span::of(&places_mm);
        Ok(Self {
            file,
            places_mm,
            place_of,
            readings_um,
            measured,
            time,
            timed,
            repeat,
            noise,
            correlated,
            volume,
            span,
            remarks,
            notes,
            checks,
        })
    }

    /// Variance of the noise of a reading, in µm²; `None` where it is not known.
    #[must_use]
    pub fn variance_um2(&self, row: usize, axis: usize) -> Option<f64> {
        match &self.noise {
            Noise::Column(each) => Some(each[row] * each[row]),
            Noise::Stated(std_um) => Some(std_um * std_um),
            Noise::Repeats { std_um, .. } => Some(std_um[axis] * std_um[axis]),
            Noise::Unknown => None,
        }
    }

    /// What the noise is expected to be of one reading along an axis, root mean square; NaN where it is not known.
    #[must_use]
    pub fn noise_um(&self, axis: usize) -> f64 {
        let each = (0..self.place_of.len()).map(|row| self.variance_um2(row, axis).unwrap_or(f64::NAN));
        (each.sum::<f64>() / self.place_of.len() as f64).sqrt()
    }

    /// Numbers that were read.
    #[must_use]
    pub fn numbers(&self) -> usize {
        self.measured.len() * self.place_of.len()
    }

    /// A displacement in words, with a dash for a component that was not measured.
    #[must_use]
    pub fn displacement(&self, by_um: [f64; 3]) -> String {
        let each = |axis| if self.measured.contains(&axis) { format!("{:.1}", by_um[axis]) } else { "–".to_owned() };
        format!("({}) µm", [0, 1, 2].map(each).join(", "))
    }

    /// Means of some places (all without `some`), and the columns of the trend, of each measured component.
    #[must_use]
    pub fn data(&self, terms: &[Term], some: Option<&[usize]>) -> Data {
        let all: Vec<usize> = (0..self.places_mm.len()).collect();
        let chosen = some.unwrap_or(&all);
        let mut position = vec![usize::MAX; self.places_mm.len()];
        chosen.iter().enumerate().for_each(|(index, place)| position[*place] = index);
        let places: Vec<[f64; 3]> = chosen.iter().map(|place| self.places_mm[*place]).collect();
        let (count, columns) = (chosen.len(), terms.len());
        let known = self.noise != Noise::Unknown;
        // Only these differ between the readings of one place.
        let moving: Vec<usize> = (0..columns).filter(|column| terms[*column].moves_in_time()).collect();
        let mut within = Within {
            design: DMatrix::zeros(columns, columns),
            readings: DVector::zeros(columns),
            squares: 0.0,
            dof: 0,
        };
        let mut observed = Vec::new();
        let mut design = Vec::new();
        let at = |row: usize, axis: usize, term: Term| {
            term.at(&self.volume, self.places_mm[self.place_of[row]], self.time[row])[axis]
        };
        for axis in self.measured.iter().copied() {
            let mut weights = vec![0.0; count];
            let mut repeats = vec![0_usize; count];
            let mut mean_um = vec![0.0; count];
            let mut means = Mat::<f64>::zeros(count, columns);
            for (row, place) in self.place_of.iter().enumerate() {
                let index = position[*place];
                if index == usize::MAX {
                    continue;
                }
                let weight = self.variance_um2(row, axis).map_or(1.0, f64::recip);
                weights[index] += weight;
                repeats[index] += 1;
                mean_um[index] += weight * self.readings_um[row][axis];
                for (column, term) in terms.iter().enumerate().filter(|(_, term)| term.moves_in_time()) {
                    means[(index, column)] += weight * at(row, axis, *term);
                }
            }
            for index in 0..count {
                mean_um[index] /= weights[index];
                for (column, term) in terms.iter().enumerate() {
                    if term.moves_in_time() {
                        means[(index, column)] /= weights[index];
                    } else {
                        means[(index, column)] = term.at(&self.volume, places[index], 0.0)[axis];
                    }
                }
            }
            // Only what changes slowly in time is fitted to the differences within places.
            let spacing = (self.place_of.len().max(2) as f64 - 1.0).recip();
            let slowly_um2 = self.correlated[axis].map_or(0.0, |found| found.slowly(spacing));
            for (row, place) in self.place_of.iter().enumerate().filter(|_| known) {
                let index = position[*place];
                if index == usize::MAX || repeats[index] < 2 {
                    continue;
                }
                let weight = self.variance_um2(row, axis).map_or(1.0, |variance| (variance + slowly_um2).recip());
                let reading = self.readings_um[row][axis] - mean_um[index];
                let left: Vec<f64> =
                    moving.iter().map(|column| at(row, axis, terms[*column]) - means[(index, *column)]).collect();
                within.squares += weight * reading * reading;
                for (one, first) in left.iter().zip(&moving) {
                    within.readings[*first] += weight * reading * one;
                    for (other, second) in left.iter().zip(&moving) {
                        within.design[(*first, *second)] += weight * one * other;
                    }
                }
            }
            within.dof += repeats.iter().map(|repeats| repeats.saturating_sub(1)).sum::<usize>();
            let share = repeats.iter().map(|repeats| if known { 1.0 } else { 1.0 / *repeats as f64 }).collect();
            let noise_um2 = weights.iter().map(|weight| if known { 1.0 / weight } else { 0.0 }).collect();
            let shared = self.correlated[axis].map(|of| self.shared(of, axis, &position, &weights));
            observed.push(Observed { mean_um, noise_um2, share, shared });
            design.push(means);
        }
        let within = (known && within.dof > 0).then_some(within);
        Data { places, observed, design, within }
    }

    /// Errors that means of places share: `position` of each place among them, and sums of the weights of their readings.
    fn shared(&self, of: InTime, axis: usize, position: &[usize], weights: &[f64]) -> SharedErrors {
        let mut readings = vec![Vec::new(); weights.len()];
        for (row, place) in self.place_of.iter().enumerate() {
            if let Some(own) = readings.get_mut(position[*place]) {
                let weight = self.variance_um2(row, axis).map_or(1.0, f64::recip);
                own.push((self.time[row], weight / weights[position[*place]]));
            }
        }
        SharedErrors { of, readings }
    }
}

/// Distinct places, and the place of each row.
fn distinct(rows: &[[f64; 3]]) -> (Vec<[f64; 3]>, Vec<usize>) {
    let mut known: HashMap<[i64; 3], usize> = HashMap::new();
    let mut places = Vec::new();
    let numbers = rows.iter().map(|row| {
        let key = row.map(|value| (value / SAME_MM).round() as i64);
        *known.entry(key).or_insert_with(|| {
            places.push(*row);
            places.len() - 1
        })
    });
    let numbers = numbers.collect();
    (places, numbers)
}

fn occurrences(place_of: &[usize], places: usize) -> Vec<usize> {
    let mut seen = vec![0; places];
    let number = |place: &usize| {
        seen[*place] += 1;
        seen[*place]
    };
    place_of.iter().map(number).collect()
}

/// Time from 0 to 1.
fn scaled(time: Option<&[f64]>, count: usize) -> Vec<f64> {
    let rows: Vec<f64> = (0..count).map(|row| row as f64).collect();
    let time = time.unwrap_or(&rows);
    let first = time.iter().copied().fold(f64::INFINITY, f64::min);
    let last = time.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    time.iter().map(|at| if last > first { (at - first) / (last - first) } else { 0.0 }).collect()
}
