//! HDF5 files of other programs: their datasets of numbers, in whatever groups they lie, read line by line.
//!
//! Links out of the file are not followed. What is said here of damage holds as for measurement files: what is declared and was not
//! written is refused.

use std::{collections::HashSet, ops::Range, path::Path};

use hdf5_metno::{
    Dataset, Group, Hyperslab, Location, LocationType, ObjectReference1, ReferencedObject, SliceOrIndex,
    types::{FloatSize, Reference, TypeDescriptor},
};
use runout_core::Result;

use crate::{
    node::{self, Place},
    raw, text, utf8_path,
};

/// Groups in groups that are looked through.
const DEEPEST: usize = 16;
/// Datasets that are listed.
const MOST: usize = 1 << 16;
/// Texts of a dataset and numbers of an attribute that are read.
const MOST_TEXTS: usize = 64;
/// Where MATLAB keeps what cells refer to.
const REFERRED: &str = "#refs#";
/// The attribute that MATLAB gives its variables.
const CLASS: &str = "MATLAB_class";

/// An attribute: its numbers or its text.
#[derive(Debug, Clone, PartialEq)]
pub enum AttributeValue {
    /// Numbers.
    Numbers(Vec<f64>),
    /// A text.
    Text(String),
}

/// Attributes by their names.
pub type Attributes = Vec<(String, AttributeValue)>;

/// A dataset of another program.
#[derive(Debug, Clone)]
pub struct ForeignDataset {
    dataset: Dataset,
    place: Place,
    /// Names of the groups that it is in, and its own.
    pub path: Vec<String>,
    /// Extents; MATLAB's, which the file holds reversed, as MATLAB has them.
    pub shape: Vec<usize>,
    /// Its numbers, or the fields of its records, with their stored types: "f64".
    pub numbers: Vec<(Option<String>, &'static str)>,
    /// Its text, where it is one or some.
    pub text: Option<String>,
    /// Its attributes.
    pub attributes: Attributes,
    is_reversed: bool,
}

/// All that a file of another program holds.
#[derive(Debug, Default)]
pub struct ForeignFile {
    /// Its datasets, in the order of their names.
    pub datasets: Vec<ForeignDataset>,
    /// Attributes of its groups, by their names.
    pub groups: Vec<(Vec<String>, Attributes)>,
}

impl ForeignFile {
    /// Looks through a file.
    ///
    /// # Errors
    /// When it is no HDF5 file, or its groups cannot be read.
    pub fn open(path: &Path) -> Result<Self> {
        utf8_path::check(path)?;
        let (file, place, _) = node::open(path, false)?;
        let mut found = Self::default();
        let mut seen = HashSet::new();
        found.group(&file, &place, &mut Vec::new(), &mut seen)?;
        Ok(found)
    }

    fn group(
        &mut self,
        group: &Group,
        place: &Place,
        path: &mut Vec<String>,
        seen: &mut HashSet<String>,
    ) -> Result<()> {
        // A group may be a member of itself.
        let identity = group.loc_info().map_err(|error| place.error(error))?;
        if path.len() > DEEPEST || !seen.insert(format!("{:?} {:?}", identity.fileno, identity.token)) {
            return Ok(());
        }
        self.groups.push((path.clone(), attributes(group, place)));
        for name in node::members(group, place)? {
            if path.is_empty() && name == REFERRED || self.datasets.len() >= MOST {
                continue;
            }
            // What leads out of the file, or nowhere, is not listed.
            let Ok(kind) = node::kind(group, place, &name) else { continue };
            path.push(name.clone());
            if kind == LocationType::Group {
                let (inner, place) = node::group(group, place, &name)?;
                self.group(&inner, &place, path, seen)?;
            } else if kind == LocationType::Dataset
                && let Ok((dataset, place)) = node::dataset(group, place, &name)
            {
                self.dataset(dataset, place, path, 0)?;
            }
            path.pop();
        }
        Ok(())
    }

    fn dataset(&mut self, dataset: Dataset, place: Place, path: &[String], depth: usize) -> Result<()> {
        let attributes = attributes(&dataset, &place);
        let of_matlab = attributes.iter().find(|(name, _)| name == CLASS).map(|(_, value)| value.clone());
        let is_matlab = of_matlab.is_some();
        let is_characters = of_matlab == Some(AttributeValue::Text("char".into()));
        let is_empty = attributes.iter().any(|(name, _)| name == "MATLAB_empty");
        let mut shape = dataset.shape();
        if is_matlab {
            shape.reverse();
        }
        let stored = dataset.dtype().and_then(|stored| stored.to_descriptor());
        let mut found = ForeignDataset {
            place,
            path: path.to_vec(),
            shape,
            numbers: Vec::new(),
            text: None,
            attributes,
            is_reversed: is_matlab,
            dataset,
        };
        match stored {
            Ok(TypeDescriptor::Reference(Reference::Object)) if depth == 0 => return self.cells(&found),
            Ok(TypeDescriptor::Compound(record)) if found.shape.len() == 1 => {
                let fields = record.fields.iter();
                found.numbers =
                    fields.filter_map(|field| Some((Some(field.name.clone()), number_name(&field.ty)?))).collect();
            }
            Ok(other) => {
                let is_text = is_characters
                    || matches!(
                        other,
                        TypeDescriptor::FixedAscii(_)
                            | TypeDescriptor::FixedUnicode(_)
                            | TypeDescriptor::VarLenAscii
                            | TypeDescriptor::VarLenUnicode
                    );
                if is_text {
                    found.text = Some(if is_empty { String::new() } else { texts(&found.dataset, is_characters) });
                } else if !is_empty {
                    found.numbers.extend(number_name(&other).map(|name| (None, name)));
                }
            }
            Err(_) => {}
        }
        self.datasets.push(found);
        Ok(())
    }

    /// What the cells of MATLAB refer to.
    fn cells(&mut self, cells: &ForeignDataset) -> Result<()> {
        if cells.dataset.size() > MOST || node::written_shape(&cells.dataset, &cells.place).is_err() {
            return Ok(());
        }
        let references = cells.dataset.read_raw::<ObjectReference1>().map_err(|error| cells.place.error(error))?;
        for (number, reference) in references.into_iter().enumerate() {
            let Ok(ReferencedObject::Dataset(dataset)) = cells.dataset.dereference(&reference) else { continue };
            let mut path = cells.path.clone();
            let last = path.pop().unwrap_or_default();
            path.push(format!("{last}[{number}]"));
            let is_own = cells
                .place
                .links()
                .is_none_or(|links| links.is_home_of(&dataset) && links.check_dataset(&dataset).is_ok());
            if is_own && self.datasets.len() < MOST {
                self.dataset(dataset, cells.place.clone(), &path, 1)?;
            }
        }
        Ok(())
    }
}

impl ForeignDataset {
    /// Whether what was declared is there.
    ///
    /// # Errors
    /// What is missing.
    pub fn check(&self) -> Result<()> {
        let stored = self.dataset.dtype().and_then(|stored| stored.to_descriptor());
        if stored.is_ok_and(|stored| !matches!(stored, TypeDescriptor::Compound(_) | TypeDescriptor::Boolean)) {
            node::element_type(&self.dataset, &self.place)?;
        }
        node::written_shape(&self.dataset, &self.place).map(|_| ())
    }

    /// Samples that are worth reading at once: those of some whole chunks.
    #[must_use]
    pub fn chunk(&self, time: usize) -> usize {
        let chunk = self.dataset.chunk().unwrap_or_default();
        chunk.get(self.dimension(time)).copied().unwrap_or(1)
    }

    fn dimension(&self, dimension: usize) -> usize {
        if self.is_reversed { self.shape.len() - 1 - dimension } else { dimension }
    }

    /// Numbers along one dimension at a place in the others, of a field of records where one is named.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn read(&self, field: Option<&str>, time: usize, at: &[usize], range: Range<usize>) -> Result<Vec<f64>> {
        let failed = |error: hdf5_metno::Error| self.place.error(error);
        if let Some(field) = field {
            let values = raw::read_field(&self.dataset, field, range);
            return values.ok_or_else(|| self.place.error(format!("the field `{field}` cannot be read")));
        }
        if self.shape.is_empty() {
            return self.dataset.read_raw::<f64>().map_err(failed);
        }
        let mut slices = vec![SliceOrIndex::Index(0); self.shape.len()];
        for (dimension, place) in at.iter().enumerate() {
            slices[self.dimension(dimension)] = SliceOrIndex::Index(*place);
        }
        slices[self.dimension(time)] = SliceOrIndex::from(range);
        let selection = Hyperslab::from(slices);
        if self.numbers.first().is_some_and(|(_, name)| *name == "bool") {
            let found = self.dataset.read_slice_1d::<bool, _>(selection).map_err(failed)?;
            return Ok(found.into_iter().map(|value| f64::from(u8::from(value))).collect());
        }
        self.dataset.read_slice_1d::<f64, _>(selection).map(|found| found.to_vec()).map_err(failed)
    }
}

/// The name of a type of numbers.
fn number_name(descriptor: &TypeDescriptor) -> Option<&'static str> {
    use hdf5_metno::types::IntSize;
    Some(match descriptor {
        TypeDescriptor::Float(FloatSize::U8) => "f64",
        TypeDescriptor::Float(FloatSize::U4) => "f32",
        TypeDescriptor::Integer(IntSize::U1) => "i8",
        TypeDescriptor::Integer(IntSize::U2) => "i16",
        TypeDescriptor::Integer(IntSize::U4) => "i32",
        TypeDescriptor::Integer(IntSize::U8) => "i64",
        TypeDescriptor::Unsigned(IntSize::U1) => "u8",
        TypeDescriptor::Unsigned(IntSize::U2) => "u16",
        TypeDescriptor::Unsigned(IntSize::U4) => "u32",
        TypeDescriptor::Unsigned(IntSize::U8) => "u64",
        TypeDescriptor::Boolean => "bool",
        _ => return None,
    })
}

fn texts(dataset: &Dataset, is_characters: bool) -> String {
    let most = if is_characters { 1 << 16 } else { MOST_TEXTS };
    if dataset.size() == 0 || dataset.size() > most {
        return String::new();
    }
    text::texts(dataset, dataset).map_or_else(|_| String::new(), |texts| texts.join(", "))
}

/// The attributes that are numbers or texts.
fn attributes(location: &Location, place: &Place) -> Attributes {
    let value = |name: &String| {
        let stored = location.attr(name).and_then(|attribute| attribute.dtype()?.to_descriptor()).ok()?;
        if node::is_number(&stored) {
            let numbers = node::numbers(location, place, name).ok()??;
            return (numbers.len() <= MOST_TEXTS).then_some(AttributeValue::Numbers(numbers));
        }
        let texts = node::texts(location, place, name).ok()??;
        (texts.len() <= MOST_TEXTS).then(|| AttributeValue::Text(texts.join(", ")))
    };
    let names = location.attr_names().unwrap_or_default();
    names.into_iter().filter_map(|name| value(&name).map(|value| (name, value))).collect()
}
