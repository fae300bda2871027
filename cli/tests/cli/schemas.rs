//! The schemas in schemas/ are those of the types.

use std::{collections::BTreeMap, fs, path::Path};

use crate::folder::Folder;
use serde_json::Value;

fn read(folder: &Path) -> BTreeMap<String, Value> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files
        .map(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, serde_json::from_slice(&fs::read(&path).unwrap()).unwrap())
        })
        .collect()
}

#[test]
fn schemas_are_fresh() {
    let folder = Folder::with(&[]);
    assert_eq!(folder.run(&["schema", "--out", "schemas"]).status, 0);
    let checked_in = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas"));
    let fresh = read(&folder.path().join("schemas"));
    // Schemas of files that other programs read may lie there too.
    for (name, schema) in &fresh {
        assert!(checked_in.get(name) == Some(schema), "schemas/{name} is stale: cargo xtask schemas");
    }
}
