//! The picture of the house: the block of `ARCHITECTURE.md` fenced as `house`, which says what may depend on what.
//!
//! ```text
//! # folder -> folders; `*` stands for one name
//! plugins/* -> core
//! apart plugins/a: simulate separators
//! cycle core: why its modules still depend on each other
//! cycle core::pipeline: why those inside `pipeline` do
//! ```

use crate::process::Outcome;

/// What the block allows.
#[derive(Debug, Default)]
pub(crate) struct Picture {
    arrows: Vec<(String, String)>,
    /// Crates and two of their modules of which neither may take anything from the other.
    pub apart: Vec<(String, [String; 2])>,
    /// Crates and their modules whose children depend on each other in a cycle, and why.
    pub cycles: Vec<(String, String)>,
}

impl Picture {
    /// Reads the block out of a document.
    pub(crate) fn read(document: &str) -> Outcome<Self> {
        let Some((_, rest)) = document.split_once("```house\n") else {
            return Err("ARCHITECTURE.md has no block ```house".into());
        };
        let block = rest.split("```").next().unwrap_or_default();
        let mut picture = Self::default();
        for line in block.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
            if let Some((folder, reason)) = line.strip_prefix("cycle ").and_then(|rest| rest.split_once(": ")) {
                picture.cycles.push((folder.trim().into(), reason.trim().into()));
            } else if let Some((folder, modules)) = line.strip_prefix("apart ").and_then(|rest| rest.split_once(": ")) {
                let [one, other] = modules.split_whitespace().collect::<Vec<_>>()[..] else {
                    return Err(format!("ARCHITECTURE.md: `{line}` does not name two modules"));
                };
                picture.apart.push((folder.trim().into(), [one.into(), other.into()]));
            } else if let Some((from, to)) = line.split_once("->") {
                for to in to.split_whitespace() {
                    picture.arrows.push((from.trim().into(), to.into()));
                }
            } else {
                return Err(format!(
                    "ARCHITECTURE.md: `{line}` is none of `FOLDER -> FOLDER …`, `apart FOLDER: MODULE MODULE`, `cycle FOLDER: REASON`"
                ));
            }
        }
        Ok(picture)
    }

    pub(crate) fn allows(&self, from: &str, to: &str) -> bool {
        self.arrows.iter().any(|arrow| matches(&arrow.0, from) && matches(&arrow.1, to))
    }

    /// Arrows that none of these needs.
    pub(crate) fn unused<'a>(&'a self, arrows: &'a [(String, String)]) -> impl Iterator<Item = String> + 'a {
        let needed =
            |arrow: &(String, String)| arrows.iter().any(|(from, to)| matches(&arrow.0, from) && matches(&arrow.1, to));
        self.arrows.iter().filter(move |arrow| !needed(arrow)).map(|(from, to)| format!("{from} -> {to}"))
    }
}

/// Whether a folder is meant: name by name, `*` for any.
fn matches(pattern: &str, folder: &str) -> bool {
    let mut names = folder.split('/');
    pattern.split('/').all(|part| names.next().is_some_and(|name| part == "*" || part == name))
        && names.next().is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: &str = "text\n```house\n# ground\nplugins/* -> core\nplugins/a -> plugins/shared\ncli -> core plugins/*\n\
                         cycle core: old\n```\nplugins/* -> plugins/*\n";

    #[test]
    fn arrows_are_those_of_the_block_only() {
        let picture = Picture::read(BLOCK).unwrap();
        assert!(picture.allows("plugins/b", "core") && picture.allows("plugins/a", "plugins/shared"));
        assert!(picture.allows("cli", "plugins/b"));
        for (from, to) in [("plugins/b", "plugins/shared"), ("core", "plugins/a"), ("plugins/a/deep", "core")] {
            assert!(!picture.allows(from, to), "{from} -> {to}");
        }
        assert_eq!(picture.cycles, [("core".to_owned(), "old".to_owned())]);
        let unused: Vec<String> = picture.unused(&[("plugins/b".into(), "core".into())]).collect();
        assert_eq!(unused, ["plugins/a -> plugins/shared", "cli -> core", "cli -> plugins/*"]);
    }

    #[test]
    fn a_line_that_says_nothing_is_refused() {
        assert!(Picture::read("no block").is_err());
        assert!(Picture::read("```house\ncore plugins\n```").unwrap_err().contains("core plugins"));
        assert!(Picture::read("```house\napart core: a b c\n```").unwrap_err().contains("two modules"));
        assert!(Picture::read("```house\ncycle core:\n```").unwrap_err().contains("REASON"));
    }
}
