//! Recordings of named channels, from the files of other programs to a form.

use std::{fs, path::Path};

use serde_json::Value;

use crate::folder::Folder;

const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../formats/channels/tests/assets/campaign");

/// A file, and what `[load]` says beside its path.
const CAMPAIGNS: [(&str, &str); 12] = [
    ("campaign.tdms", ""),
    ("campaign.mat", ""),
    ("campaign-7.3.mat", "unit = \"um\""),
    ("campaign.h5", "setups = { only = \"Run 0\" }\nchannel_path = \"runs/{setup}/{channel}/values\""),
    ("campaign.csv", ""),
    ("campaign.lvm", ""),
    ("campaign.npz", "unit = \"um\""),
    (
        "campaign.npy",
        "unit = \"um\"\nsample_rate_hz = 640\nchannels = { A = \"data[:, 0]\", B = \"data[:, 1]\", C = \"data[:, 2]\" }",
    ),
    ("campaign.parquet", "sample_rate_hz = 640"),
    ("campaign.arrow", "sample_rate_hz = 640"),
    ("campaign.uff", ""),
    (
        "campaign.wav",
        "channels = { A = { channel = \"ch1\", gain = 10, unit = \"um\" }, B = { channel = \"ch2\", gain = 0.01, unit = \"mm\" }, C = { channel = \
         \"ch3\", gain = 10, unit = \"µm\" } }",
    ),
];

fn pipeline(sensors: [&str; 3], load: &str) -> String {
    let [a, b, c] = sensors;
    format!(
        "[rig]\npart_radius_mm = 20\nsensors = [{{ id = \"{a}\", angle_deg = 0 }}, {{ id = \"{b}\", angle_deg = 99.84375 }}, {{ id = \"{c}\", angle_deg \
         = 202.5 }}]\nsetups = [{{ id = \"only\" }}]\n\n{load}\n[[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = \
         32\n\n[separate]\nplugin = \"three-point\"\n\n[[export]]\nplugin = \"parquet\"\npath = \"out\"\n"
    )
}

/// Runs a pipeline on a file of the campaign, and gives the station of the summary.
fn station(file: &str, pipeline: &str) -> Value {
    let folder = Folder::with(&[("pipeline.toml", pipeline)]);
    fs::copy(Path::new(ASSETS).join(file), folder.path().join(file)).unwrap();
    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!(ran.status, 0, "{file}: {}", ran.stderr);
    let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
    summary["stations"][0].clone()
}

#[test]
fn one_campaign_in_all_formats_gives_one_form() {
    let mut first: Option<f64> = None;
    for (file, more) in CAMPAIGNS {
        let mark = match file {
            "campaign.npy" => "data[:, 3]",
            "campaign.wav" => "ch4",
            _ => "Index",
        };
        let load =
            format!("[load]\nplugin = \"channels\"\npath = \"{file}\"\n{more}\nmarker = {{ channel = \"{mark}\" }}\n");
        let station = station(file, &pipeline(["A", "B", "C"], &load));
        let rms_um = station["sections"][0]["form_rms_um"].as_f64().unwrap();
        // Three lobes of ±1.5 µm; noise of 0.01 µm over eight turns.
        assert!((rms_um - 1.5 / 2_f64.sqrt()).abs() < 0.01, "{file}: {rms_um}");
        // Six digits of text are the coarsest: UFF has five of 4 µm, 4·10⁻⁵ µm, averaged.
        let first = *first.get_or_insert(rms_um);
        assert!((rms_um - first).abs() < 2e-5, "{file}: {rms_um} for {first}");
    }
}

#[test]
fn the_table_that_inspect_prints_works_when_pasted() {
    for (file, _) in CAMPAIGNS {
        let folder = Folder::with(&[]);
        fs::copy(Path::new(ASSETS).join(file), folder.path().join(file)).unwrap();
        let inspected = folder.run(&["inspect", file, "--json"]);
        assert_eq!(inspected.status, 0, "{file}: {}", inspected.stderr);
        let report: Value = serde_json::from_str(&inspected.stdout).unwrap();
        let load = report["load"].as_str().unwrap_or_else(|| panic!("{file}: {}", inspected.stdout));
        let mark = report["mark"].as_str().unwrap_or_default();
        assert!(mark.contains("Index") || mark.ends_with("3]") || mark == "ch4", "{file}: {report}");
        let printed = folder.run(&["inspect", file]);
        assert!(load.lines().all(|line| printed.stdout.contains(line)), "{file}: {}", printed.stdout);
        let station = station(file, &pipeline(["S1", "S2", "S3"], load));
        let rms_um = station["sections"][0]["form_rms_um"].as_f64().unwrap();
        // The numbers of WAV are a tenth.
        let expected = if file == "campaign.wav" { 0.15 } else { 1.5 } / 2_f64.sqrt();
        assert!((rms_um / expected - 1.0).abs() < 0.01, "{file}: {rms_um}\n{load}");
    }
}

#[test]
fn mistakes_are_said_with_words() {
    let load = |more: &str| format!("[load]\nplugin = \"channels\"\npath = \"campaign.tdms\"\n{more}\n");
    let marker = "marker = { channel = \"Index\" }";
    for (more, status, words) in [
        ("", 1, "expected `marker`, `angle` or `times` in [load], found none"),
        ("marker = { channel = \"index\" }\nformat = \"tmds\"", 2, "did you mean `tdms`?"),
        ("marker = { channel = \"Indx\" }", 1, "did you mean `Index`?"),
        (&format!("{marker}\nangle = {{ channel = \"A\" }}"), 2, "found `marker` and `angle`"),
        (&format!("{marker}\nchannels = {{ D = \"A\" }}"), 2, "the rig has no sensor `D`"),
        (&format!("{marker}\nunit = \"mm\""), 1, "the file says `µm`, the configuration `mm`"),
        (&format!("{marker}\nsample_rate_hz = 600"), 1, "that of the configuration 600 Hz"),
        (
            &format!("{marker}\nchannels = {{ A = \"Index\" }}"),
            1,
            "the channel is in V, the sensor of the rig in a unit of length",
        ),
        (&format!("{marker}\nsetups = {{ only = \"Run 1\" }}"), 1, "expected a group `Run 1`"),
        ("marker = { channel = \"Index\", threshold = 7 }", 1, "it lies from 0 to 5"),
    ] {
        let folder = Folder::with(&[("pipeline.toml", &pipeline(["A", "B", "C"], &load(more)))]);
        fs::copy(Path::new(ASSETS).join("campaign.tdms"), folder.path().join("campaign.tdms")).unwrap();
        let ran = folder.run(&["run", "pipeline.toml"]);
        let said = ran.stderr.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
        assert!(said.contains(words) && ran.status == status, "{more}: {} {}", ran.status, ran.stderr);
    }
}
