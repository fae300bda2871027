//! CSV files as programs write them, and as they should not be.
//!
//! Long because each test is one file of another program.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::{fmt::Write as _, fs, io::Write as _, path::Path};

use runout_core::{
    Result,
    marker::{Edge, Marker},
    measurement::{Block, Capture, Recording},
    pipeline::{Context, StageConfig},
    rig::{Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
    stage::{Request, Source},
};
use runout_csv::{CsvConfig, FileConfig, StationConfig};

/// Sensors `S1` and, turned round, `Fühler`.
fn rig(setups: &[&str]) -> Rig {
    let sensor = |id: &str, sign| SensorConfig {
        id: id.into(),
        angle_deg: 0.0,
        z_mm: 0.0,
        section: id.into(),
        sign,
        ..SensorConfig::default()
    };
    let setup = |id: &&str| SetupConfig { id: (*id).into(), ..SetupConfig::default() };
    let config = RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: Rotation::Ccw,
        sensors: vec![sensor("S1", 1), sensor("Fühler", -1)],
        setups: setups.iter().map(setup).collect(),
    };
    config.check().unwrap()
}

fn config(pattern: Option<&str>) -> CsvConfig {
    CsvConfig {
        stations: vec![StationConfig { name: "s".into(), z_mm: 0.0 }],
        pattern: pattern.map(str::to_owned),
        files: Vec::new(),
        sample_rate_hz: None,
        speed_rpm: None,
        marker: None,
    }
}

fn open(folder: &Path, config: CsvConfig, rig: &Rig) -> Result<Box<dyn Recording>> {
    let loader = config.check(&Context { folder, rig: Some(rig) }).unwrap();
    match loader.open(&Request { rig: Some(rig), columns: &[] })? {
        Source::Turns(recording) => Ok(recording),
        Source::Points(_) => unreachable!("a CSV measurement is of turns"),
    }
}

fn drain(recording: &dyn Recording) -> Result<(Capture, Vec<f64>, Vec<f64>)> {
    let mut stream = recording.open(0, 0)?;
    let (mut samples, mut angle_rev, mut block) = (Vec::new(), Vec::new(), Block::default());
    while stream.next_block(&mut block)? {
        assert_eq!(block.start as usize * 2, samples.len());
        samples.extend_from_slice(&block.samples);
        angle_rev.extend_from_slice(&block.angle_rev);
    }
    Ok((stream.capture().clone(), samples, angle_rev))
}

/// Reads one file of these bytes.
fn read(bytes: impl AsRef<[u8]>) -> Result<(Capture, Vec<f64>, Vec<f64>)> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("x.csv"), bytes).unwrap();
    drain(&*open(folder.path(), config(Some("x.csv")), &rig(&["one"]))?)
}

/// What reading these bytes fails with.
fn refusal(bytes: impl AsRef<[u8]>) -> String {
    read(bytes).map(|_| ()).unwrap_err().to_string()
}

fn expect(found: &str, parts: &[&str]) {
    for part in parts {
        assert!(found.contains(part), "`{part}` is not in: {found}");
    }
}

#[test]
fn delimiters_decimals_and_encodings_are_distinguished() {
    let comma = "S1,index,Fühler\n1.5,0,2\n-0.25,1,.5\n1e-3,0,-7.125\n";
    let semicolon = comma.replace(',', ";");
    let decimal_comma = semicolon.replace('.', ",");
    let tab = decimal_comma.replace(';', "\t");
    let crlf = tab.replace('\n', "\r\n");
    let latin1: Vec<u8> = tab.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect();
    let quoted = semicolon.replace("S1;index;Fühler", "\"S1\";\"index\";\"Fühler\"").replace("1.5", "\"1.5\"");
    let quoted_between_blanks = quoted.replace("\"1.5\"", " \"1.5\" ").replace("-0.25", "  \"-0.25\"");
    let remarked = format!("# a remark; with, all\tof them\n\n#\n{comma}\n\n");
    let padded = comma.replace(',', " , ");
    let ended = semicolon.replace(".5\n", ".5;\n");
    let unended = comma.trim_end();
    let bom = format!("\u{feff}{comma}");
    let quoted = [quoted, quoted_between_blanks];
    let texts = [
        comma,
        &semicolon,
        &decimal_comma,
        &tab,
        &crlf,
        &quoted[0],
        &quoted[1],
        &remarked,
        &padded,
        &ended,
        unended,
        &bom,
    ];
    for bytes in texts.iter().map(|text| text.as_bytes()).chain([latin1.as_slice()]) {
        let (capture, samples, _) = read(bytes).unwrap();
        let shown = String::from_utf8_lossy(bytes);
        assert_eq!(samples, [1.5, -2.0, -0.25, -0.5, 1e-3, 7.125], "{shown}");
        assert_eq!((capture.samples, capture.marks), (3, vec![0.5]), "{shown}");
        assert_eq!(capture.sensor_ids, ["S1", "Fühler"]);
    }
}

#[test]
fn an_empty_cell_is_a_missing_reading() {
    let (_, samples, _) = read("index;S1;Fühler\n0;1;\n1;;2\n").unwrap();
    assert!((samples[0] - 1.0).abs() < 1e-15 && samples[1].is_nan() && samples[2].is_nan());
    let divided = read("index,S1,Fühler\n0,1,1\n0,#DIV/0!,2\n").map(|_| ()).unwrap_err();
    expect(&divided.to_string(), &["line 3, column 2 (`S1`)", "#DIV/0!"]);
    expect(divided.advice().unwrap(), &["leave its cell empty or write NaN"]);
    expect(&refusal("index;S1;Fühler\n0;1;1\n;1;2\n"), &["line 3, column 1 (`index`)", "expected a number"]);
}

#[test]
fn turns_begin_where_the_mark_rises() {
    let mut text = "index,S1,Fühler\n".to_owned();
    for sample in 0..40_000 {
        // Up for three samples; also at the very first, of which nobody knows when it rose.
        writeln!(text, "{},{sample},{}", u8::from(sample % 100 < 3), -sample).unwrap();
    }
    let (capture, samples, angles) = read(text).unwrap();
    assert_eq!(capture.marks, (1..400).map(|turn| f64::from(turn * 100) - 0.5).collect::<Vec<_>>());
    assert!(!capture.encoder && angles.is_empty());
    assert!(samples.chunks(2).enumerate().all(|(row, pair)| pair == [row as f64; 2]));
    expect(&refusal("index,S1,Fühler\n0,0,0\n5,0,0\n"), &["line 3, column 1", "0 or 1, found 5"]);
}

#[test]
fn an_encoder_s_angle_comes_with_each_block() {
    let mut text = "S1\tFühler\tangle_deg\ttime_s\n".to_owned();
    for sample in 0..20_000 {
        writeln!(text, "0\t0\t{:.2}\t{:.4}", -0.9 * f64::from(sample), 0.0005 * f64::from(sample)).unwrap();
    }
    let (capture, _, angle_rev) = read(&text).unwrap();
    assert!(capture.encoder);
    assert_eq!(angle_rev.len(), 20_000);
    assert!((angle_rev[19_999] - 19_999.0 / 400.0).abs() < 1e-12);
    assert_eq!(capture.marks, (0..50).map(|turn| f64::from(turn * 400)).collect::<Vec<_>>());
    // Times of four decimals at 2 kHz: the rounding of one step over 10 s.
    assert!((capture.sample_rate_hz.unwrap() / 2000.0 - 1.0).abs() < 1e-9, "{:?}", capture.sample_rate_hz);
    let backwards = text.replace("\t-90.00\t", "\t90.00\t");
    expect(&refusal(backwards), &["line 102, column 3 (`angle_deg`)", "falling"]);
}

#[test]
fn times_have_to_be_even() {
    let rows = |times: &[&str]| {
        times.iter().fold("time_s;index;S1;Fühler\n".to_owned(), |text, time| text + time + ";0;1;1\n")
    };
    let (capture, ..) = read(rows(&["1,0", "1,1", "1,2", "1,3"])).unwrap();
    assert!((capture.sample_rate_hz.unwrap() - 10.0).abs() < 1e-12);
    expect(&refusal(rows(&["0", "0,1", "0,2", "0,4"])), &["line 5, column 1 (`time_s`)", "even steps", "0.4"]);
    // Each step is near the mean of those before it: 0.5 ms at first, 2.5 ms at last.
    let slower: Vec<String> =
        (0..2000).map(|sample| format!("{:.9}", 1e-3 * f64::from(sample).powf(1.2)).replace('.', ",")).collect();
    let slower: Vec<&str> = slower.iter().map(String::as_str).collect();
    expect(&refusal(rows(&slower)), &["even steps", "before where steps of", "the sampling rate changes"]);
    expect(&refusal(rows(&["0", "0,1", "0,1"])), &["line 4", "above 0.1"]);
    expect(&refusal(rows(&["0", ""])), &["line 3, column 1", "expected a number"]);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("x.csv"), rows(&["1,0", "1,1", "1,2"])).unwrap();
    for (stated, fits) in [(10.0, true), (10.1, false)] {
        let config = CsvConfig { sample_rate_hz: Some(stated), speed_rpm: Some(60.0), ..config(Some("x.csv")) };
        let recording = open(folder.path(), config, &rig(&["one"])).unwrap();
        let found = drain(&*recording);
        assert_eq!(found.is_ok(), fits);
        if let Ok((capture, ..)) = found {
            assert_eq!((capture.sample_rate_hz, capture.stated_speed_rpm), (Some(stated), Some(60.0)));
        }
    }
}

#[test]
fn mistakes_are_reported_with_their_place() {
    expect(&refusal(""), &["x.csv", "expected a header"]);
    expect(&refusal("index,S1,Fühler\n"), &["expected samples"]);
    expect(&refusal("index,S1,T2\n0,1,2\n"), &["x.csv, line 1", "`Fühler`", "found index, S1, T2"]);
    expect(&refusal("S1,Fühler\n1,2\n"), &["`index` or `angle_deg`"]);
    expect(&refusal("index,S1,S1,Fühler\n0,1,1,2\n"), &["`S1` is there twice"]);
    expect(&refusal("index,S1,Fühler\n0,1,2\n0,1\n"), &["line 3", "expected 3 cells", "found 2"]);
    expect(&refusal("index,S1,Fühler\n0,1,2\n0,1,2,3\n"), &["line 3", "expected 3 cells", "found 4"]);
    expect(&refusal("S1,Fühler,index\n0,1\n"), &["line 2", "expected 3 cells", "found 2"]);
    expect(&refusal("# x\nindex,S1,Fühler\n0,1,2µm\n"), &["line 3, column 3 (`Fühler`)", "found `2µm`"]);
    expect(&refusal("index;S1;Fühler\n0;1,5;2\n0;1.5;2\n"), &["line 3, column 2", "decimal comma", "found `1.5`"]);
    expect(&refusal("index;S1;Fühler\n0;1.5;2\n0;1,5;2\n"), &["line 3, column 2", "found `1,5`"]);
    for (text, mark, refused) in [
        ("index;S1;Fühler\n0;1,5;2\n0;1.5;2\n", "decimal comma, as in 1,5", "1.5"),
        ("index;S1;Fühler\n0;1.5;2\n0;1,5;2\n", "decimal point, as in 1.5", "1,5"),
    ] {
        let error = read(text).map(|_| ()).unwrap_err();
        expect(error.advice().unwrap(), &[mark]);
        assert!(!error.advice().unwrap().contains(refused), "{:?}", error.advice());
    }
    expect(&refusal("index,S1,Fühler\n0,1,2\n\n0,1,2\n"), &["line 3", "blank line"]);
    expect(&refusal(b"\xff\xfei\0n\0d\0"), &["UTF-16"]);
    expect(&refusal(vec![b'7'; 3 << 20]), &["line 1", "line end"]);
    for (text, advice) in [
        ("index,S1,Fühler\n0,1,5,2,5\n", "decimal commas by semicolon or tab"),
        ("index,S1,Fühler\n0,1\n", "one cell for each name"),
        ("index;S1;Fühler\n0;1;2;3\n", "one cell for each name"),
        ("index|S1|Fühler\n0|1|2\n", "delimited by comma, semicolon or tab"),
        ("Recorder 7\nindex,S1,Fühler\n0,1,2\n", "does not begin with `#`"),
    ] {
        let error = read(text).map(|_| ()).unwrap_err();
        expect(error.advice().unwrap(), &[advice]);
    }
    for (cell, shown, advice) in [
        ("µm", "µm", "rows of units"),
        ("NA", "NA", "write NaN"),
        ("# noise", "# noise", "above the header"),
        ("1 000", "1 000", "thousands"),
        ("\u{1b}[2J", "\\u{1b}[2J", "1.5e-3"),
    ] {
        let error = read(format!("S1,Fühler,index\n{cell},1,0\n")).map(|_| ()).unwrap_err();
        expect(&error.to_string(), &[&format!("found `{shown}`")]);
        expect(error.advice().unwrap(), &[advice]);
    }
    for cell in ["NaN", ""] {
        for column in ["index", "angle_deg"] {
            let error = read(format!("S1,Fühler,{column}\n0,1,0\n0,1,{cell}\n")).map(|_| ()).unwrap_err();
            expect(&error.to_string(), &["line 3, column 3"]);
            expect(error.advice().unwrap(), &["only readings may be missing"]);
            assert_eq!(error.advice().unwrap().contains("rows of units"), !cell.is_empty(), "{cell}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let missing = open(folder.path(), config(Some("none.csv")), &rig(&["one"]));
    expect(&missing.map(|_| ()).unwrap_err().to_string(), &["none.csv", "No such file"]);
}

#[test]
fn damaged_files_are_errors_or_data_but_no_panic() {
    let text = "time_s;index;S1;Fühler\n0,0;0;1,25;\"2\"\n0,1;1;-0,5;3\n0,2;0;7;nan\n".as_bytes();
    for place in 0..text.len() {
        let _ = read(&text[..place]);
        for byte in [0, b'\n', b'"', b';', b',', b'9', 0xFF] {
            let mut damaged = text.to_vec();
            damaged[place] = byte;
            let _ = read(damaged);
        }
    }
}

#[test]
fn files_are_found_by_pattern_or_by_list() {
    let folder = tempfile::tempdir().unwrap();
    let rig = rig(&["one", "two"]);
    let stations =
        vec![StationConfig { name: "up".into(), z_mm: 9.0 }, StationConfig { name: "down".into(), z_mm: 1.0 }];
    let mut files = Vec::new();
    for (index, (setup, station)) in [("one", "up"), ("one", "down"), ("two", "up"), ("two", "down")].iter().enumerate()
    {
        let text = format!("index,S1,Fühler,temperature\n0,{index},0,20\n");
        let path = folder.path().join(format!("{setup}-{station}.csv"));
        fs::write(&path, text).unwrap();
        files.push(FileConfig {
            path: path.file_name().unwrap().into(),
            setup: (*setup).into(),
            station: (*station).into(),
        });
    }
    let by_pattern = CsvConfig { stations: stations.clone(), ..config(Some("{setup}-{station}.csv")) };
    let by_list = CsvConfig { stations: stations.clone(), files: files.clone(), ..config(None) };
    for config in [by_pattern.clone(), by_list.clone()] {
        let recording = open(folder.path(), config, &rig).unwrap();
        let names: Vec<&str> = recording.stations().iter().map(|key| key.name.as_str()).collect();
        assert_eq!(names, ["down", "up"]);
        let (capture, samples, _) = drain(&*recording).unwrap();
        assert_eq!((capture.station.as_str(), samples[0].to_bits()), ("down", 1.0_f64.to_bits()));
        assert_eq!(recording.inputs().len(), 4);
        let [unknown, marks] = &recording.remarks()[..] else { panic!("{:?}", recording.remarks()) };
        assert_eq!(unknown, "columns that the rig does not name: temperature");
        assert!(marks.contains("at whole samples"), "two setups: {marks}");
    }
    let fault = |config: CsvConfig| {
        let context = Context { folder: folder.path(), rig: Some(&rig) };
        config.check(&context).map(|_| ()).unwrap_err().to_string()
    };
    expect(&fault(CsvConfig { pattern: Some("{setup}.csv".into()), ..by_pattern.clone() }), &["`{station}`"]);
    expect(&fault(CsvConfig { files: files.clone(), ..by_pattern.clone() }), &["found both"]);
    expect(&fault(CsvConfig { pattern: None, ..by_pattern.clone() }), &["found neither"]);
    expect(&fault(CsvConfig { files: files[1..].to_vec(), ..by_list.clone() }), &["`one` at `up`"]);
    let mut twice = files.clone();
    twice[1] = files[0].clone();
    expect(&fault(CsvConfig { files: twice, ..by_list.clone() }), &["already in"]);
    let mut unknown = files.clone();
    unknown[2].setup = "tow".into();
    expect(&fault(CsvConfig { files: unknown, ..by_list }), &["no setup `tow`"]);
    for rate_hz in [-1.0, 0.0, 2e9, 1e300, f64::NAN] {
        let config = CsvConfig { sample_rate_hz: Some(rate_hz), ..by_pattern.clone() };
        expect(&fault(config), &["above 0 and up to 1e9 Hz"]);
    }
    expect(&fault(CsvConfig { speed_rpm: Some(-1.0), ..by_pattern }), &["expected a number above 0"]);
}

/// A mark in volts: up for some samples each turn; the rising edge passes 2.5 V a quarter of a sample behind each 40th, the falling
/// one in the middle between two samples.
fn with_trace(name: &str) -> String {
    let mut text = format!("S1;{name};Fühler;index\n");
    for row in 0..4000 {
        let volts = match row % 40 {
            0 => 1.75,
            1 => 4.75,
            2..=5 => 5.0,
            _ => 0.0,
        };
        writeln!(text, "{row};{};-{row};0", volts.to_string().replace('.', ",")).unwrap();
    }
    text
}

fn read_marked(bytes: impl AsRef<[u8]>, marker: Marker) -> Result<(Capture, Vec<f64>, Vec<String>)> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("x.csv"), bytes).unwrap();
    let config = CsvConfig { marker: Some(marker), ..config(Some("x.csv")) };
    let recording = open(folder.path(), config, &rig(&["one"]))?;
    let (capture, samples, _) = drain(&*recording)?;
    Ok((capture, samples, recording.remarks()))
}

#[test]
fn marks_are_found_in_an_analogue_trace() {
    let marker = Marker { channel: "MARK".into(), threshold: 2.5, hysteresis: 0.5, edge: Edge::Rising };
    for (edge, first) in [(Edge::Rising, 0.25), (Edge::Falling, 5.5)] {
        let (capture, samples, remarks) = read_marked(with_trace("MARK"), Marker { edge, ..marker.clone() }).unwrap();
        assert_eq!((capture.samples, capture.marks.len(), samples[2 * 77]), (4000, 100, 77.0));
        for (turn, mark) in capture.marks.iter().enumerate() {
            assert!((mark - (40.0 * turn as f64 + first)).abs() < 1e-9, "{mark}");
        }
        let remarks = remarks.join("; ");
        expect(&remarks, &["the trace `MARK` was used, not the column `index`"]);
        assert!(!remarks.contains("does not name"), "{remarks}");
    }
    let refused = |text: String, marker: Marker| read_marked(text, marker).map(|_| ()).unwrap_err().to_string();
    expect(&refused(with_trace("Mark"), marker.clone()), &["expected a column `MARK` with the mark, found S1, Mark"]);
    let high = Marker { threshold: 5.5, ..marker.clone() };
    expect(&refused(with_trace("MARK"), high), &["`MARK`, found 0: it lies from 0 to 5", "5.5"]);
    let broken = with_trace("MARK").replace("\n1000;1,75", "\n1000;NaN");
    expect(&refused(broken, marker.clone()), &["x.csv, line 1002, column 2 (`MARK`)", "expected a number"]);
    // Volts in the column of 0 and 1.
    let (volts, twice) =
        (with_trace("index").replacen("index\n", "other\n", 1), with_trace("MARK").replacen("index", "MARK", 1));
    expect(&refusal(&volts), &["expected 0 or 1, found 1.75"]);
    expect(&refused(twice, marker), &["the column `MARK` is there twice"]);
}

#[test]
fn settings_of_the_trace_are_checked() {
    let rig = rig(&["one"]);
    let refused = |marker: Marker| {
        let config = CsvConfig { marker: Some(marker), ..config(Some("x.csv")) };
        let checked = config.check(&Context { folder: Path::new(""), rig: Some(&rig) });
        checked.map(|_| ()).unwrap_err().to_string()
    };
    let marker = Marker { channel: "MARK".into(), threshold: 2.5, hysteresis: 0.5, edge: Edge::Rising };
    expect(&refused(Marker { channel: "S1".into(), ..marker.clone() }), &["`S1` is a sensor of the rig"]);
    expect(&refused(Marker { hysteresis: -0.5, ..marker.clone() }), &["at least 0, found -0.5"]);
    expect(&refused(Marker { threshold: f64::NAN, ..marker }), &["finite"]);
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

/// As loggers leave it; also several members one after the other, as `cat a.gz b.gz` makes them.
#[test]
fn a_file_that_gzip_packed_is_read() {
    let text = with_trace("other");
    let plain = read(&text).unwrap();
    let whole = packed(text.as_bytes());
    let (one, other) = text.as_bytes().split_at(text.len() / 3);
    let members = [packed(one), packed(other)].concat();
    for bytes in [&whole, &members] {
        let found = read(bytes).unwrap();
        assert_eq!((found.0.samples, &found.1), (plain.0.samples, &plain.1));
    }
    for length in [3, 12, whole.len() / 2, whole.len() - 3] {
        expect(&refusal(&whole[..length]), &["x.csv"]);
    }
    let mut wrong = whole.clone();
    let middle = wrong.len() / 2;
    wrong[middle..middle + 8].fill(0xFF);
    expect(&refusal(&wrong), &["x.csv"]);
    expect(&refusal(b"PK\x03\x04 and so on"), &["found a ZIP archive"]);
}
