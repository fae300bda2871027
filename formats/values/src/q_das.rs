//! The exporter `q-das`: the Q-DAS ASCII transfer format, descriptions and values in one file (`.dfq`).
//!
//! A line of a key field is `Knnnn/c text`, of the characteristic c; fields below K2000 are of the part. The line of values has one
//! value a characteristic, each with its attribute (0: valid) and, where it is known, its time.

use std::{fmt::Write, path::PathBuf};

use runout_core::{
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::Exporter,
    summary::{ReportedValue, Summary},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    decision, decision_name,
    file::{SummaryFile, check_ending},
};

/// Between a value and what belongs to it.
const WITHIN: char = '\u{14}';
/// Between characteristics.
const BETWEEN: char = '\u{f}';
/// Digits behind the point of a value whose uncertainty is not known.
const USUAL_DIGITS: usize = 4;
/// The most that programs show.
const MOST_DIGITS: usize = 9;
/// Characters of a text, at most.
const LONGEST: usize = 255;

/// `[[export]] plugin = "q-das"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QDasConfig {
    /// The file to write, ending in `.dfq`: one characteristic a value and limit.
    pub path: PathBuf,
    /// Only values that a limit names; with `false` all values.
    #[serde(default = "only_limited")]
    pub only_limited: bool,
    /// Number of the part (K1001).
    pub part_number: Option<String>,
    /// Description of the part (K1002); the pipeline's title without it.
    pub part: Option<String>,
    /// When it was measured (K0004), as `28.11.2026/14:30:00`.
    pub time: Option<String>,
}

fn only_limited() -> bool {
    true
}

impl StageConfig for QDasConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "q-das";
    const ABOUT: &'static str = "values with their limits in the Q-DAS ASCII transfer format (.dfq)";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        check_ending(&self.path, &["dfq"])?;
        if let Some(time) = self.time.as_ref().filter(|time| !is_time(time)) {
            return Err(Fault::at("time", format!("expected a time as `28.11.2026/14:30:00`, found `{time}`")));
        }
        Ok(Box::new(SummaryFile { path: context.path(&self.path), config: self, contents }))
    }
}

/// Whether it is `DD.MM.YYYY/hh:mm:ss`.
fn is_time(text: &str) -> bool {
    const FORM: &[u8] = b"DD.DD.DDDD/DD:DD:DD";
    let is_like = |(letter, form): (u8, &u8)| if *form == b'D' { letter.is_ascii_digit() } else { letter == *form };
    let number = |from: usize, most: u32| text[from..from + 2].parse().is_ok_and(|number: u32| number <= most);
    text.len() == FORM.len()
        && text.bytes().zip(FORM).all(is_like)
        && [(0, 31), (3, 12), (11, 23), (14, 59), (17, 59)].into_iter().all(|(from, most)| number(from, most))
}

fn contents(summary: &Summary, config: &QDasConfig) -> Vec<u8> {
    // What is not observable has no value to state.
    let values: Vec<(ReportedValue, f64)> = (summary.reported_values().into_iter())
        .filter(|value| value.limit.is_some() || !config.only_limited)
        .filter_map(|value| value.value().number().map(|number| (value, number)))
        .collect();
    let mut text = String::new();
    let mut field = |key: &str, content: &str| {
        if !content.is_empty() {
            let content: String = content.chars().take(LONGEST).map(printable).collect();
            // A `String` takes every text.
            let _ = write!(text, "{key} {content}\r\n");
        }
    };
    field("K0100", &values.len().to_string());
    field("K1001", config.part_number.as_deref().unwrap_or_default());
    field("K1002", config.part.as_ref().unwrap_or(&summary.title));
    let head = &summary.head;
    let known = [
        ("K1062", &head.customer),
        ("K1081", &head.serial_number),
        ("K1082", &head.machine),
        ("K1202", &head.instrument),
        ("K1222", &head.operator),
    ];
    for (key, text) in known {
        field(key, text.as_deref().unwrap_or_default());
    }
    let mut remarks = vec![format!("{}; um and urad: micrometres and microradians", summary.provenance.program)];
    remarks.extend(head.calibrated.as_ref().map(|date| format!("instrument calibrated {date}")));
    remarks.extend(head.fields.iter().map(|(name, text)| format!("{name}: {text}")));
    field("K1900", &remarks.join("; "));
    for (index, (value, _)) in values.iter().enumerate() {
        let number = index + 1;
        let mut of_value = |key: &str, content: &str| field(&format!("{key}/{number}"), content);
        of_value("K2001", &number.to_string());
        of_value("K2002", &description(value));
        of_value("K2003", &value.value().symbol);
        of_value("K2004", "0");
        of_value("K2022", &digits(value.value().std()).to_string());
        if let Some((limit, found)) = value.limit {
            let [lower, upper] = found.ends(limit);
            for (limit_key, kind_key, end) in [("K2110", "K2120", lower), ("K2111", "K2121", upper)] {
                let end = end.map(|end| end.to_string()).unwrap_or_default();
                of_value(kind_key, if end.is_empty() { "" } else { "1" });
                of_value(limit_key, &end);
            }
        }
        of_value("K2142", &value.value().unit);
        of_value("K2900", &remark(value));
    }
    let time = config.time.as_ref().map(|time| format!("{WITHIN}{time}")).unwrap_or_default();
    let line: Vec<String> = values.iter().map(|(_, number)| format!("{number}{WITHIN}0{time}")).collect();
    if !line.is_empty() {
        text += &line.join(&BETWEEN.to_string());
        text += "\r\n";
    }
    encoded(&text)
}

/// "RONt about LSCI, Gaussian 50 UPR of a, station s1".
fn description(value: &ReportedValue) -> String {
    let station = value.placed.station.map(|station| format!(", station {station}")).unwrap_or_default();
    // The band is said where it alone distinguishes values: harmonics of one order.
    let order = value.value().id().order().map(|order| format!(", order {order}")).unwrap_or_default();
    format!("{}{order}{station}", value.placed.id())
}

/// What no field has: uncertainty, interval, decision.
fn remark(value: &ReportedValue) -> String {
    let mut parts = Vec::new();
    parts.extend(value.value().std().map(|std| format!("standard uncertainty {std:.3e}")));
    parts.extend(value.value().interval_95().map(|[low, high]| format!("95 % interval {low:.6} to {high:.6}")));
    parts.extend(decision(value).map(|decision| format!("ISO 14253-1: {}", decision_name(decision))));
    parts.extend(value.remark().map(str::to_owned));
    parts.join("; ")
}

/// Digits behind the point that show two of the uncertainty.
fn digits(std: Option<f64>) -> usize {
    let known = std.filter(|std| *std > 0.0 && std.is_finite());
    known.map_or(USUAL_DIGITS, |std| (1.0 - std.log10().floor()).clamp(0.0, MOST_DIGITS as f64) as usize)
}

fn printable(character: char) -> char {
    if character.is_control() { ' ' } else { character }
}

/// The code page of Windows where it holds every character, else UTF-8 with its mark.
fn encoded(text: &str) -> Vec<u8> {
    // Control characters of Latin-1 are other characters in that code page; `printable` leaves none.
    let single: Option<Vec<u8>> = text.chars().map(|character| u8::try_from(u32::from(character)).ok()).collect();
    single.unwrap_or_else(|| ["\u{feff}", text].concat().into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_one_form() {
        assert!(is_time("28.11.2026/14:30:00"));
        for wrong in [
            "2026-11-28 14:30:00",
            "28.11.2026/24:30:00",
            "28.13.2026/14:30:00",
            "28.11.2026/14:30",
            "",
            "µ8.11.2026/14:30:0",
        ] {
            assert!(!is_time(wrong), "{wrong}");
        }
    }

    #[test]
    fn digits_show_two_of_the_uncertainty() {
        for (std, expected) in [(0.012, 3), (0.12, 2), (3.0, 1), (1500.0, 0), (1e-20, 9)] {
            assert_eq!(digits(Some(std)), expected, "{std}");
        }
        assert_eq!((digits(None), digits(Some(0.0))), (4, 4));
    }

    #[test]
    fn letters_of_western_europe_are_one_byte() {
        assert_eq!(encoded("süd"), b"s\xfcd");
        assert_eq!(encoded("Ω"), "\u{feff}Ω".as_bytes());
    }
}
