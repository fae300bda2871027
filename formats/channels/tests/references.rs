//! Files of the reference libraries, whose numbers they read themselves (`assets/write_….py`), equal to the last bit.

use std::fs;

use crate::support::{all, all_assets, bits, opened};

/// A channel as a reference library reads it.
struct Expected {
    path: String,
    unit: Option<String>,
    rate_hz: Option<f64>,
    numbers: Vec<f64>,
}

fn expected(text: &str) -> Vec<Expected> {
    let lines: Vec<&str> = text.lines().collect();
    let channel = |pair: &[&str]| {
        let [path, unit, rate, count] = pair[0].split('\t').collect::<Vec<_>>()[..] else { panic!("{}", pair[0]) };
        let number = |word: &str| f64::from_bits(u64::from_str_radix(word, 16).unwrap());
        let numbers: Vec<f64> = pair[1].split_whitespace().map(number).collect();
        assert_eq!(numbers.len().to_string(), count);
        let unit = (!unit.is_empty()).then(|| unit.to_owned());
        Expected { path: path.into(), unit, rate_hz: rate.parse().ok(), numbers }
    };
    lines.chunks_exact(2).map(channel).collect()
}

#[test]
fn files_of_reference_libraries_are_equal_to_the_last_bit() {
    let mut wrong = Vec::new();
    for path in all_assets() {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let expected = expected(&fs::read_to_string(format!("{}.expected", path.display())).unwrap());
        assert!(!expected.is_empty(), "{name}");
        let found = match opened(&path).and_then(|file| all(&*file)) {
            Ok(found) => found,
            Err(error) => {
                wrong.push(error.to_string());
                continue;
            }
        };
        if found.len() != expected.len() {
            let paths: Vec<String> = found.iter().map(|(channel, _)| channel.path()).collect();
            wrong.push(format!("{name}: {} channels for {}: {paths:?}", found.len(), expected.len()));
        }
        for expected in expected {
            let Some((channel, values)) = found.iter().find(|(channel, _)| channel.path() == expected.path) else {
                wrong.push(format!("{name}: no channel {}", expected.path));
                continue;
            };
            if channel.samples != values.len() as u64 {
                wrong.push(format!("{name}: {}: {} samples for {}", expected.path, values.len(), channel.samples));
            }
            if bits(values) != bits(&expected.numbers) {
                let at = values.iter().zip(&expected.numbers).position(|(a, b)| a.to_bits() != b.to_bits());
                let counts = (values.len(), expected.numbers.len());
                let pair = at.map(|at| (values[at], expected.numbers[at]));
                wrong.push(format!("{name}: {}: numbers differ at {at:?}: {pair:?}, {counts:?}", expected.path));
            }
            if channel.unit != expected.unit {
                wrong.push(format!("{name}: {}: unit {:?} for {:?}", expected.path, channel.unit, expected.unit));
            }
            let same_rate = match (channel.rate_hz, expected.rate_hz) {
                (Some(one), Some(other)) => (one / other - 1.0).abs() < 1e-12,
                (one, other) => one.is_none() && other.is_none(),
            };
            if !same_rate {
                wrong.push(format!("{name}: {}: {:?} Hz for {:?}", expected.path, channel.rate_hz, expected.rate_hz));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
