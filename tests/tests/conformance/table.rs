//! Checks and plugins as a table, and the page that it is printed on.

use std::{
    fmt::Write,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

/// What a check says of a plugin.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum TestOutcome {
    Holds,
    /// Why it does not apply.
    Exempt(String),
    /// What is wrong.
    Fails(String),
}

impl From<Result<(), String>> for TestOutcome {
    fn from(result: Result<(), String>) -> Self {
        result.map_or_else(Self::Fails, |()| Self::Holds)
    }
}

/// One check of a kind of plugins: what its campaigns call it, and what must hold.
pub(crate) struct Check(pub(crate) &'static str, pub(crate) &'static str);

/// All checks on all plugins of one kind.
pub(crate) struct Kind {
    pub(crate) heading: &'static str,
    /// How the plugins are tested, in one or two sentences.
    pub(crate) about: &'static str,
    pub(crate) checks: &'static [Check],
    /// Each plugin, and what each check found.
    pub(crate) plugins: Vec<(String, Vec<TestOutcome>)>,
}

impl Kind {
    /// Every check that fails, as a line.
    pub(crate) fn failures(&self) -> impl Iterator<Item = String> {
        self.plugins.iter().flat_map(move |(plugin, found)| {
            let failed = move |(check, found): (&Check, &TestOutcome)| match found {
                TestOutcome::Fails(why) => Some(format!("{} {plugin}, {}: {why}", self.heading, check.0)),
                _ => None,
            };
            self.checks.iter().zip(found).filter_map(failed)
        })
    }

    fn print(&self, page: &mut String) {
        let mut reasons: Vec<&str> = Vec::new();
        let _ = writeln!(page, "\n## {}\n\n{}\n", self.heading, self.about);
        for (number, check) in self.checks.iter().enumerate() {
            let _ = writeln!(page, "{}. {}", number + 1, check.1);
        }
        let numbers: Vec<String> = (1..=self.checks.len()).map(|number| number.to_string()).collect();
        let _ = writeln!(page, "\n| plugin | {} |", numbers.join(" | "));
        let _ = writeln!(page, "| --- |{}", " --- |".repeat(self.checks.len()));
        for (plugin, found) in &self.plugins {
            let cells = found.iter().map(|found| match found {
                TestOutcome::Holds => "yes".to_owned(),
                TestOutcome::Fails(_) => "no".to_owned(),
                TestOutcome::Exempt(why) => {
                    let known = reasons.iter().position(|reason| reason == why).unwrap_or_else(|| {
                        reasons.push(why);
                        reasons.len() - 1
                    });
                    letter(known)
                }
            });
            let _ = writeln!(page, "| `{plugin}` | {} |", cells.collect::<Vec<_>>().join(" | "));
        }
        if !reasons.is_empty() {
            page.push('\n');
        }
        for (number, reason) in reasons.iter().enumerate() {
            let _ = writeln!(page, "- {}: {reason}", letter(number));
        }
    }
}

fn letter(number: usize) -> String {
    let letter = char::from(b'a' + u8::try_from(number % 26).unwrap_or_default());
    format!("({})", letter.to_string().repeat(1 + number / 26))
}

/// The page of all kinds.
pub(crate) fn page(kinds: &[Kind]) -> String {
    let mut page = String::from(
        "# What every plugin is tested for\n\n\
         This page lists the checks that all built-in plugins of a kind pass, and where one does not apply, with the reason. \
         `cargo nextest run -p runout-tests -E 'binary(conformance)'` does the checks and compares this page with what they find; \
         with `RUNOUT_WRITE_PAGE=1` it writes the page. The suite takes the plugins from the program's registry: a new one without a \
         campaign in `tests/campaigns` fails. `runout plugins test -- COMMAND` does the checks of separators of turns on a \
         [program of your own](../external-programs.md).\n",
    );
    for kind in kinds {
        kind.print(&mut page);
    }
    page
}

/// What `test` finds of each plugin, in their order.
pub(crate) fn on_two_threads<'a>(
    names: impl Iterator<Item = &'a str>,
    test: impl Fn(&str) -> Vec<TestOutcome> + Sync,
) -> Vec<(String, Vec<TestOutcome>)> {
    let names: Vec<&str> = names.collect();
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some(name) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
            let one = test(name);
            found.lock().unwrap().push(((*name).to_owned(), one));
        }
    };
    thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
    let mut found = found.into_inner().unwrap();
    found.sort_by_key(|(name, _)| names.iter().position(|known| known == name));
    found
}
