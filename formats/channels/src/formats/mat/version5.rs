//! Version 5: elements of a type, a length and data; matrices are elements of elements, and each variable may be deflated.

use std::io::Read;

use flate2::read::ZlibDecoder;
use runout_core::{Error, Result, input_file::InputFile};

use super::{Matrix, Variables, bytes_of};
use crate::{
    bytes::{Bytes, text},
    channel::Kind,
    source::{Source, Unpacking},
    strided::Run,
};

/// Bytes of the header.
const HEADER: u64 = 128;
/// Types of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Flags and classes of matrices.
const IS_COMPLEX: u32 = 0x0800;
const IS_LOGICAL: u32 = 0x0200;
const CELL: u32 = 1;
const STRUCT: u32 = 2;
const OBJECT: u32 = 3;
const CHARACTERS: u32 = 4;
const SPARSE: u32 = 5;
/// Matrices in matrices.
const DEEPEST: usize = 16;
/// Variables, fields and cells of a file.
const MOST: usize = 1 << 18;

pub(super) fn recognises(head: &[u8]) -> bool {
    matches!(head.get(124..128), Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I']))
        && head[..4].iter().all(|byte| *byte != 0)
}

pub(super) fn open(input: &InputFile) -> Result<Variables> {
    let mut bytes = Bytes::open(&input.into())?;
    bytes.seek(HEADER - 2)?;
    let is_big_endian = bytes.array()? == *b"MI";
    bytes.is_big_endian = is_big_endian;
    let mut elements = Vec::new();
    while bytes.rest() >= 8 {
        let tag = Tag::read(&mut bytes)?;
        elements.push(tag);
        if tag.end() > bytes.length() {
            return Err(bytes.damaged(format!("a variable of {} bytes was declared, the file ends before", tag.length)));
        }
        // Only what is not packed is padded.
        bytes.seek(if tag.kind == COMPRESSED { tag.end() } else { tag.behind() }.min(bytes.length()))?;
    }
    if bytes.rest() > 0 {
        return Err(bytes.damaged("expected a variable, found a part of one"));
    }
    let (source, places) = unpacked(input, &elements)?;
    let mut reader = Reader { bytes: Bytes::open(&source)?, variables: Variables::of(source) };
    reader.bytes.is_big_endian = is_big_endian;
    for place in places {
        reader.bytes.seek(place)?;
        let tag = Tag::read(&mut reader.bytes)?;
        if tag.kind == MATRIX {
            reader.matrix(tag, "", None, 0)?;
        }
    }
    Ok(reader.variables)
}

/// The file itself, or a temporary one of all its variables where some are packed; and where each begins.
fn unpacked(input: &InputFile, elements: &[Tag]) -> Result<(Source, Vec<u64>)> {
    if elements.iter().all(|tag| tag.kind != COMPRESSED) {
        return Ok((input.into(), elements.iter().map(|tag| tag.begin).collect()));
    }
    let shown = input.path().display().to_string();
    let (mut unpacking, mut places) = (Unpacking::of(&shown)?, Vec::with_capacity(elements.len()));
    for tag in elements {
        let mut file = input.open()?;
        let is_packed = tag.kind == COMPRESSED;
        let from = if is_packed { tag.data } else { tag.begin };
        std::io::Seek::seek(&mut file, std::io::SeekFrom::Start(from))
            .map_err(|error| Error::caused("read", &shown, error))?;
        let stored = file.take(tag.end() - from);
        let (begin, _) = if is_packed {
            unpacking.append(&mut ZlibDecoder::new(stored))?
        } else {
            let mut stored = stored;
            unpacking.append(&mut stored)?
        };
        places.push(begin);
    }
    Ok((unpacking.finish()?, places))
}

/// What stands before the data of an element.
#[derive(Debug, Clone, Copy)]
struct Tag {
    kind: u32,
    length: u64,
    begin: u64,
    data: u64,
    is_small: bool,
}

impl Tag {
    fn read(bytes: &mut Bytes) -> Result<Self> {
        let begin = bytes.place();
        let first = bytes.u32()?;
        // A small element has its length in the upper half, and its data in place of the length.
        let (kind, length, is_small) = match first >> 16 {
            0 => (first, u64::from(bytes.u32()?), false),
            small => (first & 0xFFFF, u64::from(small), true),
        };
        if is_small && length > 4 {
            return Err(bytes.damaged(format!("expected at most 4 bytes in a small element, found {length}")));
        }
        Ok(Self { kind, length, begin, data: bytes.place(), is_small })
    }

    fn end(&self) -> u64 {
        self.data.saturating_add(self.length)
    }

    /// Where the next element begins: data are padded to eight bytes.
    fn behind(&self) -> u64 {
        if self.is_small { self.begin + 8 } else { self.data.saturating_add(self.length.div_ceil(8).saturating_mul(8)) }
    }
}

struct Reader {
    bytes: Bytes,
    variables: Variables,
}

impl Reader {
    /// The next element, which has to end where the one around it does.
    fn element(&mut self, around: &Tag) -> Result<Tag> {
        let tag = Tag::read(&mut self.bytes)?;
        if tag.end() > around.end() || tag.end() > self.bytes.length() {
            return Err(self.bytes.damaged("expected an element inside the one around it"));
        }
        Ok(tag)
    }

    fn data(&mut self, around: &Tag) -> Result<(Tag, Vec<u8>)> {
        let tag = self.element(around)?;
        let data = self.bytes.take(tag.length)?;
        self.bytes.seek(tag.behind())?;
        Ok((tag, data))
    }

    fn numbers(&mut self, around: &Tag) -> Result<Vec<u32>> {
        let (_, data) = self.data(around)?;
        let big = self.bytes.is_big_endian;
        let number = |bytes: &[u8]| {
            let bytes = bytes.first_chunk().copied().unwrap_or_default();
            if big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
        };
        Ok(data.chunks_exact(4).map(number).collect())
    }

    /// A matrix; `name` is that of a field or cell, which has none of its own.
    fn matrix(&mut self, tag: Tag, group: &str, name: Option<String>, depth: usize) -> Result<()> {
        if tag.length == 0 {
            // An empty matrix, as of a field that was not set.
            return Ok(());
        }
        if depth > DEEPEST || self.variables.channels.len() > MOST {
            return Err(self.bytes.damaged(format!("expected at most {DEEPEST} levels and {MOST} variables")));
        }
        let flags = self.numbers(&tag)?.first().copied().unwrap_or(0);
        let class = flags & 0xFF;
        if class > SPARSE && kind_of_class(class).is_none() {
            // Functions and objects of newer kinds have other elements.
            if let Some(name) = name {
                self.variables.add_text(group, &name, None);
            }
            return Ok(());
        }
        let shape: Vec<u64> = self.numbers(&tag)?.into_iter().map(u64::from).collect();
        let own = text(&self.data(&tag)?.1);
        let name = name.unwrap_or(own);
        if name.is_empty() {
            // What MATLAB keeps of its functions.
            return Ok(());
        }
        let elements = bytes_of(&shape, 1).unwrap_or(u64::MAX);
        match class {
            CELL => {
                for cell in 0..elements {
                    let inner = self.element(&tag)?;
                    self.inner(inner, &below(group, &name), format!("[{cell}]"), depth)?;
                }
            }
            STRUCT | OBJECT => self.structure(&tag, &below(group, &name), class, elements, depth)?,
            CHARACTERS => {
                let (tag, data) = self.data(&tag)?;
                let characters = characters(tag.kind, &data, self.bytes.is_big_endian);
                self.variables.add_text(group, &name, Some(characters));
            }
            SPARSE => self.variables.add_text(group, &name, None),
            _ => self.numeric(&tag, flags, shape, group, &name)?,
        }
        Ok(())
    }

    /// What is in a field or cell; reading goes on behind it.
    fn inner(&mut self, tag: Tag, group: &str, name: String, depth: usize) -> Result<()> {
        if tag.kind == MATRIX {
            self.matrix(tag, group, Some(name), depth + 1)?;
        }
        self.bytes.seek(tag.behind())
    }

    fn structure(&mut self, tag: &Tag, group: &str, class: u32, elements: u64, depth: usize) -> Result<()> {
        if class == OBJECT {
            self.data(tag)?;
        }
        let width = self.numbers(tag)?.first().copied().unwrap_or(0) as usize;
        let (_, names) = self.data(tag)?;
        let names: Vec<String> = if width == 0 { Vec::new() } else { names.chunks(width).map(text).collect() };
        if names.is_empty() {
            return Ok(());
        }
        for element in 0..elements {
            let group = if elements == 1 { group.to_owned() } else { format!("{group}[{element}]") };
            for name in &names {
                let inner = self.element(tag)?;
                self.inner(inner, &group, name.clone(), depth)?;
            }
        }
        Ok(())
    }

    fn numeric(&mut self, tag: &Tag, flags: u32, shape: Vec<u64>, group: &str, name: &str) -> Result<()> {
        let stored = self.element(tag)?;
        let Some(kind) = kind_of_element(stored.kind) else {
            return Err(self
                .bytes
                .damaged(format!("`{name}`: expected numbers, found an element of type {}", stored.kind)));
        };
        let size = bytes_of(&shape, kind.bytes() as u64);
        if size != Some(stored.length) {
            let problem = format!("`{name}`: the shape {shape:?} was declared, {} bytes are there", stored.length);
            return Err(self.bytes.damaged(problem));
        }
        let is_logical = flags & IS_LOGICAL != 0;
        let class = if is_logical { Some(Kind::Bool) } else { kind_of_class(flags & 0xFF) };
        let first = Run::dense(stored.data, 1, kind, self.bytes.is_big_endian);
        let matrix =
            Matrix { group: group.to_owned(), name: name.to_owned(), shape, kind: class.unwrap_or(kind), first };
        self.variables.add(&matrix);
        if flags & IS_COMPLEX != 0 {
            let remark = format!("{}: `{name}` is complex: its real part is read", self.variables.source.shown());
            self.variables.remarks.push(remark);
        }
        Ok(())
    }
}

fn below(group: &str, name: &str) -> String {
    match (group.is_empty(), name.starts_with('[')) {
        (true, _) => name.to_owned(),
        (false, true) => format!("{group}{name}"),
        (false, false) => format!("{group}/{name}"),
    }
}

/// Characters of 8, 16 or 32 bits.
fn characters(kind: u32, data: &[u8], is_big_endian: bool) -> String {
    let units: Vec<u16> = match kind {
        4 | 17 => data
            .chunks_exact(2)
            .map(|pair| {
                if is_big_endian {
                    u16::from_be_bytes([pair[0], pair[1]])
                } else {
                    u16::from_le_bytes([pair[0], pair[1]])
                }
            })
            .collect(),
        _ => return text(data),
    };
    String::from_utf16_lossy(&units)
        .trim_matches(|character: char| character == '\0' || character.is_whitespace())
        .to_owned()
}

fn kind_of_element(kind: u32) -> Option<Kind> {
    Some(match kind {
        1 => Kind::I8,
        2 => Kind::U8,
        3 => Kind::I16,
        4 => Kind::U16,
        5 => Kind::I32,
        6 => Kind::U32,
        7 => Kind::F32,
        9 => Kind::F64,
        12 => Kind::I64,
        13 => Kind::U64,
        _ => return None,
    })
}

fn kind_of_class(class: u32) -> Option<Kind> {
    Some(match class {
        6 => Kind::F64,
        7 => Kind::F32,
        8 => Kind::I8,
        9 => Kind::U8,
        10 => Kind::I16,
        11 => Kind::U16,
        12 => Kind::I32,
        13 => Kind::U32,
        14 => Kind::I64,
        15 => Kind::U64,
        _ => return None,
    })
}
