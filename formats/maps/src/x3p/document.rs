//! `main.xml` of an X3P file, read event by event: a list of points in it is never held as text.

use std::io::BufRead;

use quick_xml::{Reader, events::Event};
use runout_core::Result;

use crate::{
    map::{MOST_POINTS, damaged},
    numbers::Kind,
};

/// Longest text of an element that is kept.
const LONGEST: usize = 4096;
/// Deepest element.
const DEEPEST: usize = 32;
/// Texts in the place of a date or a name.
const PLACEHOLDERS: [&str; 5] = ["", "N/A", "n/a", "Date of Calibration", "Type"];

/// An axis of the coordinate system.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    pub is_absolute: bool,
    kind: Kind,
    pub increment: f64,
    pub offset: f64,
}

impl Axis {
    /// Type of its stored numbers.
    pub(super) fn kind(&self) -> Kind {
        self.kind
    }
}

/// What `main.xml` says.
#[derive(Debug)]
pub(super) struct Document {
    pub axes: [Axis; 3],
    /// Points along x, y and z; a list of points counts along x.
    pub size: [u64; 3],
    /// Binary file, its MD5, and the file of valid points.
    pub link: Option<String>,
    pub checksum: Option<String>,
    pub valid_link: Option<String>,
    /// Numbers of `DataList`, those of a point beside each other; NaN for one that was not measured.
    pub data: Vec<f64>,
    pub about: Vec<(String, String)>,
}

impl Document {
    pub(super) fn read(file: impl BufRead, shown: &str) -> Result<Self> {
        let wrong = |error: quick_xml::Error| damaged(shown, format!("main.xml: {error}"));
        let mut reader = Reader::from_reader(file);
        reader.config_mut().trim_text(true);
        let axis = Axis { is_absolute: false, kind: Kind::F64, increment: 1.0, offset: 0.0 };
        let absolute = Axis { is_absolute: true, ..axis.clone() };
        let (axes, size, data, about) = ([axis.clone(), axis, absolute], [0, 1, 1], Vec::new(), Vec::new());
        let mut document = Self { axes, size, link: None, checksum: None, valid_link: None, data, about };
        let (mut path, mut text, mut buffer): (Vec<String>, String, Vec<u8>) = (Vec::new(), String::new(), Vec::new());
        loop {
            buffer.clear();
            match reader.read_event_into(&mut buffer).map_err(wrong)? {
                Event::Start(start) if path.len() < DEEPEST => {
                    path.push(start.local_name().as_ref().to_owned());
                    text.clear();
                }
                Event::Start(_) => return Err(damaged(shown, "main.xml: its elements are too deep")),
                Event::Empty(empty) => {
                    path.push(empty.local_name().as_ref().to_owned());
                    document.element(&path, "", shown)?;
                    path.pop();
                }
                Event::Text(part) if text.len() < LONGEST => text.push_str(&part.into_inner()),
                Event::End(_) => {
                    document.element(&path, &text, shown)?;
                    path.pop();
                    text.clear();
                }
                Event::Eof => break,
                _ => {}
            }
        }
        Ok(document)
    }

    /// Takes the text of an element.
    fn element(&mut self, path: &[String], text: &str, shown: &str) -> Result<()> {
        let text = text.trim();
        let [.., parent, name] = path else { return Ok(()) };
        let number =
            || text.parse::<f64>().map_err(|_| damaged(shown, format!("main.xml: {name} is `{text}`, no number")));
        let count =
            || text.parse::<u64>().map_err(|_| damaged(shown, format!("main.xml: {name} is `{text}`, no count")));
        let axis = ["CX", "CY", "CZ"].iter().position(|axis| axis == parent);
        match (axis, name.as_str()) {
            (Some(axis), "AxisType") => self.axes[axis].is_absolute = text == "A",
            (Some(axis), "DataType") if !text.is_empty() => {
                self.axes[axis].kind = match text {
                    "I" => Kind::I16,
                    "L" => Kind::I32,
                    "F" => Kind::F32,
                    "D" => Kind::F64,
                    _ => return Err(damaged(shown, format!("main.xml: unknown DataType `{text}` of {parent}"))),
                };
            }
            (Some(axis), "Increment") if !text.is_empty() => {
                self.axes[axis].increment = number()?;
                if !(self.axes[axis].increment.is_finite() && self.axes[axis].increment.abs() > 0.0) {
                    return Err(damaged(shown, format!("main.xml: the increment of {parent} is {text}")));
                }
            }
            (Some(axis), "Offset") if !text.is_empty() => self.axes[axis].offset = number()?,
            (_, "SizeX" | "ListDimension") => self.size[0] = count()?,
            (_, "SizeY") => self.size[1] = count()?,
            (_, "SizeZ") => self.size[2] = count()?,
            (_, "PointDataLink") => self.link = Some(text.to_owned()),
            (_, "MD5ChecksumPointData") => self.checksum = Some(text.to_owned()).filter(|text| text.len() == 32),
            (_, "ValidPointsLink") if !text.is_empty() => self.valid_link = Some(text.to_owned()),
            (_, "Datum") => self.datum(text, shown)?,
            _ if path.iter().any(|part| part == "Record2") && !PLACEHOLDERS.contains(&text) => {
                let known = if parent == "Record2" { name.clone() } else { format!("{parent} {name}") };
                self.about.push((known.to_lowercase(), text.to_owned()));
            }
            _ => {}
        }
        Ok(())
    }

    /// Takes the coordinates of a point, of all axes or of those that are stored.
    fn datum(&mut self, text: &str, shown: &str) -> Result<()> {
        let width = self.axes.iter().filter(|axis| axis.is_absolute).count();
        let point = self.data.len() / width.max(1) + 1;
        if self.data.len() >= 3 * MOST_POINTS {
            return Err(damaged(shown, format!("main.xml lists more than {MOST_POINTS} points")));
        }
        if text.is_empty() {
            self.data.extend(std::iter::repeat_n(f64::NAN, width));
            return Ok(());
        }
        let no_number = || {
            damaged(shown, format!("main.xml: point {point} is `{text}`; expected {width} numbers between semicolons"))
        };
        let parts = text.split(';').map(|part| part.trim().parse::<f64>().map_err(|_| no_number()));
        let parts = parts.collect::<Result<Vec<f64>>>()?;
        match parts.len() {
            found if found == width => self.data.extend(parts),
            3 => self
                .data
                .extend(parts.iter().zip(&self.axes).filter(|(_, axis)| axis.is_absolute).map(|(part, _)| part)),
            _ => return Err(no_number()),
        }
        Ok(())
    }
}
