//! What a build needs besides Rust: libhdf5 is built from source, by CMake 3.26 or newer, make and a C compiler.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use crate::process::{Outcome, answer, run, say, tools};

/// What libhdf5 2.2 asks for. Debian 12's own is 3.25.
const OLDEST_CMAKE: (u32, u32) = (3, 26);

/// Finds or brings everything and says what to do with it.
pub(crate) fn report() -> Outcome {
    let cmake = ready()?;
    say(&format!("set-up is complete; CMake is {}", cmake.display()));
    if answer("cmake", &["--version"]).and_then(|text| version(&text)).is_none_or(|found| found < OLDEST_CMAKE) {
        say(&format!("`cargo xtask` finds it by itself; for plain cargo: export CMAKE={}", cmake.display()));
    }
    Ok(())
}

/// A cargo command with everything that a build needs.
pub(crate) fn cargo(arguments: &[&str]) -> Outcome<Command> {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).env("CMAKE", ready()?);
    Ok(command)
}

/// The CMake to use, with the rest in place.
pub(crate) fn ready() -> Outcome<PathBuf> {
    compiler()?;
    cmake()
}

/// The parts of Rust that a minimal installation leaves out.
pub(crate) fn components() -> Outcome {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    for (component, command) in [("rustfmt", "fmt"), ("clippy", "clippy")] {
        if answer(&cargo, &[command, "--version"]).is_none() {
            run(Command::new("rustup").args(["component", "add", component]))?;
        }
    }
    Ok(())
}

fn compiler() -> Outcome {
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    if answer(&compiler, &["--version"]).is_none() {
        install(&["build-essential"], &format!("a C compiler (`{compiler}`)"))?;
    }
    if answer("make", &["--version"]).is_none() && answer("ninja", &["--version"]).is_none() {
        install(&["make"], "make")?;
    }
    Ok(())
}

fn cmake() -> Outcome<PathBuf> {
    let own = tools().join("cmake-venv/bin/cmake");
    let configured = std::env::var_os("CMAKE").map(PathBuf::from);
    let candidates = [configured, Some("cmake".into()), Some(own.clone())];
    let usable = |program: &PathBuf| {
        answer(program, &["--version"]).and_then(|text| version(&text)).is_some_and(|found| found >= OLDEST_CMAKE)
    };
    if let Some(found) = candidates.into_iter().flatten().find(usable) {
        return Ok(found);
    }
    let (major, minor) = OLDEST_CMAKE;
    say(&format!("there is no CMake {major}.{minor} or newer here: installing one below {}", tools().display()));
    let folder = tools().join("cmake-venv");
    python_environment(&folder)?;
    run(Command::new(folder.join("bin/pip")).args(["install", "--quiet", "--upgrade", "cmake>=3.26"]))?;
    if usable(&own) {
        Ok(own)
    } else {
        Err(format!(
            "{} does not run; install CMake {major}.{minor} or newer and name it by the environment variable CMAKE",
            own.display()
        ))
    }
}

/// Makes a Python environment in `folder`, unless there is one that works.
pub(crate) fn python_environment(folder: &Path) -> Outcome {
    if answer(folder.join("bin/pip"), &["--version"]).is_some() {
        return Ok(());
    }
    let make = || {
        let shown = folder.display().to_string();
        answer("python3", &["-m", "venv", "--clear", &shown]).is_some()
            && answer(folder.join("bin/pip"), &["--version"]).is_some()
    };
    if make() {
        return Ok(());
    }
    install(&["python3", "python3-venv"], "Python 3 with its venv module")?;
    if make() { Ok(()) } else { Err(format!("python3 -m venv {} fails", folder.display())) }
}

/// Installs Debian packages, as root or by sudo.
pub(crate) fn install(packages: &[&str], what: &str) -> Outcome {
    let list = packages.join(" ");
    let refused = |problem: &str| format!("{what} is missing and {problem}; install it (Debian, Ubuntu: {list})");
    if answer("apt-get", &["--version"]).is_none() {
        return Err(refused("there is no apt-get here"));
    }
    say(&format!("{what} is missing: installing {list}"));
    let root = answer("id", &["-u"]).is_some_and(|id| id.trim() == "0");
    let apt = |arguments: &[&str]| {
        let mut command = if root { Command::new("env") } else { Command::new("sudo") };
        command.args(["DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq"]).args(arguments);
        run(&mut command)
    };
    apt(&["update"]).map_err(|error| refused(&error))?;
    let arguments: Vec<&str> =
        ["install", "--yes", "--no-install-recommends"].iter().chain(packages).copied().collect();
    apt(&arguments).map_err(|error| refused(&error))
}

/// Major and minor of "cmake version 3.31.2".
fn version(text: &str) -> Option<(u32, u32)> {
    let number = text.lines().next()?.split_whitespace().find(|word| word.starts_with(|c: char| c.is_ascii_digit()))?;
    let mut parts = number.split('.').map(str::parse);
    Some((parts.next()?.ok()?, parts.next()?.ok()?))
}

#[cfg(test)]
mod tests {
    use super::version;

    #[test]
    fn versions_compare_by_number() {
        assert_eq!(version("cmake version 3.31.2\n\nmore"), Some((3, 31)));
        assert!(version("cmake version 3.25.1") < Some(super::OLDEST_CMAKE));
        assert!(version("cmake version 4.0.0-rc1") > Some(super::OLDEST_CMAKE));
        assert_eq!(version("no such thing"), None);
    }
}
