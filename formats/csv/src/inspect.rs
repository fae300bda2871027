//! What a text file holds, without a rig.

use std::path::Path;

use runout_core::{Result, input_file::InputFile};
use serde::Serialize;

use crate::{
    header::{ANGLE, INDEX, TIME, decode, delimiter_of},
    lines::{Stretch, Stretches, cells},
};

/// A text file in short.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TextReport {
    /// "csv".
    pub format: &'static str,
    /// What is between columns: "comma", "semicolon", "tab".
    pub delimiter: &'static str,
    /// The line of the header, from 1.
    pub header_line: u64,
    /// The header's names, in the file's order.
    pub columns: Vec<String>,
    /// The column that says where turns begin: "index" or "angle_deg"; a trace of a mark has a name of its own.
    pub angle_by: Option<&'static str>,
    /// Whether a column `time_s` gives the sampling rate.
    pub time: bool,
    /// Lines behind the header that are not blank.
    pub rows: u64,
}

/// What a text file holds; nothing where it is no table of at least two columns.
///
/// # Errors
/// When it cannot be read.
pub fn inspect(path: &Path) -> Result<Option<TextReport>> {
    let (mut stretches, mut stretch) = (Stretches::open(&InputFile::new(path)?)?, Stretch::default());
    let mut report: Option<TextReport> = None;
    while stretches.next(&mut stretch)? {
        let mut lines = stretch.lines();
        while let Some(line) = lines.next() {
            if line.is_blank() {
                continue;
            }
            match &mut report {
                Some(known) => {
                    // An empty cell may be behind the last one.
                    let width = cells(line.bytes, byte_of(known.delimiter)).count();
                    if known.rows == 0 && !(known.columns.len()..=known.columns.len() + 1).contains(&width) {
                        return Ok(None);
                    }
                    known.rows += 1;
                }
                None if line.bytes.starts_with(b"#") => {}
                // JSON, or JSON Lines.
                None if matches!(line.bytes.trim_ascii_start().first(), Some(b'{' | b'[')) => return Ok(None),
                None if line.bytes.iter().any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace()) => {
                    return Ok(None);
                }
                None => {
                    let delimiter = delimiter_of(line.bytes);
                    let columns: Vec<String> = cells(line.bytes, delimiter).map(decode).collect();
                    if columns.len() < 2 {
                        return Ok(None);
                    }
                    let has = |name: &&str| columns.iter().any(|column| column == name);
                    report = Some(TextReport {
                        format: "csv",
                        delimiter: name_of(delimiter),
                        header_line: line.number,
                        angle_by: [ANGLE, INDEX].into_iter().find(has),
                        time: has(&TIME),
                        columns,
                        rows: 0,
                    });
                }
            }
        }
    }
    Ok(report.filter(|report| report.rows > 0))
}

fn name_of(delimiter: u8) -> &'static str {
    match delimiter {
        b'\t' => "tab",
        b';' => "semicolon",
        _ => "comma",
    }
}

fn byte_of(delimiter: &str) -> u8 {
    match delimiter {
        "tab" => b'\t',
        "semicolon" => b';',
        _ => b',',
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::fs;

    use super::*;

    fn found(text: &[u8]) -> Option<TextReport> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        fs::write(&path, text).unwrap();
        inspect(&path).unwrap()
    }

    #[test]
    fn a_table_is_recognised_by_its_header_and_first_row() {
        let report =
            found("# made by hand\n\ntime_s;index;S1;Fühler\n0,0;0;1,25;-0,5\n0,1;1;1;2;\n\n".as_bytes()).unwrap();
        assert_eq!(report.columns, ["time_s", "index", "S1", "Fühler"]);
        assert_eq!((report.delimiter, report.header_line, report.rows), ("semicolon", 3, 2));
        assert_eq!((report.angle_by, report.time), (Some("index"), true));
        let marked = found(b"S1,MARK\r\n1,2.5\r\n").unwrap();
        assert_eq!((marked.angle_by, marked.rows), (None, 1));
    }

    #[test]
    fn what_is_no_table_is_none() {
        let nothing: [&[u8]; 7] = [
            b"",
            b"# comments only\n",
            b"one column\n1\n",
            b"a,b\n",
            b"a,b\n1,2,3,4\n",
            b"{\"time_s\":0.0,\"S1\":1.0}\n{\"time_s\":0.1,\"S1\":1.1}\n",
            b"\x7fELF\x02\x01\0,\0\n1,2\n",
        ];
        for text in nothing {
            assert_eq!(found(text), None, "{}", String::from_utf8_lossy(text));
        }
    }
}
