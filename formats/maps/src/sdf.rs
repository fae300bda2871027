//! SDF: surface data files of ISO 25178-71, as ASCII and binary, and those of the BCR from before the standard.
//!
//! ```text
//! aISO-1.0 | bISO-1.0 | aISO-2.0 | bISO-2.0 | aBCR-1.0 | bBCR-1.0
//! ManufacID (10 bytes), CreateDate and ModDate (12 bytes each, DDMMYYYYHHMM),
//! NumPoints, NumProfiles (u16; u32 in ISO-2.0), Xscale, Yscale, Zscale, Zresolution (f64, metres), Compression, DataType, CheckType (u8)
//! heights, profile by profile; then a trailer of text
//! ```
//!
//! As ASCII the same fields are lines `Name = value`, and `*` ends each of the three records. A point that was not measured is the
//! least number of its type (BCR: the greatest), or `BAD`. The first profile is at y = 0; in BCR files it is the last row of the map.

use std::io::{self, BufRead, BufReader, Read, Write};

use runout_core::{Result, height_grid::HeightGrid};

use crate::{
    input::Input,
    map::{MM_PER_M, Map, NM_PER_M, checked_size, damaged, failed},
    numbers::{self, Kind},
};

/// Bytes of the names of versions.
const MAGIC: usize = 8;
/// Longest line of a header, and longest number.
const LINE: u64 = 4096;
const LONGEST: usize = 64;
/// Numbers from which on a float of a BCR file is none.
const BCR_VOID: [f64; 2] = [3.4e38, 1.7e308];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    Bcr,
    Iso1,
    Iso2,
}

/// Whether these first bytes are those of an SDF file.
pub(crate) fn is_one(start: &[u8]) -> bool {
    magic(start).is_some()
}

/// Version, and whether it is binary.
fn magic(start: &[u8]) -> Option<(Version, bool)> {
    let (first, rest) = start.get(..MAGIC)?.split_first()?;
    let version = match rest {
        b"BCR-1.0" => Version::Bcr,
        b"ISO-1.0" => Version::Iso1,
        b"ISO-2.0" => Version::Iso2,
        _ => return None,
    };
    match first.to_ascii_lowercase() {
        b'a' => Some((version, false)),
        b'b' => Some((version, true)),
        _ => None,
    }
}

#[derive(Debug)]
struct Header {
    version: Version,
    size: [u64; 2],
    scale_m: [f64; 3],
    kind: Kind,
    about: Vec<(String, String)>,
}

/// Reads a file.
pub(crate) fn read(input: &Input) -> Result<Map> {
    let shown = &input.shown;
    let mut file = BufReader::new(input.open()?);
    let mut start = [0; MAGIC];
    file.read_exact(&mut start).map_err(|error| failed(shown, error))?;
    let (version, is_binary) = magic(&start).ok_or_else(|| damaged(shown, "it does not begin as an SDF file"))?;
    let header = if is_binary { binary(&mut file, version, shown) } else { text(&mut file, version, shown) }?;
    let [x_m, y_m, z_m] = header.scale_m;
    let [rows, columns] = header.size;
    // A profile may leave out the distance of rows, which it does not have.
    let y_m = if rows == 1 && y_m <= 0.0 { x_m } else { y_m };
    let count = checked_size(shown, header.size, [MM_PER_M * x_m, MM_PER_M * y_m])?;
    if !(z_m.is_finite() && z_m > 0.0) {
        return Err(damaged(shown, format!("Zscale is {z_m}; expected metres above 0")));
    }
    let least = count as u64 * if is_binary { header.kind.size() as u64 } else { 2 };
    if least > input.bytes {
        let problem = format!("it declares {rows} profiles of {columns} points, and has {} bytes", input.bytes);
        return Err(damaged(shown, problem));
    }
    let mut heights = if is_binary {
        numbers::read(&mut file, header.kind, count).map_err(|error| failed(shown, error))?
    } else {
        words(&mut file, count, header.version).map_err(|error| failed(shown, error))?
    };
    let (is_void, scale_nm) = (void(header.version, header.kind), z_m * NM_PER_M);
    for height in &mut heights {
        *height = if is_void(*height) { f64::NAN } else { *height * scale_nm };
    }
    let columns = columns as usize;
    if header.version == Version::Bcr {
        let [mut low, mut high] = [0, rows as usize - 1];
        while low < high {
            let (before, behind) = heights.split_at_mut(high * columns);
            before[low * columns..(low + 1) * columns].swap_with_slice(&mut behind[..columns]);
            (low, high) = (low + 1, high - 1);
        }
    }
    let grid = HeightGrid {
        columns,
        step_x_mm: MM_PER_M * x_m,
        step_y_mm: MM_PER_M * y_m,
        origin_x_mm: 0.0,
        origin_y_mm: 0.0,
        std_nm: None,
        height_nm: heights,
    };
    Ok(Map { format: "SDF", grid, layers: vec!["heights".into()], about: header.about, remarks: Vec::new() })
}

/// Whether a number is a point that was not measured.
fn void(version: Version, kind: Kind) -> impl Fn(f64) -> bool {
    let [least, greatest] = kind.range();
    move |number: f64| match (version, kind) {
        (Version::Bcr, Kind::F32) => number.is_nan() || number >= BCR_VOID[0],
        (Version::Bcr, Kind::F64) => number.is_nan() || number >= BCR_VOID[1],
        (Version::Bcr, _) => number >= greatest || number.is_nan(),
        _ => number <= least || !number.is_finite(),
    }
}

fn binary(file: &mut impl Read, version: Version, shown: &str) -> Result<Header> {
    let counts = if version == Version::Iso2 { Kind::U32 } else { Kind::U16 };
    let mut header = [0; 77];
    let length = 34 + 2 * counts.size() + 35;
    let header = &mut header[..length];
    file.read_exact(header).map_err(|error| failed(shown, error))?;
    let (texts, rest) = header.split_at(34);
    let (sizes, rest) = rest.split_at(2 * counts.size());
    let [columns, rows] = [0, 1].map(|place| counts.decode(&sizes[place * counts.size()..]) as u64);
    let scale_m = [0, 1, 2].map(|place| Kind::F64.decode(&rest[8 * place..]));
    if rest[32] != 0 {
        return Err(damaged(
            shown,
            format!("its heights are compressed by method {}, which no standard describes", rest[32]),
        ));
    }
    let kind =
        kind(u32::from(rest[33])).ok_or_else(|| damaged(shown, format!("unknown type {} of heights", rest[33])))?;
    let named = [("maker", &texts[..10]), ("created", &texts[10..22]), ("modified", &texts[22..])];
    let about = named.map(|(name, bytes)| {
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        (name.to_owned(), String::from_utf8_lossy(&bytes[..end]).trim().to_owned())
    });
    Ok(Header { version, size: [rows, columns], scale_m, kind, about: about.into() })
}

fn kind(code: u32) -> Option<Kind> {
    [Kind::U8, Kind::U16, Kind::U32, Kind::F32, Kind::I8, Kind::I16, Kind::I32, Kind::F64].get(code as usize).copied()
}

/// Names of the types in headers of the BCR.
const NAMES: [&str; 8] = ["UCHAR", "UINTEGER", "ULONGINT", "FLOAT", "CHAR", "INTEGER", "LONGINT", "DOUBLE"];

fn text(file: &mut impl BufRead, version: Version, shown: &str) -> Result<Header> {
    let mut fields: Vec<(String, String)> = Vec::new();
    loop {
        let mut bytes = Vec::new();
        let read = file.by_ref().take(LINE).read_until(b'\n', &mut bytes).map_err(|error| failed(shown, error))?;
        if read == 0 {
            return Err(damaged(shown, "the header does not end with `*`"));
        }
        let line = String::from_utf8_lossy(&bytes);
        let line = if version == Version::Bcr { line.split(';').next().unwrap_or_default() } else { &line };
        if line.trim() == "*" {
            break;
        }
        if let Some((name, value)) = line.split_once('=') {
            fields.push((name.trim().to_ascii_lowercase(), value.trim().to_owned()));
        }
    }
    let field = |name: &str| fields.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str());
    let needed = |name: &str| field(name).ok_or_else(|| damaged(shown, format!("the header has no {name}")));
    let number = |name: &str| {
        let value = needed(name)?;
        value.parse::<f64>().map_err(|_| damaged(shown, format!("{name} = `{value}` is no number")))
    };
    let count = |name: &str| {
        let value = needed(name)?;
        value.parse::<u64>().map_err(|_| damaged(shown, format!("{name} = `{value}` is no number of points")))
    };
    let code = needed("datatype")?;
    let named = || NAMES.iter().position(|name| code.eq_ignore_ascii_case(name)).map(|place| place as u32);
    let kind = code.parse().ok().or_else(named).and_then(kind);
    let kind = kind.ok_or_else(|| damaged(shown, format!("unknown type `{code}` of heights")))?;
    let about = [("maker", "manufacid"), ("created", "createdate"), ("modified", "moddate")];
    let about = about.iter().filter_map(|(name, key)| Some(((*name).to_owned(), field(key)?.to_owned())));
    Ok(Header {
        version,
        size: [count("numprofiles")?, count("numpoints")?],
        scale_m: [number("xscale")?, number("yscale")?, number("zscale")?],
        kind,
        about: about.collect(),
    })
}

/// Heights as text, NaN for those that are marked.
fn words(file: &mut impl BufRead, count: usize, version: Version) -> io::Result<Vec<f64>> {
    let wrong = |problem: String| io::Error::new(io::ErrorKind::InvalidData, problem);
    let mut heights = Vec::new();
    let mut word = Vec::with_capacity(LONGEST);
    let mut is_comment = false;
    while heights.len() < count {
        let block = file.fill_buf()?;
        if block.is_empty() && word.is_empty() {
            return Err(wrong(format!("it ends after {} of {count} heights", heights.len())));
        }
        let used = block.len().max(1);
        for byte in block.iter().copied().chain(block.is_empty().then_some(b'\n')) {
            is_comment = (is_comment && byte != b'\n') || (version == Version::Bcr && byte == b';');
            if !(is_comment || byte.is_ascii_whitespace()) {
                word.push(byte);
                if word.len() > LONGEST {
                    return Err(wrong(format!("height {} is no number", heights.len() + 1)));
                }
            } else if !word.is_empty() && heights.len() < count {
                let text = String::from_utf8_lossy(&word);
                let is_void = ["bad", "nan"].iter().any(|mark| text.eq_ignore_ascii_case(mark));
                let number = if is_void { Some(f64::NAN) } else { text.parse().ok() };
                heights
                    .push(number.ok_or_else(|| wrong(format!("height {} is `{text}`, no number", heights.len() + 1)))?);
                word.clear();
            }
        }
        let used = if block.is_empty() { 0 } else { used };
        file.consume(used);
    }
    Ok(heights)
}

/// Writes a map as binary ISO-1.0, or ISO-2.0 where it has more than 65 535 rows or columns, with heights as f64.
pub(crate) fn write(grid: &HeightGrid, title: &str, file: &mut impl Write) -> io::Result<()> {
    let [rows, columns] = [grid.rows(), grid.columns];
    let is_long = rows.max(columns) > usize::from(u16::MAX);
    file.write_all(if is_long { b"bISO-2.0" } else { b"bISO-1.0" })?;
    // Files with the same heights have the same bytes: the standard's dates have no value for "not stated".
    file.write_all(b"runout    010120000000010120000000")?;
    for count in [columns, rows] {
        let bytes = (count as u32).to_le_bytes();
        file.write_all(if is_long { &bytes } else { &bytes[..2] })?;
    }
    // Zresolution: −1 is not known.
    for number in [grid.step_x_mm / MM_PER_M, grid.step_y_mm / MM_PER_M, 1.0 / NM_PER_M, -1.0] {
        file.write_all(&number.to_le_bytes())?;
    }
    // Not compressed, f64, no check sum.
    file.write_all(&[0, 7, 0])?;
    let mut block = Vec::with_capacity(8 * columns);
    for row in grid.height_nm.chunks(columns.max(1)) {
        block.clear();
        for height in row {
            let number = if height.is_finite() { *height } else { f64::MIN };
            block.extend(number.to_le_bytes());
        }
        file.write_all(&block)?;
    }
    let ascii: String = title.chars().filter(|letter| letter.is_ascii_graphic() || *letter == ' ').collect();
    if ascii.is_empty() { Ok(()) } else { file.write_all(format!("Title = {ascii}\r\n").as_bytes()) }
}
