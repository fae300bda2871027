//! The website: pages of `docs/` and READMEs, and a gallery of the examples' reports, by MkDocs, which checks every link and anchor.

use std::{
    collections::BTreeSet,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    foreign,
    process::{Outcome, answer, root, run, say, target, tools},
    report_check::with_report,
    results,
    setup::{self, cargo},
};

/// What makes the pages.
const GENERATOR: &str = "mkdocs-material>=9.6,<10";
/// Lines of the terminal that the gallery shows of an example.
const SHOWN: usize = 14;
/// Size of a picture of a report, in pixels.
const PICTURE: &str = "--window-size=1200,800";

/// Builds `target/site/html`; with `--links` without the gallery, which needs no program.
pub(crate) fn site(words: &[&str]) -> Outcome {
    let gallery = match words {
        ["--links"] => None,
        [] => {
            run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
            Some(target().join("release/runout"))
        }
        [program] => Some(PathBuf::from(program)),
        _ => return Err("site takes --links, a PROGRAM or nothing".into()),
    };
    let folder = target().join("site");
    let pages = folder.join("pages");
    empty(&pages)?;
    stage(&pages)?;
    let text = match gallery {
        None => "# Gallery\n\n`cargo xtask site` runs the examples and puts their reports here.\n".to_owned(),
        Some(program) => reports(&folder.join("run"), &program, &pages)?,
    };
    write(&pages.join("gallery.md"), &text)?;
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

/// Runs all examples, copies their reports to the pages, and gives the text of the gallery.
fn reports(folder: &Path, program: &Path, pages: &Path) -> Outcome<String> {
    empty(folder)?;
    let place = pages.join("reports");
    // A later command of a README may write the same report of other data: the first one stays.
    let mut keep = |example: &Path| {
        for report in html_below(example)? {
            let kept = place.join(name(example)).join(report.strip_prefix(example).unwrap_or(&report));
            if !kept.is_file() {
                copy(&report, &kept)?;
            }
        }
        Ok(())
    };
    results::run_examples(folder, program, &with_report, &mut keep)?;
    let browser = foreign::browser();
    let mut text = String::from(
        "# Gallery\n\nThe reports of the examples, as their pipelines write them. Each opens in the browser and needs no network.\n",
    );
    for example in children(&folder.join("examples"))? {
        let name = name(&example);
        let found = html_below(&place.join(&name))?;
        let Some(first) = found.first() else { continue };
        let shown = |report: &Path| report.strip_prefix(pages).unwrap_or(report).display().to_string();
        let _ = write!(text, "\n## {}\n\n[How it is made](examples/{name}/README.md)", title(&example));
        for report in &found {
            let inside = report.strip_prefix(place.join(&name)).unwrap_or(report).display().to_string();
            let _ = write!(text, " · [{}]({})", inside.trim_start_matches("out/"), shown(report));
        }
        text.push('\n');
        if let Some(browser) = browser {
            let picture = place.join(format!("{name}.png"));
            photograph(browser, first, &picture)?;
            let _ = write!(text, "\n[![First screen of the report]({})]({})\n", shown(&picture), shown(first));
        }
        if let Some(answer) = first_values(&example) {
            let _ = write!(text, "\n```text\n{answer}\n```\n");
        }
    }
    Ok(text)
}

fn name(example: &Path) -> String {
    example.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The heading of an example's README.
fn title(example: &Path) -> String {
    let text = fs::read_to_string(example.join("README.md")).unwrap_or_default();
    let heading = text.lines().find_map(|line| line.strip_prefix("# ")).unwrap_or("Example");
    heading.to_owned()
}

/// What a run of the example printed first: verdict and key values.
fn first_values(example: &Path) -> Option<String> {
    let printed = (0..).map_while(|number| fs::read_to_string(example.join(format!("{number}.txt"))).ok());
    let mut answers = printed.filter(|text| text.contains("Key values"));
    let text = answers.next()?;
    Some(text.lines().take(SHOWN).collect::<Vec<_>>().join("\n").trim_end().to_owned())
}

/// Takes a picture of the first screen of a page.
fn photograph(browser: &str, page: &Path, picture: &Path) -> Outcome {
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--hide-scrollbars", "--enable-unsafe-swiftshader", PICTURE]);
    command.arg("--virtual-time-budget=15000").arg(format!("--screenshot={}", picture.display()));
    let output = command.arg(format!("file://{}", page.display())).output();
    let output = output.map_err(|error| format!("cannot start {browser}: {error}"))?;
    if output.status.success() { Ok(()) } else { Err(format!("{browser} took no picture of {}", page.display())) }
}

/// All reports below a folder, which need not be there: those of a folder before those of its folders.
fn html_below(folder: &Path) -> Outcome<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let (folders, files): (Vec<_>, Vec<_>) = children(folder)?.into_iter().partition(|path| path.is_dir());
    let is_page = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "html");
    let mut found: Vec<_> = files.into_iter().filter(is_page).collect();
    for folder in folders {
        found.extend(html_below(&folder)?);
    }
    Ok(found)
}

fn children(folder: &Path) -> Outcome<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).map_err(|error| format!("cannot read {}: {error}", folder.display()))?;
    let mut paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    Ok(paths)
}

fn empty(folder: &Path) -> Outcome {
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))
}

fn copy(from: &Path, to: &Path) -> Outcome {
    let problem = |error: std::io::Error| format!("cannot copy {} to {}: {error}", from.display(), to.display());
    fs::create_dir_all(to.parent().unwrap_or(to)).map_err(problem)?;
    fs::copy(from, to).map(|_| ()).map_err(problem)
}

fn write(path: &Path, text: &str) -> Outcome {
    fs::write(path, text).map_err(|error| format!("cannot write {}: {error}", path.display()))
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
