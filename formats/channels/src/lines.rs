//! The channels in an array of numbers: one a column, or a row where rows are longer.

/// Channels of one array: more are pictures.
const MOST: u64 = 1 << 16;

/// A row or column of an array.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line {
    /// Behind the array's name: `[:, 3]`, `[3, :]` or nothing.
    pub(crate) suffix: String,
    pub(crate) samples: u64,
    /// From the array's first number, in the unit of the strides.
    pub(crate) offset: u64,
    pub(crate) stride: u64,
    /// The dimension of time, and the place in the others.
    pub(crate) time: usize,
    pub(crate) at: u64,
}

/// The lines of an array with these extents and distances of neighbours; the longest dimension is that of time, and dimensions of one
/// do not count. `None` where more than two are left.
pub(crate) fn lines(shape: &[u64], strides: &[u64]) -> Option<Vec<Line>> {
    let long: Vec<usize> = (0..shape.len()).filter(|dimension| shape[*dimension] != 1).collect();
    let (time, across) = match long[..] {
        [] => (None, None),
        [time] => (Some(time), None),
        [first, second] if shape[first] >= shape[second] => (Some(first), Some(second)),
        [first, second] => (Some(second), Some(first)),
        _ => return None,
    };
    let samples = time.map_or(1, |time| shape[time]);
    let stride = time.map_or(0, |time| strides[time]);
    let time = time.unwrap_or(0);
    let Some(across) = across else {
        return Some(vec![Line { suffix: String::new(), samples, offset: 0, stride, time, at: 0 }]);
    };
    let line = |at: u64| {
        let suffix = if time < across { format!("[:, {at}]") } else { format!("[{at}, :]") };
        Line { suffix, samples, offset: at.saturating_mul(strides[across]), stride, time, at }
    };
    (shape[across] <= MOST).then(|| (0..shape[across]).map(line).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn the_longest_dimension_is_that_of_time() {
        let of = |shape: &[u64], strides: &[u64]| {
            let lines = lines(shape, strides).unwrap();
            (lines.len(), lines.last().unwrap().suffix.clone(), lines.last().unwrap().offset, lines[0].stride)
        };
        assert_eq!(of(&[9, 3], &[3, 1]), (3, "[:, 2]".into(), 2, 3));
        assert_eq!(of(&[3, 9], &[1, 3]), (3, "[2, :]".into(), 2, 3));
        assert_eq!(of(&[1, 9], &[9, 1]), (1, String::new(), 0, 1));
        assert_eq!(of(&[9, 1, 2], &[2, 2, 1]), (2, "[:, 1]".into(), 1, 2));
        assert!(lines(&[2, 3, 4], &[12, 4, 1]).is_none() && lines(&[1 << 20, 1 << 20], &[1, 1]).is_none());
        assert_eq!(lines(&[], &[]).unwrap()[0].samples, 1);
        assert!(lines(&[0, 3], &[1, 1]).unwrap().is_empty());
    }
}
