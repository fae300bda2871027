//! One trace along the axis.

use std::cmp::Ordering;

use runout_core::{
    Error, ErrorKind, Result,
    points::{Points, Trace},
};

/// Below this there is no cubic between readings.
const FEWEST_POINTS: usize = 4;

/// A gap is wider than this many steps and spacings.
const GAP: f64 = 3.0;

/// Readings along z, ascending.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AxialTrace {
    /// Its name in the file.
    pub id: String,
    /// Rows of the file's points that it has, counted from 1.
    pub rows: [usize; 2],
    /// Strictly ascending positions, in mm; four or more.
    pub z_mm: Vec<f64>,
    /// One reading a position, in µm.
    pub reading_um: Vec<f64>,
    /// When each reading was taken: 0 at the first of the file, 1 at the last.
    pub time: Vec<f64>,
    /// Points that a flag leaves out.
    pub flagged: usize,
}

impl AxialTrace {
    /// A trace of a file, without the points that are flagged. One with falling z is turned round.
    ///
    /// # Errors
    /// When it has too few points, or its z neither rises nor falls throughout.
    pub(crate) fn of(points: &Points, trace: &Trace) -> Result<Self> {
        let [first_row, last_row] = [trace.points.start + 1, trace.points.end];
        let refuse = |problem: String| {
            Error::new("separate", format!("trace {} of {}", trace.id, points.input.display()), problem)
                .of(ErrorKind::InsufficientData)
        };
        let used: Vec<usize> = match points.column("flag") {
            Ok(flags) => trace.points.clone().filter(|row| flags.get(*row).is_none_or(|flag| *flag < 0.5)).collect(),
            Err(_) => trace.points.clone().collect(),
        };
        let column = |name| -> Result<Vec<f64>> {
            let values = points.column(name)?;
            Ok(used.iter().filter_map(|row| values.get(*row).copied()).collect())
        };
        let (mut z_mm, mut reading_um) = (column("z_mm")?, column("reading_um")?);
        let flagged = trace.points.len() - used.len();
        if z_mm.len() < FEWEST_POINTS {
            let without = if flagged > 0 { format!(" without the {flagged} that are flagged") } else { String::new() };
            let problem = format!("it has {} points{without}; {FEWEST_POINTS} are needed", z_mm.len());
            return Err(refuse(problem).help("take it out of the file, or measure it with more points"));
        }
        let mut time = match column("time_s") {
            Ok(time_s) => {
                if let Some(at) =
                    time_s.windows(2).position(|pair| pair[0].partial_cmp(&pair[1]) != Some(Ordering::Less))
                {
                    let problem = format!("time_s does not rise from {} to {} s", time_s[at], time_s[at + 1]);
                    return Err(refuse(problem).help("sort its rows in the order in which they were measured"));
                }
                from_0_to_1(&time_s)
            }
            Err(_) => from_0_to_1(&z_mm),
        };
        if z_mm.first() > z_mm.last() {
            z_mm.reverse();
            reading_um.reverse();
            time.reverse();
        }
        if let Some(pair) = z_mm.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]) != Some(Ordering::Less)) {
            let problem = if pair[0].total_cmp(&pair[1]).is_eq() {
                format!("z = {} mm is there twice", pair[0])
            } else {
                format!("z goes back between {} and {} mm", pair[1], pair[0])
            };
            let problem = format!("{problem} (column z_mm, points {first_row} to {last_row} of the file)");
            return Err(refuse(problem).help(
                "z has to rise or fall throughout a trace: sort its rows, or give a second pass a name of its own",
            ));
        }
        Ok(Self { id: trace.id.clone(), rows: [first_row, last_row], z_mm, reading_um, time, flagged })
    }

    /// First and last position, in mm.
    pub(crate) fn range_mm(&self) -> [f64; 2] {
        [self.z_mm.first(), self.z_mm.last()].map(|z| z.copied().unwrap_or(f64::NAN))
    }

    /// Median distance of neighbouring positions, in mm.
    pub(crate) fn spacing_mm(&self) -> f64 {
        let mut spacings: Vec<f64> = self.z_mm.windows(2).map(|pair| pair[1] - pair[0]).collect();
        spacings.sort_by(f64::total_cmp);
        spacings.get(spacings.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// Points beyond a range.
    pub(crate) fn beyond(&self, [first, last]: [f64; 2]) -> usize {
        self.z_mm.iter().filter(|z| !(first..=last).contains(*z)).count()
    }

    /// Where it has no points for long within a range: the positions on both sides.
    pub(crate) fn gaps(&self, [first, last]: [f64; 2], step_mm: f64) -> Vec<[f64; 2]> {
        let wide = GAP * step_mm.max(self.spacing_mm());
        let pairs = self.z_mm.windows(2).map(|pair| [pair[0], pair[1]]);
        pairs.filter(|[from, to]| *to > first && *from < last && to - from > wide).collect()
    }

    /// With neighbouring points averaged, so that there are no more than `most`.
    pub(crate) fn condensed(&self, most: usize) -> Self {
        let block = self.z_mm.len().div_ceil(most.max(1));
        if block < 2 {
            return self.clone();
        }
        let means = |values: &[f64]| -> Vec<f64> {
            values.chunks(block).map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64).collect()
        };
        Self { z_mm: means(&self.z_mm), reading_um: means(&self.reading_um), time: means(&self.time), ..self.clone() }
    }
}

/// Values along a trace, from 0 at its first row to 1 at its last.
fn from_0_to_1(values: &[f64]) -> Vec<f64> {
    let first = values.first().copied().unwrap_or_default();
    let length = values.last().map_or(1.0, |last| last - first);
    values.iter().map(|value| (value - first) / length).collect()
}
