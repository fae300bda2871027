//! Numbers as the page's program takes them.

use base64::{Engine, prelude::BASE64_STANDARD};
use serde::Serialize;

/// Numbers as short as they can be written.
#[derive(Serialize)]
#[serde(untagged)]
pub(crate) enum Numbers {
    /// All the same.
    Same { same: f64, count: usize },
    /// At equal steps.
    Steps { from: f64, step: f64, count: usize },
    /// Little-endian f32 in base64.
    Each(String),
}

impl Numbers {
    pub(crate) fn of(numbers: &[f64]) -> Self {
        let count = numbers.len();
        if let (Some(first), Some(last)) = (numbers.first(), numbers.last())
            && count > 2
        {
            let step = (last - first) / (count - 1) as f64;
            let near = |place: usize, number: f64| {
                (number - (first + step * place as f64)).abs() <= 1e-9 * first.abs().max(last.abs())
            };
            if numbers.iter().enumerate().all(|(place, number)| near(place, *number)) {
                return if step == 0.0 {
                    Self::Same { same: *first, count }
                } else {
                    Self::Steps { from: *first, step, count }
                };
            }
        }
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| (*number as f32).to_le_bytes()).collect();
        Self::Each(BASE64_STANDARD.encode(bytes))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn json(numbers: &[f64]) -> String {
        serde_json::to_string(&Numbers::of(numbers)).unwrap()
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(json(&[0.0, 0.5, 1.0, 1.5]), r#"{"from":0.0,"step":0.5,"count":4}"#);
        assert_eq!(json(&[0.25; 3]), r#"{"same":0.25,"count":3}"#);
        assert_eq!(json(&[1.0]), "\"AACAPw==\"");
        assert_eq!(json(&[]), "\"\"");
        assert!(json(&[f64::NAN; 4]).starts_with('"'));
    }
}
