//! The stages that the configuration states, in their order: crop, outliers, form, voids.

use runout_core::{
    Error, ErrorKind, Result,
    height_grid::HeightGrid,
    summary::Value,
    table::{ColumnSpec, TableRows, TableSpec, counts, texts},
};

use crate::{
    config::{AsMeasuredConfig, Voids},
    filling,
    form::remove,
    neighbours::outliers,
};

/// One stage, as the result names it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stage {
    pub name: &'static str,
    pub setting: String,
    pub points: usize,
}

/// A map or a profile behind all stages.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Staged {
    /// Heights that values are computed from.
    pub grid: HeightGrid,
    /// Name of the form that was removed.
    pub reference: String,
    pub stages: Vec<Stage>,
    /// Nodes that were filled, with a column of the height parameters' uncertainty by it.
    pub filled: usize,
    pub by_filling: Option<TableRows>,
    /// The standard uncertainty of Sq by filling, in nm.
    pub sq_by_filling_nm: Option<f64>,
    pub values: Vec<Value>,
}

/// The table of the stages.
pub(crate) fn table() -> TableSpec {
    TableSpec::new(
        "stages",
        "what was done to the points before values were computed, in this order",
        vec![
            ColumnSpec::name("stage", "crop, outliers, form, voids"),
            ColumnSpec::name("setting", "how, and what was found"),
            ColumnSpec::count("points", "", "points that it left out, changed or filled"),
        ],
    )
}

/// The table of what filling does to values.
pub(crate) fn filling_table() -> TableSpec {
    TableSpec::new(
        "filling",
        "height parameters of the unfiltered map with its voids filled, and their standard uncertainty by the filling alone",
        vec![
            ColumnSpec::name("symbol", "the height parameter (ISO 25178-2, 4.2)"),
            ColumnSpec::number("value", "", "its value, in `unit`"),
            ColumnSpec::number("std_value", "", "its standard uncertainty by the filling: what filled voids of this pattern change elsewhere on the map"),
            ColumnSpec::name("unit", "unit of both"),
        ],
    )
    .optional()
}

/// Rows of the table of the stages.
pub(crate) fn rows(stages: &[Stage]) -> Result<TableRows> {
    let spec = table();
    let rows = spec.rows(vec![
        texts(stages.iter().map(|stage| stage.name)),
        texts(stages.iter().map(|stage| stage.setting.as_str())),
        counts(stages.iter().map(|stage| stage.points)),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}

/// The stages in words, for the notes of a result.
pub(crate) fn sentence(stages: &[Stage]) -> String {
    let each = stages.iter().map(|stage| format!("{}: {} ({} points)", stage.name, stage.setting, stage.points));
    format!("stages before the values, in this order: {}", each.collect::<Vec<_>>().join("; "))
}

/// Takes a grid through the stages; a profile is a grid of one row.
///
/// # Errors
/// When too few points are left, or they do not determine the form.
pub(crate) fn staged(mut grid: HeightGrid, config: &AsMeasuredConfig, object: &str) -> Result<Staged> {
    let mut stages = Vec::new();
    if let Some(crop) = config.crop {
        let before = grid.height_nm.len();
        grid = cropped(&grid, crop.x_mm, crop.y_mm).map_err(|problem| {
            Error::new("crop", object, problem)
                .of(ErrorKind::InsufficientData)
                .help("`crop` in [separate] counts x and y as the file does")
        })?;
        let along =
            |axis: &str, ends: Option<[f64; 2]>| ends.map(|[from, to]| format!("{axis} from {from} to {to} mm"));
        let ends: Vec<String> = along("x", crop.x_mm).into_iter().chain(along("y", crop.y_mm)).collect();
        stages.push(Stage { name: "crop", setting: ends.join(", "), points: before - grid.height_nm.len() });
    }
    if let Some(mads) = config.outlier_mad {
        let found = outliers(&grid.height_nm, grid.columns, mads);
        grid.height_nm.iter_mut().zip(&found).filter(|(_, is_one)| **is_one).for_each(|(height, _)| *height = f64::NAN);
        let setting = format!("further than {mads} median absolute deviations from the median of their neighbours");
        stages.push(Stage { name: "outliers", setting, points: found.iter().filter(|is_one| **is_one).count() });
    }
    let measured = grid.height_nm.len() - grid.holes();
    if measured < 2 {
        return Err(
            Error::new("evaluate", object, format!("{measured} points are left")).of(ErrorKind::InsufficientData)
        );
    }
    let removed = remove(&mut grid, config, object)?;
    stages.push(Stage { name: "form", setting: format!("{}{}", removed.name, removed.found), points: measured });
    let mut staged = Staged {
        reference: removed.name,
        values: removed.values,
        filled: 0,
        by_filling: None,
        sq_by_filling_nm: None,
        stages,
        grid,
    };
    if config.voids == Voids::Fill {
        staged.fill()?;
    }
    Ok(staged)
}

impl Staged {
    fn fill(&mut self) -> Result<()> {
        let (heights, count) = filling::filled(&self.grid);
        if count > 0 {
            if let Some(found) = filling::uncertain(&self.grid, &heights) {
                let spec = filling_table();
                let rows = spec.rows(vec![
                    texts(found.symbols),
                    runout_core::table::numbers(found.values),
                    runout_core::table::numbers(found.std),
                    texts(found.units),
                ])?;
                self.by_filling = Some(TableRows { table: spec.name, rows });
                self.sq_by_filling_nm = Some(found.std[0]);
            }
            self.grid.height_nm = heights;
        }
        self.filled = count;
        let setting = "filled by the nearest heights along row and column, weighted by the inverse distance";
        self.stages.push(Stage { name: "voids", setting: setting.into(), points: count });
        Ok(())
    }
}

/// The part of a grid between these ends.
fn cropped(
    grid: &HeightGrid,
    x_mm: Option<[f64; 2]>,
    y_mm: Option<[f64; 2]>,
) -> std::result::Result<HeightGrid, String> {
    let range = |ends: Option<[f64; 2]>, origin: f64, step: f64, count: usize| {
        let [from, to] = ends.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        // A hundredth of a step beside an end is on it.
        let first = ((from - origin) / step - 0.01).ceil().max(0.0) as usize;
        let behind = (((to - origin) / step + 0.01).floor() + 1.0).clamp(0.0, count as f64) as usize;
        first.min(behind)..behind
    };
    let columns = range(x_mm, grid.origin_x_mm, grid.step_x_mm, grid.columns);
    let rows = range(y_mm, grid.origin_y_mm, grid.step_y_mm, grid.rows());
    if columns.len() < 2 || rows.len() < 2.min(grid.rows()) {
        let ends = |origin: f64, step: f64, count: usize| {
            format!("{origin:.6} to {:.6} mm", origin + step * (count - 1) as f64)
        };
        return Err(format!(
            "{} rows and {} columns lie in it; x goes from {}, y from {}",
            rows.len(),
            columns.len(),
            ends(grid.origin_x_mm, grid.step_x_mm, grid.columns),
            ends(grid.origin_y_mm, grid.step_y_mm, grid.rows())
        ));
    }
    let heights = rows.clone().flat_map(|row| &grid.height_nm[row * grid.columns..][columns.clone()]).copied();
    Ok(HeightGrid {
        height_nm: heights.collect(),
        columns: columns.len(),
        origin_x_mm: grid.origin_x_mm + grid.step_x_mm * columns.start as f64,
        origin_y_mm: grid.origin_y_mm + grid.step_y_mm * rows.start as f64,
        ..grid.clone()
    })
}
