//! How fast a file is read: four sensors and a mark, as a recorder with six decimals writes them.
#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark")]

use std::{fmt::Write, fs, hint::black_box};

use divan::{Bencher, counter::BytesCount};
use runout_core::{
    measurement::Block,
    pipeline::{Context, Registry},
    rig::{Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
    stage::{Request, Source},
};
use tempfile::TempDir;
use toml::de::DeTable;

const ROWS: usize = 300_000;

fn rig() -> Rig {
    let sensor = |id: &str, angle_deg| SensorConfig {
        id: id.into(),
        angle_deg,
        z_mm: 0.0,
        section: "a".into(),
        ..SensorConfig::default()
    };
    RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Ccw,
        sensors: vec![sensor("S1", 0.0), sensor("S2", 90.0), sensor("S3", 180.0), sensor("S4", 228.75)],
        setups: vec![SetupConfig { id: "one".into(), ..SetupConfig::default() }],
    }
    .check()
    .unwrap()
}

/// A file with this between its cells and in its numbers.
fn file(folder: &TempDir, delimiter: char, decimal: char) -> String {
    let mut text = ["S1", "S2", "S3", "S4", "index"].join(&delimiter.to_string()) + "\n";
    for row in 0..ROWS {
        for sensor in 0..4 {
            let reading = 12.0 * (0.002_45 * row as f64 + 1.3 * f64::from(sensor)).sin();
            write!(text, "{}{delimiter}", format!("{reading:.6}").replace('.', &decimal.to_string())).unwrap();
        }
        writeln!(text, "{}", u8::from(row % 2560 == 0)).unwrap();
    }
    let path = folder.path().join("x.csv");
    fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn read(bencher: Bencher, delimiter: char, decimal: char) {
    let folder = TempDir::new().unwrap();
    let path = file(&folder, delimiter, decimal);
    let config = format!("plugin = \"csv\"\npattern = \"{path}\"\nstations = [{{ name = \"s\" }}]");
    let mut registry = Registry::default();
    runout_csv::register(&mut registry);
    let rig = rig();
    let context = Context { folder: folder.path(), rig: Some(&rig) };
    let loader = registry.loaders.build(&DeTable::parse(&config).unwrap(), &context).unwrap();
    bencher.counter(BytesCount::new(fs::metadata(&path).unwrap().len())).bench_local(|| {
        let Source::Turns(recording) = loader.open(&Request { rig: Some(&rig), columns: &[] }).unwrap() else {
            panic!("it holds turns")
        };
        let mut stream = recording.open(0, 0).unwrap();
        let mut block = Block::default();
        while stream.next_block(&mut block).unwrap() {
            black_box(&block.samples);
        }
    });
}

#[divan::bench(sample_count = 40, sample_size = 1)]
fn points(bencher: Bencher) {
    read(bencher, ',', '.');
}

#[divan::bench(sample_count = 40, sample_size = 1)]
fn decimal_commas(bencher: Bencher) {
    read(bencher, ';', ',');
}

fn main() {
    divan::main();
}
