//! Every number of every example, before and after a change.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    chores,
    process::{Outcome, root, say, target},
    setup::cargo,
};

/// What the READMEs' commands begin with.
pub(crate) const PROGRAM: &str = "target/release/runout";

/// Runs the commands of all examples' READMEs in a copy of the repository's examples, by the release program or another one. The
/// folder then holds what they wrote, and what they printed as `NUMBER.txt`.
pub(crate) fn record(words: &[&str]) -> Outcome {
    let (folder, program) = match words {
        [folder] => {
            crate::process::run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
            (Path::new(folder), target().join("release/runout"))
        }
        [folder, program] => (Path::new(folder), PathBuf::from(program)),
        _ => return Err("usage: cargo xtask record-results FOLDER [PROGRAM]".into()),
    };
    run_examples(folder, &program, &|_| Ok(()), &mut |_| Ok(()))
}

/// Runs the commands of all examples' READMEs in a copy of the examples. `prepare` gets the folder of each copy before its first command,
/// `after` gets it after each command.
pub(crate) fn run_examples(
    folder: &Path,
    program: &Path,
    prepare: &dyn Fn(&Path) -> std::io::Result<()>,
    after: &mut dyn FnMut(&Path) -> Outcome,
) -> Outcome {
    let program = program.canonicalize().map_err(|error| format!("cannot find {}: {error}", program.display()))?;
    let failed = |error: std::io::Error| format!("cannot write to {}: {error}", folder.display());
    fs::create_dir_all(folder).map_err(failed)?;
    let folder = folder.canonicalize().map_err(failed)?;
    // Measured data, where `cargo xtask data` has brought them: pipelines name them from their own place.
    let data = target().join("data");
    if data.is_dir() {
        copy(&data, &folder.join("target/data")).map_err(failed)?;
    }
    // Blocks that need a shell name the program by this path.
    let own = folder.join(PROGRAM);
    fs::create_dir_all(own.parent().unwrap_or(&folder)).map_err(failed)?;
    fs::copy(&program, &own).map_err(failed)?;
    let mut examples: Vec<PathBuf> = fs::read_dir(root().join("examples"))
        .map_err(|error| format!("cannot read examples/: {error}"))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.join("README.md").is_file())
        .collect();
    examples.sort();
    for example in examples {
        let name = example.file_name().unwrap_or_default();
        let copied = folder.join("examples").join(name);
        copy(&example, &copied).map_err(failed)?;
        prepare(&copied).map_err(failed)?;
        let text = fs::read_to_string(example.join("README.md"))
            .map_err(|error| format!("cannot read {}: {error}", example.display()))?;
        for (number, mut command) in runs(&text, &own).into_iter().enumerate() {
            let words: Vec<_> = command.get_args().map(std::ffi::OsStr::to_string_lossy).collect();
            say(&format!("$ runout {}", words.join(" ")));
            let output = command
                .current_dir(&folder)
                .output()
                .map_err(|error| format!("cannot start {}: {error}", command.get_program().display()))?;
            if !output.status.success() {
                say(&format!("  {}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim_end()));
            }
            fs::write(copied.join(format!("{number}.txt")), output.stdout).map_err(failed)?;
            after(&copied)?;
        }
    }
    Ok(())
}

/// Compares the numbers of two recorded folders, to 1e-12 relative or to what is given.
pub(crate) fn compare(words: &[&str]) -> Outcome {
    chores::studies(&[&["compare-results"], words].concat())
}

/// What runs the commands of a README: the program, or a shell for each block where one of them needs it.
fn runs(text: &str, program: &Path) -> Vec<Command> {
    let lines = commands(text);
    if lines.iter().all(|line| !line.contains('$')) {
        let run = |line: &String| {
            let mut command = Command::new(program);
            command.args(words_of(line));
            command
        };
        return lines.iter().map(run).collect();
    }
    let blocks = text.split("```").skip(1).step_by(2).filter(|block| !commands(&format!("```{block}")).is_empty());
    let shell = |block: &str| {
        let mut command = Command::new("sh");
        command.arg("-ec").arg(block.split_once('\n').map_or("", |(_, script)| script));
        command
    };
    blocks.map(shell).collect()
}

/// The commands of a README, each on one line without its comment and the program's name.
pub(crate) fn commands(text: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut inside = false;
    for line in text.replace("\\\n", " ").lines() {
        if line.starts_with("```") {
            inside = !inside;
        } else if let (true, Some(rest)) = (inside, line.trim().strip_prefix(PROGRAM)) {
            commands.push(rest.split("  #").next().unwrap_or(rest).trim().to_owned());
        }
    }
    commands
}

/// Words as a shell splits them, with quotes and without expansions.
fn words_of(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), String::new(), None);
    for letter in line.chars() {
        match quote {
            Some(open) if letter == open => quote = None,
            None if letter == '\'' || letter == '"' => quote = Some(letter),
            None if letter.is_whitespace() => {
                if !word.is_empty() {
                    words.push(std::mem::take(&mut word));
                }
            }
            _ => word.push(letter),
        }
    }
    if !word.is_empty() {
        words.push(word);
    }
    words
}

fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            // What an earlier run has left is not copied.
            if entry.file_name() != "out" {
                copy(&entry.path(), &target)?;
            }
        } else if entry.path().extension().is_none_or(|extension| extension != "h5") {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_of_a_readme() {
        let text = "text\n```\ntarget/release/runout run a.toml \\\n  --set 'x = [1]'   # a comment\nprinted\n```\n\
                    target/release/runout no\n```text\ntarget/release/runout check b.toml\n```\n";
        assert_eq!(commands(text), ["run a.toml    --set 'x = [1]'", "check b.toml"]);
        assert_eq!(words_of(&commands(text)[0]), ["run", "a.toml", "--set", "x = [1]"]);
    }
}
