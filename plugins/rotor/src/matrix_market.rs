//! Matrix Market files: coordinate or array, general, symmetric or skew-symmetric, real or integer.

use std::path::Path;

use faer::Mat;
use nalgebra_sparse::io::load_coo_from_matrix_market_str;
use runout_core::{Error, Result, input_file::read_text};

use crate::model::MOST_DEGREES_OF_FREEDOM;

/// Reads a square matrix.
///
/// # Errors
/// When the file cannot be read, is not of this format, is not square, or is too large.
pub(crate) fn read(path: &Path) -> Result<Mat<f64>> {
    let object = path.display().to_string();
    let text = read_text(path).map_err(|error| Error::new("read", &object, error))?;
    parse(&text).map_err(|problem| {
        Error::new("read", &object, problem).help(
            "expected a Matrix Market file: `%%MatrixMarket matrix coordinate real symmetric`, sizes, then one element a line, \
             rows and columns from 1",
        )
    })
}

fn parse(text: &str) -> std::result::Result<Mat<f64>, String> {
    let header = text.lines().next().unwrap_or_default().to_lowercase();
    let words: Vec<&str> = header.split_whitespace().collect();
    sizes_fit(text, words.get(2) == Some(&"coordinate"))?;
    let (size, elements) = if words.get(3) == Some(&"integer") {
        let matrix = load_coo_from_matrix_market_str::<i128>(text).map_err(|error| said(error.message()))?;
        let elements: Vec<_> = matrix.triplet_iter().map(|(row, column, value)| (row, column, *value as f64)).collect();
        ((matrix.nrows(), matrix.ncols()), elements)
    } else {
        let matrix = load_coo_from_matrix_market_str::<f64>(text).map_err(|error| said(error.message()))?;
        let elements: Vec<_> = matrix.triplet_iter().map(|(row, column, value)| (row, column, *value)).collect();
        ((matrix.nrows(), matrix.ncols()), elements)
    };
    if size.0 != size.1 || size.0 == 0 {
        return Err(format!("expected a square matrix, found {} rows and {} columns", size.0, size.1));
    }
    if size.0 > MOST_DEGREES_OF_FREEDOM {
        let most = MOST_DEGREES_OF_FREEDOM;
        return Err(format!("expected at most {most} degrees of freedom, found {}; reduce the model first", size.0));
    }
    let mut matrix = Mat::zeros(size.0, size.1);
    for (row, column, value) in elements {
        // A place that is written twice counts twice: that is how finite elements are added.
        matrix[(row, column)] += value;
    }
    Ok(matrix)
}

/// Refuses sizes and indices that no integer holds, at which the parser panics.
fn sizes_fit(text: &str, coordinate: bool) -> std::result::Result<(), String> {
    let lines = text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('%'));
    for (order, (number, line)) in lines.enumerate() {
        // The first line holds sizes; then, with coordinates, each begins with row and column.
        let whole = match (order, coordinate) {
            (0, _) => 3,
            (_, true) => 2,
            (_, false) => return Ok(()),
        };
        for word in line.split_whitespace().take(whole) {
            if word.bytes().all(|byte| byte.is_ascii_digit()) && word.parse::<u32>().is_err() {
                return Err(format!("line {}: {word} is too large for a size or an index", number + 1));
            }
        }
    }
    Ok(())
}

/// The parser's message on one line, without its drawing of the place.
fn said(message: &str) -> String {
    let kept = message.lines().map(str::trim).filter(|line| !line.is_empty() && !line.contains('|'));
    let kept = kept.map(|line| line.strip_prefix("Error:").map_or(line, str::trim));
    let kept = kept.map(|line| line.trim_start_matches("= ").replace("--> ", "line and column "));
    kept.collect::<Vec<_>>().join(" ")
}
