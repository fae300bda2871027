//! `runout convert`: a height map in another format.

use runout_core::{Error, ErrorKind, length_unit::micrometres};
use runout_maps::{Map, Wanted, read, write};

use super::{print, there_already};
use crate::{
    args::ConvertArgs,
    failure::Failure,
    render,
    reports::inspect::{ConvertReport, MapReport},
};

/// Reads a map, writes it, and says what the other format does not hold.
///
/// # Errors
/// When the file cannot be read or written.
pub(crate) fn execute(args: &ConvertArgs, json: bool) -> Result<(), Failure> {
    if !args.overwrite && std::fs::symlink_metadata(&args.output).is_ok() {
        return Err(there_already(&args.output, "name another file, or add --overwrite"));
    }
    print(&report(args)?, json, render::file::converted)
}

fn report(args: &ConvertArgs) -> runout_core::Result<ConvertReport> {
    if let Some(unit) = args.unit.as_deref().filter(|unit| micrometres(unit).is_none()) {
        let error = Error::new("convert", args.input.display().to_string(), format!("`{unit}` is no unit of length"));
        return Err(error.of(ErrorKind::Configuration).help("m, mm, um, nm, in, mil"));
    }
    let step = |place: usize| args.step_mm.get(place).copied();
    let wanted = Wanted { layer: args.layer.clone(), unit: args.unit.clone(), step_mm: [step(0), step(1)] };
    let map = read(&args.input, &wanted)?;
    let title = args.input.file_stem().unwrap_or_default().to_string_lossy();
    let output = write(&map.grid, &args.output, &title)?;
    Ok(ConvertReport { lost: lost(&map, &output), output, input: MapReport::new(map) })
}

/// Not in the written file, in words.
fn lost(map: &Map, output: &std::path::Path) -> Vec<String> {
    let is_sdf = output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("sdf"));
    let is_h5 = output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("h5"));
    let grid = &map.grid;
    let mut lost = Vec::new();
    if is_sdf && (grid.origin_x_mm.abs() > 0.0 || grid.origin_y_mm.abs() > 0.0) {
        lost.push(format!(
            "the place of the first point, x = {} mm, y = {} mm: SDF has none",
            grid.origin_x_mm, grid.origin_y_mm
        ));
    }
    if let Some(std_nm) = grid.std_nm.filter(|_| !is_h5) {
        lost.push(format!("the standard uncertainty of a height, {std_nm} nm"));
    }
    if map.layers.len() > 1 {
        lost.push(format!("the other maps of the file: it has {}", map.layers.join(", ")));
    }
    if !map.about.is_empty() {
        let names: Vec<&str> = map.about.iter().map(|(name, _)| name.as_str()).collect();
        lost.push(format!("what the file says of itself: {}", names.join(", ")));
    }
    lost
}
