//! Where the structures of a file of the old format lie: object headers, trees, nodes and heaps, which have no checksum (HDF5 File Format
//! Specification 3.0, II.A, III.A to III.E, IV.A).
//!
//! A data set whose damaged address leads into one of them would give other numbers without an error. What cannot be followed is left
//! out: the library says what is wrong with a structure itself. Between structures and data lie bytes that nothing takes; they are 0
//! unless something was deleted, or an address is damaged.

use std::{
    collections::HashSet,
    fs::File,
    io::{Read, Seek, SeekFrom},
    ops::Range,
};

use runout_core::{Error, Result, input_file::InputFile};

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Bytes of an address or a length; files with others are rare.
const WIDTH: usize = 8;
/// Half of the entries of a node of a tree of chunks, where the superblock does not say it.
const CHUNK: usize = 32;
/// Bytes of an entry of a group: name, object header, and what is kept of it.
const ENTRY: usize = 40;
/// Structures that are followed, at most, and bytes of one that are read.
const MOST: usize = 1_000_000;
const LONGEST: u64 = 1 << 24;

/// A structure that an address leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Header,
    /// More messages of an object header, so many bytes.
    Continuation(u64),
    /// A tree of a group, or a node of it.
    Tree,
    /// A tree of chunks, or a node of it, of so many dimensions, the bytes of an element among them.
    Chunks(u8),
    Heap,
    /// A collection of texts.
    Texts,
}

/// The structures of a file.
pub(super) struct Structures {
    /// The bytes of each.
    pub(super) bytes: Vec<Range<u64>>,
    /// Whether the file begins with them, and not with a block of its user.
    pub(super) from_start: bool,
    /// Whether all that lead on were followed, and nothing else is to be in the file.
    is_whole: bool,
}

/// A walk through the structures of a file.
struct Walk {
    file: File,
    /// Where addresses count from.
    base: u64,
    end: u64,
    /// Entries of a leaf and of an inner node of a group's tree, half of them.
    leaf: usize,
    inner: usize,
    /// Half of the entries of a node of a tree of chunks.
    chunk: usize,
    found: Vec<Range<u64>>,
    seen: HashSet<(u64, Kind)>,
    ahead: Vec<(u64, Kind)>,
    /// Whether something was met that this walk does not know, or that left bytes behind.
    lost: bool,
}

/// The structures of a file of the old format; `None` of the others.
///
/// # Errors
/// When it cannot be opened, or is not the file that it was.
pub(super) fn of(input: &InputFile) -> Result<Option<Structures>> {
    let file = input.open()?;
    let mut walk = Walk {
        file,
        base: 0,
        end: input.bytes(),
        leaf: 0,
        inner: 0,
        chunk: CHUNK,
        found: Vec::new(),
        seen: HashSet::new(),
        ahead: Vec::new(),
        lost: false,
    };
    if walk.superblock().is_none() {
        return Ok(None);
    }
    while let Some((address, kind)) = walk.ahead.pop() {
        if walk.seen.len() < MOST && walk.seen.insert((address, kind)) {
            // What is damaged leads nowhere.
            walk.lost |= walk.follow(address, kind).is_none();
        }
    }
    Ok(Some(Structures { bytes: walk.found, from_start: walk.base == 0, is_whole: !walk.lost }))
}

/// A remark where bytes hold something that neither these structures nor these data take.
///
/// # Errors
/// When the file cannot be read, or is not the file that it was.
pub(super) fn remark(input: &InputFile, structures: &Structures, mut data: Vec<Range<u64>>) -> Result<Option<String>> {
    if !structures.is_whole {
        return Ok(None);
    }
    let shown = input.path().display().to_string();
    let failure = |error: std::io::Error| Error::caused("read", &shown, error);
    let mut file = input.open()?;
    data.extend_from_slice(&structures.bytes);
    data.sort_unstable_by_key(|bytes| bytes.start);
    let (mut at, mut bytes, end) = (0, Vec::new(), input.bytes());
    for taken in data.into_iter().chain(std::iter::once(end..end)) {
        if taken.start > at {
            bytes.clear();
            file.seek(SeekFrom::Start(at)).map_err(failure)?;
            (&mut file).take((taken.start - at).min(LONGEST)).read_to_end(&mut bytes).map_err(failure)?;
            // Texts of data sets, and what else is no part of the walk, begin with a name of four letters.
            let is_structure = bytes.get(..4).is_some_and(|name| name.iter().all(u8::is_ascii_uppercase));
            if !is_structure && bytes.iter().any(|byte| *byte != 0) {
                return Ok(Some(format!(
                    "{shown}: {} bytes from byte {at} on are not 0 and belong to nothing: data were deleted from the file, or it is damaged",
                    taken.start - at
                )));
            }
        }
        at = at.max(taken.end);
    }
    Ok(None)
}

impl Walk {
    /// Reads so many bytes from an address.
    fn read(&mut self, address: u64, length: u64) -> Option<Vec<u8>> {
        let from = self.base.checked_add(address)?;
        if length > LONGEST || from.checked_add(length)? > self.end {
            return None;
        }
        let mut bytes = vec![0; length as usize];
        self.file.seek(SeekFrom::Start(from)).ok()?;
        self.file.read_exact(&mut bytes).ok()?;
        Some(bytes)
    }

    /// Takes note of a structure.
    fn take(&mut self, address: u64, length: u64) {
        let from = self.base.saturating_add(address);
        self.found.push(from..from.saturating_add(length));
    }

    /// The superblock of version 0 or 1, at the beginning of the file or behind a block of its user.
    fn superblock(&mut self) -> Option<()> {
        let end = self.end;
        let mut places = std::iter::once(0).chain((9..63).map(|power| 1_u64 << power).take_while(|place| *place < end));
        let place = places.find(|place| self.read(*place, 8).is_some_and(|bytes| bytes == SIGNATURE))?;
        let head = self.read(place, 100)?;
        let more = match head[8] {
            0 => 0,
            1 => 4,
            _ => return None,
        };
        if usize::from(head[13]) != WIDTH || usize::from(head[14]) != WIDTH {
            return None;
        }
        (self.leaf, self.inner) = (usize::from(short(&head, 16)?), usize::from(short(&head, 18)?));
        if more > 0 {
            self.chunk = usize::from(short(&head, 24)?);
        }
        self.base = place;
        self.take(0, (56 + more + ENTRY) as u64);
        self.entry(&head[56 + more..]);
        Some(())
    }

    /// An entry of a group: its object, and the tree and names of a group that are kept with it.
    fn entry(&mut self, entry: &[u8]) -> Option<()> {
        self.ahead.push((number(entry, 8)?, Kind::Header));
        if entry.get(16..20)? == [1, 0, 0, 0] {
            self.ahead.extend([(number(entry, 24)?, Kind::Tree), (number(entry, 32)?, Kind::Heap)]);
        }
        Some(())
    }

    fn follow(&mut self, address: u64, kind: Kind) -> Option<()> {
        match kind {
            Kind::Header => {
                let head = self.read(address, 16)?;
                // Version 1; the second version has a checksum.
                if head[0] != 1 {
                    return None;
                }
                let length = u64::from(u32::from_le_bytes(*head[8..].first_chunk()?));
                self.take(address, 16 + length);
                let messages = self.read(address + 16, length)?;
                self.messages(&messages)
            }
            Kind::Continuation(length) => {
                let messages = self.read(address, length)?;
                self.take(address, length);
                self.messages(&messages)
            }
            Kind::Tree => self.tree(address),
            Kind::Chunks(dimensions) => self.chunks(address, dimensions),
            Kind::Heap => {
                let head = self.read(address, 32).filter(|head| head.starts_with(b"HEAP"))?;
                self.take(address, 32);
                self.take(number(&head, 24)?, number(&head, 8)?);
                Some(())
            }
            Kind::Texts => {
                let head = self.read(address, 16).filter(|head| head.starts_with(b"GCOL"))?;
                self.take(address, number(&head, 8)?);
                Some(())
            }
        }
    }

    /// Messages of an object header that lead on: more of them, a group's tree, texts of an attribute.
    fn messages(&mut self, mut messages: &[u8]) -> Option<()> {
        while let Some(head) = messages.get(..8) {
            let (kind, length) = (short(head, 0)?, usize::from(short(head, 2)?));
            let body = messages.get(8..8 + length)?;
            match kind {
                0x10 => self.ahead.push((number(body, 0)?, Kind::Continuation(number(body, 8)?))),
                // A group of the new format, whose links are in its header, or in a heap that this walk does not know: the library makes
                // it of a group of the old one for a name in UTF-8. What the old one leaves behind belongs to nothing.
                0x02 => self.lost = true,
                0x06 => self.ahead.extend(hard_link(body).map(|object| (object, Kind::Header))),
                0x11 => self.ahead.extend([(number(body, 0)?, Kind::Tree), (number(body, 8)?, Kind::Heap)]),
                // The layout, of the version that has been written since HDF5 1.6.3.
                0x08 if body.starts_with(&[3, 2]) => {
                    self.ahead.push((number(body, 3)?, Kind::Chunks(*body.get(2)?)));
                }
                0x08 => self.lost |= body.first() != Some(&3),
                0x0C => {
                    // One that cannot be read leads nowhere; those behind it may.
                    let _ = self.attribute(body);
                }
                _ => {}
            }
            messages = &messages[8 + length..];
        }
        Some(())
    }

    /// Texts of any length, each as its length, the address of its collection and its number there.
    fn attribute(&mut self, body: &[u8]) -> Option<()> {
        let padded = |length: u16| if body.first() == Some(&1) { length.next_multiple_of(8) } else { length };
        let [name, kind, space] = [2, 4, 6].map(|at| short(body, at).map(|length| usize::from(padded(length))));
        let from = if body.first() == Some(&3) { 9 } else { 8 };
        let of_kind = from + name?;
        // Class 9 is that of variable length.
        if body.get(of_kind)? & 0x0F == 9 {
            let texts = body.get(of_kind + kind? + space?..)?;
            self.ahead.extend(texts.chunks_exact(16).filter_map(|text| Some((number(text, 4)?, Kind::Texts))));
        }
        Some(())
    }

    /// A tree of chunks; these themselves are data.
    fn chunks(&mut self, address: u64, dimensions: u8) -> Option<()> {
        let key = chunk_key(dimensions);
        let length = (24 + 2 * self.chunk * WIDTH + (2 * self.chunk + 1) * key) as u64;
        let node = self.read(address, length).filter(|node| node.starts_with(b"TREE\x01"))?;
        self.take(address, length);
        let (level, count) = (node[5], usize::from(short(&node, 6)?));
        if level > 0 {
            let children = node[24..].chunks_exact(key + WIDTH).take(count);
            self.ahead.extend(children.filter_map(|pair| Some((number(pair, key)?, Kind::Chunks(dimensions)))));
        }
        Some(())
    }

    /// A tree of a group, or a leaf of it.
    fn tree(&mut self, address: u64) -> Option<()> {
        if self.read(address, 4)? == b"SNOD" {
            let length = (8 + 2 * self.leaf * ENTRY) as u64;
            let node = self.read(address, length)?;
            self.take(address, length);
            let count = usize::from(short(&node, 6)?);
            return node[8..].chunks_exact(ENTRY).take(count).try_for_each(|entry| self.entry(entry));
        }
        let length = (24 + 2 * self.inner * WIDTH + (2 * self.inner + 1) * WIDTH) as u64;
        let node = self.read(address, length).filter(|node| node.starts_with(b"TREE\0"))?;
        self.take(address, length);
        // Keys and children take turns.
        let count = usize::from(short(&node, 6)?);
        let children = node[24..].chunks_exact(2 * WIDTH).take(count);
        self.ahead.extend(children.filter_map(|pair| Some((number(pair, WIDTH)?, Kind::Tree))));
        Some(())
    }
}

/// Where a link of a group's header leads, unless that is a name in this file or another one.
fn hard_link(body: &[u8]) -> Option<u64> {
    let flags = usize::from(*body.get(1)?);
    // Its kind, its number in the order of creation and the set of its characters are there only where the flags say so.
    let has = |flag: usize| usize::from(flags & flag != 0);
    if has(8) == 1 && *body.get(2)? != 0 {
        return None;
    }
    let at = 2 + has(8) + 8 * has(4) + has(16);
    let width = 1 << (flags & 3);
    let length = body.get(at..at + width)?.iter().rev().fold(0, |length, byte| (length << 8) | usize::from(*byte));
    number(body, at.checked_add(width)?.checked_add(length)?)
}

fn chunk_key(dimensions: u8) -> usize {
    // The chunk's size and filters, and where it begins.
    WIDTH + WIDTH * usize::from(dimensions)
}

fn short(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn number(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
