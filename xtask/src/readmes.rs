//! Whether the READMEs show what the program prints.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::{
    process::{Outcome, root, say},
    results::{PROGRAM, run_examples},
};

/// Marks lines of which a README leaves something out.
const LEFT_OUT: &str = "…";

/// Runs the commands of all examples' READMEs by a program, in a copy of the examples below a folder, and names each line that a README
/// shows as printed and no command of it prints. Words: `FOLDER PROGRAM`.
pub(crate) fn check(words: &[&str]) -> Outcome {
    let [folder, program] = words else { return Err("usage: cargo xtask check-readmes FOLDER PROGRAM".into()) };
    let folder = Path::new(folder);
    run_examples(folder, Path::new(program), &|_| Ok(()), &mut |_| Ok(()))?;
    let mut stale = 0;
    let mut readmes = vec![(root().join("README.md"), "01-four-sensor".to_owned())];
    for (example, _) in examples(folder)? {
        readmes.push((root().join("examples").join(&example).join("README.md"), example));
    }
    for (readme, example) in readmes {
        let text = read(&readme)?;
        let printed = printed(&folder.join("examples").join(&example))?;
        for (number, line) in shown(&text) {
            if !printed.contains(&joined(line)) {
                stale += 1;
                say(&format!("{}:{number}: {line}", readme.strip_prefix(root()).unwrap_or(&readme).display()));
            }
        }
    }
    if stale > 0 {
        return Err(format!("{stale} lines of READMEs are not printed by the program"));
    }
    say("the READMEs show what the program prints");
    Ok(())
}

fn read(path: &Path) -> Outcome<String> {
    fs::read_to_string(path).map_err(|error| format!("cannot read {}: {error}", path.display()))
}

/// Names and folders of the copied examples, in their order.
fn examples(folder: &Path) -> Outcome<Vec<(String, PathBuf)>> {
    let folder = folder.join("examples");
    let entries = fs::read_dir(&folder).map_err(|error| format!("cannot read {}: {error}", folder.display()))?;
    let mut examples: Vec<_> = entries
        .filter_map(|entry| {
            let entry = entry.ok()?;
            Some((entry.file_name().into_string().ok()?, entry.path()))
        })
        .filter(|(_, path)| path.join("README.md").is_file())
        .collect();
    examples.sort();
    Ok(examples)
}

/// What the commands of an example printed, on one line: READMEs break lines that are long.
fn printed(example: &Path) -> Outcome<String> {
    let mut all = String::new();
    for number in 0.. {
        let path = example.join(format!("{number}.txt"));
        if !path.is_file() {
            break;
        }
        all.push_str(&joined(&read(&path)?));
        all.push(' ');
    }
    Ok(all)
}

/// The words of a text, a space apart.
fn joined(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Lines of a README, with their numbers from 1, that are shown as printed: those of blocks without a language that hold no command, since
/// commands have blocks of their own.
fn shown(text: &str) -> Vec<(usize, &str)> {
    let mut lines = Vec::new();
    let mut block: Option<(bool, Vec<(usize, &str)>)> = None;
    for (index, line) in text.lines().enumerate() {
        match (line.strip_prefix("```"), &mut block) {
            (Some(language), None) => block = Some((matches!(language, "" | "text"), Vec::new())),
            (Some(_), Some(_)) => {
                let (is_output, held) = block.take().unwrap_or_default();
                let has_command = held.iter().any(|(_, line)| {
                    ["$ ", PROGRAM, "cargo ", "pip ", "runout ", "python"].iter().any(|start| line.starts_with(start))
                });
                if is_output && !has_command {
                    lines.extend(held);
                }
            }
            (None, Some((_, held))) if !line.trim().is_empty() && !line.contains(LEFT_OUT) => {
                held.push((index + 1, line));
            }
            (None, _) => {}
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn blocks_of_output_are_compared_and_commands_are_not() {
        let text = "a\n```\ntarget/release/runout run a.toml\n```\n```\nForm\n  …\n\n  rms 1.0\n```\n```toml\nkey = 1\n```\n```text\nlast\n```\n";
        assert_eq!(shown(text), [(6, "Form"), (9, "  rms 1.0"), (15, "last")]);
    }
}
