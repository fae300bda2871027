//! The positions that all traces can be brought to.

use std::path::Path;

use runout_core::{Error, ErrorKind, Result};

use crate::trace::AxialTrace;

/// More positions would be a mistaken step.
const MOST_POSITIONS: f64 = 1e6;
/// Two positions have no deviation from a line.
const FEWEST_POSITIONS: usize = 3;

/// The range that all traces cover.
pub(crate) fn common_range(file: &Path, all: &[&AxialTrace]) -> Result<[f64; 2]> {
    let start = |trace: &&&AxialTrace| trace.range_mm()[0];
    let end = |trace: &&&AxialTrace| trace.range_mm()[1];
    let latest = all.iter().max_by(|a, b| start(a).total_cmp(&start(b)));
    let earliest = all.iter().min_by(|a, b| end(a).total_cmp(&end(b)));
    match (latest, earliest) {
        (Some(latest), Some(earliest)) if start(&latest) < end(&earliest) => Ok([start(&latest), end(&earliest)]),
        (Some(latest), Some(earliest)) => {
            let (begins, ends) = (start(&latest), end(&earliest));
            let [of_latest, of_earliest] =
                [latest, earliest].map(|trace| trace.rows.map(|row| row.to_string()).join(" to "));
            let problem = format!(
                "trace {} begins at {begins} mm, where {} has ended ({ends} mm): column z_mm, points {of_latest} and \
                 {of_earliest} of the file",
                latest.id, earliest.id
            );
            Err(Error::new("separate", file.display().to_string(), problem)
                .of(ErrorKind::InsufficientData)
                .help("all traces have to share a range of z, in the part's own coordinate"))
        }
        _ => {
            Err(Error::new("separate", file.display().to_string(), "it has no traces").of(ErrorKind::InsufficientData))
        }
    }
}

/// Where straightness is given.
pub(crate) fn positions(step_mm: Option<f64>, file: &Path, all: &[&AxialTrace], range: [f64; 2]) -> Result<Vec<f64>> {
    let [first, last] = range;
    let z_mm = match (step_mm, all) {
        (None, [one, others @ ..]) if others.iter().all(|other| other.z_mm == one.z_mm) => one.z_mm.clone(),
        (step, _) => {
            // Without a step given, the ends fit; with one, the last position may only seem to be beyond.
            let steps = match step {
                None => ((last - first) / coarsest_mm(all)).round().max(1.0),
                Some(step) => ((last - first) / step + 1e-6).floor(),
            };
            let step = step.unwrap_or((last - first) / steps);
            if steps > MOST_POSITIONS {
                let problem = format!("a step of {step} mm makes {steps:.0} positions of {:.3} mm", last - first);
                return Err(Error::new("separate", file.display().to_string(), problem)
                    .of(ErrorKind::InsufficientData)
                    .help("set a larger `step_mm` in [separate]"));
            }
            (0..=steps as usize).map(|index| (first + step * index as f64).min(last)).collect()
        }
    };
    if z_mm.len() < FEWEST_POSITIONS {
        let problem = format!(
            "all traces share z = {first} to {last} mm: {} positions, and {FEWEST_POSITIONS} are needed",
            z_mm.len()
        );
        return Err(Error::new("separate", file.display().to_string(), problem)
            .of(ErrorKind::InsufficientData)
            .help("measure a longer common range, or set a smaller `step_mm` in [separate]"));
    }
    Ok(z_mm)
}

/// Largest of the traces' median spacings, in mm.
pub(crate) fn coarsest_mm(all: &[&AxialTrace]) -> f64 {
    all.iter().map(|trace| trace.spacing_mm()).fold(0.0, f64::max)
}
