//! What a program answered: tables by name, and warnings.

use crate::frame::Frame;

/// An answer, sorted.
pub(crate) struct Answer<'a> {
    tables: Vec<&'a Frame>,
    /// Texts of `warning` frames.
    pub warnings: Vec<String>,
}

impl<'a> Answer<'a> {
    /// Sorts frames; each of these tables may be there once.
    ///
    /// # Errors
    /// What else is there, in words that go on from "the program".
    pub(crate) fn of(frames: &'a [Frame], names: &[&str]) -> Result<Self, String> {
        let mut answer = Self { tables: Vec::new(), warnings: Vec::new() };
        for frame in frames {
            let is_twice = || answer.tables.iter().any(|known| known.name == frame.name);
            match frame.name.as_str() {
                "warning" => answer.warnings.push(String::from_utf8_lossy(&frame.body).trim().to_owned()),
                name if names.contains(&name) && !is_twice() => answer.tables.push(frame),
                name => return Err(format!("gave `{name}`, where one `{}` was expected", names.join("`, one `"))),
            }
        }
        Ok(answer)
    }

    /// The table of a name.
    pub(crate) fn table(&self, name: &str) -> Option<&'a Frame> {
        self.tables.iter().find(|frame| frame.name == name).copied()
    }
}
