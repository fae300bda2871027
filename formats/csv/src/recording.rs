//! The files of a measurement, and the samples of each.

use std::path::PathBuf;

use runout_core::{
    Error, Result,
    measurement::{Block, Capture, Recording, SampleStream, StationKey},
    rig::Rig,
};

use crate::{
    config::Stated,
    header::Header,
    lines::{Line, Lines, split},
    number,
    scan::{Rows, Scan, ragged},
};

/// Instants in a block: four channels of f64 then take 512 KiB, which a core's own cache holds.
const BLOCK_SAMPLES: usize = 16_384;

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
        Ok(Self { rig: rig.clone(), stations, paths, stated, remarks })
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
        let (header, mut lines) = Header::open(path, &self.rig)?;
        let scan = Scan::of(&header, &mut lines)?;
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
        let (header, lines) = Header::open(path, &self.rig)?;
        let mut roles = vec![Role::Skip; header.names.len()];
        for (channel, (column, sensor)) in header.sensors.iter().zip(&self.rig.sensors).enumerate() {
            roles[*column] = Role::Sensor { channel, sign: sensor.sign };
        }
        if scan.encoder.is_some() {
            roles[header.phase.column()] = Role::Angle;
        }
        Ok(Box::new(CsvStream { capture, header, lines, roles, scan, rows: Rows::default(), next: 0 }))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.paths.iter().flatten().cloned().collect()
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// What a column is read for.
#[derive(Debug, Clone, Copy)]
enum Role {
    Sensor { channel: usize, sign: f64 },
    Angle,
    Skip,
}

/// The second pass over a file.
struct CsvStream {
    capture: Capture,
    header: Header,
    lines: Lines,
    roles: Vec<Role>,
    scan: Scan,
    rows: Rows,
    next: u64,
}

impl SampleStream for CsvStream {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        block.start = self.next;
        let channels = self.capture.channels();
        let mut filled = 0;
        while filled < BLOCK_SAMPLES {
            let Some(line) = self.lines.next()? else { break };
            if self.rows.ends_at(&line, &self.header)? {
                continue;
            }
            let begin = block.samples.len();
            block.samples.resize(begin + channels, f64::NAN);
            let row = Row { header: &self.header, roles: &self.roles, decimal: self.scan.decimal };
            let angle_deg = row.read(line, &mut block.samples[begin..])?;
            if let Some(encoder) = &self.scan.encoder {
                block.angle_rev.push(encoder.turns(angle_deg));
            }
            filled += 1;
        }
        self.next += filled as u64;
        let ended = filled < BLOCK_SAMPLES;
        if self.next > self.scan.samples || (ended && self.next != self.scan.samples) {
            let problem = format!("it had {} rows at first and {} now", self.scan.samples, self.next);
            return Err(Error::new("read", &self.header.shown, problem).help("something writes to it"));
        }
        Ok(filled > 0)
    }
}

/// How a row is read.
struct Row<'a> {
    header: &'a Header,
    roles: &'a [Role],
    decimal: u8,
}

impl Row<'_> {
    /// Fills the channels and gives the encoder's angle, where there is one.
    fn read(&self, line: Line, channels: &mut [f64]) -> Result<f64> {
        let delimiter = self.header.delimiter;
        let mut angle_deg = f64::NAN;
        let mut rest = Some(line.bytes);
        for (column, role) in self.roles.iter().enumerate() {
            let Some(bytes) = rest else { return Err(ragged(self.header, line.number, column)) };
            if let Role::Skip = role {
                rest = split(bytes, delimiter).1;
                continue;
            }
            let value = match number::leading(bytes, self.decimal) {
                Some((value, length)) if length == bytes.len() => {
                    rest = None;
                    value
                }
                Some((value, length)) if bytes[length] == delimiter => {
                    rest = Some(&bytes[length + 1..]);
                    value
                }
                _ => {
                    let (cell, after) = split(bytes, delimiter);
                    rest = after;
                    number::of_cell(cell, self.decimal)
                        .ok_or_else(|| self.header.no_number(line.number, column, cell, self.decimal))?
                }
            };
            match role {
                Role::Sensor { channel, sign } => channels[*channel] = value * sign,
                Role::Angle => angle_deg = value,
                Role::Skip => {}
            }
        }
        match rest {
            // Some programs end each row with a delimiter.
            Some(bytes) if !bytes.trim_ascii().is_empty() => {
                let more = memchr::memchr_iter(delimiter, bytes).count() + 1;
                Err(ragged(self.header, line.number, self.roles.len() + more))
            }
            _ => Ok(angle_deg),
        }
    }
}
