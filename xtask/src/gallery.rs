//! The gallery of the website: the reports of all examples, each with a picture and its first values.

use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    foreign,
    process::{Outcome, run, target},
    report_check::with_report,
    results,
    setup::cargo,
    site::{self, copy, empty},
};

/// Lines of the terminal that the gallery shows of an example.
const SHOWN: usize = 14;
/// Size of a picture of a report, in pixels.
const PICTURE: &str = "--window-size=1200,800";

/// Builds the website with the gallery, by the release program or another one; with `--links` the pages only.
pub(crate) fn site(words: &[&str]) -> Outcome {
    let program = match words {
        ["--links"] => return site::pages(),
        [] => {
            run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
            target().join("release/runout")
        }
        [program] => PathBuf::from(program),
        _ => return Err("site takes --links, a PROGRAM or nothing".into()),
    };
    site::build(&|pages| reports(&target().join("site/run"), &program, pages))
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
