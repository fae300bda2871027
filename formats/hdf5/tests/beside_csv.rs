//! Readings give the same stream as HDF5 and as CSV.

use std::{fmt::Write as _, path::Path};

use runout_core::{
    measurement::{MemoryStream, Recording},
    pipeline::{Context, StageConfig},
    rig::Rig,
    stage::{Request, Source},
};
use runout_csv::{CsvConfig, StationConfig};
use runout_hdf5::WriteOptions;

use crate::double::{Memory, TURN, load, read, rig, write};

/// A file with the sensors' own signs and all digits.
fn write_csv(path: &Path, stream: &MemoryStream, rig: &Rig) {
    let phase = if stream.capture.encoder { "angle_deg" } else { "index" };
    let mut text = format!("{phase};S2;S1\n");
    for (row, pair) in stream.samples.chunks_exact(2).enumerate() {
        match stream.angle_rev.get(row) {
            Some(turns) => write!(text, "{}", turns * 360.0).unwrap(),
            None => text.push(if row > 0 && row % TURN == 0 { '1' } else { '0' }),
        }
        writeln!(text, ";{};{}", pair[1] * rig.sensors[1].sign, pair[0] * rig.sensors[0].sign).unwrap();
    }
    std::fs::write(path, text.replace('.', ",")).unwrap();
}

fn load_csv(folder: &Path, memory: &Memory, rig: &Rig) -> Box<dyn Recording> {
    let station = |key: &runout_core::measurement::StationKey| StationConfig { name: key.name.clone(), z_mm: key.z_mm };
    let config = CsvConfig {
        stations: memory.stations.iter().map(station).collect(),
        pattern: Some("{setup}_{station}.csv".into()),
        files: Vec::new(),
        sample_rate_hz: Some(TURN as f64),
        speed_rpm: Some(60.0),
        marker: None,
    };
    let loader = config.check(&Context { folder, rig: Some(rig) }).unwrap();
    match loader.open(&Request { rig: Some(rig), columns: &[] }).unwrap() {
        Source::Turns(recording) => recording,
        Source::Points(_) => panic!("a CSV measurement is of turns"),
    }
}

#[test]
fn csv_and_hdf5_give_the_same() {
    for encoder in [false, true] {
        let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
        let mut memory = Memory::new(&rig, &[("b", 2.0), ("a", 1.0)], 20_025, encoder);
        for (station, setups) in memory.captures.iter_mut().enumerate() {
            for (setup, stream) in setups.iter_mut().enumerate() {
                // A mark of 0 and 1 has no better place than between two samples.
                stream.capture.marks.iter_mut().for_each(|mark| *mark = mark.round() - 0.5);
                let name = format!("{}_{}.csv", rig.setups[setup].id, memory.stations[station].name);
                write_csv(&folder.path().join(name), stream, &rig);
            }
        }
        let path = folder.path().join("same.h5");
        write(&memory, &rig, &path, &WriteOptions::default()).unwrap();
        let (hdf5, csv) = (load(&path, &rig).unwrap(), load_csv(folder.path(), &memory, &rig));
        assert_eq!(hdf5.stations(), csv.stations());
        for station in 0..2 {
            for setup in 0..2 {
                let (hdf5, mut csv) = (read(&*hdf5, station, setup).unwrap(), read(&*csv, station, setup).unwrap());
                assert_eq!(hdf5.samples, csv.samples);
                assert_eq!(hdf5.angle_rev, csv.angle_rev);
                csv.capture.object.clone_from(&hdf5.capture.object);
                // A column of 0 and 1 gives a mark to half a sample.
                csv.capture.marks_within_samples = hdf5.capture.marks_within_samples;
                assert_eq!(hdf5.capture, csv.capture);
            }
        }
    }
}
