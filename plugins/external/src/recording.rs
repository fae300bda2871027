//! A loader of recordings: what captures there are in, then their samples block by block.

use std::{collections::HashMap, path::PathBuf, sync::Arc};

use runout_core::{
    Error, Result,
    input_file::InputFile,
    measurement::{Block, Capture, Recording, SampleStream, StationKey},
    rig::Rig,
    stage::{Loader, Request, Source, SourceKind},
    table::{ColumnSpec, TableSpec, counts, texts},
};
use serde_json::Value;

use crate::{
    answer::Answer,
    frame::Frame,
    responder::Responder,
    session::Session,
    tables::{Table, encode},
    turns::rig_of,
};

/// Samples of one request, of all channels together.
const BLOCK: u64 = 1 << 18;
const CAPTURES: [&str; 6] = ["station", "z_mm", "setup", "samples", "sample_rate_hz", "speed_rpm"];
const MARKS: [&str; 3] = ["station", "setup", "at"];

/// What reads recordings of a format of its own.
pub(crate) struct ExternalRecordings {
    pub responder: Responder,
    pub config: Value,
    pub path: PathBuf,
}

impl Loader for ExternalRecordings {
    fn kind(&self) -> SourceKind {
        SourceKind::Turns
    }

    fn open(&self, wanted: &Request) -> Result<Source> {
        let object = self.path.display().to_string();
        let rig = wanted.rig.ok_or_else(|| Error::new("read", &object, "recorded turns need a [rig]"))?;
        let input = InputFile::new(&self.path)?;
        let path = std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone());
        let about = [
            ("stage", "load-samples".to_owned()),
            ("config", self.config.to_string()),
            ("path", path.display().to_string()),
            ("rig", rig_of(rig).to_string()),
        ];
        let session = Session::new(self.responder.clone());
        let column = ColumnSpec::name("sensor", "id of a sensor whose samples are wanted");
        let spec = TableSpec::new("sensors", "sensors of the rig", vec![column]);
        let sensors = texts(rig.sensors.iter().map(|sensor| &sensor.id));
        let request = request(&spec, vec![sensors], &about)?;
        let found = session.answer(("read", &object), request, |answer| listed(answer, rig, &object))?;
        Ok(Source::Turns(Box::new(ExternalRecording { found, session: Arc::new(session), about, input, object })))
    }
}

fn request(
    spec: &TableSpec,
    columns: Vec<runout_core::table::ArrayRef>,
    about: &[(&'static str, String)],
) -> Result<Vec<u8>> {
    let frame = encode(&spec.name, &spec.rows(columns)?, about);
    let frame = frame.map_err(|error| Error::caused("write", format!("the table {}", spec.name), error))?;
    let mut request = Vec::new();
    frame.append_to(&mut request);
    Frame::end().append_to(&mut request);
    Ok(request)
}

/// What a recording has.
struct Listed {
    stations: Vec<StationKey>,
    /// Ids of the rig's.
    setups: Vec<String>,
    /// Of the rig's sensors.
    signs: Vec<f64>,
    /// `[station][setup]` of the rig.
    captures: Vec<Capture>,
    remarks: Vec<String>,
}

/// A recording that is read through a session.
struct ExternalRecording {
    found: Listed,
    session: Arc<Session>,
    about: [(&'static str, String); 4],
    input: InputFile,
    object: String,
}

impl Recording for ExternalRecording {
    fn stations(&self) -> &[StationKey] {
        &self.found.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let capture = self.found.captures.get(station * self.found.setups.len() + setup);
        let capture = capture.ok_or_else(|| Error::new("read", &self.object, "there is no such capture"))?;
        Ok(Box::new(ExternalStream { recording: self, capture, next: 0 }))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        vec![self.input.path().to_owned()]
    }

    fn opened(&self) -> Result<Vec<InputFile>> {
        Ok(vec![self.input.clone()])
    }

    fn remarks(&self) -> Vec<String> {
        self.found.remarks.clone()
    }
}

/// The captures of an answer, those of the rig's setups.
fn listed(answer: &[Frame], rig: &Rig, object: &str) -> std::result::Result<Listed, String> {
    let answer = Answer::of(answer, &["captures", "marks"])?;
    let table = Table::decode(answer.table("captures").ok_or("gave no table `captures`")?, &CAPTURES)?;
    let [station, setup] = ["station", "setup"].map(|name| filled(&table, name, table.texts(name)));
    let (station, setup) = (station?, setup?);
    let z_mm = filled(&table, "z_mm", table.numbers("z_mm"))?;
    let samples = filled(&table, "samples", table.counts("samples"))?;
    let [rate, speed] = ["sample_rate_hz", "speed_rpm"].map(|name| table.numbers(name));
    let (rate, speed) = (rate?, speed?);
    let mut marks = marks(&answer)?;
    let mut stations: Vec<StationKey> = Vec::new();
    let mut rows: HashMap<(usize, &str), usize> = HashMap::new();
    for row in 0..table.count() {
        let known = stations.iter().position(|known| known.name == station[row]);
        if known.is_some_and(|known| stations[known].z_mm.to_bits() != z_mm[row].to_bits()) {
            return Err(format!("gave station {} at two places `z_mm`", station[row]));
        }
        let at = known.unwrap_or_else(|| {
            stations.push(StationKey { name: station[row].clone(), z_mm: z_mm[row] });
            stations.len() - 1
        });
        if rows.insert((at, &setup[row]), row).is_some() {
            return Err(format!("gave the capture of station {} in setup {} twice", station[row], setup[row]));
        }
    }
    if stations.is_empty() {
        return Err("gave no captures".into());
    }
    let mut captures = Vec::new();
    for (at, key) in stations.iter().enumerate() {
        for (index, id) in rig.setups.iter().map(|setup| &setup.id).enumerate() {
            let Some(row) = rows.get(&(at, id.as_str())).copied() else {
                return Err(format!("gave no capture of station {} in setup {id}, which the rig has", key.name));
            };
            let number = |column: &Option<Vec<Option<f64>>>| column.as_ref().and_then(|column| column[row]);
            let (sample_rate_hz, stated_speed_rpm) = (number(&rate), number(&speed));
            let where_it_is = format!("the capture of station {} in setup {id}", key.name);
            if u32::try_from(samples[row]).is_err() {
                return Err(format!(
                    "gave {where_it_is} with {} samples: up to {} can be asked for",
                    samples[row],
                    u32::MAX
                ));
            }
            if sample_rate_hz.is_some_and(|rate| rate <= 0.0) {
                return Err(format!("gave {where_it_is} with a sampling rate that is not above 0"));
            }
            let marks = marks.remove(&(key.name.clone(), id.clone())).unwrap_or_default();
            if !marks.is_sorted_by(|one, next| one < next) {
                return Err(format!("gave {where_it_is} with marks that do not ascend"));
            }
            captures.push(Capture {
                object: format!("{object}:/{id}/{}", key.name),
                setup: index,
                station: key.name.clone(),
                z_mm: key.z_mm,
                stated_speed_rpm,
                sample_rate_hz,
                samples: samples[row] as u64,
                sensors: (0..rig.sensors.len()).collect(),
                sensor_ids: rig.sensors.iter().map(|sensor| sensor.id.clone()).collect(),
                converter_limits_um: None,
                marks,
                marks_within_samples: 0.0,
                encoder: false,
                trimmed: Vec::new(),
                responses: Vec::new(),
            });
        }
    }
    let mut remarks = answer.warnings;
    let mut unused: Vec<&String> = setup.iter().filter(|id| !rig.setups.iter().any(|setup| setup.id == **id)).collect();
    unused.sort_unstable();
    unused.dedup();
    remarks.extend(unused.iter().map(|id| format!("the setup `{id}` of the recording is not in the rig: not used")));
    let setups = rig.setups.iter().map(|setup| setup.id.clone()).collect();
    let signs = rig.sensors.iter().map(|sensor| sensor.sign).collect();
    Ok(Listed { stations, setups, signs, captures, remarks })
}

/// A column that must be there, without nulls.
fn filled<T>(
    table: &Table,
    name: &str,
    found: std::result::Result<Option<Vec<Option<T>>>, String>,
) -> std::result::Result<Vec<T>, String> {
    let cells: Option<Vec<T>> = table.needed(name, found)?.into_iter().collect();
    cells.ok_or_else(|| format!("gave captures or marks with a null in the column `{name}`"))
}

/// Sample positions at which turns begin, by station and setup.
fn marks(answer: &Answer) -> std::result::Result<HashMap<(String, String), Vec<f64>>, String> {
    let table = Table::decode(answer.table("marks").ok_or("gave no table `marks`")?, &MARKS)?;
    let [station, setup] = ["station", "setup"].map(|name| filled(&table, name, table.texts(name)));
    let at = filled(&table, "at", table.numbers("at"))?;
    let mut marks: HashMap<(String, String), Vec<f64>> = HashMap::new();
    for ((station, setup), at) in station?.into_iter().zip(setup?).zip(at) {
        marks.entry((station, setup)).or_default().push(at);
    }
    Ok(marks)
}

/// The samples of a capture, a request a block.
struct ExternalStream<'a> {
    recording: &'a ExternalRecording,
    capture: &'a Capture,
    next: u64,
}

impl SampleStream for ExternalStream<'_> {
    fn capture(&self) -> &Capture {
        self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        block.clear();
        let count = (BLOCK / self.capture.channels().max(1) as u64).max(1).min(self.capture.samples - self.next);
        block.start = self.next;
        if count == 0 {
            return Ok(false);
        }
        let columns = [("station", "name of the station"), ("setup", "id of the setup")];
        let mut columns: Vec<ColumnSpec> = columns.map(|(name, about)| ColumnSpec::name(name, about)).into();
        columns.push(ColumnSpec::count("first", "", "number of the first sample, from 0"));
        columns.push(ColumnSpec::count("count", "", "how many"));
        let spec = TableSpec::new("block", "samples that are wanted", columns);
        let found = &self.recording.found;
        let cells = vec![
            texts([&self.capture.station]),
            texts([&found.setups[self.capture.setup]]),
            counts([self.next as usize]),
            counts([count as usize]),
        ];
        let request = request(&spec, cells, &self.recording.about)?;
        let (ids, object) = (&self.capture.sensor_ids, &self.capture.object);
        let answered = self
            .recording
            .session
            .answer(("read", object), request, |answer| samples(answer, ids, count as usize, &mut block.samples));
        answered?;
        if found.signs.iter().any(|sign| *sign < 0.0) {
            for row in block.samples.chunks_exact_mut(found.signs.len()) {
                row.iter_mut().zip(&found.signs).for_each(|(value, sign)| *value *= sign);
            }
        }
        self.next += count;
        Ok(true)
    }
}

/// Puts a block's samples side by side; a null is a sample that is not known.
fn samples(answer: &[Frame], ids: &[String], count: usize, into: &mut Vec<f64>) -> std::result::Result<(), String> {
    let answer = Answer::of(answer, &["samples"])?;
    let names: Vec<&str> = ids.iter().map(String::as_str).collect();
    let table = Table::decode(answer.table("samples").ok_or("gave no table `samples`")?, &names)?;
    if table.count() != count {
        return Err(format!("gave {} samples, where {count} were asked for", table.count()));
    }
    into.resize(count * ids.len(), f64::NAN);
    for (channel, id) in names.iter().enumerate() {
        let values = table.needed(id, table.numbers(id))?;
        for (place, value) in into.iter_mut().skip(channel).step_by(ids.len()).zip(values) {
            *place = value.unwrap_or(f64::NAN);
        }
    }
    Ok(())
}
