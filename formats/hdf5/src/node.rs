//! Groups, datasets and attributes with their place in the file, so that every error can name it.

use std::{fmt, io::Read, path::Path, sync::Arc};

use hdf5_metno::{
    Attribute, Dataset, Datatype, File, Group, H5Type, Location, LocationType,
    dataset::Layout,
    types::{FloatSize, IntSize, TypeDescriptor, VarLenUnicode},
};
use runout_core::{Error, ErrorKind, Result, input_file::InputFile};

use crate::{
    heaps,
    links::{self, Links, Refusal},
    raw, text,
    type_name::type_name,
};

/// Where something stands: `shaft.h5:/initial/s01`.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    file: String,
    path: String,
    links: Option<Arc<Links>>,
}

impl Place {
    pub(crate) fn root(file: &Path) -> Self {
        Self { file: file.display().to_string(), path: "/".into(), links: None }
    }

    pub(crate) fn child(&self, name: &str) -> Self {
        let separator = if self.path == "/" { "" } else { "/" };
        Self { file: self.file.clone(), path: format!("{}{separator}{name}", self.path), links: self.links.clone() }
    }

    /// The path in the file.
    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    /// What is known of the file's links; nothing of a file that is being written.
    pub(crate) fn links(&self) -> Option<&Links> {
        self.links.as_deref()
    }

    /// The error of what is not read.
    fn refused(&self, refusal: Refusal) -> Error {
        let error = self.error(refusal.problem);
        match refusal.help {
            Some(help) => error.help(help),
            None => error,
        }
    }

    #[allow(clippy::needless_pass_by_value, reason = "callers give text and errors alike")]
    pub(crate) fn error(&self, problem: impl fmt::Display) -> Error {
        Error::new("read", self.to_string(), without_build_paths(&problem.to_string())).of(ErrorKind::DamagedData)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.file, self.path)
    }
}

/// A message without the folder in which the library looks for filters: it is one of the machine that compiled it.
fn without_build_paths(problem: &str) -> String {
    match problem.split_once("can't open directory (") {
        Some((before, after)) => {
            let after = after.split_once(')').map_or("", |(_, after)| after);
            let after = after.strip_prefix(". Please verify its existence").unwrap_or(after);
            format!("{before}the program has no such filter{after}")
        }
        None => problem.to_owned(),
    }
}

/// Opens a file for reading; links out of it are followed where this is allowed.
pub(crate) fn open(path: &Path, follow_links: bool) -> Result<(File, Place, Arc<Links>)> {
    let shown = path.display().to_string();
    raw::forbid_plugins();
    // The file system's own answer is clearer than the library's.
    let input = InputFile::new(path)?;
    let file = File::open(path).map_err(|error| {
        if is_text(path) {
            return Error::new("open", &shown, "no HDF5 file, but text")
                .of(ErrorKind::DamagedData)
                .help("a recording in text is read by [load] plugin = \"csv\"");
        }
        let problem = error.to_string();
        if problem.contains("unable to lock file") {
            return Error::new("open", &shown, "another program holds the file open for writing").of(ErrorKind::Io).help(
                "close it there; where it is known to write nothing more, HDF5_USE_FILE_LOCKING=FALSE in the environment opens it all the same",
            );
        }
        Error::new("open", &shown, format!("no HDF5 file, or a damaged one: {problem}"))
            .of(ErrorKind::DamagedData)
            .help("a file whose writing was interrupted is often truncated")
    })?;
    input.check()?;
    heaps::check(&file, &input)?;
    let links = Arc::new(Links::of(&file, &input, follow_links));
    let place = Place { links: Some(Arc::clone(&links)), ..Place::root(path) };
    Ok((file, place, links))
}

/// Whether a file begins with characters and nothing else.
fn is_text(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(1024).read_to_end(&mut start));
    let is_character = |byte: &u8| matches!(byte, b'\t' | b'\n' | b'\r' | b' '..=b'~' | 0x80..);
    read.is_ok() && !start.is_empty() && start.iter().all(is_character)
}

/// Names of the members of a group, sorted.
pub(crate) fn members(group: &Group, place: &Place) -> Result<Vec<String>> {
    let mut names = group.member_names().map_err(|error| place.error(error))?;
    names.sort();
    Ok(names)
}

/// A member that must be a group.
pub(crate) fn group(parent: &Group, place: &Place, name: &str) -> Result<(Group, Place)> {
    let (parent_place, place) = (place, place.child(name));
    if let Some(links) = place.links() {
        links.check(parent, parent_place.path(), name).map_err(|refusal| place.refused(refusal))?;
    }
    let group = parent.group(name).map_err(|error| place.error(format!("expected a group: {error}")))?;
    if let Some(links) = place.links() {
        links.opened(&group).map_err(|refusal| place.refused(refusal))?;
    }
    Ok((group, place))
}

/// A member that must be a dataset.
pub(crate) fn dataset(parent: &Group, place: &Place, name: &str) -> Result<(Dataset, Place)> {
    let (parent_place, place) = (place, place.child(name));
    if !parent.link_exists(name) {
        return Err(place.error("expected a dataset, found nothing of that name"));
    }
    if let Some(links) = place.links() {
        links.check(parent, parent_place.path(), name).map_err(|refusal| place.refused(refusal))?;
    }
    let dataset = parent.dataset(name).map_err(|error| place.error(format!("expected a dataset: {error}")))?;
    if let Some(links) = place.links() {
        links
            .opened(&dataset)
            .and_then(|()| links.check_dataset(&dataset))
            .map_err(|refusal| place.refused(refusal))?;
    }
    Ok((dataset, place))
}

/// What kind of object a member is.
pub(crate) fn kind(parent: &Group, place: &Place, name: &str) -> Result<LocationType> {
    if let Some(links) = place.links() {
        links.check(parent, place.path(), name).map_err(|refusal| place.child(name).refused(refusal))?;
    }
    parent.loc_type_by_name(name).map_err(|error| place.child(name).error(error))
}

/// Of what holds names or settings: a rig has fewer sensors.
const MOST_ELEMENTS: usize = 65_536;

fn attribute(location: &Location, place: &Place, name: &str) -> Result<Option<Attribute>> {
    let names = location.attr_names().map_err(|error| place.error(error))?;
    if !names.iter().any(|known| known == name) {
        return Ok(None);
    }
    let at = |problem: String| place.error(format!("attribute `{name}`: {problem}"));
    let attribute = location.attr(name).map_err(|error| at(error.to_string()))?;
    match attribute.size() {
        0 => Err(at("expected a value, found none".into())),
        size if size > MOST_ELEMENTS => Err(at(format!("expected at most {MOST_ELEMENTS} elements, found {size}"))),
        _ => Ok(Some(attribute)),
    }
}

/// The numbers of an attribute, where it is there.
pub(crate) fn numbers(location: &Location, place: &Place, name: &str) -> Result<Option<Vec<f64>>> {
    let Some(attribute) = attribute(location, place, name)? else { return Ok(None) };
    let at = |problem: String| place.error(format!("attribute `{name}`: {problem}"));
    let stored = attribute.dtype().map_err(|error| at(error.to_string()))?;
    let found = stored.to_descriptor().map_err(|error| at(error.to_string()))?;
    standard(&stored, &found).map_err(at)?;
    if !matches!(found, TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) | TypeDescriptor::Float(_)) {
        return Err(at(format!("expected a number, found {}", type_name(&found))));
    }
    attribute.read_raw::<f64>().map(Some).map_err(|error| at(error.to_string()))
}

/// One finite number of an attribute, where it is there.
pub(crate) fn number(location: &Location, place: &Place, name: &str) -> Result<Option<f64>> {
    match numbers(location, place, name)?.as_deref() {
        None => Ok(None),
        Some([value]) if value.is_finite() => Ok(Some(*value)),
        Some(other) => {
            Err(place.error(format!("attribute `{name}`: expected one finite number, found {}", listed(other))))
        }
    }
}

/// One number above 0 of an attribute, where it is there.
pub(crate) fn positive(location: &Location, place: &Place, name: &str) -> Result<Option<f64>> {
    match number(location, place, name)? {
        Some(value) if value <= 0.0 => {
            Err(place.error(format!("attribute `{name}`: expected a number above 0, found {value}")))
        }
        other => Ok(other),
    }
}

fn listed(values: &[f64]) -> String {
    match values {
        [one] => one.to_string(),
        many => format!("{} numbers", many.len()),
    }
}

/// The texts of an attribute, where it is there.
pub(crate) fn texts(location: &Location, place: &Place, name: &str) -> Result<Option<Vec<String>>> {
    let Some(attribute) = attribute(location, place, name)? else { return Ok(None) };
    let at = |problem: String| place.error(format!("attribute `{name}`: {problem}"));
    text::texts(&attribute, location).map(Some).map_err(at)
}

/// The texts of a dataset.
pub(crate) fn texts_of(group: &Group, place: &Place, name: &str) -> Result<Vec<String>> {
    let (dataset, place) = dataset(group, place, name)?;
    written_shape(&dataset, &place)?;
    match dataset.size() {
        0 => Err(place.error("expected texts, found none")),
        size if size > MOST_ELEMENTS => {
            Err(place.error(format!("expected at most {MOST_ELEMENTS} elements, found {size}")))
        }
        _ => text::texts(&dataset, group).map_err(|problem| place.error(problem)),
    }
}

/// One text of an attribute, where it is there.
pub(crate) fn text(location: &Location, place: &Place, name: &str) -> Result<Option<String>> {
    match texts(location, place, name)? {
        None => Ok(None),
        Some(mut all) if all.len() == 1 => Ok(all.pop()),
        Some(all) => Err(place.error(format!("attribute `{name}`: expected one text, found {}", all.len()))),
    }
}

/// An attribute that has to be there.
pub(crate) fn needed<T>(value: Option<T>, place: &Place, name: &str) -> Result<T> {
    value.ok_or_else(|| place.error(format!("expected an attribute `{name}`, found none of that name")))
}

/// The type of a dataset's elements.
pub(crate) fn element_type(dataset: &Dataset, place: &Place) -> Result<TypeDescriptor> {
    let stored = dataset.dtype().map_err(|error| place.error(error))?;
    let found = stored.to_descriptor().map_err(|error| place.error(error))?;
    standard(&stored, &found).map_err(|problem| place.error(problem))?;
    Ok(found)
}

/// Refuses numbers that are like those of a standard type but for a part of it, as an exponent counted from elsewhere: no program
/// writes such, and damage makes them.
fn standard(stored: &Datatype, found: &TypeDescriptor) -> std::result::Result<(), String> {
    if !is_number(found) || raw::is_standard(stored) {
        return Ok(());
    }
    Err(format!("its type is none of the standard ones, though as long as {}: the file is damaged", type_name(found)))
}

/// Whether numbers of this type can be read as f64.
pub(crate) fn is_number(descriptor: &TypeDescriptor) -> bool {
    use TypeDescriptor::{Float, Integer, Unsigned};
    matches!(descriptor, Float(FloatSize::U4 | FloatSize::U8))
        || matches!(descriptor, Integer(size) | Unsigned(size) if *size as usize <= IntSize::U8 as usize)
}

/// The shape of a dataset, once it is certain that as many elements were really written.
///
/// A recording that was cut short can declare any shape; HDF5 would fill what is missing with zeros.
pub(crate) fn written_shape(dataset: &Dataset, place: &Place) -> Result<Vec<usize>> {
    let shape = dataset.get_shape().map_err(|error| place.error(error))?;
    let kind = dataset.dtype().map_err(|error| place.error(error))?;
    let width = kind.size();
    let elements = shape.iter().try_fold(1_usize, |product, extent| product.checked_mul(*extent));
    let Some(bytes) = elements.and_then(|elements| elements.checked_mul(width)) else {
        return Err(place.error(format!("the shape {shape:?} is beyond any memory")));
    };
    let incomplete = |found: String| {
        Err(place
            .error(format!("the shape {shape:?} was declared, but {found}"))
            .help("the recording was probably interrupted"))
    };
    match dataset.layout() {
        Layout::Chunked => {
            let (Some(chunk), Some(found)) = (dataset.chunk(), dataset.num_chunks()) else {
                return Err(place.error("its chunks cannot be counted"));
            };
            if chunk.len() != shape.len() || chunk.contains(&0) {
                return Err(place.error(format!("the chunk shape {chunk:?} does not fit the shape {shape:?}")));
            }
            if let Some(links) = place.links() {
                // A chunk is unpacked as a whole.
                links::within(&chunk, width as u64, links.input().bytes()).map_err(|problem| {
                    place
                        .error(format!("a chunk of it is too large: {problem}"))
                        .help("repack it in smaller chunks: h5repack -l CHUNK=8192x4 IN OUT")
                })?;
            }
            let counts = shape.iter().zip(&chunk).map(|(extent, side)| extent.div_ceil(*side));
            let expected = counts.fold(1_usize, usize::saturating_mul);
            if bytes > 0 && found < expected {
                return incomplete(format!("only {found} of {expected} chunks were written"));
            }
        }
        Layout::Contiguous | Layout::Compact => {
            let stored = dataset.storage_size();
            // What lies in one piece cannot grow: the shape that was written takes it as a whole. Texts of any length take another
            // number of bytes in the file than their type says.
            let is_fixed = kind.to_descriptor().is_ok_and(|descriptor| is_number(&descriptor));
            if is_fixed && stored > bytes as u64 && bytes > 0 && dataset.layout() == Layout::Contiguous {
                let problem = format!("the shape {shape:?} was declared, but {stored} bytes were written, not {bytes}");
                return Err(place.error(problem).help("the file is damaged: copy it again from where it was recorded"));
            }
            if stored < bytes as u64 && dataset.dcpl().is_ok_and(|plist| plist.external().is_empty()) {
                return incomplete(format!("only {stored} of {bytes} bytes were written"));
            }
        }
        Layout::Virtual => {}
    }
    Ok(shape)
}

/// Creates a group, and those above it that are not there yet, without times: equal contents are equal files.
pub(crate) fn create_group(parent: &Group, path: &str) -> hdf5_metno::Result<Group> {
    let create = |parent: &Group, name: &str| parent.create_group_builder().obj_track_times(false).create(name);
    let Some((above, name)) = path.rsplit_once('/') else { return create(parent, path) };
    let above = if parent.link_exists(above) { parent.group(above)? } else { create_group(parent, above)? };
    create(&above, name)
}

/// Begins a file that is not there yet: its root has no times either, and from this version on HDF5 protects its own structures by
/// checksums.
pub(crate) fn create_file(path: &Path) -> hdf5_metno::Result<File> {
    File::with_options()
        .with_fapl(|access| access.libver_v110())
        .with_fcpl(|create| create.obj_track_times(false))
        .create_excl(path)
}

/// Writes a text attribute.
pub(crate) fn put_text(location: &Location, name: &str, text: &str) -> hdf5_metno::Result<()> {
    put(location, name, &unicode(text)?)
}

/// Writes an attribute of one element.
pub(crate) fn put<T: H5Type>(location: &Location, name: &str, value: &T) -> hdf5_metno::Result<()> {
    location.new_attr::<T>().create(name)?.write_scalar(value)
}

/// Writes an attribute of one element, or one element a channel.
pub(crate) fn put_list<T: H5Type>(location: &Location, name: &str, values: &[T]) -> hdf5_metno::Result<()> {
    location.new_attr::<T>().shape(values.len()).create(name)?.write(values)
}

/// A text as HDF5 holds it, without NUL, which would end it.
pub(crate) fn unicode(text: &str) -> hdf5_metno::Result<VarLenUnicode> {
    text.parse().map_err(|_| format!("a text must not contain NUL: {text:?}").into())
}
