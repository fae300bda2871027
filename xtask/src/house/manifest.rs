//! Members of the workspace and the arrows between them, from the `Cargo.toml` files.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use crate::process::Outcome;

/// A crate: its folder below the root and the folders of the workspace's crates that its program text may import.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Member {
    pub folder: String,
    pub uses: BTreeSet<String>,
}

/// All members of the workspace at `root`, in the order of the manifest. Dependencies of tests are left out.
pub(crate) fn members(root: &Path) -> Outcome<Vec<Member>> {
    let workspace = Manifest::read(root)?;
    let shared: BTreeMap<&str, String> = workspace
        .entries("workspace.dependencies")
        .filter_map(|(name, value)| Some((name, clean("", quoted_after(value, "path")?))))
        .collect();
    let mut members = Vec::new();
    for folder in workspace.folders(root) {
        let manifest = Manifest::read(&root.join(&folder))?;
        let mut uses = BTreeSet::new();
        for (name, value) in manifest.dependencies() {
            if let Some(path) = quoted_after(&value, "path") {
                uses.insert(clean(&folder, path));
            } else if let Some(shared) = shared.get(name) {
                uses.insert(shared.clone());
            }
        }
        members.push(Member { folder, uses });
    }
    Ok(members)
}

/// As much of a manifest as is needed: lines `key = value` with the table that they stand in.
struct Manifest(Vec<(String, String, String)>);

impl Manifest {
    fn read(folder: &Path) -> Outcome<Self> {
        let path = folder.join("Cargo.toml");
        let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(Self::parse(&text))
    }

    fn parse(text: &str) -> Self {
        let mut table = String::new();
        let mut entries: Vec<(String, String, String)> = Vec::new();
        let mut open = false;
        for line in text.lines().map(|line| line.split('#').next().unwrap_or_default().trim()) {
            if let (true, Some(last)) = (open, entries.last_mut()) {
                last.2.push_str(line);
            } else if let Some(header) = line.strip_prefix('[') {
                table = header.trim_end_matches(']').replace('"', "");
                continue;
            } else if let Some((key, value)) = line.split_once('=') {
                entries.push((table.clone(), key.trim().replace('"', ""), value.trim().into()));
            } else {
                continue;
            }
            let value = entries.last().map_or("", |entry| entry.2.as_str());
            let count = |mark: char| value.matches(mark).count();
            open = count('[') > count(']') || count('{') > count('}');
        }
        Self(entries)
    }

    fn entries(&self, table: &str) -> impl Iterator<Item = (&str, &str)> {
        let own = self.0.iter().filter(move |entry| entry.0 == table);
        own.map(|(_, key, value)| (key.as_str(), value.as_str()))
    }

    /// Names and values of what the program itself depends on, also of one platform only.
    fn dependencies(&self) -> impl Iterator<Item = (&str, String)> {
        self.0.iter().filter_map(|(table, key, value)| {
            if table == "dependencies" || (table.starts_with("target.") && table.ends_with(".dependencies")) {
                // `name = { … }` or `name.path = "…"`.
                let (name, part) = key.split_once('.').unwrap_or((key, ""));
                Some((name, if part.is_empty() { value.clone() } else { format!("{part} = {value}") }))
            } else {
                // [dependencies.name], one key a line.
                Some((table.strip_prefix("dependencies.")?, format!("{key} = {value}")))
            }
        })
    }

    /// Folders of the members; `folder/*` stands for each one that has a manifest.
    fn folders(&self, root: &Path) -> Vec<String> {
        let list = self.entries("workspace").find(|(key, _)| *key == "members").map_or("", |(_, value)| value);
        let mut folders = Vec::new();
        for word in list.split('"').skip(1).step_by(2) {
            let Some(parent) = word.strip_suffix("/*") else {
                folders.push(clean("", word));
                continue;
            };
            let found = fs::read_dir(root.join(parent)).into_iter().flatten().flatten();
            let mut names: Vec<String> = found
                .filter(|entry| entry.path().join("Cargo.toml").is_file())
                .map(|entry| format!("{parent}/{}", entry.file_name().to_string_lossy()))
                .collect();
            names.sort();
            folders.extend(names);
        }
        folders
    }
}

/// The text between quotation marks behind `key =` in an inline table.
fn quoted_after<'a>(value: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = value.split_once(&format!("{key} =")).or_else(|| value.split_once(&format!("{key}=")))?;
    rest.trim_start().strip_prefix('"')?.split('"').next()
}

/// A path from a folder, without `.` and `..`.
fn clean(from: &str, path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in from.split('/').chain(path.split('/')) {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::house::tests::tree;

    #[test]
    fn arrows_come_from_dependencies_of_the_program_only() {
        let folder = tree(&[
            (
                "Cargo.toml",
                "[workspace]\nmembers = [\n  \"core\", # ground\n  \"plugins/*\",\n]\n\
                 [workspace.dependencies]\nmy-core = { path = \"core\" }\nmy-b = { version = \"1\", path = \"plugins/b\" }\n",
            ),
            ("core/Cargo.toml", "[package]\nname = \"my-core\"\n[dev-dependencies]\nmy-b.workspace = true\n"),
            ("plugins/a/Cargo.toml", "[dependencies]\nmy-core.workspace = true\nserde = \"1\"\n"),
            (
                "plugins/b/Cargo.toml",
                "[target.'cfg(unix)'.dependencies]\nmy-core = { path = \"../../core\" }\n\
                 [dependencies.my-a]\npath = \"../a\"\n",
            ),
        ]);
        let found = members(&folder).unwrap();
        let shown: Vec<String> = found
            .iter()
            .map(|member| format!("{}: {}", member.folder, member.uses.iter().cloned().collect::<Vec<_>>().join(" ")))
            .collect();
        assert_eq!(shown, ["core: ", "plugins/a: core", "plugins/b: core plugins/a"]);
    }

    /// A library that is not tested has no test that would never run, and one without examples none that nobody compiles.
    #[test]
    fn nothing_that_is_left_out_of_the_tests_has_any() {
        let root = crate::process::root();
        let mut left_out = [0, 0];
        for folder in Manifest::read(&root).unwrap().folders(&root) {
            let manifest = Manifest::read(&root.join(&folder)).unwrap();
            let is_off = |what: &str| manifest.entries("lib").any(|entry| entry == (what, "false"));
            let [tests, examples] = [is_off("test"), is_off("doctest")];
            for (path, text) in texts(&root.join(&folder).join("src")) {
                let place = path.display();
                assert!(!tests || !text.contains("#[test]"), "{place}: its tests are not run");
                assert!(!examples || !has_example(&text), "{place}: its examples are not compiled");
            }
            left_out[0] += usize::from(tests);
            left_out[1] += usize::from(examples);
        }
        assert!(left_out.iter().all(|count| *count > 0), "{left_out:?}");
    }

    /// Whether a block of code in the documentation is a program: rustdoc takes one without a language for Rust.
    fn has_example(text: &str) -> bool {
        let lines = text.lines().map(str::trim_start);
        let docs = lines.filter_map(|line| line.strip_prefix("///").or_else(|| line.strip_prefix("//!")));
        let opening = docs.filter_map(|line| line.trim().strip_prefix("```")).step_by(2);
        opening.into_iter().any(|language| !["text", "toml"].contains(&language))
    }

    /// Texts of all files of a folder and those within it.
    fn texts(folder: &Path) -> Vec<(std::path::PathBuf, String)> {
        let mut found = Vec::new();
        for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                found.extend(texts(&path));
            } else {
                let text = fs::read_to_string(&path).unwrap_or_default();
                found.push((path, text));
            }
        }
        found
    }
}
