//! The head of a report: what was measured, by whom, with what, for whom.

use std::{collections::BTreeMap, path::Path};

use base64::{Engine, prelude::BASE64_STANDARD};
use runout_error::fault::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// Bytes of a logo, at most: every summary has it.
const LARGEST_LOGO: usize = 256 * 1024;

/// `[report]`: what the head of a report says. Everything may be left out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ReportHead {
    /// The machine or spindle that was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<String>,
    /// Its serial number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial_number: Option<String>,
    /// Who measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operator: Option<String>,
    /// The instrument.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instrument: Option<String>,
    /// When the instrument was calibrated: 2026-03-01.
    #[serde(default, deserialize_with = "date", skip_serializing_if = "Option::is_none")]
    pub calibrated: Option<String>,
    /// For whom.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub customer: Option<String>,
    /// An image file (PNG, JPEG, GIF, WebP or SVG, at most 256 KiB), relative to the TOML; in results the image itself as a data URI.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub logo: Option<String>,
    /// Whatever else the head has to say, by name: { Order = "4711" }.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub fields: BTreeMap<String, String>,
}

/// A date as TOML has it, or in quotes.
fn date<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Date {
        Text(String),
        Toml(toml::value::Datetime),
    }
    Ok(Some(match Date::deserialize(deserializer)? {
        Date::Text(text) => text,
        Date::Toml(date) => date.to_string(),
    }))
}

impl ReportHead {
    /// Checks it; the logo's file is read, relative to `folder`.
    ///
    /// # Errors
    /// When the date is none, a text breaks its line, or the logo cannot be read.
    pub fn check(mut self, folder: &Path) -> Result<Self, Fault> {
        if let Some(date) = self.calibrated.as_ref().filter(|date| !is_date(date)) {
            return Err(Fault::at("calibrated", format!("expected a date as 2026-03-01, found `{date}`")));
        }
        let texts = [
            ("machine", &self.machine),
            ("serial_number", &self.serial_number),
            ("operator", &self.operator),
            ("instrument", &self.instrument),
            ("customer", &self.customer),
        ];
        for (key, text) in texts {
            if text.as_ref().is_some_and(|text| text.chars().any(char::is_control)) {
                return Err(Fault::at(key, "expected a text of one line"));
            }
        }
        let breaks = |text: &str| text.chars().any(char::is_control);
        if let Some((name, _)) = self.fields.iter().find(|(name, text)| breaks(name) || breaks(text)) {
            return Err(Fault::at(name.as_str(), "expected a name and a text of one line").under("fields"));
        }
        self.logo = self.logo.map(|path| embedded(&folder.join(&path))).transpose()?;
        Ok(self)
    }

    /// Name and text of everything that it says, but for the logo.
    #[must_use]
    pub fn entries(&self) -> Vec<(&str, &str)> {
        let known = [
            ("Machine", &self.machine),
            ("Serial number", &self.serial_number),
            ("Operator", &self.operator),
            ("Instrument", &self.instrument),
            ("Calibrated", &self.calibrated),
            ("Customer", &self.customer),
        ];
        let known = known.into_iter().filter_map(|(name, text)| Some((name, text.as_deref()?)));
        known.chain(self.fields.iter().map(|(name, text)| (name.as_str(), text.as_str()))).collect()
    }

    /// Whether it says nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.logo.is_none() && self.entries().is_empty()
    }
}

/// Whether it is YYYY-MM-DD, of a day that a month may have.
fn is_date(text: &str) -> bool {
    let parts: Vec<&str> = text.split('-').collect();
    let [year, month, day] = parts[..] else { return false };
    let number = |text: &str, digits: usize, most: u32| {
        text.len() == digits && text.parse().is_ok_and(|number: u32| (1..=most).contains(&number))
    };
    number(year, 4, 9999) && number(month, 2, 12) && number(day, 2, 31)
}

/// An image file as a data URI.
fn embedded(path: &Path) -> Result<String, Fault> {
    let shown = path.display();
    let fault =
        |message: String| Fault::at("logo", message).help("name a PNG, JPEG, GIF, WebP or SVG file of at most 256 KiB");
    let length = std::fs::metadata(path).map_err(|error| fault(format!("cannot read {shown}: {error}")))?.len();
    if length > LARGEST_LOGO as u64 {
        return Err(fault(format!("{shown} has {length} bytes, more than {LARGEST_LOGO}")));
    }
    let bytes = std::fs::read(path).map_err(|error| fault(format!("cannot read {shown}: {error}")))?;
    let kind = image_kind(&bytes).ok_or_else(|| fault(format!("{shown} is no image that browsers show")))?;
    Ok(format!("data:image/{kind};base64,{}", BASE64_STANDARD.encode(bytes)))
}

/// The kind of an image by its first bytes.
fn image_kind(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Some("png"),
        [0xff, 0xd8, 0xff, ..] => Some("jpeg"),
        [b'G', b'I', b'F', b'8', ..] => Some("gif"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("webp"),
        _ => {
            let text = std::str::from_utf8(bytes).ok()?.trim_start_matches('\u{feff}').trim_start();
            let is_svg = text.starts_with('<') && text.contains("<svg");
            is_svg.then_some("svg+xml")
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn read(text: &str) -> ReportHead {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn dates_may_be_in_quotes_or_not() {
        for text in ["calibrated = 2026-03-01", "calibrated = '2026-03-01'"] {
            let head = read(text).check(Path::new(".")).unwrap();
            assert_eq!(head.entries(), [("Calibrated", "2026-03-01")]);
        }
        for wrong in ["'1.3.2026'", "'2026-13-01'", "2026-03-01T12:00:00", "''"] {
            let refused = read(&format!("calibrated = {wrong}")).check(Path::new(".")).unwrap_err();
            assert!(refused.to_string().contains("expected a date"), "{wrong}");
        }
    }

    #[test]
    fn a_logo_is_embedded_as_what_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let png = [0x89, b'P', b'N', b'G', 13, 10, 26, 10];
        std::fs::write(folder.path().join("a.png"), png).unwrap();
        std::fs::write(folder.path().join("b.svg"), "<?xml version='1.0'?><svg xmlns='http://www.w3.org/2000/svg'/>")
            .unwrap();
        std::fs::write(folder.path().join("c.txt"), "no image").unwrap();
        std::fs::write(folder.path().join("d.png"), vec![0x89; LARGEST_LOGO + 1]).unwrap();
        let logo = |name: &str| read(&format!("logo = '{name}'")).check(folder.path());
        assert_eq!(logo("a.png").unwrap().logo.unwrap(), "data:image/png;base64,iVBORw0KGgo=");
        assert!(logo("b.svg").unwrap().logo.unwrap().starts_with("data:image/svg+xml;base64,PD94"));
        for (name, said) in [("c.txt", "no image"), ("d.png", "more than"), ("e.png", "cannot read")] {
            assert!(logo(name).unwrap_err().to_string().contains(said), "{name}");
        }
    }

    #[test]
    fn everything_else_has_a_name_of_its_own() {
        let text = "machine = 'VMC 5'\nfields = { Order = '4711', Room = 'B2' }";
        let head = read(text).check(Path::new(".")).unwrap();
        assert_eq!(head.entries(), [("Machine", "VMC 5"), ("Order", "4711"), ("Room", "B2")]);
        assert!(!head.is_empty() && ReportHead::default().is_empty());
        assert!(toml::from_str::<ReportHead>("machin = 'VMC 5'").is_err());
        let refused = read("fields = { Order = \"47\\n11\" }").check(Path::new(".")).unwrap_err();
        assert!(refused.to_string().contains("one line"));
    }
}
