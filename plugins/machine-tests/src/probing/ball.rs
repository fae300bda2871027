//! Sets of touches of a sphere or a ring: the centre of each by least squares, and the radial deviations from it.

use runout_core::{
    Error, ErrorKind, Result,
    consistency::{Check, Test, groups::Group},
    numerics::least_squares::Basis,
    points::Points,
};

/// Steps of a fit, and the share of the radius below which one is its last.
const STEPS: usize = 60;
const LAST: f64 = 1e-13;
/// Largest angle between the touches of two sets that are one place: its cosine, of 5°.
const SAME_PLACE: f64 = 0.9962;

/// Touches of one set.
pub(super) struct Set {
    /// Number in the column `repeat`.
    pub number: f64,
    pub centre_mm: Vec<f64>,
    /// Towards each touch.
    pub directions: Vec<Vec<f64>>,
    /// Radial distance less the radius of the fit, in µm.
    pub deviations_um: Vec<f64>,
}

/// All sets; touches in the same order.
pub(super) struct Touches {
    pub sets: Vec<Set>,
    /// Least-squares fits of the first set: centre and radius.
    pub fit: Basis,
}

fn refuse(points: &Points, problem: String, help: &str) -> Error {
    Error::new("evaluate", points.input.display().to_string(), problem)
        .of(ErrorKind::UnsuitableData)
        .help(help.to_owned())
}

/// Columns of the centre and of the radius, for touches in directions.
fn design(directions: &[Vec<f64>]) -> Basis {
    let axes = directions.first().map_or(0, Vec::len);
    let mut columns: Vec<Vec<f64>> =
        (0..axes).map(|axis| directions.iter().map(|direction| direction[axis]).collect()).collect();
    columns.push(vec![1.0; directions.len()]);
    Basis::of(columns)
}

impl Set {
    /// Fits a sphere (three coordinates) or a circle (two).
    fn of(number: f64, touches_mm: &[Vec<f64>]) -> std::result::Result<Self, String> {
        let axes = touches_mm.first().map_or(0, Vec::len);
        if touches_mm.len() < axes + 3 {
            return Err(format!("expected at least {} touches, found {}", axes + 3, touches_mm.len()));
        }
        let count = touches_mm.len() as f64;
        let mut centre: Vec<f64> =
            (0..axes).map(|axis| touches_mm.iter().map(|touch| touch[axis]).sum::<f64>() / count).collect();
        let mut radius = 0.0;
        for step in 0..STEPS {
            let arm =
                |touch: &Vec<f64>| -> Vec<f64> { touch.iter().zip(&centre).map(|(at, centre)| at - centre).collect() };
            let arms: Vec<Vec<f64>> = touches_mm.iter().map(arm).collect();
            let lengths: Vec<f64> =
                arms.iter().map(|arm| arm.iter().map(|part| part * part).sum::<f64>().sqrt()).collect();
            if !lengths.iter().all(|length| *length > 0.0 && length.is_finite()) {
                break;
            }
            let directions: Vec<Vec<f64>> =
                arms.iter().zip(&lengths).map(|(arm, length)| arm.iter().map(|part| part / length).collect()).collect();
            if step == 0 {
                radius = lengths.iter().sum::<f64>() / count;
            }
            let fit = design(&directions);
            if fit.dependent() {
                break;
            }
            let off: Vec<f64> = lengths.iter().map(|length| length - radius).collect();
            let moved = fit.coefficients(&off);
            let size = moved.iter().map(|part| part.abs()).fold(0.0, f64::max);
            centre.iter_mut().zip(&moved).for_each(|(centre, by)| *centre += by);
            radius += moved[axes];
            if size <= LAST * radius {
                let deviations_um = lengths.iter().map(|length| 1e3 * (length - radius)).collect();
                return Ok(Self { number, centre_mm: centre, directions, deviations_um });
            }
            if !(size.is_finite() && radius > 0.0) {
                break;
            }
        }
        Err("the touches determine no centre and radius".into())
    }

    /// Range of the radial distances, in µm.
    pub(super) fn range_um(&self) -> f64 {
        range(&self.deviations_um)
    }
}

/// Largest less smallest.
pub(crate) fn range(values: &[f64]) -> f64 {
    let ends =
        values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], one| [low.min(*one), high.max(*one)]);
    ends[1] - ends[0]
}

impl Touches {
    /// Sets that are equal to the first one that they are equal to: what two fits of copies differ by is rounding.
    pub(super) fn copies(&self, rounding_um: f64) -> Option<Check> {
        let same = |one: &Set, other: &Set| {
            one.deviations_um.iter().zip(&other.deviations_um).all(|(a, b)| (a - b).abs() < rounding_um)
        };
        let copy = |(at, set): (usize, &Set)| {
            let of = self.sets[..at].iter().find(|before| same(before, set))?;
            Some(format!("set {} is equal to set {}", set.number, of.number))
        };
        let found: Vec<String> = self.sets.iter().enumerate().filter_map(copy).collect();
        (!found.is_empty()).then(|| {
            let finding = || format!("{}, touch by touch: a copy shows no noise; leave it out", found.join(", "));
            Check::new(Test::Measured, "copies of sets", found.len() as f64, &[], 0.0).finding(finding)
        })
    }

    /// Length of the mean of the directions of the first set: 0 all around, 0.64 of half a ring, 0.5 of half a sphere, 1 at one place.
    pub(super) fn lopsidedness(&self) -> f64 {
        let directions = &self.sets[0].directions;
        let axes = directions.first().map_or(0, Vec::len);
        let mean = |axis: usize| directions.iter().map(|to| to[axis]).sum::<f64>() / directions.len() as f64;
        (0..axes).map(|axis| mean(axis).powi(2)).sum::<f64>().sqrt()
    }

    /// Of points, by the column `repeat`.
    pub(super) fn of(points: &Points, axes: &[&str]) -> Result<Self> {
        let columns = axes.iter().map(|name| points.column(name)).collect::<Result<Vec<_>>>()?;
        let rows = columns.first().map_or(0, |column| column.len());
        let repeat = points.column("repeat").map_or_else(|_| vec![1.0; rows], <[f64]>::to_vec);
        let mut numbers = repeat.clone();
        numbers.sort_by(f64::total_cmp);
        numbers.dedup();
        let mut sets = Vec::new();
        for number in numbers {
            let of = (0..rows).filter(|row| repeat[*row].total_cmp(&number).is_eq());
            let touches: Vec<Vec<f64>> = of.map(|row| columns.iter().map(|column| column[row]).collect()).collect();
            let set = Set::of(number, &touches);
            let help =
                "touch the whole sphere (25 places) or the whole ring; a set of touches has one number in `repeat`";
            sets.push(set.map_err(|problem| refuse(points, format!("set {number}: {problem}"), help))?);
        }
        let Some(first) = sets.first() else {
            return Err(refuse(points, "there is no touch".into(), "each row is a touch"));
        };
        for set in &sets[1..] {
            let help = "touch the same places in the same order in each set";
            if set.directions.len() != first.directions.len() {
                let problem = format!(
                    "set {} has {} touches, set {} has {}",
                    first.number,
                    first.directions.len(),
                    set.number,
                    set.directions.len()
                );
                return Err(refuse(points, problem, help));
            }
            let turned = first
                .directions
                .iter()
                .zip(&set.directions)
                .position(|(one, other)| one.iter().zip(other).map(|(a, b)| a * b).sum::<f64>() < SAME_PLACE);
            if let Some(touch) = turned {
                let problem =
                    format!("touch {} of set {} is elsewhere than that of set {}", touch + 1, set.number, first.number);
                return Err(refuse(points, problem, help));
            }
        }
        let fit = design(&first.directions);
        Ok(Self { sets, fit })
    }

    /// Mean deviation at each place, in µm.
    pub(super) fn means_um(&self) -> Vec<f64> {
        let count = self.sets.len() as f64;
        let places = self.sets[0].deviations_um.len();
        (0..places).map(|place| self.sets.iter().map(|set| set.deviations_um[place]).sum::<f64>() / count).collect()
    }

    /// What changes from set to set, in the order of the touches; without the part of each place.
    pub(super) fn noise_um(&self) -> Vec<Vec<f64>> {
        let means = self.means_um();
        self.sets
            .iter()
            .map(|set| set.deviations_um.iter().zip(&means).map(|(one, mean)| one - mean).collect())
            .collect()
    }

    /// Its squares by the direction, along an axis, that touches are nearest to.
    pub(super) fn sides(&self) -> Vec<Group> {
        let directions = &self.sets[0].directions;
        let of_touch = self.freedom() as f64 / directions.len() as f64;
        let noise = self.noise_um();
        let mut sides: Vec<Group> = Vec::new();
        for (touch, to) in directions.iter().enumerate() {
            let nearest = to.iter().zip(["x", "y", "z"]).max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            let Some((along, axis)) = nearest else { continue };
            let name = format!("the side {}{axis}", if *along < 0.0 { '-' } else { '+' });
            let squares: f64 = noise.iter().map(|set| set[touch] * set[touch]).sum();
            match sides.iter_mut().find(|side| side.name == name) {
                Some(side) => (side.squares, side.freedom) = (side.squares + squares, side.freedom + of_touch),
                None => sides.push(Group { name, squares, freedom: of_touch }),
            }
        }
        sides
    }

    /// Degrees of freedom of it.
    pub(super) fn freedom(&self) -> usize {
        (self.sets.len() - 1) * (self.sets[0].deviations_um.len() - self.fit.rank())
    }
}
