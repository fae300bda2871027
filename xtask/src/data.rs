//! Measured data that others made public: fetched, checked, and converted to what examples and tests read, in `target/data`.

mod convert;

use std::{fs, path::Path, process::Command};

use crate::{
    process::{Outcome, answer, root, run, say},
    setup,
};

/// A public file.
struct Public {
    /// Where it is, in one commit.
    url: &'static str,
    /// Where it is kept below the folder of data.
    place: &'static str,
    /// BLAKE3 of the file.
    blake3: &'static str,
    made: &'static [Made],
}

/// What is made from a public file.
struct Made {
    place: &'static str,
    blake3: &'static str,
    by: fn(&[u8]) -> Outcome<String>,
}

macro_rules! piweb {
    ($name:literal) => {
        concat!(
            "https://raw.githubusercontent.com/ZEISS-PiWeb/PiWeb-Formplots/23dc4d36cb949906db302852ab47e5ed8fa3953d/",
            "src/Tests/TestData/pltx/",
            $name
        )
    };
}

/// Two cylinders and a quadrature signal for the examples; with the rest of the plots tests compare minimum zones.
/// Licences: PiWeb-Formplots BSD-3-Clause, © 2017 ZEISS PiWeb; NmmQuad MIT, © 2024 Michael Matus.
const FILES: [Public; 10] = [
    Public {
        url: piweb!("DIN%20Zylinderform2.pltx"),
        place: "zeiss-cylinder/original/DIN Zylinderform2.pltx",
        blake3: "d51d9055303276b059ad2e41d849946b464fbf70aa33b7e640e79570d522ac5a",
        made: &[
            Made {
                place: "zeiss-cylinder/cylinder-r15.csv",
                blake3: "8abd29809af26dea4c955c8aad5346fb4d8b519b42a5f3c70026e2d2f67b35d3",
                by: convert::traces,
            },
            Made {
                place: "zeiss-cylinder/circle-c4.csv",
                blake3: "d9670140b0c86f8391db8e857b8a028468beddce75a5c97127868345f3e63177",
                by: |bytes| convert::circle(bytes, "C4"),
            },
        ],
    },
    Public {
        url: piweb!("DIN%20Zylinderform3.pltx"),
        place: "zeiss-cylinder/original/DIN Zylinderform3.pltx",
        blake3: "cd7a50f3937d64375fccd175469d206024fc681b57d49b8469c1f52b3611fe9e",
        made: &[Made {
            place: "zeiss-cylinder/cylinder-r15-three-sections.csv",
            blake3: "6b96c7af57ea8e5d53f73d4351c2a905f3c286e3928494b619cf665991c1ff46",
            by: convert::traces,
        }],
    },
    Public {
        url: concat!(
            "https://raw.githubusercontent.com/matusm/NmmQuad/f50273aeddf72c86e6e3894718fccafceb1ba940/",
            "TestData/results/test01_XYZ_f_quad_X_raw.csv"
        ),
        place: "bev-quadrature/original/test01_XYZ_f_quad_X_raw.csv",
        blake3: "28292a7683ace9b6a5dd2ff810a244a0cb8453fc04042a2feb0c31a1c2600192",
        made: &[Made {
            place: "bev-quadrature/x-axis.csv",
            blake3: "a9193caf5bc620d35481896bef0b0019dc913f2219d8472e8f5af9fc9ed0260c",
            by: convert::quadrature,
        }],
    },
    Public {
        url: piweb!("DIN%20Rundheit%20Auswertebereich.pltx"),
        place: "zeiss-cylinder/original/DIN Rundheit Auswertebereich.pltx",
        blake3: "c50dd7be483aef491cd046c741b7577276aa0fd1e10477f62afa8ffc2912047c",
        made: &[],
    },
    Public {
        url: piweb!("DIN%20Rundheit%20Punktemaskierung.pltx"),
        place: "zeiss-cylinder/original/DIN Rundheit Punktemaskierung.pltx",
        blake3: "d1020ea42112101419ec1c0c93343b203c5fbe031277b6fda6a9cf507ae47028",
        made: &[],
    },
    Public {
        url: piweb!("Rundheit%201.pltx"),
        place: "zeiss-cylinder/original/Rundheit 1.pltx",
        blake3: "c3108862a99f4bcb7723ff213c4cb3673e4d9fcc47f04bd762188c270c6288c5",
        made: &[],
    },
    Public {
        url: piweb!("Rundheit%202.pltx"),
        place: "zeiss-cylinder/original/Rundheit 2.pltx",
        blake3: "4b8b9db1f278f3a0699b4a8f64d1124ee6c9535413835556dc5f5d568610ef69",
        made: &[],
    },
    Public {
        url: piweb!("DIN%20Zylinderform%20Mantel.pltx"),
        place: "zeiss-cylinder/original/DIN Zylinderform Mantel.pltx",
        blake3: "fc0db15bff4a00f67c284dc780ccb50ab6571dcca7932f67df5ff18317eb4571",
        made: &[],
    },
    Public {
        url: piweb!("DIN%20Zylinderform%20nur%20Helix.pltx"),
        place: "zeiss-cylinder/original/DIN Zylinderform nur Helix.pltx",
        blake3: "c0fd03dff3f2405294c5002eef66f5cd440775d6abd5420d2a163de66022e7ac",
        made: &[],
    },
    Public {
        url: piweb!("Zylinderform_Zylinder4.pltx"),
        place: "zeiss-cylinder/original/Zylinderform_Zylinder4.pltx",
        blake3: "aa88db8fe23fdb7fc8f5beab2457b60bb0c664e8481d96312ff31247f13d0c88",
        made: &[],
    },
];

/// Brings every file that is not there yet, from the network or from a folder.
pub(crate) fn bring(from: Option<&Path>) -> Outcome {
    // The examples' pipelines name this folder, wherever cargo builds.
    let folder = root().join("target/data");
    let missing = all(&FILES, &folder, from)?;
    let (needed, compared): (Vec<_>, Vec<_>) = missing.iter().partition(|(public, _)| !public.made.is_empty());
    let listed = |files: &[&(&Public, String)]| {
        let each = files.iter().map(|(public, problem)| {
            format!("  {} ({problem})\n    to be put into {}", public.url, folder.join(public.place).display())
        });
        each.collect::<Vec<_>>().join("\n")
    };
    if !compared.is_empty() {
        say(&format!("plots that only tests compare with could not be had:\n{}", listed(&compared)));
    }
    if needed.is_empty() {
        say(&format!("what the examples need is in {}", folder.display()));
        return Ok(());
    }
    let again = "put them there and run `cargo xtask data` again, or into one folder: `cargo xtask data --from FOLDER`";
    Err(format!("these public files could not be had:\n{}\n{again}", listed(&needed)))
}

/// The files that could not be had, and why.
fn all<'a>(files: &'a [Public], to: &Path, from: Option<&Path>) -> Outcome<Vec<(&'a Public, String)>> {
    let mut missing = Vec::new();
    for public in files {
        let complete = |place: &str, blake3: &str| read(&to.join(place)).is_some_and(|bytes| sum(&bytes) == blake3);
        let made = public.made.iter().all(|made| complete(made.place, made.blake3));
        if made && (complete(public.place, public.blake3) || !public.made.is_empty()) {
            continue;
        }
        // What others converted already is as good, if it is the same.
        let mut given = public.made.iter().map(|made| (made, found(from, made.place, made.blake3)));
        if !public.made.is_empty()
            && given.all(|(made, bytes)| bytes.is_some_and(|bytes| write(&to.join(made.place), &bytes).is_ok()))
        {
            continue;
        }
        let bytes =
            match found(Some(to), public.place, public.blake3).or_else(|| found(from, public.place, public.blake3)) {
                Some(bytes) => bytes,
                None if from.is_some() => {
                    missing.push((public, "not in the folder given, or another file".into()));
                    continue;
                }
                None => match fetch(public.url, &to.join(public.place), public.blake3) {
                    Ok(bytes) => bytes,
                    Err(problem) => {
                        missing.push((public, problem));
                        continue;
                    }
                },
            };
        write(&to.join(public.place), &bytes)?;
        for made in public.made {
            let text = (made.by)(&bytes).map_err(|problem| format!("{}: {problem}", public.place))?;
            if sum(text.as_bytes()) != made.blake3 {
                return Err(format!("{} as converted is not what it has to be (BLAKE3 {})", made.place, made.blake3));
            }
            write(&to.join(made.place), text.as_bytes())?;
            say(&format!("{} made from {}", made.place, public.place));
        }
    }
    Ok(missing)
}

/// A file of a folder, at its place or by its bare name, if it is the right one.
fn found(folder: Option<&Path>, place: &str, blake3: &str) -> Option<Vec<u8>> {
    let folder = folder?;
    let name = Path::new(place).file_name()?;
    [folder.join(place), folder.join(name)].iter().filter_map(|path| read(path)).find(|bytes| sum(bytes) == blake3)
}

/// Fetches a file and checks it.
fn fetch(url: &str, to: &Path, blake3: &str) -> Outcome<Vec<u8>> {
    if answer("curl", &["--version"]).is_none() {
        setup::install(&["curl"], "curl")?;
    }
    let folder = to.parent().unwrap_or(to);
    fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let part = to.with_extension("part");
    let mut curl = Command::new("curl");
    curl.args(["--fail", "--location", "--silent", "--show-error", "--connect-timeout", "20", "--max-time", "300"]);
    let outcome = run(curl.arg("--output").arg(&part).arg(url));
    let bytes = read(&part);
    let _ = fs::remove_file(&part);
    outcome.map_err(|_| "curl failed".to_owned())?;
    bytes
        .filter(|bytes| sum(bytes) == blake3)
        .ok_or_else(|| format!("what came is another file: BLAKE3 is not {blake3}"))
}

fn sum(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

fn read(path: &Path) -> Option<Vec<u8>> {
    fs::read(path).ok()
}

/// Writes a file that appears whole.
fn write(path: &Path, bytes: &[u8]) -> Outcome {
    let failure = |error: std::io::Error| format!("{}: {error}", path.display());
    fs::create_dir_all(path.parent().unwrap_or(path)).map_err(failure)?;
    let part = path.with_extension("part");
    fs::write(&part, bytes).map_err(failure)?;
    fs::rename(&part, path).map_err(failure)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::house::tests::tree;

    const TEXT: &str = "Phase (deg), Radius, Roundness deviation\n   0.114, 501.001, 1.662\n";
    const MADE: &str = "phase_deg,radius_counts,deviation_counts\n0.114,501.001,1.662\n";

    /// Files as in the list, of a signal with one sample.
    fn files(url: String) -> [Public; 1] {
        let leak = |text: String| -> &'static str { Box::leak(text.into_boxed_str()) };
        let made = Made { place: "q/x.csv", blake3: leak(sum(MADE.as_bytes())), by: convert::quadrature };
        let made = Box::leak(Box::new([made]));
        [Public { url: leak(url), place: "q/original/raw.csv", blake3: leak(sum(TEXT.as_bytes())), made }]
    }

    #[test]
    fn a_file_is_fetched_checked_and_converted() {
        if answer("curl", &["--version"]).is_none() {
            return;
        }
        let there = tree(&[("raw.csv", TEXT), ("wrong.csv", "another\n")]);
        let here = tree(&[("q/x.csv", "half a fi")]);
        let url = |name: &str| format!("file://{}", there.join(name).display());
        for (name, problem) in [("wrong.csv", "another file"), ("absent.csv", "curl failed")] {
            let files = files(url(name));
            let missing = all(&files, &here, None).unwrap();
            assert!(missing[0].1.contains(problem), "{}", missing[0].1);
        }
        assert!(all(&files(url("raw.csv")), &here, None).unwrap().is_empty());
        assert_eq!(fs::read_to_string(here.join("q/x.csv")).unwrap(), MADE);
        // Nothing is fetched twice.
        assert!(all(&files(url("absent.csv")), &here, None).unwrap().is_empty());
    }

    #[test]
    fn a_folder_may_hold_originals_or_what_is_made_from_them() {
        for (name, text) in [("raw.csv", TEXT), ("q/original/raw.csv", TEXT), ("q/x.csv", MADE), ("x.csv", MADE)] {
            let (there, here) = (tree(&[(name, text)]), tree(&[]));
            let files = files("file:///nowhere".into());
            assert!(all(&files, &here, Some(&*there)).unwrap().is_empty(), "{name}");
            assert_eq!(fs::read_to_string(here.join("q/x.csv")).unwrap(), MADE);
        }
        let (there, here) = (tree(&[("raw.csv", "another")]), tree(&[]));
        assert!(
            all(&files("file:///nowhere".into()), &here, Some(&*there)).unwrap()[0].1.contains("not in the folder")
        );
    }

    #[test]
    fn every_file_has_its_place_and_checksum() {
        for public in &FILES {
            let name = Path::new(public.place).file_name().unwrap().to_str().unwrap();
            assert!(public.url.ends_with(&name.replace(' ', "%20")), "{}", public.url);
            assert!(public.made.iter().map(|made| made.blake3).chain([public.blake3]).all(|sum| sum.len() == 64));
        }
    }
}
