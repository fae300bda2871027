//! Texts as programs write them: of variable or fixed length, padded with blanks or NULs, or as MATLAB's characters and cells.

use hdf5_metno::{
    Container, Dataset, H5Type, Location, ObjectReference1, ReferencedObject,
    types::{FixedAscii, FixedUnicode, IntSize, Reference, TypeDescriptor, VarLenAscii, VarLenUnicode},
};

use crate::{raw, type_name::type_name};

/// Characters of a text of fixed length.
const LONGEST_FIXED: usize = 1024;
/// Characters of all texts that are stored as numbers.
const MOST_CHARACTERS: usize = 1 << 16;

/// The texts that an attribute or a dataset holds, without what pads them.
///
/// `file` is any place in the same file: cells refer to their texts.
pub(crate) fn texts(container: &Container, file: &Location) -> Result<Vec<String>, String> {
    let found = container.dtype().and_then(|dtype| dtype.to_descriptor()).map_err(|error| error.to_string())?;
    let all: Result<Vec<String>, String> = match &found {
        TypeDescriptor::VarLenUnicode => {
            no_longer_than_the_file(container)?;
            each(container, |text: &VarLenUnicode| utf8(text.as_bytes()))
        }
        TypeDescriptor::VarLenAscii => {
            no_longer_than_the_file(container)?;
            each(container, |text: &VarLenAscii| Ok(any(text.as_bytes())))
        }
        TypeDescriptor::FixedUnicode(size) if *size <= LONGEST_FIXED => {
            each(container, |text: &FixedUnicode<LONGEST_FIXED>| utf8(text.as_bytes()))
        }
        TypeDescriptor::FixedAscii(size) if *size <= LONGEST_FIXED => {
            each(container, |text: &FixedAscii<LONGEST_FIXED>| Ok(any(text.as_bytes())))
        }
        TypeDescriptor::Reference(Reference::Object) => cells(container, file),
        TypeDescriptor::Unsigned(IntSize::U1 | IntSize::U2) => characters(container),
        other => Err(format!("expected text, found {}", type_name(other))),
    };
    let padding = |character: char| character == '\0' || character.is_whitespace();
    Ok(all?.into_iter().map(|text| text.trim_matches(padding).to_owned()).collect())
}

/// Texts of variable length of an attribute or a dataset.
pub(crate) fn variable(container: &Container) -> Result<Vec<VarLenUnicode>, String> {
    no_longer_than_the_file(container)?;
    container.read_raw().map_err(|error| error.to_string())
}

/// Refuses texts of variable length that are said to be longer than the file.
fn no_longer_than_the_file(container: &Container) -> Result<(), String> {
    let bytes = container.file().map_err(|error| error.to_string())?.size();
    match raw::longest_text(container) {
        Some(length) if u64::from(length) > bytes => {
            Err(format!("a text is said to have {length} bytes, the file has {bytes}: it is damaged"))
        }
        _ => Ok(()),
    }
}

fn each<T: H5Type>(container: &Container, text: impl Fn(&T) -> Result<String, String>) -> Result<Vec<String>, String> {
    container.read_raw::<T>().map_err(|error| error.to_string())?.iter().map(text).collect()
}

fn utf8(bytes: &[u8]) -> Result<String, String> {
    String::from_utf8(bytes.to_vec()).map_err(|_| "expected text in UTF-8".into())
}

/// UTF-8, or else Latin-1, whose bytes are the first 256 characters: what claims to be ASCII is often one of them.
fn any(bytes: &[u8]) -> String {
    utf8(bytes).unwrap_or_else(|_| bytes.iter().map(|byte| char::from(*byte)).collect())
}

/// A cell array: references to one text each.
fn cells(container: &Container, file: &Location) -> Result<Vec<String>, String> {
    let references = container.read_raw::<ObjectReference1>().map_err(|error| error.to_string())?;
    let cell = |reference| -> Result<String, String> {
        match file.dereference(reference).map_err(|error| error.to_string())? {
            ReferencedObject::Dataset(dataset) => only(&dataset),
            _ => Err("expected a cell with a text, found another object".into()),
        }
    };
    references.iter().map(cell).collect()
}

/// The one text of a dataset.
fn only(dataset: &Dataset) -> Result<String, String> {
    let descriptor = dataset.dtype().and_then(|dtype| dtype.to_descriptor()).map_err(|error| error.to_string())?;
    // A cell of cells could refer to itself.
    if matches!(descriptor, TypeDescriptor::Reference(_)) {
        return Err("expected a cell with a text, found a cell of cells".into());
    }
    match texts(dataset, dataset)?.as_slice() {
        [text] => Ok(text.clone()),
        other => Err(format!("expected a cell with one text, found {}", other.len())),
    }
}

/// Texts as the numbers of their characters, as MATLAB stores them: a row of characters, or a matrix of one text a row, whose
/// dimensions the file holds reversed.
fn characters(container: &Container) -> Result<Vec<String>, String> {
    let shape = container.shape();
    let (length, count) = match shape[..] {
        [length] | [length, 1] | [1, length] => (length, 1),
        [length, count] => (length, count),
        _ => return Err(format!("expected characters in one or two dimensions, found the shape {shape:?}")),
    };
    if container.size() == 0 || container.size() > MOST_CHARACTERS {
        return Err(format!("expected 1 to {MOST_CHARACTERS} characters, found {}", container.size()));
    }
    let codes = container.read_raw::<u16>().map_err(|error| error.to_string())?;
    let text = |row: usize| {
        let units: Vec<u16> = (0..length).map(|place| codes[place * count + row]).collect();
        String::from_utf16(&units).map_err(|_| "expected characters of UTF-16".to_owned())
    };
    (0..count).map(text).collect()
}
