//! Reports on paper: how many pages they have, and what is on a station's sheet.

use crate::{
    chromium::in_chromium,
    folder::{self, Folder},
    report::{EXPORT, SCENARIO},
};

/// Between the margins of A4, px.
const PAGE: [u64; 2] = [688, 1032];

/// A print of a simulated shaft with so many stations.
fn print(stations: usize) -> Option<serde_json::Value> {
    let scenario = SCENARIO.replace("count = 5", &format!("count = {stations}"));
    let evaluate = "\n[evaluate]\nfilter_upr = [5]\n";
    let pipeline = folder::pipeline() + evaluate + EXPORT;
    let folder = Folder::with(&[("pipeline.toml", &pipeline), ("rig.toml", folder::RIG), ("scenario.toml", &scenario)]);
    for command in [["simulate", "scenario.toml"], ["run", "pipeline.toml"]] {
        let ran = folder.run(&command);
        assert_eq!(ran.status, 0, "{}", ran.shown());
    }
    in_chromium("print.mjs", &folder.path().join("out/report.html"))
}

#[test]
fn a_few_stations_have_a_page_each() {
    let Some(printed) = print(3) else { return };
    let sheets = printed["found"].as_array().unwrap();
    let names: Vec<&str> = sheets.iter().map(|sheet| sheet["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["s001", "s002", "s003"]);
    for sheet in sheets {
        let number = |key: &str| sheet[key].as_u64().unwrap();
        assert!(number("width") <= PAGE[0] && number("height") <= PAGE[1], "{sheet}");
        assert!(number("charts") >= 3 && number("rows") > 10, "{sheet}");
    }
    // The first page, the sheets, the values of the part with its surface, the rig.
    assert!((5..=6).contains(&printed["pages"].as_u64().unwrap()), "{printed}");
    assert_eq!((printed["left"].as_u64(), printed["controls"].as_u64()), (Some(0), Some(0)), "{printed}");
}

#[test]
fn many_stations_are_gathered_on_four_pages() {
    let Some(printed) = print(12) else { return };
    assert_eq!(printed["found"], serde_json::json!([]));
    assert!((2..=4).contains(&printed["pages"].as_u64().unwrap()), "{printed}");
    assert!(printed["wide"].as_u64().unwrap() <= PAGE[0], "{printed}");
}
