//! Height maps: how they are read, and how a simulated surface is written.
//!
//! ```text
//! /            format = "runout-surface", version = 1, step_x_mm, step_y_mm, origin_x_mm, origin_y_mm, optionally std_nm
//! /height_nm   [rows, columns] f64 or f32, columns along the feed; NaN where there is none
//! /truth       scenario: what a simulation declares to be true
//! ```

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use hdf5_metno::File;
use ndarray::ArrayView2;
use runout_core::{Result, atomic_file::PendingFile, height_grid::HeightGrid, points::Points, provenance};

use crate::{
    MEASUREMENT_FORMAT, RESULT_FORMAT, SURFACE_FORMAT, VERSION,
    links::Links,
    measurement::TRUTH,
    node::{self, Place},
    superblock,
};

/// The dataset of heights.
const HEIGHTS: &str = "height_nm";
/// Most points of a map: 1.6 GB of heights.
const MOST_POINTS: usize = 200_000_000;
/// Side of a chunk.
const CHUNK: usize = 256;
/// Level of deflate: noise in the last digits does not compress better with more.
const DEFLATE: u8 = 1;

/// The nodes of a height map with a height, with the files behind them.
///
/// # Errors
/// As [`read_height_map`] has them.
pub fn height_map_points(path: &Path, follow_links: bool) -> Result<Points> {
    let (grid, links) = read(path, follow_links)?;
    let inputs = links.inputs();
    let besides = inputs.iter().skip(1).map(|file| file.path().to_owned()).collect();
    let mut points = Points { besides, opened: inputs, ..Points::of_grid(grid, path.to_owned()) };
    points.remarks.extend(superblock::remark(links.input())?);
    Ok(points)
}

/// Reads a height map.
///
/// # Errors
/// When the file is no height map of version 1, a step is not above 0, it has fewer than two rows or columns, or no heights.
pub fn read_height_map(path: &Path) -> Result<HeightGrid> {
    read(path, false).map(|(grid, _)| grid)
}

fn read(path: &Path, follow_links: bool) -> Result<(HeightGrid, Arc<Links>)> {
    let (file, place, links) = node::open(path, follow_links)?;
    check_format(&file, &place)?;
    let step = |name: &str| node::needed(node::positive(&file, &place, name)?, &place, name);
    let origin = |name: &str| node::needed(node::number(&file, &place, name)?, &place, name);
    let [step_x_mm, step_y_mm] = [step("step_x_mm")?, step("step_y_mm")?];
    let [origin_x_mm, origin_y_mm] = [origin("origin_x_mm")?, origin("origin_y_mm")?];
    let std_nm = node::positive(&file, &place, "std_nm")?;
    let (dataset, place) = node::dataset(&file, &place, HEIGHTS)?;
    let shape = dataset.get_shape().map_err(|error| place.error(error))?;
    let [rows, columns] = shape[..] else {
        return Err(place.error(format!("expected [rows, columns], found the shape {shape:?}")));
    };
    if rows < 2 || columns < 2 {
        return Err(place.error(format!(
            "expected two or more rows and columns, found {rows} by {columns}: a single profile shows no surface"
        )));
    }
    if rows.checked_mul(columns).is_none_or(|points| points > MOST_POINTS) {
        return Err(place
            .error(format!("{rows} by {columns} points are more than {MOST_POINTS}"))
            .help("read a part of it"));
    }
    node::written_shape(&dataset, &place)?;
    let kind = node::element_type(&dataset, &place)?;
    if !node::is_number(&kind) {
        return Err(place.error(format!("expected numbers, found {}", crate::type_name::type_name(&kind))));
    }
    let height_nm = dataset.read_raw::<f64>().map_err(|error| place.error(error))?;
    let grid = HeightGrid { columns, step_x_mm, step_y_mm, origin_x_mm, origin_y_mm, std_nm, height_nm };
    if let Some(index) = grid.height_nm.iter().position(|height| height.is_infinite()) {
        let [row, column] = [index / columns, index % columns];
        return Err(place.error(format!("row {row}, column {column} is infinite; a point without a height is NaN")));
    }
    match rows * columns - grid.holes() {
        measured @ 0..2 => Err(place.error(format!("{measured} of {} points have a height", rows * columns))),
        _ => Ok((grid, links)),
    }
}

fn check_format(file: &File, place: &Place) -> Result<()> {
    let help = format!(
        "a height map has the root attributes format = \"{SURFACE_FORMAT}\", version = {VERSION}, step_x_mm, step_y_mm, \
         origin_x_mm and origin_y_mm"
    );
    let format = node::text(file, place, "format")?;
    match format.as_deref() {
        Some(SURFACE_FORMAT) => {}
        Some(MEASUREMENT_FORMAT) => {
            let problem = "this is a recording of sensors, not a height map";
            return Err(place.error(problem).help("the loader `hdf5` reads it"));
        }
        Some(RESULT_FORMAT) => return Err(place.error("this is a result, not a height map").help(help)),
        Some(other) => {
            return Err(place.error(format!("expected the format `{SURFACE_FORMAT}`, found `{other}`")).help(help));
        }
        None => {
            let problem = "the attribute `format` is missing: this is a file of another program";
            return Err(place.error(problem).help(help));
        }
    }
    let version = node::needed(node::number(file, place, "version")?, place, "version")?;
    if version.total_cmp(&(VERSION as f64)).is_ne() {
        return Err(place.error(format!("expected version {VERSION} of a height map, found {version}")));
    }
    Ok(())
}

/// Writes a height map, whole or not at all; `scenario` is what a simulation declares to be true.
///
/// # Errors
/// When the grid is none, or the file system fails.
pub fn write_height_map(grid: &HeightGrid, path: &Path, title: &str, scenario: Option<&str>) -> Result<PathBuf> {
    let pending = PendingFile::new(path)?;
    pending.room_for((1 << 20) + 8 * grid.height_nm.len() as u64)?;
    let shape = (grid.rows(), grid.columns);
    let heights = ArrayView2::from_shape(shape, &grid.height_nm).map_err(|error| pending.failure(error))?;
    let write = || -> hdf5_metno::Result<()> {
        let file = node::create_file(pending.path())?;
        node::put_text(&file, "format", SURFACE_FORMAT)?;
        node::put(&file, "version", &VERSION)?;
        node::put_text(&file, "program", &format!("runout {}", provenance::VERSION))?;
        node::put_text(&file, "title", title)?;
        node::put(&file, "step_x_mm", &grid.step_x_mm)?;
        node::put(&file, "step_y_mm", &grid.step_y_mm)?;
        node::put(&file, "origin_x_mm", &grid.origin_x_mm)?;
        node::put(&file, "origin_y_mm", &grid.origin_y_mm)?;
        if let Some(std_nm) = grid.std_nm {
            node::put(&file, "std_nm", &std_nm)?;
        }
        let chunk = (shape.0.clamp(1, CHUNK), shape.1.clamp(1, CHUNK));
        let dataset = file.new_dataset::<f64>().chunk(chunk).shuffle().deflate(DEFLATE).shape(shape).create(HEIGHTS)?;
        dataset.write(heights)?;
        if let Some(scenario) = scenario {
            node::put_text(&*node::create_group(&file, TRUTH)?, "scenario", scenario)?;
        }
        // What the disk refuses comes out here, and not when the file is closed.
        file.flush()
    };
    write().map_err(|error| pending.failure(error))?;
    pending.commit()
}
