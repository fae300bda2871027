//! The files of a measurement, and the samples of each.

use std::{num::NonZeroUsize, path::PathBuf};

use runout_core::{
    Error, ErrorKind, Result,
    encoder::EncoderScan,
    input_file::InputFile,
    measurement::{Block, Capture, Recording, SampleStream, StationKey},
    rig::Rig,
};

use crate::{
    header::{Header, Phase},
    rows::{Piece, Rows},
    scan::Scan,
    stated::Stated,
};

/// Readings of a file that are kept from the first pass, at most: 32 MiB. A file that has more is read twice.
const MOST_KEPT: usize = 1 << 22;

/// Sampling rates that differ by a smaller share are the same: a time column's rounding.
const SAME_RATE: f64 = 1e-3;

/// The files of a measurement.
pub(crate) struct CsvRecording {
    rig: Rig,
    stations: Vec<StationKey>,
    /// `[station][setup]`.
    files: Vec<Vec<InputFile>>,
    stated: Stated,
    remarks: Vec<String>,
    most_kept: usize,
}

/// What a column of marks leaves open between setups.
const MARKS_AT_WHOLE_SAMPLES: &str = "marks of a column `index` are at whole samples: half a sample is not known of the angle between two \
    setups. The stated uncertainties include it; an encoder's angle, a trace of the mark, or fractional marks (HDF5) make them smaller";

impl CsvRecording {
    /// Examines every file's header.
    pub(crate) fn open(rig: &Rig, stations: Vec<StationKey>, paths: &[Vec<PathBuf>], stated: Stated) -> Result<Self> {
        let mut remarks = Vec::new();
        let mut unknown: Vec<String> = Vec::new();
        let mut at_whole_samples = false;
        let remember = |paths: &Vec<PathBuf>| paths.iter().map(|path| InputFile::new(path)).collect();
        let files: Vec<Vec<InputFile>> = paths.iter().map(remember).collect::<Result<_>>()?;
        for file in files.iter().flatten() {
            let (header, ..) = Header::open(file, rig, stated.marker.as_ref())?;
            remarks.extend(header.remarks);
            at_whole_samples |= matches!(header.phase, Phase::Index(_));
            for name in header.unknown {
                if !unknown.contains(&name) {
                    unknown.push(name);
                }
            }
        }
        if !unknown.is_empty() {
            remarks.push(format!("columns that the rig does not name: {}", unknown.join(", ")));
        }
        if at_whole_samples && rig.setups.len() > 1 {
            remarks.push(MARKS_AT_WHOLE_SAMPLES.into());
        }
        Ok(Self { rig: rig.clone(), stations, files, stated, remarks, most_kept: MOST_KEPT })
    }
}

impl Recording for CsvRecording {
    fn stations(&self) -> &[StationKey] {
        &self.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        self.open_with(NonZeroUsize::MIN, station, setup)
    }

    fn open_with(&self, threads: NonZeroUsize, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let file = self.files.get(station).and_then(|setups| setups.get(setup));
        let (Some(key), Some(file)) = (self.stations.get(station), file) else {
            return Err(Error::new("open", format!("station {station} in setup {setup}"), "there is no such file")
                .of(ErrorKind::MissingFile));
        };
        let marker = self.stated.marker.as_ref();
        let rows = Rows::open(file, &self.rig, marker)?;
        let shown = rows.format.header.shown.clone();
        let mut scan = Scan::of(rows, marker, threads, self.most_kept)?;
        let sample_rate_hz = match (self.stated.sample_rate_hz, scan.sample_rate_hz) {
            (Some(stated), Some(found)) if (found / stated - 1.0).abs() > SAME_RATE => {
                return Err(Error::new(
                    "read",
                    shown,
                    format!("`time_s` gives {found} Hz, the configuration {stated} Hz"),
                )
                .help("leave `sample_rate_hz` out of [load], or correct it"));
            }
            (stated, found) => stated.or(found),
        };
        let capture = Capture {
            object: shown,
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
            marks_within_samples: scan.within_samples,
            encoder: scan.encoder.is_some(),
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        if let Some(kept) = scan.kept.take() {
            return Ok(Box::new(KeptStream { capture, blocks: kept.into_iter(), encoder: scan.encoder }));
        }
        let rows = Rows::open(file, &self.rig, marker)?;
        Ok(Box::new(CsvStream { capture, rows, piece: Piece::default(), encoder: scan.encoder, next: 0 }))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.files.iter().flatten().map(|file| file.path().to_owned()).collect()
    }

    fn opened(&self) -> Result<Vec<InputFile>> {
        Ok(self.files.iter().flatten().cloned().collect())
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
    piece: Piece,
    encoder: Option<EncoderScan>,
    next: u64,
}

impl SampleStream for CsvStream {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        // What is written over needs no zeros.
        self.piece.samples = Some(std::mem::take(&mut block.samples));
        block.clear();
        block.start = self.next;
        let more = self.rows.next(&mut self.piece)?;
        if more {
            block.samples = self.piece.samples.take().unwrap_or_default();
            if let Some(encoder) = &self.encoder {
                block.angle_rev.extend(self.piece.phases().map(|angle_deg| encoder.turns(angle_deg)));
            }
            self.next += self.piece.instants.len() as u64;
        }
        if self.next > self.capture.samples || (!more && self.next != self.capture.samples) {
            let problem = format!("it had {} rows at first and {} now", self.capture.samples, self.next);
            return Err(Error::new("read", &self.rows.format.header.shown, problem).help("something writes to it"));
        }
        Ok(more && !block.samples.is_empty())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::fmt::Write as _;

    use runout_core::rig::{RigConfig, Rotation, SensorConfig, SetupConfig};

    use super::*;

    fn rig() -> Rig {
        let sensor = |id: &str, sign| SensorConfig {
            id: id.into(),
            angle_deg: 0.0,
            z_mm: 0.0,
            section: id.into(),
            sign,
            ..SensorConfig::default()
        };
        let config = RigConfig {
            interruptions: Vec::new(),
            bearings: Vec::new(),
            part_radius_mm: 30.0,
            rotation: Rotation::Ccw,
            sensors: vec![sensor("S1", 1), sensor("S2", -1)],
            setups: vec![SetupConfig { id: "one".into(), ..SetupConfig::default() }],
        };
        config.check().unwrap()
    }

    /// How a file is read: with how many threads, and how many readings are kept from the first look.
    const WAYS: [(usize, usize); 7] =
        [(1, MOST_KEPT), (1, 0), (1, 40_001), (2, MOST_KEPT), (2, 40_001), (3, 0), (7, MOST_KEPT)];

    /// Capture, readings and angles.
    fn read(text: &str, (threads, most_kept): (usize, usize)) -> Result<(Capture, Vec<f64>, Vec<f64>)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        std::fs::write(&path, text).unwrap();
        let station = StationKey { name: "s".into(), z_mm: 0.0 };
        let stated = Stated::default();
        let mut recording = CsvRecording::open(&rig(), vec![station], &[vec![path]], stated)?;
        recording.most_kept = most_kept;
        let mut stream = recording.open_with(NonZeroUsize::new(threads).unwrap(), 0, 0)?;
        let (mut samples, mut angles, mut block) = (Vec::new(), Vec::new(), Block::default());
        while stream.next_block(&mut block)? {
            assert_eq!(block.start as usize * 2, samples.len());
            samples.append(&mut block.samples);
            angles.append(&mut block.angle_rev);
        }
        let capture = Capture { object: String::new(), ..stream.capture().clone() };
        Ok((capture, samples, angles))
    }

    /// The problem, without the name of the file.
    fn problem(text: &str, way: (usize, usize)) -> String {
        let error = read(text, way).map(|_| ()).unwrap_err().to_string();
        error.rsplit("x.csv").next().unwrap().to_owned()
    }

    /// Rows that are some stretches of text, and their readings. Whole numbers leave open for long what the decimal mark is.
    fn long(phase: &str, whole: usize) -> (String, Vec<f64>) {
        let mut text = format!("time_s;S2;other;{phase};S1\n");
        let mut samples = Vec::new();
        for row in 0..ROWS {
            let phase = if phase == "index" { f64::from(u8::from(row % 500 == 3)) } else { 72.0 * row as f64 };
            let reading = if row < whole { (row % 100) as f64 } else { (row % 1000) as f64 / 8.0 };
            let written = reading.to_string().replace('.', ",");
            writeln!(text, "{row};{written};\"a;b\";{phase};-{row}").unwrap();
            samples.extend([-(row as f64), -reading]);
        }
        (text, samples)
    }

    const ROWS: usize = 40_000;

    #[test]
    fn however_a_file_is_read_it_is_the_same() {
        for (phase, whole) in [("index", 0), ("angle_deg", 0), ("index", ROWS - 100)] {
            let (text, samples) = long(phase, whole);
            for way in WAYS {
                let (capture, found, angles) = read(&text, way).unwrap();
                assert!(found == samples, "{phase}, {way:?}");
                let turns = if phase == "index" { ROWS / 500 } else { ROWS / 5 };
                assert_eq!((capture.samples, capture.marks.len()), (ROWS as u64, turns), "{way:?}");
                assert_eq!(capture.sample_rate_hz, Some(1.0));
                assert_eq!(angles.len(), if phase == "index" { 0 } else { ROWS });
                assert!(angles.iter().enumerate().all(|(row, angle)| (angle - 0.2 * row as f64).abs() < 1e-9));
            }
        }
    }

    /// What a recorder leaves that lost its power, also before any row has shown the decimal mark.
    #[test]
    fn zero_bytes_are_no_number() {
        for row in ["1;2;0\0", "1\0;2;0", "1\x005;2;0", "\0\0\0\0"] {
            for way in WAYS {
                let problem = problem(&format!("S1;S2;index\n1;2;0\n{row}\n"), way);
                assert!(problem.contains("line 3"), "{row:?}: {problem}");
            }
        }
    }

    #[test]
    fn mistakes_are_the_same_however_a_file_is_read() {
        for row in ["1.0,2.0", "1.0,2.0,0,4.0", "x,2.0,0", "1.0,2.0,", "1.0,2.0,7", "", "1.0,2.0,\"0"] {
            let text = format!("S1,S2,index\n1.0,2.0,0\n{row}\n1.0,2.0,1\n");
            for way in WAYS {
                assert_eq!(problem(&text, way), problem(&text, WAYS[0]), "{row}, {way:?}");
            }
        }
    }

    /// Wherever a stretch of text ends: of two mistakes the first one is reported, with its line.
    #[test]
    fn the_first_mistake_is_reported_with_its_line() {
        let (text, _) = long("index", 0);
        let lines: Vec<&str> = text.lines().collect();
        for (line, row, words) in [
            (17_000, "16998;1;;0;x", "expected a number"),
            (17_001, "16999;1;;3;1", "expected 0 or 1, found 3"),
            (17_002, "16999;1;;0;1", "expected a time above"),
            (17_003, "", "expected a row, found a blank line between rows"),
            (ROWS, "1;2", "expected 5 cells as in the header, found 2"),
        ] {
            let mut lines = lines.clone();
            lines[line - 1] = row;
            if line < ROWS {
                lines[line + 12_000] = "something else";
            }
            let text = lines.join("\n");
            for way in WAYS {
                // Cells of readings are not examined where they are not kept: that is left to the second pass.
                let problem = problem(&text, way);
                let reported = problem.starts_with(&format!(", line {line}")) && problem.contains(words);
                let later = row.ends_with('x') && problem.starts_with(&format!(", line {}", line + 12_001));
                assert!(reported || (later && way.1 < MOST_KEPT), "{line}, {way:?}: {problem}");
            }
        }
    }

    #[test]
    fn a_mistake_before_a_line_without_end_is_reported_first() {
        let (text, _) = long("index", 0);
        let mut lines: Vec<&str> = text.lines().collect();
        let endless = "1".repeat(3 << 20);
        lines[20_000] = &endless;
        let endless = lines.join("\n");
        lines[17_000] = "16999;1;;3;1";
        let both = lines.join("\n");
        for way in WAYS {
            let problem = [&endless, &both].map(|text| problem(text, way));
            assert_eq!(problem[0], ", line 20001: expected a line end within 1048576 bytes", "{way:?}");
            assert!(problem[1].starts_with(", line 17001, column 4"), "{way:?}: {}", problem[1]);
        }
    }

    /// Blank lines may end a file, whether a line end ends them or not, and however many there are.
    #[test]
    fn blank_lines_at_the_end_are_passed_over() {
        for end in ["", "\n", "\r\n\r\n", "\n \t\n   "] {
            let text = format!("S1,S2,index\n1.5,2,0\n3,4,1{end}");
            assert_eq!(read(&text, WAYS[0]).unwrap().1, [1.5, -2.0, 3.0, -4.0], "{end:?}");
        }
        let text = format!("S1,S2,index\n1.5,2,0\n{}", "\n".repeat(1 << 20));
        for way in WAYS {
            assert_eq!(read(&text, way).unwrap().1, [1.5, -2.0]);
            let text = format!("{text}1.5,2,0");
            assert_eq!(problem(&text, way), ", line 3: expected a row, found a blank line between rows");
        }
    }
}
