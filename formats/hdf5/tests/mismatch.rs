//! Files that are whole but do not hold what they should: each is answered by name.

use std::path::Path;

use hdf5_metno::{File, Group};
use ndarray::Array2;
use runout_hdf5::WriteOptions;

use crate::double::{Memory, load, message, read, rig, write};

/// Writes a good file, changes it, and gives what reading it says.
fn after(encoder: bool, change: impl Fn(&File)) -> String {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("shaft.h5");
    let memory = Memory::new(&rig, &[("a", 1.0), ("b", 2.0)], 500, encoder);
    write(&memory, &rig, &path, &WriteOptions::default()).unwrap();
    let file = File::open_rw(&path).unwrap();
    change(&file);
    file.close().unwrap();
    let result = load(&path, &rig).and_then(|recording| {
        for station in 0..2 {
            for setup in 0..2 {
                read(&*recording, station, setup)?;
            }
        }
        Ok(recording.remarks())
    });
    match result {
        Ok(remarks) => format!("read: {}", remarks.join("; ")),
        Err(error) => error.to_string(),
    }
}

fn expect(found: &str, parts: &[&str]) {
    for part in parts {
        assert!(found.contains(part), "`{part}` is not in: {found}");
    }
}

fn group(file: &File, name: &str) -> Group {
    file.group(name).unwrap()
}

#[test]
fn names_are_matched() {
    expect(&after(false, |_| {}), &["read: "]);
    expect(&after(false, |file| file.unlink("reversed/b").unwrap()), &["shaft.h5:/reversed", "`b` is missing"]);
    expect(&after(false, |file| file.unlink("reversed").unwrap()), &["`reversed`", "found initial"]);
    let extra = after(false, |file| {
        file.create_group("third").unwrap();
        let sensors = group(file, "initial").dataset("a/samples").unwrap();
        assert!(sensors.attr("sensors").is_ok());
    });
    expect(&extra, &["read: ", "setups that the rig does not name: third"]);
    let nameless = after(false, |file| {
        let samples = file.dataset("initial/a/samples").unwrap();
        samples.delete_attr("sensors").unwrap();
        let names = ["S1", "T2"].map(|name| name.parse::<hdf5_metno::types::VarLenUnicode>().unwrap());
        samples.new_attr_builder().with_data(&names).create("sensors").unwrap();
    });
    expect(&nameless, &["/initial/a/samples", "`S2`", "found S1, T2"]);
}

#[test]
fn attributes_are_checked() {
    let remove = |object: &'static str, name: &'static str| {
        after(false, move |file| match file.dataset(object) {
            Ok(dataset) => dataset.delete_attr(name).unwrap(),
            Err(_) => group(file, object).delete_attr(name).unwrap(),
        })
    };
    expect(&remove("/", "format"), &["shaft.h5:/", "`format`"]);
    expect(&remove("initial/a", "z_mm"), &["/initial/a", "`z_mm`"]);
    expect(&remove("initial/a/samples", "sensors"), &["/initial/a/samples", "`sensors`"]);
    let replaced = |object: &'static str, name: &'static str, value: f64| {
        after(false, move |file| {
            let object = group(file, object);
            object.delete_attr(name).unwrap();
            object.new_attr::<f64>().create(name).unwrap().write_scalar(&value).unwrap();
        })
    };
    expect(&replaced("/", "version", 2.0), &["expected 1, found 2"]);
    expect(&replaced("/", "length_unit", 2.0), &["`length_unit`", "expected text"]);
    expect(&replaced("reversed/b", "z_mm", 3.0), &["/reversed/b", "2 mm", "`initial`", "found 3 mm"]);
    expect(&replaced("reversed/b", "z_mm", f64::NAN), &["/reversed/b", "finite"]);
    expect(&replaced("reversed/b", "speed_rpm", 0.0), &["/reversed/b", "`speed_rpm`", "above 0"]);
}

fn replace_samples<T: hdf5_metno::H5Type + Clone>(file: &File, shape: (usize, usize), value: T) {
    let group = group(file, "initial/a");
    group.unlink("samples").unwrap();
    let data = Array2::from_elem(shape, value);
    let samples = group.new_dataset_builder().with_data(&data).create("samples").unwrap();
    let names = ["S2", "S1"].map(|name| name.parse::<hdf5_metno::types::VarLenUnicode>().unwrap());
    samples.new_attr_builder().with_data(&names).create("sensors").unwrap();
}

#[test]
fn types_and_shapes_are_checked() {
    expect(&after(false, |file| replace_samples(file, (500, 2), 0_u8)), &["/samples", "i32", "found u8"]);
    expect(&after(false, |file| replace_samples(file, (500, 2), 0_i16)), &["/samples", "`scale`"]);
    expect(&after(false, |file| replace_samples(file, (500, 3), 0.0)), &["`sensors`", "[500, 3]", "found 2"]);
    expect(&after(false, |file| replace_samples(file, (40, 2), 0.0)), &["/index", "expected", "49.75"]);
    expect(&after(false, |file| replace_samples(file, (500, 2), 0.0)), &["read: "]);
    let line = after(false, |file| {
        group(file, "initial/a").unlink("samples").unwrap();
        file.new_dataset_builder().with_data(&[0.0, 1.0]).create("initial/a/samples").unwrap();
    });
    expect(&line, &["[samples, channels]", "[2]"]);
    // A shape that was declared and never written must not be read as zeros, nor be made room for.
    for chunked in [false, true] {
        let declared = after(false, |file| {
            group(file, "initial/a").unlink("samples").unwrap();
            let builder = file.new_dataset_builder();
            let builder = if chunked { builder.chunk((1000, 2)) } else { builder };
            builder.empty::<f64>().shape((1_usize << 40, 2)).create("initial/a/samples").unwrap();
        });
        expect(&declared, &["/samples", "declared", "only 0 of"]);
    }
}

fn replace_line(file: &File, name: &str, values: &[f64]) {
    group(file, "initial/b").unlink(name).unwrap();
    file.new_dataset_builder().with_data(values).create(format!("initial/b/{name}").as_str()).unwrap();
}

#[test]
fn marks_and_angles_are_checked() {
    let index = |values: &'static [f64]| after(false, move |file| replace_line(file, "index", values));
    expect(&index(&[0.5, 50.5]), &["read: "]);
    expect(&index(&[0.5, 50.5, 50.5]), &["/initial/b/index", "mark 2", "above 50.5"]);
    expect(&index(&[0.5, f64::NAN]), &["mark 1", "found NaN"]);
    expect(&index(&[0.5, 501.0]), &["mark 1", "500", "found 501"]);
    let angle = |step: fn(usize) -> f64| {
        after(true, move |file| replace_line(file, "angle_deg", &(0..500).map(step).collect::<Vec<f64>>()))
    };
    expect(&angle(|sample| sample as f64 * -7.2), &["read: "]);
    expect(&angle(|sample| (sample as f64 * 7.2) % 360.0), &["/initial/b/angle_deg", "sample 50", "unwrapped"]);
    expect(&angle(|sample| if sample == 77 { 0.0 } else { sample as f64 }), &["sample 77", "rising"]);
    expect(&angle(|sample| if sample == 77 { f64::NAN } else { sample as f64 }), &["sample 77", "NaN"]);
    expect(&after(true, |file| replace_line(file, "angle_deg", &[0.0; 40])), &["500 samples", "found 40"]);
    expect(&after(true, |file| file.unlink("initial/b/angle_deg").unwrap()), &["`index` or `angle_deg`"]);
}

#[test]
fn a_falling_angle_turns_the_same_way_round() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("falling.h5");
    let mut memory = Memory::new(&rig, &[("a", 1.0)], 500, true);
    for stream in &mut memory.captures[0] {
        stream.angle_rev.iter_mut().for_each(|turns| *turns = -*turns);
    }
    write(&memory, &rig, &path, &WriteOptions::default()).unwrap();
    let found = read(&*load(&path, &rig).unwrap(), 0, 0).unwrap();
    assert_eq!(found.capture.marks.len(), 9);
    assert!(found.angle_rev.windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn what_is_no_measurement_is_refused() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let text = message(load(&folder.path().join("none.h5"), &rig));
    assert!(text.contains("none.h5") && text.contains("No such file"), "{text}");
    let path = folder.path().join("text.h5");
    std::fs::write(&path, "index,S1\n").unwrap();
    assert!(message(load(&path, &rig)).contains("no HDF5 file, but text"));
    assert!(!message(load(Path::new("/"), &rig)).is_empty());
}
