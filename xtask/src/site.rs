//! The website: pages of `docs/` and READMEs, by MkDocs, which checks every link and anchor.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    process::{Outcome, answer, root, run, say, target, tools},
    setup,
};

/// What makes the pages.
const GENERATOR: &str = "mkdocs-material>=9.6,<10";
const NO_GALLERY: &str = "# Gallery\n\n`cargo xtask site` runs the examples and puts their reports here.\n";

/// Builds the pages without the gallery, which needs no program.
pub(crate) fn pages() -> Outcome {
    build(&|_| Ok(NO_GALLERY.to_owned()))
}

/// Builds `target/site/html` with a page that `gallery` writes; it gets the folder of the pages, where its files go.
pub(crate) fn build(gallery: &dyn Fn(&Path) -> Outcome<String>) -> Outcome {
    let folder = target().join("site");
    let pages = folder.join("pages");
    empty(&pages)?;
    stage(&pages)?;
    let page = pages.join("gallery.md");
    fs::write(&page, gallery(&pages)?).map_err(|error| format!("cannot write {}: {error}", page.display()))?;
    let settings = folder.join("mkdocs.yml");
    copy(&root().join("docs/mkdocs.yml"), &settings)?;
    // With `--quiet`, the generator counts no warnings.
    let mut build = Command::new(generator()?);
    build.env("NO_MKDOCS_2_WARNING", "1");
    run(build.args(["build", "--strict", "--config-file"]).arg(settings))?;
    say(&format!("the website: python3 -m http.server --directory {}", folder.join("html").display()));
    Ok(())
}

/// The generator's program, installed where it is not yet.
fn generator() -> Outcome<PathBuf> {
    let environment = tools().join("site");
    let program = environment.join("bin/mkdocs");
    if answer(&program, &["--version"]).is_none() {
        setup::python_environment(&environment)?;
        run(Command::new(environment.join("bin/pip")).args(["install", "--quiet", GENERATOR]))?;
    }
    Ok(program)
}

/// Copies all pages of `docs/` and every file of the repository that a page links to, so that links hold on both.
fn stage(pages: &Path) -> Outcome {
    let mut open: Vec<PathBuf> = vec!["README.md".into()];
    for folder in ["docs", "docs/appendix"] {
        let entries = fs::read_dir(root().join(folder)).map_err(|error| format!("cannot read {folder}: {error}"))?;
        let names = entries.filter_map(|entry| Some(Path::new(folder).join(entry.ok()?.file_name())));
        open.extend(names.filter(|path| path.extension().is_some_and(|extension| extension == "md")));
    }
    let mut staged = BTreeSet::new();
    while let Some(page) = open.pop() {
        let from = root().join(&page);
        if !from.is_file() || !staged.insert(page.clone()) {
            continue;
        }
        copy(&from, &pages.join(&page))?;
        if page.extension().is_some_and(|extension| extension == "md") {
            let text = fs::read_to_string(&from).map_err(|error| format!("cannot read {}: {error}", from.display()))?;
            let folder = page.parent().unwrap_or(Path::new(""));
            open.extend(linked(&text).into_iter().map(|link| normal(&folder.join(link))));
        }
    }
    Ok(())
}

/// Files that a page links to, as it writes them.
fn linked(text: &str) -> Vec<&str> {
    let ends = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#', ' ']).next());
    ends.filter(|link| !link.is_empty() && !link.contains("://")).collect()
}

/// A path without `..`.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        if part == std::path::Component::ParentDir {
            normal.pop();
        } else {
            normal.push(part);
        }
    }
    normal
}

/// Makes an empty folder.
pub(crate) fn empty(folder: &Path) -> Outcome {
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))
}

/// Copies a file, with the folders that it needs.
pub(crate) fn copy(from: &Path, to: &Path) -> Outcome {
    let problem = |error: std::io::Error| format!("cannot copy {} to {}: {error}", from.display(), to.display());
    fs::create_dir_all(to.parent().unwrap_or(to)).map_err(problem)?;
    fs::copy(from, to).map(|_| ()).map_err(problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_of_a_page() {
        assert_eq!(linked("[a](b.md#c) ![d](../e.svg) [f](https://g.h) [i](#j)"), ["b.md", "../e.svg"]);
        assert_eq!(normal(Path::new("docs/appendix/../e.svg")), Path::new("docs/e.svg"));
    }
}
