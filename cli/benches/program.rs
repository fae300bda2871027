//! The program as its users meet it: how soon it starts, how long a diagnosis takes, and its meshes beside a plain write of
//! as many bytes. Files go to a temporary folder; what is written stays in the page cache.
#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark")]

use std::{
    f64::consts::TAU,
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
    process::Command,
    sync::LazyLock,
};

use divan::{Bencher, counter::ItemsCount};
use runout_cli::builtin::registry;
use runout_core::{
    pipeline::Context,
    stage::{About, Completed, ResultInfo},
    summary::Summary,
    surface::Surface,
};
use tempfile::TempDir;
use toml::de::DeTable;

const RINGS: usize = 400;
const ANGLES: usize = 2560;

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| TempDir::new().unwrap());

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name)
}

/// Runs the program, quietly, in a folder.
fn runout(folder: &Path, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_runout")).current_dir(folder).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[divan::bench]
fn start_help() {
    runout(FOLDER.path(), &["--help"]);
}

#[divan::bench]
fn start_check() {
    runout(&example("06-closed-loop"), &["check", "pipeline.toml"]);
}

/// Example 6: four sensors, three setups, 60 turns of 512 samples; the campaign is simulated outside the clock.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn diagnosis(bencher: Bencher) {
    static CAMPAIGN: LazyLock<PathBuf> = LazyLock::new(|| {
        let folder = FOLDER.path().join("closed-loop");
        fs::create_dir(&folder).unwrap();
        for file in ["scenario.toml", "pipeline.toml"] {
            fs::copy(example("06-closed-loop").join(file), folder.join(file)).unwrap();
        }
        runout(&folder, &["simulate", "scenario.toml", "--out", "campaign.h5"]);
        folder
    });
    let folder = &*CAMPAIGN;
    bencher.bench_local(|| runout(folder, &["diagnose", "pipeline.toml"]));
}

/// A million points of a lobed part.
static SURFACE: LazyLock<Surface> = LazyLock::new(|| {
    let deviation_um = |ring: usize, step: usize| {
        let angle = TAU * step as f64 / ANGLES as f64;
        3.0 * (3.0 * angle + 0.01 * ring as f64).cos() + 0.4 * (40.0 * angle).sin()
    };
    Surface {
        radius_mm: 30.0,
        angles: ANGLES,
        z_mm: (0..RINGS).map(|ring| 0.25 * ring as f64).collect(),
        deviation_um: (0..RINGS).flat_map(|ring| (0..ANGLES).map(move |step| deviation_um(ring, step))).collect(),
        interpolation: "linear",
        meetings: Vec::new(),
    }
});

fn summary() -> Summary {
    Summary { title: "bench".into(), ..Summary::default() }
}

/// Writes a mesh with normals and colours; gives the size of the file.
fn mesh(plugin: &str, extension: &str, surface: &Surface) -> u64 {
    let config = format!("plugin = \"{plugin}\"\npath = \"part.{extension}\"");
    let context = Context { folder: FOLDER.path(), rig: None };
    let exporter = registry().exporters.build(&DeTable::parse(&config).unwrap(), &context).unwrap();
    let export = exporter.begin(&ResultInfo { title: "bench".into(), ..ResultInfo::default() }).unwrap();
    let (summary, about) = (summary(), About::default());
    let files = export
        .finish(&Completed {
            summary: &summary,
            about: &about,
            surface: Some(surface),
            heights: None,
            diagnosis: None,
            overview: None,
        })
        .unwrap();
    // The files are not kept: they go as they are dropped.
    files.iter().map(|file| fs::metadata(file.path()).unwrap().len()).sum()
}

fn bench_mesh(bencher: Bencher, plugin: &'static str, extension: &'static str) {
    let surface = &*SURFACE;
    bencher.counter(ItemsCount::new(RINGS * ANGLES)).bench_local(|| mesh(plugin, extension, surface));
}

/// As many bytes, from memory.
fn bench_plain(bencher: Bencher, plugin: &str, extension: &str) {
    let bytes = vec![7_u8; mesh(plugin, extension, &SURFACE) as usize];
    let path = FOLDER.path().join("plain");
    bencher.counter(ItemsCount::new(RINGS * ANGLES)).bench_local(|| {
        File::create(&path).unwrap().write_all(&bytes).unwrap();
        fs::remove_file(&path).unwrap();
    });
}

#[divan::bench(sample_count = 30, sample_size = 1)]
fn mesh_glb(bencher: Bencher) {
    bench_mesh(bencher, "gltf", "glb");
}

#[divan::bench(sample_count = 30, sample_size = 1)]
fn mesh_glb_plain_write(bencher: Bencher) {
    bench_plain(bencher, "gltf", "glb");
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn mesh_obj(bencher: Bencher) {
    bench_mesh(bencher, "obj", "obj");
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn mesh_obj_plain_write(bencher: Bencher) {
    bench_plain(bencher, "obj", "obj");
}

fn main() {
    divan::main();
}
