//! What the files hold, read back by other programs: calamine and openpyxl (XLSX), the crate csv, and key fields one by one.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{collections::BTreeMap, env, fs, path::Path, process::Command};

use calamine::{Data, Reader, Xlsx};
use runout_core::{
    atomic_file::commit_all,
    draws::NORMAL_95,
    evaluate::decide,
    fault::Fault,
    pipeline::{Context, Registry},
    stage::{About, Completed, Exporter, ResultInfo},
    summary::Summary,
    table::{ColumnSpec, TableSpec, numbers, texts},
};
use serde_json::json;
use toml::de::DeTable;

const UPPER_UM: f64 = 2.0;

/// Two sections with RONt of 1.5 ± 0.125 µm and 2.0625 ± 0.125 µm, one without uncertainty that is beyond the limit by much, a value of a domain's own
/// and one that is not observable.
fn summary() -> Summary {
    let ront = |value: f64, std: Option<f64>| {
        let uncertainty =
            std.map(|std| json!({ "std": std, "interval_95": [value - 2.0 * std, value + 2.0 * std], "draws": 400 }));
        json!({
            "symbol": "RONt", "unit": "um", "value": value, "source": "ISO 12181-1:2011", "band_upr": [2, 50], "lost_orders": [],
            "filter": "Gaussian 50 UPR", "reference": "LSCI", "coverage": 1.0, "uncertainty": uncertainty,
            "no_uncertainty": if std.is_none() { Some("one turn, no scatter") } else { None },
        })
    };
    let section = |name: &str, value, std| json!({ "section": name, "z_mm": 5.0, "form_rms_um": 1.0, "form_std_um": null, "values": [ront(value, std)], "truth_form_rms_error_um": null });
    let station = |name: &str, sections: Vec<serde_json::Value>| {
        json!({
            "station": name, "z_mm": 5.0, "captures": [], "sections": sections, "motion_values": [], "residual_rms_um": null,
            "expected_residual_rms_um": null, "chi2_per_dof": null, "truth": null, "warnings": [],
        })
    };
    let whole = json!({
        "title": "Welle süd", "provenance": { "program": "runout test", "configuration": "[load]\nplugin = 'csv'\n", "inputs": [] },
        "lost_orders": { "form": [], "motion": [] }, "part": null, "limits": [], "surface": null, "outputs": [],
        "stations": [station("s1", vec![section("a", 1.5, Some(0.125)), section("b", 2.0625, Some(0.125))]), station("s2", vec![section("a", 9.0, None)])],
        "values": [
            { "symbol": "gain", "of": "probe; left", "value": 1.25, "std": 0.5, "unit": "", "about": "gain, \"as found\"" },
            { "symbol": "offset", "value": null, "std": null, "unit": "mm", "about": "not observable" },
        ],
        "warnings": ["order 4 is lost"],
        "head": { "machine": "VMC 5", "serial_number": "0815", "operator": "A. B.", "instrument": "laser L1", "calibrated": "2026-03-01",
            "customer": "C & Co", "fields": { "Order": "4712" } },
    });
    let mut summary: Summary = serde_json::from_value(whole).unwrap();
    let limit = serde_json::from_value(json!({ "symbol": "RONt", "unit": "um", "upper": UPPER_UM })).unwrap();
    let limits = decide(&[limit], &summary.placed_values()).unwrap().0;
    summary.limits = limits;
    summary
}

fn form() -> TableSpec {
    TableSpec::new(
        "form",
        "form of a section",
        vec![ColumnSpec::name("section", "its id"), ColumnSpec::number("form_um", "um", "deviation")],
    )
}

fn exporter(toml: &str, folder: &Path) -> Result<Box<dyn Exporter>, Fault> {
    let mut registry = Registry::default();
    runout_values::register(&mut registry);
    registry.exporters.build(&DeTable::parse(toml).unwrap(), &Context { folder, rig: None })
}

/// Writes the summary, with a table of two rows, one of which is lost.
fn export(toml: &str, folder: &Path) -> Vec<u8> {
    let exporter = exporter(toml, folder).unwrap();
    let table = form();
    let summary = summary();
    let mut export = exporter
        .begin(&ResultInfo { title: summary.title.clone(), tables: vec![table.clone()], longest_name: None })
        .unwrap();
    export.rows(&table, &table.rows(vec![texts(["a"]), numbers([0.25])]).unwrap()).unwrap();
    export.rows(&table, &table.rows(vec![texts(["b"]), numbers([f64::NAN])]).unwrap()).unwrap();
    let about = About { convention: "outward positive".into(), ..About::default() };
    let completed =
        Completed { summary: &summary, about: &about, surface: None, heights: None, diagnosis: None, overview: None };
    let files = commit_all(export.finish(&completed).unwrap()).unwrap();
    assert_eq!(files, exporter.outputs(&[table]));
    fs::read(&files[0]).unwrap()
}

/// Decision and numbers of a value and limit: value, std, ends of the interval, upper limit.
type Row = (String, Vec<Option<f64>>);

fn expected() -> BTreeMap<String, Row> {
    let row = |decision: &str, numbers: [Option<f64>; 5]| (decision.to_owned(), numbers.to_vec());
    let limit = Some(UPPER_UM);
    BTreeMap::from([
        ("s1 a RONt".into(), row("conforms", [Some(1.5), Some(0.125), Some(1.25), Some(1.75), limit])),
        ("s1 b RONt".into(), row("undecided", [Some(2.0625), Some(0.125), Some(1.8125), Some(2.3125), limit])),
        ("s2 a RONt".into(), row("undecided", [Some(9.0), None, None, None, limit])),
        (
            " probe; left gain".into(),
            row("", [Some(1.25), Some(0.5), Some(1.25 - NORMAL_95 * 0.5), Some(1.25 + NORMAL_95 * 0.5), None]),
        ),
        ("  offset".into(), row("", [None; 5])),
    ])
}

const NUMBERS: [&str; 5] = ["value", "std", "low_95", "high_95", "upper_limit"];

fn read_csv(bytes: &[u8], delimiter: u8, point: &str) -> BTreeMap<String, Row> {
    let mut reader = csv::ReaderBuilder::new().delimiter(delimiter).from_reader(bytes);
    let header = reader.headers().unwrap().clone();
    let rows = reader.records().map(|record| {
        let record = record.unwrap();
        let cell = |name: &str| record[header.iter().position(|known| known == name).unwrap()].to_owned();
        let key = ["station", "of", "symbol"].map(cell).join(" ");
        let number = |name: &str| {
            Some(cell(name)).filter(|text| !text.is_empty()).map(|text| text.replace(point, ".").parse().unwrap())
        };
        (key, (cell("decision"), NUMBERS.map(number).to_vec()))
    });
    rows.collect()
}

#[test]
fn csv_has_every_value_in_both_spellings() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(read_csv(&export("plugin = 'csv'\npath = 'values.csv'", folder.path()), b',', "."), expected());
    let comma = export("plugin = 'csv'\npath = 'out/values.csv'\ndecimal_comma = true", folder.path());
    assert!(String::from_utf8_lossy(&comma).contains(";1,5;um;0,125;"));
    assert_eq!(read_csv(&comma, b';', ","), expected());
}

#[test]
fn xlsx_has_values_and_the_tables_that_were_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let toml = "plugin = 'xlsx'\npath = 'values.xlsx'\ntables = ['form']";
    let bytes = export(toml, folder.path());
    assert!(bytes == export(toml, folder.path()), "equal runs give equal bytes");
    let mut book = Xlsx::new(std::io::Cursor::new(bytes)).unwrap();
    assert_eq!(book.sheet_names(), ["values", "form", "about"]);
    let range = book.worksheet_range("values").unwrap();
    let header: Vec<String> = range.rows().next().unwrap().iter().map(ToString::to_string).collect();
    let rows: BTreeMap<String, Row> = (range.rows().skip(1))
        .map(|row| {
            let cell = |name: &str| &row[header.iter().position(|known| known == name).unwrap()];
            let number = |name: &str| {
                if *cell(name) == Data::Empty { None } else { Some(calamine::DataType::get_float(cell(name)).unwrap()) }
            };
            let key = ["station", "of", "symbol"].map(|name| cell(name).to_string()).join(" ");
            (key, (cell("decision").to_string(), NUMBERS.map(number).to_vec()))
        })
        .collect();
    assert_eq!(rows, expected());
    let form = book.worksheet_range("form").unwrap();
    assert_eq!((form.height(), form.get((1, 1)), form.get((2, 1))), (3, Some(&Data::Float(0.25)), Some(&Data::Empty)));
    let about = book.worksheet_range("about").unwrap();
    let texts: Vec<String> = about.rows().map(|row| row[1].to_string()).collect();
    let named = |name: &str| about.rows().find(|row| row[0] == Data::String(name.into())).map(|row| row[1].to_string());
    let head = ["Machine", "Serial number", "Operator", "Instrument", "Calibrated", "Customer", "Order"];
    let said = ["VMC 5", "0815", "A. B.", "laser L1", "2026-03-01", "C & Co", "4712"];
    assert_eq!(head.map(|name| named(name).unwrap()), said);
    for text in ["Welle süd", "outward positive", "order 4 is lost", "deviation [um]", "plugin = 'csv'"] {
        assert!(texts.iter().any(|known| known == text), "{text}: {texts:?}");
    }
}

/// Fields by key and characteristic, and the values with their attributes.
fn read_q_das(text: &str) -> (BTreeMap<String, String>, Vec<Vec<String>>) {
    let (mut fields, mut values) = (BTreeMap::new(), Vec::new());
    for line in text.split("\r\n").filter(|line| !line.is_empty()) {
        match line.split_once(' ').filter(|(key, _)| key.starts_with('K')) {
            Some((key, content)) => assert!(fields.insert(key.to_owned(), content.to_owned()).is_none(), "{key} twice"),
            None => values.extend(line.split('\u{f}').map(|one| one.split('\u{14}').map(str::to_owned).collect())),
        }
    }
    (fields, values)
}

#[test]
fn q_das_has_a_characteristic_for_each_value_with_a_limit() {
    let folder = tempfile::tempdir().unwrap();
    let toml = "plugin = 'q-das'\npath = 'part.dfq'\npart_number = '4711'\ntime = '28.11.2026/14:30:00'";
    let bytes = export(toml, folder.path());
    assert!(bytes.windows(3).any(|three| three == b"s\xfcd"), "the umlaut is one byte of the code page");
    let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
    let (fields, values) = read_q_das(&text);
    let field = |key: &str| fields.get(key).map(String::as_str);
    assert_eq!([field("K0100"), field("K1001"), field("K1002")], [Some("3"), Some("4711"), Some("Welle süd")]);
    let head = ["K1062", "K1081", "K1082", "K1202", "K1222"].map(|key| field(key).unwrap());
    assert_eq!(head, ["C & Co", "0815", "VMC 5", "laser L1", "A. B."]);
    assert!(field("K1900").unwrap().ends_with("; instrument calibrated 2026-03-01; Order: 4712"));
    assert_eq!(field("K2002/2"), Some("RONt about LSCI, Gaussian 50 UPR of b, station s1"));
    for number in 1..=3 {
        let of = |key: &str| field(&format!("{key}/{number}")).map(str::to_owned);
        assert_eq!(
            [of("K2111"), of("K2121"), of("K2110"), of("K2120"), of("K2142")],
            [Some("2".into()), Some("1".into()), None, None, Some("um".into())]
        );
    }
    assert_eq!([field("K2022/1"), field("K2022/3")], [Some("2"), Some("4")]);
    assert!(field("K2900/3").unwrap().ends_with("undecided; one turn, no scatter"), "{fields:?}");
    let one = |value: &str| vec![value.to_owned(), "0".into(), "28.11.2026/14:30:00".into()];
    assert_eq!(values, [one("1.5"), one("2.0625"), one("9")]);
    // All values, but for the one that has none.
    let (fields, values) = read_q_das(&String::from_utf8_lossy(&export(
        "plugin = 'q-das'\npath = 'all.dfq'\nonly_limited = false",
        folder.path(),
    )));
    assert_eq!(
        (fields["K0100"].as_str(), values.len(), values[3].as_slice()),
        ("4", 4, &["1.25".to_owned(), "0".into()][..])
    );
}

#[test]
fn mistakes_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let fault = |toml: &str| exporter(toml, folder.path()).err().map(|fault| fault.to_string()).unwrap_or_default();
    assert!(fault("plugin = 'xlsx'\npath = 'values.xls'").contains(".xlsx"));
    assert!(fault("plugin = 'csv'\npath = 'values.txt'").contains(".csv"));
    assert!(fault("plugin = 'q-das'\npath = 'part.dfq'\ntime = 'today'").contains("today"));
    let unknown = exporter("plugin = 'xlsx'\npath = 'values.xlsx'\ntables = ['from']", folder.path()).unwrap();
    let info = ResultInfo { tables: vec![form()], ..ResultInfo::default() };
    let error = unknown.begin(&info).err().unwrap();
    assert!(error.to_string().contains("no table `from`") && error.advice().unwrap().contains("form"), "{error}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left");
}

const OPENPYXL: &str = r#"
import sys, openpyxl
book = openpyxl.load_workbook(sys.argv[1])
assert book.sheetnames == ["values", "form", "about"], book.sheetnames
sheet = book["values"]
columns = {cell.value: cell.column for cell in sheet[1]}
assert sheet.freeze_panes == "A2" and sheet.auto_filter.ref
for row in range(2, sheet.max_row + 1):
    cell = lambda name: sheet.cell(row, columns[name])
    print("|".join([str(cell(name).value) for name in ["station", "of", "value", "upper_limit", "decision"]] + [cell("value").fill.fgColor.rgb or "none"]))
"#;

/// openpyxl reads the workbook, and finds the colour of each decision.
#[test]
fn openpyxl_reads_values_and_colours() {
    let required = env::var_os("RUNOUT_REQUIRE_FOREIGN").is_some();
    let python = env::var("RUNOUT_PYTHON").unwrap_or_else(|_| "python3".into());
    let there =
        Command::new(&python).args(["-c", "import openpyxl"]).output().is_ok_and(|output| output.status.success());
    if !there {
        assert!(!required, "openpyxl is missing");
        return println!("skipped: {python} has no openpyxl");
    }
    let folder = tempfile::tempdir().unwrap();
    export("plugin = 'xlsx'\npath = 'values.xlsx'\ntables = ['form']", folder.path());
    let output = Command::new(&python).args(["-c", OPENPYXL]).arg(folder.path().join("values.xlsx")).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "s1|a|1.5|2|conforms|FFC6EFCE");
    assert_eq!(lines[1], "s1|b|2.0625|2|undecided|FFFFEB9C");
    assert_eq!(lines[3], "None|probe; left|1.25|None|None|00000000");
}
