//! What a format gives of a file, and what is asked of it.

use runout_core::{
    Error, ErrorKind, Result,
    height_grid::{GridPlaces, HeightGrid},
    length_unit::micrometres,
};

/// Most points of a map: 1.6 GB of heights.
pub(crate) const MOST_POINTS: usize = 200_000_000;
/// mm in a metre, nm in a metre, nm in a micrometre.
pub(crate) const MM_PER_M: f64 = 1e3;
pub(crate) const NM_PER_M: f64 = 1e9;
pub(crate) const NM_PER_UM: f64 = 1e3;

/// A height map, or a profile as a map of one row, as a file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// The format's name: "X3P".
    pub format: &'static str,
    /// The heights.
    pub grid: HeightGrid,
    /// Names of all the maps that the file holds; the one that was read among them.
    pub layers: Vec<String>,
    /// What the file says of itself: its creator, date, instrument. Names and texts.
    pub about: Vec<(String, String)>,
    /// What the user should know of the file.
    pub remarks: Vec<String>,
}

/// What is asked of a file beside its contents.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Wanted {
    /// Name or number, from 1, of the map that is read; the first one without it.
    pub layer: Option<String>,
    /// Unit of heights of a file that names none; of text the unit of coordinates too.
    pub unit: Option<String>,
    /// Distances of columns and rows, in mm, of a matrix as text that names none.
    pub step_mm: [Option<f64>; 2],
}

impl Wanted {
    /// The place among these of the map that is asked for, and a remark where the file has others that were not asked about.
    pub(crate) fn pick(&self, names: &[String], shown: &str) -> Result<(usize, Option<String>)> {
        let Some(layer) = &self.layer else {
            let others = (names.len() > 1).then(|| {
                format!(
                    "the file has {} maps ({}); the first one is read: `layer` in [load] names another",
                    names.len(),
                    names.join(", ")
                )
            });
            return Ok((0, others));
        };
        let by_number =
            || layer.parse::<usize>().ok().filter(|number| (1..=names.len()).contains(number)).map(|number| number - 1);
        let place = names.iter().position(|name| name == layer).or_else(by_number);
        let place = place.ok_or_else(|| {
            let problem = format!("it has no map `{layer}`");
            Error::new("read", shown, problem).help(format!(
                "its maps are {}, or 1 to {}",
                names.join(", "),
                names.len()
            ))
        })?;
        Ok((place, None))
    }

    /// nm in one of the file's unit of heights, or of the unit that is asked for.
    pub(crate) fn nanometres(&self, of_file: &str, shown: &str) -> Result<f64> {
        let asked = || self.unit.as_deref().and_then(micrometres);
        micrometres(of_file).or_else(asked).map(|um| NM_PER_UM * um).ok_or_else(|| {
            let problem = format!("its heights have the unit `{of_file}`, which is no length");
            Error::new("read", shown, problem).help("`unit = \"um\"` in [load] says what they are")
        })
    }
}

/// Checks what a header declares of a map: rows and columns, steps in mm.
pub(crate) fn checked_size(shown: &str, [rows, columns]: [u64; 2], step_mm: [f64; 2]) -> Result<usize> {
    let damaged = |problem: String| Error::new("read", shown, problem).of(ErrorKind::DamagedData);
    let points = rows.checked_mul(columns).filter(|points| *points <= MOST_POINTS as u64);
    let Some(points) = points else {
        return Err(damaged(format!("{rows} by {columns} points are more than {MOST_POINTS}")));
    };
    if columns < 2 || rows < 1 {
        return Err(damaged(format!("{rows} rows of {columns} points are no map and no profile")));
    }
    if let Some(step) = step_mm.iter().find(|step| !(step.is_finite() && **step > 0.0)) {
        return Err(damaged(format!("its points are {step} mm apart; expected a distance above 0")));
    }
    Ok(points as usize)
}

/// The grid of listed points, or the row of a profile where all have the same y.
pub(crate) fn places(x_mm: &[f64], y_mm: &[f64], shown: &str) -> Result<GridPlaces> {
    let is_row = y_mm.windows(2).all(|pair| pair[0].total_cmp(&pair[1]).is_eq());
    let found = match y_mm.first() {
        Some(y_mm) if is_row => GridPlaces::along(x_mm, *y_mm),
        _ => GridPlaces::of(x_mm, y_mm),
    };
    found.map_err(|problem| Error::new("read the grid of", shown, problem))
}

/// The error of a file that its own contents contradict.
pub(crate) fn damaged(shown: &str, problem: impl std::fmt::Display) -> Error {
    Error::new("read", shown, problem.to_string()).of(ErrorKind::DamagedData)
}

/// The error of what the operating system or a decoder refuses; a file that ends early is damaged.
pub(crate) fn failed(shown: &str, error: impl std::error::Error + Send + Sync + 'static) -> Error {
    let error = Error::caused("read", shown, error);
    if error.kind() == ErrorKind::UnsuitableData { error.of(ErrorKind::DamagedData) } else { error }
}
