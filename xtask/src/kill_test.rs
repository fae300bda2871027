//! Kills of a run, at every step that writes, syncs or renames, and at times spread over all of it: what is left is old or new as a whole.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, ExitStatus, Stdio},
    time::{Duration, Instant},
};

use crate::{
    process::{Outcome, root, run, say, target},
    random::Random,
    setup::cargo,
};

/// The state of a folder with a journal.
const JOURNAL: usize = 2;
/// Steps of a publication of few files, at most.
const MOST_STEPS: u64 = 1000;

/// `[--kills N] [--seed S] [PROGRAM]`.
pub(crate) fn test(words: &[&str]) -> Outcome {
    let (mut kills, mut seed, mut program) = (1000_u64, 1_u64, None);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let mut number =
            || words.next().and_then(|value| value.parse::<u64>().ok()).ok_or(format!("{word} takes a number"));
        match *word {
            "--kills" => kills = number()?,
            "--seed" => seed = number()?,
            path => program = Some(std::path::absolute(path).map_err(|error| format!("{path}: {error}"))?),
        }
    }
    let program = if let Some(program) = program {
        program
    } else {
        run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
        target().join("release/runout")
    };
    Test::new(program)?.kill(kills, seed)
}

type Files = BTreeMap<PathBuf, Vec<u8>>;

struct Test {
    program: PathBuf,
    folder: PathBuf,
}

impl Test {
    fn new(program: PathBuf) -> Outcome<Self> {
        let folder = target().join("kill-test");
        let _ = fs::remove_dir_all(&folder);
        let words = |error: std::io::Error| format!("{}: {error}", folder.display());
        fs::create_dir_all(&folder).map_err(words)?;
        let example = root().join("examples/08-text-recording");
        fs::copy(example.join("shaft.csv"), folder.join("shaft.csv")).map_err(words)?;
        let text = fs::read_to_string(example.join("pipeline.toml")).map_err(words)?;
        let second = "\n[[export]]\nplugin = \"hdf5\"\npath = \"elsewhere/result.h5\"\n";
        fs::write(folder.join("pipeline.toml"), text + second).map_err(words)?;
        Ok(Self { program, folder })
    }

    fn command(&self, title: &str) -> Command {
        let mut command = Command::new(&self.program);
        command.args(["run", "pipeline.toml", "--set", &format!("title={title}")]).current_dir(&self.folder);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    /// The results of a run that nobody kills.
    fn whole(&self, title: &str) -> Outcome<Files> {
        let status = self.command(title).status().map_err(|error| error.to_string())?;
        if status.success() { Ok(self.files()) } else { Err(format!("a run that nobody killed failed ({status})")) }
    }

    fn files(&self) -> Files {
        let entries =
            ["out", "elsewhere"].map(|name| fs::read_dir(self.folder.join(name)).into_iter().flatten().flatten());
        let paths = entries.into_iter().flatten().map(|entry| entry.path());
        paths.filter_map(|path| Some((path.clone(), fs::read(path).ok()?))).collect()
    }

    fn kill(&self, kills: u64, seed: u64) -> Outcome {
        let new = self.whole("new")?;
        let begun = Instant::now();
        let old = self.whole("old")?;
        let usual = begun.elapsed();
        let mut found = [0_u64; 3];
        let mut random = Random::new(seed);
        let (mut by_step, mut killed, mut runs) = (true, 0, 0);
        while killed < kills {
            runs += 1;
            let status = if by_step {
                self.at_step(killed + 1)
            } else {
                self.at_time(usual.mul_f64(random.below(1000) as f64 / 900.0))
            }?;
            // Past the last step, or the last moment.
            if status.success() {
                by_step = false;
                if runs > 3 * kills + MOST_STEPS {
                    return Err("too few runs were killed".into());
                }
            } else {
                killed += 1;
            }
            let state = self.state(&old, &new)?;
            found[state] += 1;
            if state == JOURNAL {
                self.read_completes(&new)?;
            }
            if self.whole("old")? != old {
                return Err(format!("the run after kill {killed} left other files in {}", self.folder.display()));
            }
        }
        let [whole_old, whole_new, journal] = found;
        say(&format!(
            "{killed} kills in {runs} runs (seed {seed}): {whole_old} left the old results, {whole_new} the new ones, {journal} a journal that \
             `inspect` completed; every next run succeeded"
        ));
        Ok(())
    }

    /// A command that reads a result completes the publication first.
    fn read_completes(&self, new: &Files) -> Outcome {
        let mut command = Command::new(&self.program);
        command.args(["inspect", "elsewhere/result.h5"]).current_dir(&self.folder);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let status = command.status().map_err(|error| error.to_string())?;
        // Temporary files stay until the next run.
        let shown = |files: Files| -> Files { files.into_iter().filter(|(path, _)| !is_hidden(path)).collect() };
        if status.success() && shown(self.files()) == shown(new.clone()) {
            return Ok(());
        }
        Err(format!("`inspect` did not complete the publication in {}", self.folder.display()))
    }

    fn at_step(&self, step: u64) -> Outcome<ExitStatus> {
        self.command("new").env("RUNOUT_TEST_FAULT", format!("kill:{step}")).status().map_err(|error| error.to_string())
    }

    fn at_time(&self, after: Duration) -> Outcome<ExitStatus> {
        let mut child = self.command("new").spawn().map_err(|error| error.to_string())?;
        std::thread::sleep(after);
        child.kill().and_then(|()| child.wait()).map_err(|error| error.to_string())
    }

    /// 0 for old results, 1 for new ones, 2 for a journal between them.
    fn state(&self, old: &Files, new: &Files) -> Outcome<usize> {
        let left = self.files();
        let hidden = |path: &Path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        let shown: Files =
            left.iter().filter(|(path, _)| !hidden(path)).map(|(path, bytes)| (path.clone(), bytes.clone())).collect();
        match shown {
            shown if shown == *old => Ok(0),
            shown if shown == *new => Ok(1),
            _ if left.keys().any(|path| path.extension().is_some_and(|extension| extension == "journal")) => {
                Ok(JOURNAL)
            }
            _ => Err(format!("old and new files stand side by side in {}", self.folder.display())),
        }
    }
}

/// Whether a file is no result: its name begins with a dot.
fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}
