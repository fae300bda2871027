//! Whether the house is built as `ARCHITECTURE.md` draws it: arrows between crates, cycles between a crate's modules, and
//! files too long to be read in one sitting.

mod manifest;
mod modules;
mod picture;
mod tokens;

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::process::{Outcome, root, say};
use manifest::Member;
use modules::Modules;
use picture::Picture;

/// Lines above which a file's head has to say why.
const LONG_LINES: usize = 400;
/// Lines of a file's head.
const HEAD_LINES: usize = 12;
/// What the reason begins with.
const REASON: &str = "//! Long because";

/// Prints the graphs; fails on what the picture does not have.
pub(crate) fn check(words: &[&str]) -> Outcome {
    if !words.is_empty() {
        return Err("check-house takes nothing".into());
    }
    let findings = Findings::of(&root())?;
    say(&findings.report());
    findings.verdict()
}

/// Fails on what the picture does not have, without printing the graphs: for a longer list of checks.
pub(crate) fn check_quietly() -> Outcome {
    Findings::of(&root())?.verdict()
}

#[derive(Default)]
struct Findings {
    graph: Vec<String>,
    /// Where modules depend on each other in a cycle: a crate's folder, and the module that holds them.
    cycles: Vec<String>,
    faults: Vec<String>,
}

impl Findings {
    fn of(root: &Path) -> Outcome<Self> {
        let path = root.join("ARCHITECTURE.md");
        let document = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let picture = Picture::read(&document)?;
        let members = manifest::members(root)?;
        let mut findings = Self::default();
        findings.crates(&members, &picture);
        for member in &members {
            findings.modules(root, member, &picture);
        }
        for (place, _) in &picture.cycles {
            if !findings.cycles.contains(place) {
                findings.faults.push(format!("ARCHITECTURE.md: `cycle {place}`, but there is none"));
            }
        }
        for (path, lines) in long_files(root, &members) {
            let name = path.strip_prefix(root).unwrap_or(&path).display();
            findings.faults.push(format!("{name}: {lines} lines and no `{REASON} …` in the first {HEAD_LINES}"));
        }
        Ok(findings)
    }

    fn crates(&mut self, members: &[Member], picture: &Picture) {
        self.graph.push("Crates".into());
        let mut arrows = Vec::new();
        for Member { folder, uses } in members {
            let shown: Vec<&str> = uses.iter().map(String::as_str).collect();
            self.graph
                .push(format!("  {folder} -> {}", if shown.is_empty() { "nothing".into() } else { shown.join(" ") }));
            for to in uses {
                if !picture.allows(folder, to) {
                    self.faults.push(format!("{folder} -> {to}: {}", reason(folder, to)));
                }
                arrows.push((folder.clone(), to.clone()));
            }
        }
        let unused =
            picture.unused(&arrows).map(|arrow| format!("ARCHITECTURE.md: no crate needs the arrow `{arrow}`"));
        self.faults.extend(unused);
    }

    fn modules(&mut self, root: &Path, member: &Member, picture: &Picture) {
        let folder = &member.folder;
        let modules = Modules::read(&root.join(folder));
        let top = modules.at_the_top();
        if !top.is_empty() {
            self.graph.push(format!("Modules of {folder}"));
        }
        for (_, [one, other]) in picture.apart.iter().filter(|(apart, _)| apart == folder) {
            for (from, to) in [(one, other), (other, one)] {
                match top.get(from) {
                    None => {
                        self.faults.push(format!("ARCHITECTURE.md: `apart {folder}`, but it has no module `{from}`"));
                    }
                    Some(uses) if uses.contains(to) => {
                        self.faults.push(format!("{folder}: {from} -> {to}, which are to share nothing"));
                    }
                    Some(_) => {}
                }
            }
        }
        for (from, to) in top {
            let to: Vec<String> = to.into_iter().collect();
            self.graph.push(if to.is_empty() { format!("  {from}") } else { format!("  {from} -> {}", to.join(" ")) });
        }
        for cycle in modules.cycles() {
            let modules = cycle.modules.join(", ");
            let place = if cycle.parent.is_empty() { folder.clone() } else { format!("{folder}::{}", cycle.parent) };
            let known = picture.cycles.iter().find(|(known, _)| *known == place).map(|(_, reason)| reason);
            let excuse = known.map(|reason| format!(" (known: {reason})")).unwrap_or_default();
            self.graph.push(format!("  cycle: {modules}{excuse}"));
            for (from, to, paths) in &cycle.arrows {
                self.graph.push(format!("    {from} -> {to} ({paths})"));
            }
            if known.is_none() {
                self.faults.push(format!("{place}: modules depend on each other in a cycle: {modules}"));
            }
            self.cycles.push(place);
        }
    }

    fn report(&self) -> String {
        self.graph.join("\n")
    }

    fn verdict(&self) -> Outcome {
        let faults: Vec<String> = self.faults.iter().map(|fault| format!("  {fault}")).collect();
        if faults.is_empty() {
            return Ok(());
        }
        Err(format!("the house is not as ARCHITECTURE.md draws it (`cargo xtask check-house`)\n{}", faults.join("\n")))
    }
}

/// Why an arrow that the picture does not have is wrong.
fn reason(from: &str, to: &str) -> &'static str {
    let room = |folder: &str| folder.split('/').next().unwrap_or_default().to_owned();
    match (room(from).as_str(), room(to).as_str()) {
        ("plugins", "plugins") => "a plugin imports a plugin",
        ("formats", "plugins") => "a format knows a domain",
        ("core", "core") => "a crate of the core imports upwards",
        ("core", _) => "the core imports what depends on it",
        _ => "ARCHITECTURE.md does not have this arrow",
    }
}

/// Files of the members that are long and do not say why, with their lines.
fn long_files(root: &Path, members: &[Member]) -> Vec<(PathBuf, usize)> {
    let mut open: Vec<PathBuf> = members
        .iter()
        .flat_map(|member| ["src", "tests", "benches", "examples"].map(|part| root.join(&member.folder).join(part)))
        .collect();
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|ext| ext == "rs") {
                let text = fs::read_to_string(&path).unwrap_or_default();
                let lines = text.lines().count();
                if lines > LONG_LINES && !text.lines().take(HEAD_LINES).any(|line| line.starts_with(REASON)) {
                    found.push((path, lines));
                }
            }
        }
    }
    // `tests/tests` is below `tests`, if that is a member too.
    found.sort();
    found.dedup();
    found
}

#[cfg(test)]
pub(crate) mod tests {
    use std::{
        fs,
        ops::Deref,
        path::{Path, PathBuf},
        sync::atomic::{AtomicUsize, Ordering},
    };

    use super::Findings;

    /// A folder of its own, gone with the value.
    pub(crate) struct Tree(PathBuf);

    impl Deref for Tree {
        type Target = Path;
        fn deref(&self) -> &Path {
            &self.0
        }
    }

    impl Drop for Tree {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    /// A folder of its own with these files.
    pub(crate) fn tree(files: &[(&str, &str)]) -> Tree {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("runout-xtask-{}-{count}", std::process::id()));
        for (name, text) in files {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        Tree(folder)
    }

    const WORKSPACE: &str = "[workspace]\nmembers = [\"core\", \"plugins/a\", \"plugins/b\", \"formats/c\"]\n";

    fn house(arrows: &str, more: &[(&str, &str)]) -> Findings {
        let picture = format!("# The house\n```house\n{arrows}\n```\n");
        let files = [
            ("Cargo.toml", WORKSPACE),
            ("ARCHITECTURE.md", picture.as_str()),
            ("core/Cargo.toml", "[dependencies]\n"),
            ("plugins/a/Cargo.toml", "[dependencies]\ncore = { path = \"../../core\" }\n"),
            ("plugins/b/Cargo.toml", "[dependencies]\na = { path = \"../a\" }\n"),
            ("formats/c/Cargo.toml", "[dependencies]\nb = { path = \"../../plugins/b\" }\n"),
        ];
        let root = tree(&[&files[..], more].concat());
        Findings::of(&root).unwrap()
    }

    #[test]
    fn an_arrow_that_is_not_drawn_is_a_fault() {
        let found = house("plugins/* -> core", &[]);
        let faults =
            ["plugins/b -> plugins/a: a plugin imports a plugin", "formats/c -> plugins/b: a format knows a domain"];
        assert_eq!(found.faults, faults);
        assert!(found.verdict().unwrap_err().contains("imports a plugin"));
        let drawn = house("plugins/* -> core\nplugins/b -> plugins/a\nformats/c -> plugins/b\nformats/c -> core", &[]);
        assert!(drawn.verdict().unwrap_err().contains("no crate needs the arrow `formats/c -> core`"));
    }

    #[test]
    fn a_cycle_is_a_fault_unless_it_is_known() {
        let arrows = "plugins/* -> core\nplugins/b -> plugins/a\nformats/c -> plugins/b";
        let ring = [
            ("core/src/lib.rs", "mod a; mod b;"),
            ("core/src/a.rs", "use crate::b;"),
            ("core/src/b.rs", "use super::a;"),
        ];
        let found = house(arrows, &ring);
        assert_eq!(found.faults, ["core: modules depend on each other in a cycle: a, b"]);
        let known = house(&format!("{arrows}\ncycle core: to be cut"), &ring);
        assert!(known.verdict().is_ok() && known.report().contains("cycle: a, b (known: to be cut)"));
        let stale = house(&format!("{arrows}\ncycle core: to be cut"), &[]);
        assert!(stale.verdict().unwrap_err().contains("`cycle core`, but there is none"));
    }

    #[test]
    fn modules_that_are_apart_share_nothing() {
        let arrows = "plugins/* -> core\nplugins/b -> plugins/a\nformats/c -> plugins/b\napart core: a b";
        let files = [("core/src/lib.rs", "mod a; mod b;"), ("core/src/a.rs", "use crate::b;"), ("core/src/b.rs", "")];
        assert_eq!(house(arrows, &files).faults, ["core: a -> b, which are to share nothing"]);
        let files = [("core/src/lib.rs", "mod a; mod b;"), ("core/src/a.rs", ""), ("core/src/b.rs", "")];
        assert!(house(arrows, &files).verdict().is_ok());
        let fault = house(arrows, &[("core/src/lib.rs", "mod a;"), ("core/src/a.rs", "")]).verdict().unwrap_err();
        assert!(fault.contains("no module `b`"), "{fault}");
    }

    #[test]
    fn a_long_file_gives_its_reason() {
        let arrows = "plugins/* -> core\nplugins/b -> plugins/a\nformats/c -> plugins/b";
        let long = "// line\n".repeat(401);
        let reason = format!("//! A module.\n//!\n//! Long because one table cannot be cut.\n{long}");
        let found = house(arrows, &[("core/src/lib.rs", &long), ("core/tests/whole.rs", &reason)]);
        let fault = found.verdict().unwrap_err();
        assert!(fault.contains("core/src/lib.rs: 401 lines") && !fault.contains("whole.rs"), "{fault}");
    }
}
