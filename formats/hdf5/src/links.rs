//! Ways out of a file: external links, virtual data sets, data in other files. They are refused unless the configuration allows them; then every
//! file that is read is an input like the first one.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use hdf5_metno::{Dataset, File, Group, LinkType, Location, dataset::Layout, filters::Filter};
use runout_core::input_file::InputFile;

use crate::raw;

/// Links that lead to links.
const DEEPEST: usize = 16;
/// What may be declared beyond what the files hold, in bytes; and how many times what they hold.
const ALLOWANCE: u64 = 64 << 20;
const DENSEST: u64 = 8;

/// Links of a group that lead elsewhere, by name.
type Elsewhere = Arc<HashMap<String, LinkType>>;

/// Why something is not read.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub(crate) problem: String,
    pub(crate) help: Option<&'static str>,
}

/// What is known of an opened file's links.
#[derive(Debug)]
pub(crate) struct Links {
    /// Whether ways out of the file are followed.
    follow: bool,
    input: InputFile,
    /// As the library names the file.
    name: String,
    /// By the group's path. Each group is looked through once.
    groups: Mutex<HashMap<String, Elsewhere>>,
    /// Other files that were read.
    followed: Mutex<Vec<InputFile>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Links {
    pub(crate) fn of(file: &File, input: &InputFile, follow: bool) -> Self {
        let (groups, followed) = (Mutex::default(), Mutex::default());
        Self { follow, input: input.clone(), name: file.filename(), groups, followed }
    }

    /// The file itself and those that were followed.
    pub(crate) fn inputs(&self) -> Vec<InputFile> {
        std::iter::once(&self.input).chain(&*locked(&self.followed)).cloned().collect()
    }

    /// The file itself.
    pub(crate) fn input(&self) -> &InputFile {
        &self.input
    }

    /// Whether an object lies in the file itself.
    pub(crate) fn is_home_of(&self, object: &Location) -> bool {
        object.filename() == self.name
    }

    /// Whether nothing but the file itself was read.
    pub(crate) fn is_one_file(&self) -> bool {
        locked(&self.followed).is_empty()
    }

    /// Refuses a name in the group at a path that leads out of the file, before the library goes there.
    pub(crate) fn check(&self, group: &Group, path: &str, name: &str) -> Result<(), Refusal> {
        self.pass(group, path, name, 0).map_err(|problem| self.refusal(problem))
    }

    fn refusal(&self, problem: String) -> Refusal {
        let help = "copy what it leads to into this file, or set `follow_links = true` in [load] where the other file is known";
        Refusal { problem, help: (!self.follow).then_some(help) }
    }

    fn pass(&self, group: &Group, path: &str, name: &str, depth: usize) -> Result<(), String> {
        let Some(kind) = self.elsewhere(group, path)?.get(name).copied() else { return Ok(()) };
        if depth == DEEPEST {
            return Err("its links lead to links without end".into());
        }
        let value = raw::link_value(group, name).ok_or("its link cannot be read")?;
        if kind == LinkType::External {
            let file = text(value.get(1..).unwrap_or_default());
            if !self.follow {
                return Err(format!("it is a link to another file (`{file}`)"));
            }
            return self.take_near(&file);
        }
        let target = text(&value);
        let (mut at, mut here) = if target.starts_with('/') {
            let root = group.file().map_err(|error| error.to_string())?;
            (root.as_group().map_err(|error| error.to_string())?, "/".to_owned())
        } else {
            (group.clone(), path.to_owned())
        };
        let mut steps = target.split('/').filter(|step| !step.is_empty() && *step != ".").peekable();
        while let Some(step) = steps.next() {
            self.pass(&at, &here, step, depth + 1)?;
            if steps.peek().is_some() {
                // Where it leads nowhere, the library says so.
                let Ok(next) = at.group(step) else { return Ok(()) };
                (at, here) = (next, format!("{}/{step}", here.trim_end_matches('/')));
            }
        }
        Ok(())
    }

    /// The links of a group that are none to an object of the file by its place.
    fn elsewhere(&self, group: &Group, path: &str) -> Result<Elsewhere, String> {
        if let Some(known) = locked(&self.groups).get(path) {
            return Ok(Arc::clone(known));
        }
        let mut found = HashMap::new();
        let visited = group.iter_visit_default(|name, link| {
            if link.link_type != LinkType::Hard {
                found.insert(name.to_owned(), link.link_type);
            }
            Ok(())
        });
        visited.map_err(|error| error.to_string())?;
        let found = Arc::new(found);
        locked(&self.groups).insert(path.to_owned(), Arc::clone(&found));
        Ok(found)
    }

    /// Takes note of the file that an opened object lies in.
    pub(crate) fn opened(&self, object: &Location) -> Result<(), Refusal> {
        if self.is_home_of(object) {
            return Ok(());
        }
        let name = object.filename();
        if !self.follow {
            return Err(self.refusal(format!("it lies in another file (`{name}`)")));
        }
        self.take(Path::new(&name)).map_err(|problem| self.refusal(problem))
    }

    /// Refuses a data set whose numbers lie elsewhere, whose filter is missing, or that a file of its size cannot hold.
    pub(crate) fn check_dataset(&self, dataset: &Dataset) -> Result<(), Refusal> {
        self.storage(dataset).map_err(|problem| self.refusal(problem))?;
        filters(dataset)
    }

    fn storage(&self, dataset: &Dataset) -> Result<(), String> {
        let words = |error: hdf5_metno::Error| error.to_string();
        let settings = dataset.dcpl().map_err(words)?;
        let bytes = dataset.dtype().map_err(words)?.size() as u64;
        if dataset.layout() == Layout::Virtual {
            if !self.follow {
                return Err("it is a virtual data set, whose numbers lie in others".into());
            }
            let mut held = self.input.bytes();
            for (source, path) in raw::virtual_sources(&settings).ok_or("its sources cannot be read")? {
                let file = if source == "." {
                    dataset.file().map_err(words)?
                } else {
                    self.take_near(&source)?;
                    let near = self.near(&source).find(|path| path.is_file());
                    let near = near.ok_or_else(|| format!("the file `{source}` of its numbers is not there"))?;
                    held += near.metadata().map_or(0, |found| found.len());
                    File::open(near).map_err(words)?
                };
                let source = file.dataset(&path).map_err(words)?;
                if source.layout() == Layout::Virtual {
                    return Err(format!("its numbers lie in `{path}`, a virtual data set itself"));
                }
                self.storage(&source)?;
                filters(&source).map_err(|refusal| refusal.problem)?;
            }
            return within(&dataset.shape(), bytes, held);
        }
        let external = settings.external();
        if external.is_empty() {
            return Ok(());
        }
        if !self.follow {
            return Err("its numbers lie in another file (external storage)".into());
        }
        let mut held = 0;
        for part in external {
            // Such names start from the working directory, whatever the file's folder is.
            let path = Path::new(&part.name);
            self.take(path)?;
            let found = path.metadata().map_err(|error| error.to_string())?.len();
            // All that follows is stated as 0.
            let size = if part.size == 0 { u64::MAX } else { part.size as u64 };
            held += found.saturating_sub(part.offset as u64).min(size);
        }
        let elements = dataset.shape().iter().try_fold(bytes, |product, side| product.checked_mul(*side as u64));
        match elements {
            Some(declared) if declared <= held => Ok(()),
            _ => Err(format!("the shape {:?} was declared, but its files have {held} bytes", dataset.shape())),
        }
    }

    /// Where the library looks for a file that another one names.
    fn near(&self, name: &str) -> impl Iterator<Item = PathBuf> {
        let folder = self.input.path().parent().unwrap_or(Path::new("")).to_owned();
        [folder.join(name), PathBuf::from(name)].into_iter()
    }

    fn take_near(&self, name: &str) -> Result<(), String> {
        match self.near(name).find(|path| path.exists()) {
            Some(path) => self.take(&path),
            None => Err(format!("the file `{name}` that it leads to is not there")),
        }
    }

    fn take(&self, path: &Path) -> Result<(), String> {
        let same = |file: &InputFile| file.path().canonicalize().ok() == path.canonicalize().ok();
        let mut followed = locked(&self.followed);
        if same(&self.input) || followed.iter().any(same) {
            return Ok(());
        }
        followed.push(InputFile::new(path).map_err(|error| error.to_string())?);
        Ok(())
    }
}

/// Text up to a NUL.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// Refuses what no file of so many bytes holds.
pub(crate) fn within(shape: &[usize], element: u64, held: u64) -> Result<(), String> {
    let declared = shape.iter().try_fold(element, |product, side| product.checked_mul(*side as u64));
    if declared.is_some_and(|declared| declared <= ALLOWANCE.max(held.saturating_mul(DENSEST))) {
        return Ok(());
    }
    Err(format!("{shape:?} elements of {element} bytes are declared, and its files have {held} bytes"))
}

/// Refuses what needs a filter that is not linked in.
fn filters(dataset: &Dataset) -> Result<(), Refusal> {
    let missing = dataset.filters().into_iter().find(|filter| !filter.is_available());
    let Some(filter) = missing else { return Ok(()) };
    // Registered numbers of the HDF Group.
    let name = match filter.id() {
        4 => "szip",
        307 => "bzip2",
        32000 => "LZF",
        32001 => "Blosc",
        32004 => "LZ4",
        32008 => "bitshuffle",
        32013 => "ZFP",
        32015 => "Zstandard",
        32026 => "Blosc2",
        _ => "unknown",
    };
    let number = Filter::id(&filter);
    Err(Refusal {
        problem: format!(
            "its chunks are packed by the filter {name} (number {number}), which the program does not have"
        ),
        help: Some(
            "repack it with a program that has the filter: h5repack -f GZIP=4 IN OUT, or compression=\"gzip\" in h5py",
        ),
    })
}
