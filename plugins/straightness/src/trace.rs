//! One trace along the axis.

use std::cmp::Ordering;

use runout_core::{
    Error, Result,
    points::{Points, Trace},
};

/// Below this there is no cubic between readings.
const FEWEST_POINTS: usize = 4;

/// A gap is wider than this many steps and spacings.
const GAP: f64 = 3.0;

/// Readings along z, ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct AxialTrace {
    /// Its name in the file.
    pub id: String,
    /// Strictly ascending positions, in mm; four or more.
    pub z_mm: Vec<f64>,
    /// One reading a position, in µm.
    pub reading_um: Vec<f64>,
}

impl AxialTrace {
    /// A trace of a file. One with falling z is turned round.
    ///
    /// # Errors
    /// When it has too few points, or its z neither rises nor falls throughout.
    pub fn of(points: &Points, trace: &Trace) -> Result<Self> {
        let column = |name| -> Result<Vec<f64>> {
            Ok(points.column(name)?.get(trace.points.clone()).unwrap_or_default().to_vec())
        };
        let (mut z_mm, mut reading_um) = (column("z_mm")?, column("reading_um")?);
        let refuse = |problem: String| {
            Error::new("separate", format!("trace {} of {}", trace.id, points.input.display()), problem)
        };
        if z_mm.len() < FEWEST_POINTS {
            let problem = format!("it has {} points; {FEWEST_POINTS} are needed", z_mm.len());
            return Err(refuse(problem).help("take it out of the file, or measure it with more points"));
        }
        if z_mm.first() > z_mm.last() {
            z_mm.reverse();
            reading_um.reverse();
        }
        if let Some(pair) = z_mm.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]) != Some(Ordering::Less)) {
            let problem = if pair[0].total_cmp(&pair[1]).is_eq() {
                format!("z = {} mm is there twice", pair[0])
            } else {
                format!("z goes back between {} and {} mm", pair[1], pair[0])
            };
            return Err(refuse(problem).help(
                "z has to rise or fall throughout a trace: sort its rows, or give a second pass a name of its own",
            ));
        }
        Ok(Self { id: trace.id.clone(), z_mm, reading_um })
    }

    /// First and last position, in mm.
    pub fn range_mm(&self) -> [f64; 2] {
        [self.z_mm.first(), self.z_mm.last()].map(|z| z.copied().unwrap_or(f64::NAN))
    }

    /// Median distance of neighbouring positions, in mm.
    pub fn spacing_mm(&self) -> f64 {
        let mut spacings: Vec<f64> = self.z_mm.windows(2).map(|pair| pair[1] - pair[0]).collect();
        spacings.sort_by(f64::total_cmp);
        spacings.get(spacings.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// Points beyond a range.
    pub fn beyond(&self, [first, last]: [f64; 2]) -> usize {
        self.z_mm.iter().filter(|z| !(first..=last).contains(*z)).count()
    }

    /// Where it has no points for long, in words.
    pub fn gaps(&self, [first, last]: [f64; 2], step_mm: f64) -> Vec<String> {
        let wide = GAP * step_mm.max(self.spacing_mm());
        let within = |pair: &&[f64]| pair[1] > first && pair[0] < last && pair[1] - pair[0] > wide;
        let said = |pair: &[f64]| {
            format!("trace {} has no points from {} to {} mm: a straight line stands there", self.id, pair[0], pair[1])
        };
        self.z_mm.windows(2).filter(within).map(said).collect()
    }
}
