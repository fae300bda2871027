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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn rows(text: &str) -> Vec<Vec<f64>> {
        let matrix = parse(text).unwrap();
        (0..matrix.nrows()).map(|row| (0..matrix.ncols()).map(|column| matrix[(row, column)]).collect()).collect()
    }

    #[test]
    fn every_kind_of_file_reads() {
        let general = [[4.0, -1.5], [2.0, 3.0]].map(Vec::from).to_vec();
        assert_eq!(
            rows("%%MatrixMarket matrix coordinate real general\n% note\n2 2 4\n1 1 4\n1 2 -1.5\n2 1 2e0\n2 2 3\n"),
            general
        );
        assert_eq!(rows("%%MatrixMarket matrix array real general\n2 2\n4\n2\n-1.5\n3\n"), general);
        let symmetric = [[4.0, -1.0], [-1.0, 3.0]].map(Vec::from).to_vec();
        assert_eq!(rows("%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 4\n2 1 -1\n2 2 3\n"), symmetric);
        assert_eq!(rows("%%MatrixMarket matrix array real symmetric\n2 2\n4\n-1\n3\n"), symmetric);
        assert_eq!(rows("%%MatrixMarket matrix array integer symmetric\n2 2\n4\n-1\n3\n"), symmetric);
        let skew = [[0.0, 7.0], [-7.0, 0.0]].map(Vec::from).to_vec();
        assert_eq!(rows("%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n2 1 -7\n"), skew);
        // Elements of the same place are added.
        let twice = rows("%%MatrixMarket matrix coordinate real general\n1 1 2\n1 1 4\n1 1 5\n");
        assert_eq!(twice, [[9.0]]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let cases = [
            ("%%MatrixMarket matrix coordinate real general\n2 2 1\n0 1 4\n", "one-indexed"),
            ("%%MatrixMarket matrix coordinate real general\n2 2 1\n3 1 4\n", "out of bounds"),
            ("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 4\n", "2 entries required"),
            ("%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n1 2 4\n", "lower triangle"),
            ("%%MatrixMarket matrix coordinate real general\n2 3 1\n1 1 4\n", "square"),
            ("%%MatrixMarket matrix coordinate real general\n5000 5000 1\n1 1 4\n", "at most"),
            ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 4 0\n", ""),
            ("%%MatrixMarket matrix array real general\n2 2\n1\nx\n3\n4\n", "4:1"),
            (
                "%%MatrixMarket matrix array real general\n99999999999999999999 2\n1\n",
                "line 2: 99999999999999999999 is too large",
            ),
            ("%%MatrixMarket matrix coordinate real general\n2 2 1\n99999999999999999999 2 1\n", "line 3"),
            ("1 2\n", ""),
            ("", ""),
        ];
        for (text, part) in cases {
            let problem = parse(text).unwrap_err();
            assert!(problem.contains(part), "{text:?}: {problem}");
            assert!(!problem.contains('\n'), "{problem}");
        }
    }
}
