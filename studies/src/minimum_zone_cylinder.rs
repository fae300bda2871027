//! The minimum-zone cylinder beside a global search that shares nothing with it.

use std::{f64::consts::TAU, fmt::Write, path::Path, time::Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::{
    Error, Result,
    standards::{cylindricity::Points, reference::Reference},
};

/// Zones may differ by that: rounding of coordinates of 15 mm and of distances from an axis, in µm, with room.
pub const ROUNDING_UM: f64 = 1e-9;
/// Evaluations of the width from one start.
const EVALUATIONS: usize = 800;

/// A wall: (angle in rad, z in mm, radial deviation in µm), and its nominal radius.
pub struct Wall {
    /// What it is called.
    pub name: String,
    /// In mm.
    pub radius_mm: f64,
    /// Its points.
    pub points: Vec<(f64, f64, f64)>,
}

/// What was found on one wall, in µm.
pub struct Row {
    /// The wall.
    pub name: String,
    /// Its points.
    pub points: usize,
    /// CYLt about LSCY.
    pub lscy_um: f64,
    /// CYLt about MZCY.
    pub mzcy_um: f64,
    /// Time for MZCY, in ms.
    pub took_ms: f64,
    /// The narrowest zone of the global search, and the widest that a start ended with.
    pub searched_um: [f64; 2],
}

impl Wall {
    /// Sections of a simulated cylinder: lobes that twist, bow, taper, noise.
    #[must_use]
    pub fn simulated(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let size = 10_f64.powf(rng.random_range(-0.5..1.0));
        let mut unit = || rng.random_range(-1.0..1.0);
        let [x, y, u, v, taper, bow] = std::array::from_fn(|_| unit());
        let lobes: [[f64; 3]; 6] = std::array::from_fn(|_| [unit(), 3.2 * unit(), unit()]);
        let mut points = Vec::new();
        for ring in 0..8 {
            let height = f64::from(ring) / 3.5 - 1.0;
            for step in 0..120 {
                let angle = TAU * f64::from(step) / 120.0;
                let terms = (2..).zip(&lobes).map(|(order, [a, phase, twist])| {
                    a / f64::from(order) * (f64::from(order) * angle + phase + twist * height).cos()
                });
                let centre = (x + u * height + bow * height * height) * angle.cos() + (y + v * height) * angle.sin();
                let form = terms.sum::<f64>() + centre + 0.5 * taper * height + 0.1 * unit();
                points.push((angle, 25.0 * (height + 1.0), size * form));
            }
        }
        Self { name: format!("simulated {seed}"), radius_mm: 15.0, points }
    }

    /// The circles of a file of measured points.
    ///
    /// # Errors
    /// When it cannot be read, or holds no circle.
    pub fn measured(path: &Path, radius_mm: f64) -> Result<Self> {
        let file = runout_points::read(path, &runout_cylinder::COLUMNS)?;
        let [z, angle, form] = [file.column("z_mm")?, file.column("angle_deg")?, file.column("deviation_um")?];
        let circles = file.traces.iter().filter(|trace| trace.kind == "circle");
        let points = circles.flat_map(|trace| trace.points.clone());
        let points: Vec<_> = points.map(|point| (angle[point].to_radians(), z[point], form[point])).collect();
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        if points.is_empty() {
            return Err(Error::new("read", name, "it holds no circles"));
        }
        Ok(Self { name, radius_mm, points })
    }

    /// Both cylinders, and a search from `starts` axes drawn by chance.
    ///
    /// # Errors
    /// When the wall determines no cylinder.
    pub fn study(&self, starts: usize) -> Result<Row> {
        let points = Points::new(self.radius_mm, self.points.iter().copied());
        let width = |reference: Reference| {
            let found = points.reference(reference).map(|cylinder| points.values(&cylinder).cylt_um);
            found.ok_or_else(|| {
                Error::new("find", reference.cylinder_symbol(), format!("{} determines none", self.name))
            })
        };
        let lscy_um = width(Reference::LeastSquares)?;
        let start = Instant::now();
        let mzcy_um = width(Reference::MinimumZone)?;
        let took_ms = 1e3 * start.elapsed().as_secs_f64();
        let search = Search::new(self);
        let mut rng = ChaCha8Rng::seed_from_u64(self.points.len() as u64);
        let mut searched_um = [f64::INFINITY, 0.0_f64];
        for _ in 0..starts {
            let mut draw = |size: f64| std::array::from_fn(|_| rng.random_range(-size..size));
            let (start, spread) = (draw(search.span_um), draw(0.3 * search.span_um));
            let found = search.downhill(start, spread);
            searched_um = [searched_um[0].min(found), searched_um[1].max(found)];
        }
        Ok(Row { name: self.name.clone(), points: self.points.len(), lscy_um, mzcy_um, took_ms, searched_um })
    }
}

/// A search for the narrowest zone by its width alone.
struct Search {
    /// Coordinates in µm, heights from the middle.
    places: Vec<[f64; 3]>,
    half_um: f64,
    span_um: f64,
}

/// An axis: where it is midway and how far it leans until the end, in µm.
type Axis = [f64; 4];

impl Search {
    fn new(wall: &Wall) -> Self {
        let heights = || wall.points.iter().map(|(_, z, _)| 1e3 * z);
        let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let places = wall.points.iter().map(|(angle, z, form)| {
            let radius = 1e3 * wall.radius_mm + form;
            [radius * angle.cos(), radius * angle.sin(), 1e3 * z - 0.5 * (low + high)]
        });
        let span_um = wall.points.iter().fold(0.0, |span: f64, (_, _, form)| span.max(form.abs()));
        Self { places: places.collect(), half_um: 0.5 * (high - low), span_um }
    }

    /// The zone's width about an axis: distances by the cross product with its direction.
    fn width(&self, axis: &Axis) -> f64 {
        let [a, b] = [axis[2] / self.half_um, axis[3] / self.half_um];
        let length = 1.0 + a * a + b * b;
        let squares = self.places.iter().map(|[x, y, z]| {
            let (x, y) = (x - axis[0], y - axis[1]);
            let (i, j, k) = (y - z * b, z * a - x, x * b - y * a);
            i * i + j * j + k * k
        });
        let ends = squares.fold((f64::INFINITY, 0.0), |(low, high), square| (low.min(square), f64::max(high, square)));
        (ends.1 / length).sqrt() - (ends.0 / length).sqrt()
    }

    /// Nelder and Mead's simplex (*Computer Journal* 7 (1965) 308), begun anew where it has shrunk to nothing.
    fn downhill(&self, start: Axis, spread: Axis) -> f64 {
        let mut best = (self.width(&start), start);
        let mut spent = 0;
        let mut size = 1.0;
        while spent < EVALUATIONS {
            let mut corners = vec![best];
            for k in 0..4 {
                let mut axis = best.1;
                axis[k] += size * spread[k];
                corners.push((self.width(&axis), axis));
            }
            let before = spent;
            while spent < EVALUATIONS {
                corners.sort_by(|a, b| a.0.total_cmp(&b.0));
                if corners[4].0 - corners[0].0 < 1e-12 || spent > before + EVALUATIONS / 2 {
                    break;
                }
                let middle: Axis =
                    std::array::from_fn(|k| 0.25 * corners[..4].iter().map(|(_, axis)| axis[k]).sum::<f64>());
                let away = |factor: f64| -> (f64, Axis) {
                    let axis = std::array::from_fn(|k| middle[k] + factor * (corners[4].1[k] - middle[k]));
                    (self.width(&axis), axis)
                };
                let mirrored = away(-1.0);
                let next = if mirrored.0 < corners[0].0 {
                    let farther = away(-2.0);
                    if farther.0 < mirrored.0 { farther } else { mirrored }
                } else if mirrored.0 < corners[3].0 {
                    mirrored
                } else {
                    away(if mirrored.0 < corners[4].0 { -0.5 } else { 0.5 })
                };
                spent += 2;
                if next.0 < corners[4].0 {
                    corners[4] = next;
                } else {
                    for corner in 1..5 {
                        let axis = std::array::from_fn(|k| 0.5 * (corners[corner].1[k] + corners[0].1[k]));
                        corners[corner] = (self.width(&axis), axis);
                    }
                    spent += 4;
                }
            }
            let found = corners.into_iter().fold(best, |best, corner| if corner.0 < best.0 { corner } else { best });
            (best, size) = (found, 0.3 * size);
        }
        best.0
    }
}

/// The table as Markdown: of many simulated walls the worst, of others each.
#[must_use]
pub fn table(rows: &[Row], starts: usize) -> String {
    let mut text = format!(
        "| wall | points | CYLt about LSCY | about MZCY | narrowest of {starts} starts, less MZCY | widest, less MZCY | time |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n"
    );
    for row in rows {
        let [narrowest, widest] = row.searched_um.map(|width| width - row.mzcy_um);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {} | {:.6} µm | {:.6} µm | {narrowest:+.2e} µm | {widest:+.2e} µm | {:.2} ms |",
            row.name, row.points, row.lscy_um, row.mzcy_um, row.took_ms,
        );
    }
    let worse = rows.iter().filter(|row| row.mzcy_um > row.searched_um[0] + ROUNDING_UM).count();
    let _ = writeln!(text, "\nMZCY is wider than what a start ended with on {worse} of {} walls", rows.len());
    text
}
