//! Touches of a ring, checked.

use runout_core::{Error, Result, fault::known_names, points::Points};

use crate::config::TouchProbeConfig;

/// Directions of one setup that are nearer than this are the same, in degrees.
const SAME_DIRECTION_DEG: f64 = 0.2;
/// A column of angles within ±this, in degrees, with as many points as this, is in radians.
const RADIANS: (f64, usize) = (7.0, 8);
/// A pre-travel or a range above this, in µm, is none.
const ABSURD_UM: f64 = 1000.0;
/// A standard uncertainty of a touch below this, in µm, is one in mm.
const TOO_SMALL_UM: f64 = 0.005;

/// One touch.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Touch {
    /// Index into the setups of the configuration.
    pub setup: usize,
    pub repeat: usize,
    /// Number of the direction within the setup.
    pub direction: usize,
    /// Place that was read, from the nominal centre, in mm.
    pub place_mm: [f64; 2],
    /// Angle of the touch in the machine, as seen from the centre of the ring.
    pub angle: f64,
    /// Reading less the radius of the ring, in µm, from that centre.
    pub reading_um: f64,
    /// Time, −1 at the first touch and 1 at the last.
    pub time: f64,
    /// Standard uncertainty stated for this touch, relative to the others'.
    pub std_um: Option<f64>,
}

/// All touches of a file.
#[derive(Debug, Clone)]
pub(crate) struct Touches {
    pub all: Vec<Touch>,
    /// Setups that have touches, ascending.
    pub setups: Vec<usize>,
    /// Numbers of the repeats, ascending, as the file has them.
    pub repeats: Vec<usize>,
    /// Centre of the ring in each setup of the configuration, from which angles and readings count, in µm.
    pub centre_um: Vec<[f64; 2]>,
    pub ring_radius_mm: f64,
    pub remarks: Vec<String>,
}

impl Touches {
    /// Reads the columns of points.
    pub(crate) fn new(points: &Points, config: &TouchProbeConfig) -> Result<Self> {
        let object = || points.input.display().to_string();
        let column =
            |name: &str| points.columns.iter().find(|column| column.name == name).map(|known| &known.values[..]);
        let missing = |name: &str, about: &str| {
            Error::new("read", object(), format!("the column `{name}` is missing ({about})"))
                .help("a touch is setup, direction_deg and radius_mm, or setup, x_mm and y_mm")
        };
        let Some(labels) = points.labels("setup") else { return Err(missing("setup", "id of the setup")) };
        let mut remarks = Vec::new();
        let places = places(&column, &missing, &mut remarks)?;
        let count = places.len();
        if let Some(row) =
            places.iter().position(|[x, y]| x.hypot(*y).partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater))
        {
            let problem = format!(
                "row {}, of setup `{}`, reads 0 mm from the nominal centre: it is no touch",
                row + 1,
                labels[row]
            );
            return Err(Error::new("read", object(), problem).help("take out the rows of touches that were not made"));
        }
        let setups = labels.iter().map(|label| {
            config.setups.iter().position(|setup| setup.id == *label).ok_or_else(|| {
                let known = known_names(label, config.setups.iter().map(|setup| setup.id.as_str()));
                Error::new(
                    "read",
                    object(),
                    format!("a touch is of the setup `{label}`, which `setups` does not declare"),
                )
                .help(known)
            })
        });
        let setups = setups.collect::<Result<Vec<usize>>>()?;
        let commanded: Vec<f64> = match column("direction_deg") {
            Some(angles) => angles.to_vec(),
            None => places.iter().map(|[x, y]| y.atan2(*x).to_degrees()).collect(),
        };
        let direction = directions(&setups, &commanded);
        let repeat = match column("repeat") {
            Some(numbers) => whole(numbers).ok_or_else(|| {
                Error::new("read", object(), "the column `repeat` has a number that is not whole, or below 0")
            })?,
            None => occurrences(&setups, &direction),
        };
        let time = match column("time_s") {
            Some(time) => scaled(time),
            None => scaled(&(0..count).map(|row| row as f64).collect::<Vec<_>>()),
        };
        let std = column("std_um");
        if let Some(row) = std.and_then(|std| std.iter().position(|value| !(value.is_finite() && *value > 0.0))) {
            let problem = format!("row {row} of the column `std_um` is not above 0 µm");
            return Err(Error::new("read", object(), problem));
        }
        let all = (0..count).map(|row| Touch {
            setup: setups[row],
            repeat: repeat[row],
            direction: direction[row],
            place_mm: places[row],
            angle: 0.0,
            reading_um: 0.0,
            time: time[row],
            std_um: std.map(|std| std[row]).or(config.std_um),
        });
        let mut touches = Self {
            all: all.collect(),
            setups: distinct(&setups),
            repeats: distinct(&repeat),
            centre_um: vec![[0.0; 2]; config.setups.len()],
            ring_radius_mm: config.ring_radius_mm,
            remarks,
        };
        touches.recentre(&vec![[0.0; 2]; config.setups.len()]);
        touches.suspect(&commanded, config)?;
        touches.remarks.extend(points.copies());
        Ok(touches)
    }

    /// Counts angles and readings from centres that are moved by this, in µm: exact geometry, not its first order.
    pub(crate) fn recentre(&mut self, moved_um: &[[f64; 2]]) {
        for (centre, moved) in self.centre_um.iter_mut().zip(moved_um) {
            centre.iter_mut().zip(moved).for_each(|(centre, moved)| *centre += moved);
        }
        for touch in &mut self.all {
            let centre = self.centre_um[touch.setup];
            let [x, y] = [0, 1].map(|axis| touch.place_mm[axis] - 1e-3 * centre[axis]);
            touch.angle = y.atan2(x);
            touch.reading_um = 1e3 * (x.hypot(y) - self.ring_radius_mm);
        }
    }

    /// Refuses and warns of units that are not those of the columns.
    fn suspect(&mut self, commanded: &[f64], config: &TouchProbeConfig) -> Result<()> {
        let mean_mm = self.all.iter().map(|touch| touch.place_mm[0].hypot(touch.place_mm[1])).sum::<f64>()
            / self.all.len().max(1) as f64;
        let ratio = mean_mm / self.ring_radius_mm;
        let guess = match ratio {
            0.4..0.6 => Some("`ring_radius_mm` may be the diameter"),
            1.8..2.2 => Some("the readings may be diameters"),
            500.0..2000.0 => Some("the readings may be in µm"),
            0.0005..0.002 => Some("the readings may be in metres, or deviations from the radius"),
            _ => None,
        };
        if let Some(guess) = guess {
            let problem = format!(
                "the mean radius read is {mean_mm:.4}, and `ring_radius_mm` is {}: {guess}",
                self.ring_radius_mm
            );
            return Err(Error::new("read", "the touches", problem));
        }
        let deviation = 1e3 * (mean_mm - self.ring_radius_mm);
        if deviation.abs() > ABSURD_UM {
            self.remarks.push(format!(
                "the readings are {deviation:.0} µm from `ring_radius_mm` in the mean: is the radius right, and are both in mm?"
            ));
        }
        let in_radians = |angles: &[f64]| {
            angles.len() >= RADIANS.1
                && angles.iter().all(|angle| angle.abs() < RADIANS.0)
                && angles.iter().any(|a| *a != 0.0)
        };
        if in_radians(commanded) {
            self.remarks.push("all directions are within ±7°: `direction_deg` may be in radians".into());
        }
        let turned = || config.setups.iter().flat_map(|setup| [setup.ring_deg, setup.probe_deg]);
        if turned().any(|angle| angle != 0.0) && turned().all(|angle| angle.abs() < RADIANS.0) {
            self.remarks
                .push("all setups are turned by less than 7°: `ring_deg` and `probe_deg` may be in radians".into());
        }
        let small = |um: &f64| *um > 0.0 && *um < TOO_SMALL_UM;
        if (config.std_um.as_ref().is_some_and(small)
            || self.all.iter().filter_map(|touch| touch.std_um).all(|um| small(&um)))
            && self.all.iter().any(|touch| touch.std_um.is_some())
        {
            self.remarks.push("a standard uncertainty below 0.005 µm is stated: it may be in mm".into());
        }
        if config.ring_form_um.as_ref().is_some_and(small) {
            self.remarks.push("`ring_form_um` is below 0.005 µm: it may be in mm".into());
        }
        Ok(())
    }

    /// Touches of one setup and repeat, for all that there are.
    pub(crate) fn passes(&self) -> Vec<Vec<usize>> {
        let mut passes = Vec::new();
        for setup in &self.setups {
            for repeat in &self.repeats {
                let of = |index: &usize| self.all[*index].setup == *setup && self.all[*index].repeat == *repeat;
                let pass: Vec<usize> = (0..self.all.len()).filter(of).collect();
                if !pass.is_empty() {
                    passes.push(pass);
                }
            }
        }
        passes
    }
}

type ColumnOf<'a> = dyn Fn(&str) -> Option<&'a [f64]> + 'a;

/// Places from the nominal centre, in mm.
fn places<'a>(
    column: &(impl Fn(&str) -> Option<&'a [f64]> + 'a),
    missing: &dyn Fn(&str, &str) -> Error,
    remarks: &mut Vec<String>,
) -> Result<Vec<[f64; 2]>> {
    let column: &ColumnOf<'a> = column;
    match (column("x_mm"), column("y_mm"), column("radius_mm"), column("direction_deg")) {
        (Some(x), Some(y), radius, direction) => {
            let places: Vec<[f64; 2]> = x.iter().zip(y).map(|(x, y)| [*x, *y]).collect();
            if radius.is_some() {
                remarks.push("`x_mm` and `y_mm` are used, not `radius_mm`".into());
            }
            let off = direction.map_or(0.0, |angles| {
                let off = |([x, y], angle): (&[f64; 2], &f64)| {
                    let difference = y.atan2(*x).to_degrees() - angle;
                    (difference - 360.0 * (difference / 360.0).round()).abs()
                };
                places.iter().zip(angles).map(off).fold(0.0, f64::max)
            });
            if off > 2.0 {
                remarks.push(format!(
                    "`direction_deg` is up to {off:.1}° from the direction of `x_mm`, `y_mm`, which count: is the nominal centre \
                     at 0, 0, and is the direction in degrees?"
                ));
            }
            Ok(places)
        }
        (Some(_), None, ..) => Err(missing("y_mm", "place read along y, from the nominal centre, in mm")),
        (None, Some(_), ..) => Err(missing("x_mm", "place read along x, from the nominal centre, in mm")),
        (None, None, None, _) => Err(missing("radius_mm", "radius read, from the nominal centre, in mm")),
        (None, None, _, None) => {
            Err(missing("direction_deg", "direction of the touch in the machine, from the nominal centre, in deg"))
        }
        (None, None, Some(radius), Some(angles)) => {
            let place = |(radius, angle): (&f64, &f64)| {
                let (sine, cosine) = angle.to_radians().sin_cos();
                [radius * cosine, radius * sine]
            };
            Ok(radius.iter().zip(angles).map(place).collect())
        }
    }
}

fn distinct(numbers: &[usize]) -> Vec<usize> {
    let mut all = numbers.to_vec();
    all.sort_unstable();
    all.dedup();
    all
}

fn whole(numbers: &[f64]) -> Option<Vec<usize>> {
    numbers.iter().map(|number| (*number >= 0.0 && number.fract() == 0.0).then_some(*number as usize)).collect()
}

/// From −1 to 1.
fn scaled(time: &[f64]) -> Vec<f64> {
    let first = time.iter().copied().fold(f64::INFINITY, f64::min);
    let last = time.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let span = last - first;
    time.iter().map(|at| if span > 0.0 { 2.0 * (at - first) / span - 1.0 } else { 0.0 }).collect()
}

/// The number of each direction within its setup.
fn directions(setups: &[usize], commanded_deg: &[f64]) -> Vec<usize> {
    let turned: Vec<f64> = commanded_deg.iter().map(|angle| angle.rem_euclid(360.0)).collect();
    let mut order: Vec<usize> = (0..setups.len()).collect();
    order.sort_by(|a, b| setups[*a].cmp(&setups[*b]).then(turned[*a].total_cmp(&turned[*b])));
    let mut numbers = vec![0; setups.len()];
    let (mut number, mut begun) = (0, order.first().copied());
    let mut first_of_setup = begun.map(|first| (first, 0));
    for row in order {
        let Some(start) = begun else { break };
        if setups[row] != setups[start] {
            (number, begun, first_of_setup) = (number + 1, Some(row), Some((row, number + 1)));
        } else if turned[row] - turned[start] > SAME_DIRECTION_DEG {
            (number, begun) = (number + 1, Some(row));
        }
        numbers[row] = number;
        // The last directions may be those of the first, a turn later.
        if let Some((first, own)) = first_of_setup
            && turned[first] + 360.0 - turned[row] < SAME_DIRECTION_DEG
        {
            numbers[row] = own;
        }
    }
    numbers
}

/// How often each touch's direction was touched before.
fn occurrences(setups: &[usize], directions: &[usize]) -> Vec<usize> {
    let mut seen = std::collections::BTreeMap::new();
    let number = |(setup, direction): (&usize, &usize)| {
        let count = seen.entry((*setup, *direction)).or_insert(0);
        *count += 1;
        *count - 1
    };
    setups.iter().zip(directions).map(number).collect()
}
