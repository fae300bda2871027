//! SUR, PRO: files of Digital Surf (MountainsMap, and instruments that write for it), also compressed.
//!
//! A file is one object after the other, each a header of 512 bytes, a comment, private data and heights as i16 or i32. Of a compressed
//! object (`DSCOMPRESSED`) the heights are zlib streams behind a list of their lengths. Objects that are pictures are left out.

use std::io::{BufReader, Read, Seek, SeekFrom};

use flate2::read::ZlibDecoder;
use runout_core::{Error, Result, height_grid::HeightGrid, length_unit::micrometres};

use crate::{
    input::Input,
    map::{Map, NM_PER_UM, Wanted, checked_size, damaged, failed},
    numbers::{self, Kind},
};

const HEADER: usize = 512;
const PLAIN: &[u8] = b"DIGITAL SURF";
const COMPRESSED: &[u8] = b"DSCOMPRESSED";
/// Types of objects whose points are heights: profiles, surfaces, series and layers of them, surfaces with a picture.
const HEIGHTS: [u16; 8] = [1, 2, 4, 5, 7, 8, 11, 13];
const SURFACE_WITH_PICTURES: u16 = 16;
/// Objects that are examined.
const MOST_OBJECTS: usize = 10_000;
/// What a marked height is below the least one.
const VOID_BELOW: f64 = 2.0;

/// Whether these first bytes are those of a file of Digital Surf.
pub(crate) fn is_one(start: &[u8]) -> bool {
    start.starts_with(PLAIN) || start.starts_with(COMPRESSED)
}

/// The header of one object.
struct Object {
    is_compressed: bool,
    kind: u16,
    name: String,
    size: [u64; 2],
    bits: u16,
    has_voids: bool,
    least: f64,
    step: [f64; 3],
    step_unit: [String; 3],
    unit: [String; 3],
    ratio: [f64; 3],
    offset: [f64; 3],
    inverted: u16,
    about: Vec<(String, String)>,
    /// Place of its data, and their bytes.
    data: u64,
    bytes: u64,
}

/// Reads a file.
pub(crate) fn read(input: &Input, wanted: &Wanted) -> Result<Map> {
    let shown = &input.shown;
    let mut file = BufReader::new(input.open()?);
    let (first, declared) = object(&mut file, 0, shown)?;
    let mut objects = vec![first];
    let mut remarks = Vec::new();
    while objects.len() < declared.min(MOST_OBJECTS) {
        let end = objects.last().map_or(0, |last| last.data.saturating_add(last.bytes));
        let Ok((next, _)) = object(&mut file, end, shown) else {
            remarks.push(format!("it declares {declared} objects, and {} could be read", objects.len()));
            break;
        };
        objects.push(next);
    }
    objects.retain(|object| HEIGHTS.contains(&object.kind) || object.kind == SURFACE_WITH_PICTURES);
    if objects.is_empty() {
        return Err(Error::new("read", shown, "it has pictures or spectra and no heights"));
    }
    let named = objects.iter().enumerate();
    let layers: Vec<String> = named
        .map(
            |(index, object)| {
                if object.name.is_empty() { format!("object {}", index + 1) } else { object.name.clone() }
            },
        )
        .collect();
    let (place, others) = wanted.pick(&layers, shown)?;
    remarks.extend(others);
    let object = objects.swap_remove(place);
    let grid = object.grid(&mut file, input, wanted)?;
    if object.inverted != 0 {
        remarks.push(format!(
            "its header says that heights were turned round (inversion {}): they are taken as they are stored, check which side is out of the \
             material",
            object.inverted
        ));
    }
    Ok(Map { format: "SUR", grid, layers, about: object.about, remarks })
}

/// The object at a place, and how many the file declares.
fn object(file: &mut (impl Read + Seek), start: u64, shown: &str) -> Result<(Object, usize)> {
    file.seek(SeekFrom::Start(start)).map_err(|error| failed(shown, error))?;
    let mut header = [0; HEADER];
    file.read_exact(&mut header).map_err(|error| failed(shown, error))?;
    if !is_one(&header) {
        return Err(damaged(shown, format!("expected an object at byte {start}")));
    }
    let whole = |place: usize| Kind::U16.decode(&header[place..]) as u16;
    let long = |place: usize| Kind::I32.decode(&header[place..]);
    let float = |place: usize| Kind::F32.decode(&header[place..]);
    let text = |place: usize, length: usize| latin(&header[place..place + length]);
    let each = |place: usize, size: usize| [place, place + size, place + 2 * size];
    let is_compressed = header.starts_with(COMPRESSED);
    let size = [long(112), long(108)].map(|count| if count > 0.0 { count as u64 } else { 0 });
    let (bits, points) = (whole(98), size[0].saturating_mul(size[1]));
    let bytes = if is_compressed {
        Kind::U32.decode(&header[324..]) as u64
    } else {
        points.saturating_mul(u64::from(bits / 8))
    };
    let texts = [("object", text(20, 30)), ("operator", text(50, 30)), ("client", text(338, 128))];
    let [day, month, year] = [whole(312), whole(314), whole(316)];
    let date = (year > 0).then(|| ("created".to_owned(), format!("{year:04}-{month:02}-{day:02}")));
    let about = texts.into_iter().filter(|(_, text)| !text.is_empty()).map(|(name, text)| (name.to_owned(), text));
    let object = Object {
        is_compressed,
        kind: whole(18),
        name: text(20, 30),
        size,
        bits,
        has_voids: whole(86) == 1,
        least: long(100),
        step: each(120, 4).map(float),
        step_unit: each(180, 16).map(|place| text(place, 16)),
        unit: each(228, 16).map(|place| text(place, 16)),
        ratio: each(276, 4).map(float),
        offset: each(466, 4).map(float),
        inverted: whole(290),
        about: about.chain(date).collect(),
        data: start + (HEADER as u64) + u64::from(whole(334)) + u64::from(whole(336)),
        bytes,
    };
    Ok((object, usize::from(whole(14))))
}

/// Text of a header up to its first NUL, as UTF-8 or else as Latin-1.
fn latin(bytes: &[u8]) -> String {
    let bytes = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    let text =
        std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().copied().map(char::from).collect(), str::to_owned);
    text.trim().to_owned()
}

impl Object {
    /// µm in one of the unit of its steps along an axis, which may be given by that of its lengths and their ratio.
    fn micrometres(&self, axis: usize) -> Option<f64> {
        micrometres(&self.step_unit[axis]).or_else(|| Some(micrometres(&self.unit[axis])? * self.ratio[axis]))
    }

    fn grid(&self, file: &mut (impl Read + Seek), input: &Input, wanted: &Wanted) -> Result<HeightGrid> {
        let shown = &input.shown;
        let [rows, columns] = self.size;
        let across = |axis: usize, name: &str| {
            let um = self.micrometres(axis).ok_or_else(|| {
                let problem =
                    format!("its {name} are {} `{}` apart, which is no length", self.step[axis], self.step_unit[axis]);
                Error::new("read", shown, problem)
            })?;
            Ok::<_, Error>([
                1e-3 * um * self.step[axis],
                1e-3 * micrometres(&self.unit[axis]).unwrap_or(um) * self.offset[axis],
            ])
        };
        let [step_x_mm, origin_x_mm] = across(0, "columns")?;
        let [step_y_mm, origin_y_mm] = if rows == 1 { [step_x_mm, 0.0] } else { across(1, "rows")? };
        let count = checked_size(shown, self.size, [step_x_mm, step_y_mm])?;
        let kind = match self.bits {
            16 => Kind::I16,
            32 => Kind::I32,
            bits => return Err(damaged(shown, format!("its heights have {bits} bits; expected 16 or 32"))),
        };
        let nm = match self.micrometres(2) {
            Some(um) => NM_PER_UM * um,
            None => wanted.nanometres(&self.step_unit[2], shown)?,
        };
        if !(self.step[2].is_finite() && self.step[2] > 0.0) {
            return Err(damaged(shown, format!("one digit of its heights is {} {}", self.step[2], self.step_unit[2])));
        }
        file.seek(SeekFrom::Start(self.data)).map_err(|error| failed(shown, error))?;
        let mut heights = if self.is_compressed {
            self.unpacked(file, kind, count, shown)?
        } else if self.data.saturating_add(self.bytes) > input.bytes {
            let problem = format!("it declares {rows} lines of {columns} points, and ends after {} bytes", input.bytes);
            return Err(damaged(shown, problem));
        } else {
            numbers::read(file, kind, count).map_err(|error| failed(shown, error))?
        };
        let (void, digit_nm) = (self.least - VOID_BELOW, nm * self.step[2]);
        let level_nm = NM_PER_UM * micrometres(&self.unit[2]).unwrap_or(nm / NM_PER_UM) * self.offset[2];
        let level_nm = if level_nm.is_finite() { level_nm } else { 0.0 };
        for height in &mut heights {
            let is_void = self.has_voids && (*height - void).abs() < 0.5;
            *height = if is_void { f64::NAN } else { *height * digit_nm + level_nm };
        }
        let [origin_x_mm, origin_y_mm] =
            [origin_x_mm, origin_y_mm].map(|origin| if origin.is_finite() { origin } else { 0.0 });
        let columns = columns as usize;
        Ok(HeightGrid { columns, step_x_mm, step_y_mm, origin_x_mm, origin_y_mm, std_nm: None, height_nm: heights })
    }

    /// Heights of zlib streams: their number, of each its length unpacked and packed, then the streams.
    fn unpacked(&self, file: &mut impl Read, kind: Kind, count: usize, shown: &str) -> Result<Vec<f64>> {
        let io = |error| failed(shown, error);
        let streams = numbers::read(file, Kind::U32, 1).map_err(io)?[0];
        if 4.0 + 8.0 * streams > self.bytes as f64 {
            return Err(damaged(shown, format!("it declares {streams} streams in {} bytes", self.bytes)));
        }
        let lengths = numbers::read(file, Kind::U32, 2 * streams as usize).map_err(io)?;
        let mut heights = Vec::new();
        for pair in lengths.chunks_exact(2) {
            let (unpacked, packed) = (pair[0] as usize, pair[1] as u64);
            let points = unpacked / kind.size();
            if points * kind.size() != unpacked || heights.len() + points > count {
                return Err(damaged(shown, format!("a stream of {unpacked} bytes does not fit its {count} points")));
            }
            let mut stream = file.by_ref().take(packed);
            heights.extend(numbers::read(&mut ZlibDecoder::new(&mut stream), kind, points).map_err(io)?);
            std::io::copy(&mut stream, &mut std::io::sink()).map_err(io)?;
        }
        if heights.len() != count {
            return Err(damaged(shown, format!("its streams have {} of {count} points", heights.len())));
        }
        Ok(heights)
    }
}
