//! The files of a measurement, and the samples of each.

use std::path::PathBuf;

use runout_core::{
    Error, Result,
    encoder::EncoderScan,
    measurement::{Block, Capture, Recording, SampleStream, StationKey},
    rig::Rig,
};

use crate::{
    config::Stated,
    header::Header,
    rows::Rows,
    scan::{BLOCK_SAMPLES, Scan},
};

/// Readings of a file that are kept from the first look at it, at most: 32 MiB. A file that has more is read twice.
const MOST_KEPT: usize = 1 << 22;

/// Sampling rates that differ by a smaller share are the same: a time column's rounding.
const SAME_RATE: f64 = 1e-3;

/// The files of a measurement.
pub(crate) struct CsvRecording {
    rig: Rig,
    stations: Vec<StationKey>,
    /// `[station][setup]`.
    paths: Vec<Vec<PathBuf>>,
    stated: Stated,
    remarks: Vec<String>,
    most_kept: usize,
}

impl CsvRecording {
    /// Looks at every file's header.
    pub(crate) fn open(rig: &Rig, stations: Vec<StationKey>, paths: Vec<Vec<PathBuf>>, stated: Stated) -> Result<Self> {
        let mut remarks = Vec::new();
        let mut unknown: Vec<String> = Vec::new();
        for path in paths.iter().flatten() {
            let (header, _) = Header::open(path, rig)?;
            remarks.extend(header.remarks);
            for name in header.unknown {
                if !unknown.contains(&name) {
                    unknown.push(name);
                }
            }
        }
        if !unknown.is_empty() {
            remarks.push(format!("columns that the rig does not name: {}", unknown.join(", ")));
        }
        Ok(Self { rig: rig.clone(), stations, paths, stated, remarks, most_kept: MOST_KEPT })
    }
}

impl Recording for CsvRecording {
    fn stations(&self) -> &[StationKey] {
        &self.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let path = self.paths.get(station).and_then(|setups| setups.get(setup));
        let (Some(key), Some(path)) = (self.stations.get(station), path) else {
            return Err(Error::new("open", format!("station {station} in setup {setup}"), "there is no such file"));
        };
        let mut rows = Rows::open(path, &self.rig)?;
        let mut scan = Scan::of(&mut rows, self.most_kept)?;
        let header = &rows.header;
        let sample_rate_hz = match (self.stated.sample_rate_hz, scan.sample_rate_hz) {
            (Some(stated), Some(found)) if (found / stated - 1.0).abs() > SAME_RATE => {
                return Err(Error::new(
                    "read",
                    &header.shown,
                    format!("`time_s` gives {found} Hz, the configuration {stated} Hz"),
                )
                .help("leave `sample_rate_hz` out of [load], or correct it"));
            }
            (stated, found) => stated.or(found),
        };
        let capture = Capture {
            object: header.shown.clone(),
            setup,
            station: key.name.clone(),
            z_mm: key.z_mm,
            stated_speed_rpm: self.stated.speed_rpm,
            sample_rate_hz,
            samples: scan.samples,
            sensors: (0..self.rig.sensors.len()).collect(),
            sensor_ids: self.rig.sensors.iter().map(|sensor| sensor.id.clone()).collect(),
            converter_limits_um: None,
            marks: scan.marks.clone(),
            encoder: scan.encoder.is_some(),
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        if let Some(kept) = scan.kept.take() {
            return Ok(Box::new(KeptStream { capture, blocks: kept.into_iter(), encoder: scan.encoder }));
        }
        let rows = Rows::open(path, &self.rig)?;
        Ok(Box::new(CsvStream { capture, rows, encoder: scan.encoder, next: 0 }))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.paths.iter().flatten().cloned().collect()
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// A file's samples in memory.
struct KeptStream {
    capture: Capture,
    blocks: std::vec::IntoIter<Block>,
    encoder: Option<EncoderScan>,
}

impl SampleStream for KeptStream {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        let Some(next) = self.blocks.next() else { return Ok(false) };
        *block = next;
        if let Some(encoder) = &self.encoder {
            for angle in &mut block.angle_rev {
                *angle = encoder.turns(*angle);
            }
        }
        Ok(true)
    }
}

/// The second pass over a file.
struct CsvStream {
    capture: Capture,
    rows: Rows,
    encoder: Option<EncoderScan>,
    next: u64,
}

impl SampleStream for CsvStream {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        // Not cleared: what is written over needs no zeros.
        let mut samples = std::mem::take(&mut block.samples);
        block.clear();
        block.start = self.next;
        let channels = self.capture.channels();
        samples.resize(BLOCK_SAMPLES * channels, 0.0);
        let mut filled = 0;
        for frame in samples.chunks_exact_mut(channels.max(1)) {
            let Some(instant) = self.rows.next(frame)? else { break };
            if let Some(encoder) = &self.encoder {
                block.angle_rev.push(encoder.turns(instant.phase));
            }
            filled += 1;
        }
        samples.truncate(filled * channels);
        block.samples = samples;
        self.next += filled as u64;
        let ended = filled < BLOCK_SAMPLES;
        if self.next > self.capture.samples || (ended && self.next != self.capture.samples) {
            let problem = format!("it had {} rows at first and {} now", self.capture.samples, self.next);
            return Err(Error::new("read", &self.rows.header.shown, problem).help("something writes to it"));
        }
        Ok(filled > 0)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::fmt::Write as _;

    use runout_core::rig::{RigConfig, Rotation, SensorConfig, SetupConfig};

    use super::*;

    fn rig() -> Rig {
        let sensor =
            |id: &str, sign| SensorConfig { id: id.into(), angle_deg: 0.0, z_mm: 0.0, section: id.into(), sign };
        let config = RigConfig {
            interruptions: Vec::new(),
            part_radius_mm: 30.0,
            rotation: Rotation::Ccw,
            sensors: vec![sensor("S1", 1), sensor("S2", -1)],
            setups: vec![SetupConfig { id: "one".into(), part_deg: 0.0, sensors_deg: 0.0 }],
        };
        config.check().unwrap()
    }

    /// Capture, readings and angles, and in how many blocks they came.
    fn read(text: &str, most_kept: usize) -> Result<(Capture, Vec<f64>, Vec<f64>, usize)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        std::fs::write(&path, text).unwrap();
        let station = StationKey { name: "s".into(), z_mm: 0.0 };
        let stated = Stated { sample_rate_hz: None, speed_rpm: None };
        let mut recording = CsvRecording::open(&rig(), vec![station], vec![vec![path]], stated)?;
        recording.most_kept = most_kept;
        let mut stream = recording.open(0, 0)?;
        let (mut samples, mut angles, mut block, mut blocks) = (Vec::new(), Vec::new(), Block::default(), 0);
        while stream.next_block(&mut block)? {
            assert_eq!(block.start as usize * 2, samples.len());
            samples.append(&mut block.samples);
            angles.append(&mut block.angle_rev);
            blocks += 1;
        }
        let capture = Capture { object: String::new(), ..stream.capture().clone() };
        Ok((capture, samples, angles, blocks))
    }

    #[test]
    fn a_file_that_is_kept_and_one_that_is_read_twice_are_the_same() {
        let rows = 2 * BLOCK_SAMPLES + 100;
        for phase in ["index", "angle_deg"] {
            let mut text = format!("time_s;S2;other;{phase};S1\n");
            for row in 0..rows {
                let phase = if phase == "index" { f64::from(u8::from(row % 500 == 3)) } else { 0.72 * row as f64 };
                let reading = (0.01 * row as f64).sin();
                writeln!(text, "{:.4};{reading:.6};\"a;b\";{phase};{:.3}", 1e-4 * row as f64, -reading).unwrap();
            }
            let kept = read(&text, MOST_KEPT).unwrap();
            assert_eq!((kept.1.len(), kept.3), (2 * rows, 3));
            assert_eq!(kept.2.len(), if phase == "index" { 0 } else { rows });
            assert_eq!(kept.0.marks.len(), rows / 500 + 1);
            for most_kept in [0, 1001] {
                assert!(read(&text, most_kept).unwrap() == kept, "{phase}, {most_kept} kept");
            }
        }
    }

    /// What a recorder leaves that lost its power, also before any row has told the decimal mark.
    #[test]
    fn zero_bytes_are_no_number() {
        for row in ["1;2;0\0", "1\0;2;0", "1\x005;2;0", "\0\0\0\0"] {
            for most_kept in [MOST_KEPT, 0] {
                let error =
                    read(&format!("S1;S2;index\n1;2;0\n{row}\n"), most_kept).map(|_| ()).unwrap_err().to_string();
                assert!(error.contains("line 3"), "{row:?}: {error}");
            }
        }
    }

    #[test]
    fn mistakes_are_the_same_either_way() {
        for row in ["1.0,2.0", "1.0,2.0,0,4.0", "x,2.0,0", "1.0,2.0,", "1.0,2.0,7", "", "1.0,2.0,\"0"] {
            let text = format!("S1,S2,index\n1.0,2.0,0\n{row}\n1.0,2.0,1\n");
            let told = |most_kept| {
                let error = read(&text, most_kept).map(|_| ()).unwrap_err().to_string();
                error.rsplit("x.csv").next().map(str::to_owned)
            };
            assert_eq!(told(MOST_KEPT), told(0), "{row}");
        }
    }
}
