#![allow(clippy::unwrap_used, reason = "tests")]

use std::{io::Write, path::Path, sync::Arc};

use arrow_array::{ArrayRef, Float32Array, Int64Array, RecordBatch, StringArray};
use parquet::arrow::ArrowWriter;
use runout_core::{
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::{Loader, Request, Source},
};
use serde::Deserialize;

use super::*;

const TRACED: [PointColumn; 6] = [
    PointColumn::needed("trace", PointKind::Trace, "", "name of the trace"),
    PointColumn::needed("kind", PointKind::TraceKind, "", "what it runs along"),
    PointColumn::needed("z_mm", PointKind::Number, "mm", "height"),
    PointColumn::needed("angle_deg", PointKind::Number, "deg", "angle"),
    PointColumn::needed("deviation_um", PointKind::Number, "um", "deviation"),
    PointColumn::optional("flag", PointKind::Flag, "", "left out"),
];
const LABELLED: [PointColumn; 3] = [
    PointColumn::needed("ball", PointKind::Label, "", "name of the ball"),
    PointColumn::needed("dx_mm", PointKind::Number, "mm", "actual less nominal"),
    PointColumn::optional("time_s", PointKind::Number, "s", "time"),
];

fn loader(path: &Path, keys: &str) -> std::result::Result<Box<dyn Loader>, Fault> {
    let text = format!("path = {:?}\n{keys}", path.display().to_string());
    let config = PointsConfig::deserialize(toml::Deserializer::parse(&text).unwrap()).unwrap();
    config.check(&Context { folder: Path::new(""), rig: None })
}

fn open(path: &Path, keys: &str, columns: &[PointColumn]) -> Result<Points> {
    match loader(path, keys).unwrap().open(&Request { rig: None, columns })? {
        Source::Points(points) => Ok(points),
        Source::Turns(_) => unreachable!("the loader gives points"),
    }
}

fn from(text: &str, keys: &str, columns: &[PointColumn]) -> Result<Points> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(text.as_bytes()).unwrap();
    open(file.path(), keys, columns)
}

#[test]
fn traces_with_either_decimal_mark() {
    let dots = "trace,kind,z_mm,angle_deg,deviation_um\nA,circle,1.5,0,-2\nA,circle,1.5,90,3\nB,line,2,0,1\n";
    let commas =
        "\u{feff}kind;trace;deviation_um;z_mm;angle_deg\r\ncircle;A;-2;1,5;0\r\ncircle;A;3;1,5;90\r\nline;B;1;2;0";
    let (dots, commas) = (from(dots, "", &TRACED).unwrap(), from(commas, "", &TRACED).unwrap());
    assert_eq!((&dots.columns, &dots.traces), (&commas.columns, &commas.traces));
    assert_eq!(dots.column("z_mm").unwrap(), [1.5, 1.5, 2.0]);
    assert_eq!(dots.traces[0], Trace { id: "A".into(), kind: "circle".into(), points: 0..2 });
}

#[test]
fn a_column_of_flags_may_be_there() {
    let points =
        from("flag,trace,kind,z_mm,angle_deg,deviation_um\n0,A,circle,1,0,-2\n1,A,circle,1,90,3\n", "", &TRACED);
    assert_eq!(points.unwrap().column("flag").unwrap(), [0.0, 1.0]);
    for cell in ["2", "true", "0.0", "-1", "nan"] {
        let text = format!("trace,kind,z_mm,angle_deg,deviation_um,flag\nA,circle,1,0,-2,{cell}\n");
        let message = from(&text, "", &TRACED).unwrap_err().to_string();
        let expected = format!("line 2, column 6 (flag): expected 0 (used) or 1 (left out), found `{cell}`");
        assert!(message.contains(&expected), "{message}");
    }
}

#[test]
fn an_optional_column_that_is_empty_is_absent() {
    let points = |rows: &str| from(&format!("ball,dx_mm,time_s\n{rows}"), "", &LABELLED);
    assert!(points("P1,1,\nP2,2, \n").unwrap().column("time_s").is_err());
    let message = points("P1,1,5\nP2,2,\n").unwrap_err().to_string();
    assert!(message.contains("line 3, column 3 (time_s): it is empty"), "{message}");
}

#[test]
fn a_point_beside_decimal_commas_is_none_of_a_number() {
    let thousands = "ball;dx_mm\nB1;1.250\nB2;0,42\n";
    let error = from(thousands, "", &LABELLED).unwrap_err();
    assert!(error.to_string().contains("line 2") && error.to_string().contains("found `1.250`"), "{error}");
    assert_eq!(from(&thousands.replace("0,42", "0.42"), "", &LABELLED).unwrap().column("dx_mm").unwrap(), [1.25, 0.42]);
}

#[test]
fn one_quantity_in_two_units_has_one_number() {
    let rounded = "ball,dx_mm,dx_um\nB1,0.003,3.4\nB1,0.052,51.7\n";
    assert_eq!(from(rounded, "", &LABELLED).unwrap().column("dx_mm").unwrap(), [0.003, 0.052]);
    let other = rounded.replace("51.7", "31.7");
    let error = from(&other, "", &LABELLED).unwrap_err();
    assert!(error.to_string().contains("`dx_mm` is 0.052 and `dx_um` is 31.7: which one is meant?"), "{error}");
    let chosen = from(&other, "columns = { dx_um = \"unused\" }", &LABELLED).unwrap();
    assert_eq!(chosen.column("dx_mm").unwrap(), [0.003, 0.052]);
    let chosen = from(&other, "columns = { dx_um = \"dx_mm\" }", &LABELLED).unwrap();
    assert_eq!(chosen.column("dx_mm").unwrap(), [3.4, 31.7], "as the file says");
}

#[test]
fn rows_are_selected_and_columns_renamed() {
    let text = "ball;ΔX;a_deg;dx_mm;note\nP1;0,01;0;7;x\nP1;0,02;90;8;\nP2;0,03;0;9;y\n";
    let keys = "columns = { \"ΔX\" = \"dx_mm\" }\nwhere = { a_deg = 0 }";
    let points = from(text, keys, &LABELLED).unwrap();
    assert_eq!(points.column("dx_mm").unwrap(), [0.01, 0.03]);
    assert_eq!(points.labels("ball").unwrap(), ["P1", "P2"]);
    assert!(points.labels("note").is_none() && points.column("time_s").is_err());
    let of_ball = from(text, "columns = { \"ΔX\" = \"dx_mm\" }\nwhere = { ball = \"P2\" }", &LABELLED).unwrap();
    assert_eq!(of_ball.column("dx_mm").unwrap(), [0.03]);
    for (keys, expected) in [
        ("where = { a_deg = 45 }", "no point has the values of `where`"),
        ("where = { b_deg = 0 }", "`where` names `b_deg`, which the file does not have"),
        ("columns = { ΔZ = \"dx_mm\" }", "`columns` names `ΔZ`"),
    ] {
        let keys = keys.replace("ΔZ", "\"ΔZ\"");
        let message = from(text, &keys, &LABELLED).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    let twice = loader(Path::new("points.csv"), "columns = { a = \"dx_mm\", b = \"dx_mm\" }").err().unwrap();
    assert!(twice.to_string().contains("two columns of the file"), "{twice}");
}

#[test]
fn parquet_of_other_types() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.parquet");
    let columns: [(&str, ArrayRef); 3] = [
        ("ball", Arc::new(StringArray::from(vec!["P1", "P2"]))),
        ("dx_mm", Arc::new(Float32Array::from(vec![0.25, -0.5]))),
        ("time_s", Arc::new(Int64Array::from(vec![3, 5]))),
    ];
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let mut writer = ArrowWriter::try_new(std::fs::File::create(&path).unwrap(), batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    let points = open(&path, "where = { ball = \"P2\" }", &LABELLED).unwrap();
    assert_eq!(points.column("dx_mm").unwrap(), [-0.5]);
    assert_eq!(points.column("time_s").unwrap(), [5.0]);
    std::fs::write(&path, b"PAR1 and nothing more").unwrap();
    assert!(open(&path, "", &LABELLED).is_err());
}

#[test]
fn every_mistake_is_named_with_its_place() {
    let header = "trace,kind,z_mm,angle_deg,deviation_um\n";
    let cases = [
        ("A,circle,1,0,nan\n", "line 2, column 5 (deviation_um): expected a finite number, found `nan`"),
        ("A,circle,1,0,1\nA,circle,1,x,1\n", "line 3, column 4 (angle_deg): expected a finite number, found `x`"),
        ("A,circle,1,,1\n", "line 2, column 4 (angle_deg): it is empty"),
        ("A,circle,1,0,1\nB,circle,1,0,1\nA,circle,1,0,1\n", "line 4, column 1 (trace): trace A has ended above"),
        ("A,circle,1,0,1\nA,line,1,0,1\n", "line 3, column 2 (kind): trace A is of kind circle above, not line"),
        ("A,circle,1,0\n", "line: 2"),
        ("", "it has no points"),
    ];
    for (rows, expected) in cases {
        let message = from(&format!("{header}{rows}"), "", &TRACED).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    let headers = [
        ("", "the column `trace` is missing"),
        ("trace,kind,z_mm,angle_deg,deviation\n", "the column `deviation_um` is missing (deviation, in um)"),
        ("trace,kind,z_mm,angle_deg,deviation_um,flags\n", "unknown column `flags`: is it `flag`?"),
        ("trace,kind,z_mm,z_mm,angle_deg,deviation_um\n", "the column `z_mm` is there twice"),
    ];
    for (header, expected) in headers {
        let message = from(header, "", &TRACED).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    assert!(open(Path::new("/nonexistent/cylinder.csv"), "", &TRACED).is_err());
}

/// Comments are skipped; NumPy writes the names of columns as one.
#[test]
fn lines_behind_a_hash_are_no_rows() {
    const PLACES: [PointColumn; 2] = [
        PointColumn::needed("x_mm", PointKind::Number, "mm", "place"),
        PointColumn::needed("y_um", PointKind::Number, "um", "deviation"),
    ];
    for text in [
        "# made by hand\n# second line, with a comma\nx_mm,y_um\n1,2\n# between\n3,4\n",
        "\u{feff}# made by hand\nx_mm;y_um\n1;2\n3;4\n",
        "# x_mm y_um\n1.0 2.0\n3.0 4.0\n",
        "#x_mm,y_um\n1.0,2.0\n3.0,4.0\n",
        "# note\nx_mm y_um\n1 2\n# between\n3 4\n",
    ] {
        let points = from(text, "", &PLACES).unwrap_or_else(|error| panic!("{text}: {error}"));
        let found = ["x_mm", "y_um"].map(|name| points.column(name).unwrap().to_vec());
        assert_eq!(found, [vec![1.0, 3.0], vec![2.0, 4.0]], "{text}");
    }
    let named = from("# any words at all\n1 2\n3 4\n", "names = [\"x_mm\", \"y_um\"]", &PLACES).unwrap();
    assert_eq!(named.column("y_um").unwrap(), [2.0, 4.0]);
    let message = from("# any words at all\n1 2\n3 4\n", "", &PLACES).unwrap_err().to_string();
    assert!(message.contains("line 2: its first line has 2 numbers"), "{message}");
    let message = from("# note\nx_mm,y_um\n1,2\n3,four\n", "", &PLACES).unwrap_err().to_string();
    assert!(message.contains("line 4"), "{message}");
}
