//! X3P: ISO 25178-72, a ZIP archive with `main.xml` and, unless the heights are in it, a binary file of them.
//!
//! Axes are incremental (place = number · increment + offset) or absolute (a coordinate a point); lengths are metres. Points follow each
//! other along x, then y, then z (layers). A point that was not measured is NaN, an empty `Datum`, or a bit 0 of the file of valid points,
//! the lowest bit first. What hand-packed files have is accepted: everything in a folder, files of an operating system beside it,
//! text in the place of dates.

mod document;
mod write;

use std::{
    fs::File,
    io::{BufReader, Read},
};

use md5::{Digest, Md5};
use runout_core::{Result, height_grid::HeightGrid};
use zip::ZipArchive;

use crate::{
    input::Input,
    map::{MM_PER_M, MOST_POINTS, Map, NM_PER_M, Wanted, checked_size, damaged, failed, places},
    numbers::{self, Kind},
};
use document::{Axis, Document};
pub(crate) use write::write;

/// Largest `main.xml`: 200 million points of 20 letters.
const MOST_XML: u64 = 4 << 30;

/// Packed bytes that are read at a time: a packed block is unpacked in few pieces.
const PACKED: usize = 1 << 16;

/// Whether these first bytes are those of a ZIP archive.
pub(crate) fn is_one(start: &[u8]) -> bool {
    start.starts_with(b"PK\x03\x04")
}

type Archive = ZipArchive<BufReader<File>>;

/// Whether an archive is an X3P: other formats are archives, too.
///
/// # Errors
/// When it is cut or damaged.
pub(crate) fn is_in(input: &Input) -> Result<bool> {
    Ok(member(&opened(input)?, "main.xml").is_some())
}

fn opened(input: &Input) -> Result<Archive> {
    let archive = ZipArchive::new(BufReader::with_capacity(PACKED, input.open()?));
    archive.map_err(|error| {
        failed(&input.shown, error).help("the archive is cut or damaged: copy the file again from where it was written")
    })
}

/// Reads a file.
pub(crate) fn read(input: &Input, wanted: &Wanted) -> Result<Map> {
    let shown = &input.shown;
    let mut archive = opened(input)?;
    let main =
        member(&archive, "main.xml").ok_or_else(|| damaged(shown, "the archive has no main.xml: it is no X3P"))?;
    let folder = main.trim_end_matches("main.xml").to_owned();
    let mut remarks = Vec::new();
    let document = {
        let file = archive.by_name(&main).map_err(|error| failed(shown, error))?;
        Document::read(BufReader::new(file.take(MOST_XML)), shown)?
    };
    let layers: Vec<String> = match document.size[2] {
        0 | 1 => vec!["heights".into()],
        layers if layers > MOST_POINTS as u64 => return Err(damaged(shown, format!("it declares {layers} layers"))),
        layers => (1..=layers.min(input.bytes)).map(|layer| format!("layer {layer}")).collect(),
    };
    let (layer, others) = wanted.pick(&layers, shown)?;
    remarks.extend(others);
    let stored = match &document.link {
        Some(_) => linked(&mut archive, &folder, &document, layer, &mut remarks, shown)?,
        None => listed(&document, layer, shown)?,
    };
    let grid = grid(&document, stored, shown)?;
    Ok(Map { format: "X3P", grid, layers, about: document.about, remarks })
}

/// The member of a name in the archive: in its root, or in a folder that everything is in.
fn member(archive: &Archive, name: &str) -> Option<String> {
    let names = archive.file_names().filter_map(|name| Some(name.ok()?.into_owned()));
    let fits = |known: &String| {
        let ours = !known.split('/').any(|part| part == "__MACOSX" || part.starts_with("._"));
        ours && (known == name || known.strip_suffix(name).is_some_and(|folder| folder.ends_with('/')))
    };
    names.filter(fits).min_by_key(String::len)
}

/// Coordinates of the points of one layer, in metres; those of incremental axes are empty.
struct Stored {
    xyz: [Vec<f64>; 3],
}

/// Points of the layer in a binary file.
fn linked(
    archive: &mut Archive,
    folder: &str,
    document: &Document,
    layer: usize,
    remarks: &mut Vec<String>,
    shown: &str,
) -> Result<Stored> {
    let count = document.points(shown)?;
    let kinds = document.stored().map(Axis::kind).collect::<Vec<Kind>>();
    let record: usize = kinds.iter().map(|kind| kind.size()).sum();
    let link = document.link.clone().unwrap_or_default();
    let name = member_of(archive, folder, &link, shown)?;
    let io = |error| failed(shown, error);
    let mut columns: Vec<Vec<f64>> = kinds.iter().map(|_| Vec::new()).collect();
    {
        let file = archive.by_name(&name).map_err(|error| failed(shown, error))?;
        let mut file = Hashed { file, hash: document.checksum.as_ref().map(|_| Md5::new()) };
        numbers::skip(&mut file, layer as u64 * count as u64 * record as u64).map_err(io)?;
        numbers::records(&mut file, record, count, |records| {
            let mut place = 0;
            for (column, kind) in columns.iter_mut().zip(&kinds) {
                kind.append(&records[place..], record, column);
                place += kind.size();
            }
        })
        .map_err(io)?;
        std::io::copy(&mut file, &mut std::io::sink()).map_err(io)?;
        let found = file.hash.map(|hash| hex(&hash.finalize()));
        if let (Some(found), Some(stated)) = (found, &document.checksum)
            && !stated.eq_ignore_ascii_case(&found)
        {
            remarks.push(format!("the MD5 of {link} is {found}, and main.xml states {stated}: one of them was changed after it was written"));
        }
    }
    if let Some(valid) = &document.valid_link {
        let name = member_of(archive, folder, valid, shown)?;
        let mut file = BufReader::new(archive.by_name(&name).map_err(|error| failed(shown, error))?);
        let first = layer as u64 * count as u64;
        numbers::skip(&mut file, first / 8).map_err(io)?;
        let from = (first % 8) as usize;
        let mut bits = 0_usize;
        numbers::records(&mut file, 1, (from + count).div_ceil(8), |bytes| {
            for bit in 0..8 * bytes.len() {
                let point = (bits + bit).wrapping_sub(from);
                if point < count && bytes[bit / 8] >> (bit % 8) & 1 == 0 {
                    columns.iter_mut().for_each(|column| column[point] = f64::NAN);
                }
            }
            bits += 8 * bytes.len();
        })
        .map_err(io)?;
    }
    Ok(document.placed(columns))
}

/// The member that a link leads to. Links lead into the archive; backslashes count as slashes.
fn member_of(archive: &Archive, folder: &str, link: &str, shown: &str) -> Result<String> {
    let link = link.replace('\\', "/");
    let link = link.trim_start_matches("./");
    let inside = format!("{folder}{link}");
    if archive.index_for_name(&inside).is_some() {
        return Ok(inside);
    }
    let last = link.rsplit('/').next().unwrap_or_default();
    member(archive, last)
        .filter(|_| !last.is_empty())
        .ok_or_else(|| damaged(shown, format!("the archive has no {link}, which main.xml names")))
}

/// Points of the layer in `main.xml`.
fn listed(document: &Document, layer: usize, shown: &str) -> Result<Stored> {
    let count = document.points(shown)?;
    let width = document.stored().count().max(1);
    let data = document.data.get(layer * count * width..(layer + 1) * count * width).ok_or_else(|| {
        let problem = format!("main.xml lists {} points; expected {count} a layer", document.data.len() / width);
        damaged(shown, problem)
    })?;
    let columns = (0..width).map(|column| data.iter().skip(column).step_by(width).copied().collect());
    Ok(document.placed(columns.collect()))
}

impl Document {
    /// Axes with a coordinate a point.
    fn stored(&self) -> impl Iterator<Item = &Axis> {
        self.axes.iter().filter(|axis| axis.is_absolute)
    }

    /// Points of a layer.
    fn points(&self, shown: &str) -> Result<usize> {
        let [columns, rows, _] = self.size;
        match rows.checked_mul(columns) {
            Some(points @ 1..) if points <= MOST_POINTS as u64 => Ok(points as usize),
            _ => Err(damaged(shown, format!("{rows} by {columns} points are none, or more than {MOST_POINTS}"))),
        }
    }

    /// Columns of stored axes at the places of these axes, in metres.
    fn placed(&self, columns: Vec<Vec<f64>>) -> Stored {
        let mut xyz = [const { Vec::new() }; 3];
        let mut columns = columns.into_iter();
        for (place, axis) in self.axes.iter().enumerate().filter(|(_, axis)| axis.is_absolute) {
            let mut column = columns.next().unwrap_or_default();
            column.iter_mut().for_each(|value| *value = *value * axis.increment + axis.offset);
            xyz[place] = column;
        }
        Stored { xyz }
    }
}

/// The heights on their grid.
fn grid(document: &Document, Stored { xyz: [x, y, mut z] }: Stored, shown: &str) -> Result<HeightGrid> {
    if z.is_empty() {
        return Err(damaged(shown, "its z axis is incremental: it has no heights"));
    }
    z.iter_mut().for_each(|height| *height = if height.is_finite() { *height * NM_PER_M } else { f64::NAN });
    let [columns, rows, _] = document.size;
    let [along_x, along_y] = [&document.axes[0], &document.axes[1]];
    if x.is_empty() && y.is_empty() {
        let step_mm = [along_x, along_y].map(|axis| MM_PER_M * axis.increment.abs());
        checked_size(shown, [rows, columns], step_mm)?;
        let columns = columns as usize;
        // An axis that counts down has its first place at its end.
        if along_x.increment < 0.0 {
            z.chunks_mut(columns).for_each(<[f64]>::reverse);
        }
        if along_y.increment < 0.0 {
            z.reverse();
            z.chunks_mut(columns).for_each(<[f64]>::reverse);
        }
        let first = |axis: &Axis, count: usize| MM_PER_M * (axis.offset + axis.increment.min(0.0) * (count - 1) as f64);
        return Ok(HeightGrid {
            columns,
            step_x_mm: step_mm[0],
            step_y_mm: step_mm[1],
            origin_x_mm: first(along_x, columns),
            origin_y_mm: first(along_y, rows as usize),
            std_nm: None,
            height_nm: z,
        });
    }
    let place = |stored: &[f64], axis: &Axis, number: fn(usize, usize) -> usize, index: usize| {
        let metres = stored
            .get(index)
            .copied()
            .unwrap_or_else(|| number(index, columns as usize) as f64 * axis.increment + axis.offset);
        MM_PER_M * metres
    };
    let known: Vec<usize> = (0..z.len()).filter(|index| z[*index].is_finite()).collect();
    let x: Vec<f64> = known.iter().map(|index| place(&x, along_x, |index, columns| index % columns, *index)).collect();
    let y: Vec<f64> = known.iter().map(|index| place(&y, along_y, |index, columns| index / columns, *index)).collect();
    Ok(places(&x, &y, shown)?.heights(known.iter().map(|index| z[*index]), None))
}

/// A reader that takes the checksum of what it reads.
struct Hashed<R> {
    file: R,
    hash: Option<Md5>,
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let read = self.file.read(bytes)?;
        if let Some(hash) = &mut self.hash {
            hash.update(&bytes[..read]);
        }
        Ok(read)
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes
        .iter()
        .flat_map(|byte| [byte >> 4, byte & 15])
        .filter_map(|digit| char::from_digit(u32::from(digit), 16))
        .collect()
}
