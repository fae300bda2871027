//! Maps of other programs: what their reference libraries read of them is what is read here.
#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "tests")]

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use runout_core::height_grid::HeightGrid;
use runout_maps::{Wanted, is_map, read, write};
use serde_json::Value;

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn expected() -> serde_json::Map<String, Value> {
    let text = fs::read_to_string(data().join("expected.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap().as_object().unwrap().clone()
}

/// Height in nm and the library's in m agree to the rounding of two products, or are both missing.
fn same(height_nm: f64, height_m: &Value, tolerance: f64) -> bool {
    height_m.as_f64().map_or(height_nm.is_nan(), |height_m| {
        (height_nm - 1e9 * height_m).abs() <= tolerance * (1.0 + (1e9 * height_m).abs())
    })
}

#[test]
fn every_file_is_read_as_its_reference_library_reads_it() {
    let all = expected();
    assert!(all.len() > 40);
    for (name, wanted) in &all {
        let file = wanted["file"].as_str().unwrap_or(name);
        let text = |key: &str| wanted[key].as_str().map(str::to_owned);
        let asked = Wanted { layer: text("layer"), unit: text("unit"), ..Wanted::default() };
        let map = read(&data().join(file), &asked).unwrap_or_else(|error| panic!("{name}: {error}"));
        let grid = &map.grid;
        assert_eq!(
            [grid.rows() as u64, grid.columns as u64],
            [wanted["rows"].as_u64().unwrap(), wanted["columns"].as_u64().unwrap()],
            "{name}"
        );
        let rounded = wanted["rounded"].as_bool().unwrap_or_default();
        for (step, place) in [(grid.step_x_mm, 0), (grid.step_y_mm, 1)] {
            let step_mm = wanted["step_mm"][place].as_f64().unwrap();
            // Rounded to 1 µm over four or six steps.
            assert!((step / step_mm - 1.0).abs() < if rounded { 0.01 } else { 1e-9 }, "{name}: {step} for {step_mm}");
        }
        // surfalize adds the level in its own order; text with six or nine decimals of a micrometre or millimetre rounds to 1e-3 nm.
        let tolerance = match file.rsplit_once('.').unwrap().1 {
            "xyz" => 1e-3,
            "sur" => 1e-12,
            _ => 4.0 * f64::EPSILON,
        };
        let heights = wanted["heights_m"].as_array().unwrap();
        for (index, (height, known)) in grid.height_nm.iter().zip(heights).enumerate() {
            assert!(same(*height, known, tolerance), "{name}, point {index}: {height} nm for {known} m");
        }
    }
}

/// A void in the first cell makes no header of the first row, and one in the last cell no shorter row; names of columns are none.
#[test]
fn rows_of_text_begin_and_end_with_voids() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, lines: &[&str]| {
        let path = folder.path().join(name);
        fs::write(&path, lines.join("\n")).unwrap();
        let wanted = Wanted { unit: Some("nm".into()), step_mm: [Some(0.1), Some(0.1)], ..Wanted::default() };
        read(&path, &wanted).unwrap().grid
    };
    let heights = |grid: &HeightGrid| -> Vec<Option<i32>> {
        grid.height_nm.iter().map(|height| height.is_finite().then_some(*height as i32)).collect()
    };
    for void in ["NaN", "***", "BAD", ""] {
        for separator in [";", "\t", ","] {
            let row = |cells: [&str; 4]| cells.join(separator);
            let first = read("first.txt", &[&row([void, "2", "3", "4"]), &row(["5", "6", "7", "8"])]);
            assert_eq!((first.columns, first.rows()), (4, 2), "{void:?} {separator:?}");
            assert_eq!(heights(&first), [None, Some(2), Some(3), Some(4), Some(5), Some(6), Some(7), Some(8)]);
            let last = read("last.txt", &[&row(["1", "2", "3", void]), &row(["5", "6", "7", "8"])]);
            assert_eq!(heights(&last), [Some(1), Some(2), Some(3), None, Some(5), Some(6), Some(7), Some(8)]);
            let ended = read("ended.txt", &["1;2;3;4;", "5;6;7;8;"]);
            assert_eq!((ended.columns, ended.rows()), (4, 2));
        }
    }
    let named = read("named.txt", &["a b c d", "1 2 3 4", "5 6 7 8"]);
    assert_eq!((named.columns, named.rows()), (4, 2), "names of columns are a header");
    let void = read("void.txt", &["NaN NaN NaN NaN", "1 2 3 4", "5 6 7 8"]);
    assert_eq!((void.columns, void.rows()), (4, 3), "a row of voids is none");
}

/// Columns are those that the header names, marks for missing heights are no heights, and what contradicts a matrix is refused.
#[test]
fn a_header_of_text_counts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.txt");
    let read = |lines: &[String], step_mm: Option<f64>| {
        fs::write(&path, lines.join("\n")).unwrap();
        read(&path, &Wanted { unit: Some("nm".into()), step_mm: [step_mm; 2], ..Wanted::default() })
    };
    let height = |x: usize, y: usize| (10 + 7 * x + 3 * y * y + x * x * (y + 1)) as f64;
    let each = |line: &dyn Fn(usize, usize) -> String| -> Vec<String> {
        (0..9).flat_map(|y| (0..12).map(move |x| (x, y))).map(|(x, y)| line(x, y)).collect()
    };
    let expected: Vec<f64> = (0..9).flat_map(|y| (0..12).map(move |x| height(x, y))).collect();
    let named = |header: &str, line: &dyn Fn(usize, usize) -> String| [vec![header.to_owned()], each(line)].concat();
    for lines in [
        named("y [mm],x [mm],z [nm]", &|x, y| format!("{},{},{}", 0.2 * y as f64, 0.1 * x as f64, height(x, y))),
        named("id x [mm] y [mm] z [nm] intensity", &|x, y| {
            format!("7 {} {} {} 3", 0.1 * x as f64, 0.2 * y as f64, height(x, y))
        }),
        named("# X(mm) Y(mm) Height(nm)", &|x, y| format!("{} {} {}", 0.1 * x as f64, 0.2 * y as f64, height(x, y))),
    ] {
        let grid = read(&lines, None).unwrap().grid;
        assert_eq!((grid.columns, grid.rows(), grid.height_nm.clone()), (12, 9, expected.clone()), "{}", lines[0]);
        assert!((grid.step_x_mm - 0.1).abs() < 1e-12 && (grid.step_y_mm - 0.2).abs() < 1e-12);
    }

    let row = |y: usize, mark: &str| {
        (0..12)
            .map(|x| if (x, y) == (3, 2) { mark.to_owned() } else { height(x, y).to_string() })
            .collect::<Vec<_>>()
            .join(" ")
    };
    let matrix = |mark: &str| (0..9).map(|y| row(y, mark)).collect::<Vec<String>>();
    for (header, mark) in
        [("NODATA_value -9999", "-9999"), ("# nodata = -1", "-1"), ("# Value units: nm", "1.70141e38")]
    {
        let grid = read(&[vec![header.to_owned()], matrix(mark)].concat(), Some(0.1)).unwrap().grid;
        assert_eq!((grid.rows(), grid.holes()), (9, 1), "{header}");
    }

    let labels = (0..12).map(|x| format!(" {}", 0.1 * f64::from(x))).collect::<Vec<String>>().concat();
    let labelled = (0..9).map(|y| format!("{} {}", 0.2 * y as f64, row(y, "5"))).collect::<Vec<_>>();
    let refused = [
        ([vec![format!("0{labels}")], labelled].concat(), "they are places, no heights"),
        ([matrix("5"), vec![String::new()], matrix("5")].concat(), "blank lines part its rows into 2 tables"),
        ([vec!["# Width: 2.4 mm".to_owned()], matrix("5")].concat(), "points 0.2"),
    ];
    for (lines, problem) in refused {
        let error = read(&lines, Some(0.1)).unwrap_err().to_string();
        assert!(error.contains(problem), "{error}");
    }
    let listed = each(&|x, y| format!("{x} {y} {} 3", height(x, y)));
    let error = format!("{:?}", read(&listed, None).unwrap_err());
    assert!(error.contains("does not say what its 4 columns are"), "{error}");
}

#[test]
fn files_say_what_they_leave_out() {
    let of = |name: &str| read(&data().join(name), &Wanted::default());
    let layers = of("layers.x3p").unwrap();
    assert_eq!(layers.layers, ["layer 1", "layer 2", "layer 3"]);
    assert!(layers.remarks[0].contains("has 3 maps"), "{:?}", layers.remarks);
    assert_eq!(of("objects.sur").unwrap().layers, ["left", "right"], "the picture is no map");
    let no_unit = of("bits16.sur").unwrap_err();
    assert!(no_unit.to_string().contains("`a.u.`") && no_unit.to_string().contains("no length"), "{no_unit}");
    let unknown =
        read(&data().join("layers.x3p"), &Wanted { layer: Some("4".into()), ..Wanted::default() }).unwrap_err();
    assert!(unknown.to_string().contains("no map `4`"), "{unknown}");
    assert!(!of("no-dates.x3p").unwrap().about.iter().any(|(_, text)| text.contains("N/A")));
    assert!(of("comma.xyz").unwrap_err().to_string().contains("the unit of x"));
    for name in ["int16.x3p", "iso_1_0-int16-ascii.sdf", "plain.sur", "compressed.sur"] {
        assert!(is_map(&data().join(name)).unwrap(), "{name}");
    }
    assert!(!is_map(&data().join("rounded.xyz")).unwrap());
}

#[test]
fn a_changed_binary_file_is_remarked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.x3p");
    let mut archive = zip::ZipArchive::new(fs::File::open(data().join("float64.x3p")).unwrap()).unwrap();
    let mut changed = zip::ZipWriter::new(fs::File::create(&path).unwrap());
    let names: Vec<String> = archive.file_names().map(|name| name.unwrap().into_owned()).collect();
    for name in names {
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut archive.by_name(&name).unwrap(), &mut content).unwrap();
        if name.ends_with("data.bin") {
            content[0] ^= 1;
        }
        changed.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut changed, &content).unwrap();
    }
    changed.finish().unwrap();
    let map = read(&path, &Wanted::default()).unwrap();
    assert!(map.remarks[0].contains("MD5"), "{:?}", map.remarks);
}

#[test]
fn what_is_written_reads_back_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut grid = HeightGrid {
        columns: 3,
        step_x_mm: 0.001,
        step_y_mm: 0.002,
        origin_x_mm: 0.0,
        origin_y_mm: 0.0,
        std_nm: None,
        height_nm: vec![0.1, -2.5, f64::NAN, 1e3, 1.0 / 3.0, 7.0],
    };
    for name in ["map.x3p", "map.sdf", "map.h5"] {
        let path = folder.path().join(name);
        write(&grid, &path, "a <map> & its title").unwrap();
        let found = read(&path, &Wanted::default()).unwrap().grid;
        assert_eq!((found.rows(), found.columns), (2, 3), "{name}");
        for (found, known) in found.height_nm.iter().zip(&grid.height_nm) {
            assert!(
                (found - known).abs() <= 2.0 * f64::EPSILON * known.abs() || (found.is_nan() && known.is_nan()),
                "{name}: {found} {known}"
            );
        }
        assert!((found.step_y_mm / 0.002 - 1.0).abs() < 1e-15);
        let again = folder.path().join(format!("again-{name}"));
        write(&grid, &again, "a <map> & its title").unwrap();
        assert!(
            name == "map.h5" || fs::read(&path).unwrap() == fs::read(&again).unwrap(),
            "{name}: equal runs, equal bytes"
        );
    }
    grid.columns = 6;
    write(&grid, &folder.path().join("profile.x3p"), "").unwrap();
    assert_eq!(read(&folder.path().join("profile.x3p"), &Wanted::default()).unwrap().grid.rows(), 1);
    assert!(write(&grid, &folder.path().join("map.tif"), "").unwrap_err().to_string().contains("none of the formats"));
}

/// Peak of the memory of this process, in bytes.
fn peak() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()).unwrap_or_default() * 1024
}

/// Changes bytes, cuts, repeats and overwrites lengths of every file of a format: each is read or refused, in time and in memory.
/// `RUNOUT_SEED` makes others.
#[allow(clippy::print_stderr, reason = "it measures")]
fn mutate(format: &str, ends: &[&str], count: usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged");
    let seed: u64 = std::env::var("RUNOUT_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(46);
    let mut state = seed;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    let mut files: Vec<PathBuf> = fs::read_dir(data()).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|end| ends.iter().any(|known| end == *known)));
    files.sort();
    let wholes: Vec<Vec<u8>> = files.iter().map(|file| fs::read(file).unwrap()).collect();
    let (mut read, mut longest, mut most) = (0, Duration::ZERO, 0);
    for (number, whole) in wholes.iter().cycle().take(count).enumerate() {
        let mut content = whole.clone();
        match number / wholes.len() % 4 {
            0 => content.truncate(random(whole.len())),
            1 => (0..=random(4)).for_each(|_| content[random(whole.len())] = random(256) as u8),
            2 => {
                let place = random(whole.len().saturating_sub(8));
                content[place..place + 4].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f]);
            }
            _ => {
                let (from, to) = (random(whole.len()), random(whole.len()));
                let part = whole[from.min(to)..from.max(to)].to_vec();
                content.splice(from..from, part);
            }
        }
        fs::write(&path, &content).unwrap();
        // Linux forgets the largest memory so far.
        let _ = fs::write("/proc/self/clear_refs", "5");
        let (before, start) = (peak(), Instant::now());
        let found = runout_maps::read(&path, &Wanted { unit: Some("um".into()), ..Wanted::default() });
        let (time, grown) = (start.elapsed(), peak().saturating_sub(before));
        let name = files[number % files.len()].display();
        assert!(time < Duration::from_secs(5), "{name}, file {number}: {time:?}");
        assert!(grown < 4 * content.len() as u64 + 100_000_000, "{name}, file {number}: {grown} bytes of memory");
        read += usize::from(found.is_ok());
        (longest, most) = (longest.max(time), most.max(grown));
    }
    let size = wholes.iter().map(Vec::len).max().unwrap_or(0);
    let (refused, seconds) = (count - read, longest.as_secs_f64());
    eprintln!("| {format} | {count} | {read} | {refused} | {seconds:.3} s | {} kB | {} kB |", most / 1000, size / 1000);
    assert!(refused > count / 8, "{format}: {refused} of {count}");
}

const FORMATS: [(&str, &[&str]); 4] =
    [("x3p", &["x3p"]), ("sdf", &["sdf"]), ("sur", &["sur"]), ("text", &["xyz", "asc", "txt"])];

#[test]
fn damaged_files_are_read_or_refused() {
    FORMATS.iter().for_each(|(format, ends)| mutate(format, ends, 1000));
}

/// `cargo nextest run -p runout-maps --run-ignored only --no-capture many`
#[test]
#[ignore = "takes a minute"]
fn many_damaged_files_are_read_or_refused() {
    FORMATS.iter().for_each(|(format, ends)| mutate(format, ends, 10_000));
}

/// A header that declares 10 GB is refused by what the file has.
#[test]
fn sizes_that_lie_allocate_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let before = peak();
    let change = |name: &str, edit: &dyn Fn(&mut Vec<u8>)| {
        let mut content = fs::read(data().join(name)).unwrap();
        edit(&mut content);
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        read(&path, &Wanted { unit: Some("um".into()), ..Wanted::default() }).unwrap_err().to_string()
    };
    let large = 12_000_u32.to_le_bytes();
    let sdf = change("iso_2_0-binary64-binary.sdf", &|content| {
        content[42..46].copy_from_slice(&large);
        content[46..50].copy_from_slice(&large);
    });
    assert!(sdf.contains("12000 profiles of 12000 points"), "{sdf}");
    for name in ["plain.sur", "compressed.sur"] {
        let sur = change(name, &|content| {
            content[108..112].copy_from_slice(&large);
            content[112..116].copy_from_slice(&large);
        });
        assert!(sur.contains("12000") || sur.contains("144000000"), "{sur}");
    }
    assert!(peak() - before < 50_000_000);
}

/// Real files of other programs, where the data are there.
#[test]
fn real_files() {
    let Some(folder) = std::env::var_os("RUNOUT_DATA").map(|data| PathBuf::from(data).join("formats/surfaces")) else {
        return;
    };
    let of = |name: &str, wanted: &Wanted| {
        read(&folder.join(name), wanted).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    // Written by MountainsMap 11 in both versions and encodings: one and the same surface.
    let sdf = ["iso1_ascii", "iso1_binary", "iso2_ascii", "iso2_binary"];
    let maps = sdf.map(|name| of(&format!("sdfio-mm11_{name}_int32.sdf"), &Wanted::default()).grid);
    assert_eq!((maps[0].rows(), maps[0].columns, maps[0].holes()), (20, 30, 1));
    for other in &maps[1..] {
        for (one, other) in maps[0].height_nm.iter().zip(&other.height_nm) {
            // 32 bits of 0.01 pm, and scales that differ in the last of 15 digits.
            assert!((one - other).abs() < 1e-4 || one.is_nan() && other.is_nan(), "{one} {other}");
        }
    }
    // 0, 1, 2 … nm from the first point on.
    let counted = of("sdfio-input_iso2_ascii.sdf", &Wanted::default()).grid;
    assert_eq!((counted.height_nm[1].round(), counted.height_nm[30].round()), (1.0, 30.0));
    let voids = of("x3pio-iso25178-72-2017-surface_binary.x3p", &Wanted::default()).grid;
    assert_eq!((voids.rows(), voids.columns), (150, 200));
    assert!(voids.holes() > 0);
    let third = of(
        "x3pio-iso25178-72-fdam1-surface_layers_binary.x3p",
        &Wanted { layer: Some("3".into()), ..Wanted::default() },
    );
    assert_eq!((third.layers.len(), third.grid.rows(), third.grid.columns), (3, 120, 160));
    let profile = of("x3pio-iso25178-72-fdam1-profile_int16_xml.x3p", &Wanted::default()).grid;
    assert_eq!((profile.rows(), profile.columns, profile.step_x_mm), (1, 256, 0.002));
    let pyramid = of("x3ptools-pyramid.x3p", &Wanted::default()).grid;
    assert_eq!((pyramid.rows(), pyramid.columns, pyramid.step_x_mm), (5, 5, 1e3));
    let points = of("st-xyz-1.txt", &Wanted { unit: Some("um".into()), ..Wanted::default() }).grid;
    assert_eq!((points.rows(), points.columns), (4, 4));
    assert!((points.step_x_mm / 1e-3 - 1.0).abs() < 1e-12);
    assert_eq!(points.height_nm.iter().sum::<f64>(), 20_000.0 - 2_000.0);
}
