//! What was written comes back.

use runout_core::{measurement::StationTruth, provenance::Input};
use runout_hdf5::{SampleFormat, Scale, WriteOptions, inspect};

use crate::double::{Memory, TURN, load, message, noise, read, rig, write};

#[test]
fn floats_of_64_bits_come_back_to_the_bit_and_stations_by_z() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    // More than two blocks a capture, and stations out of order.
    let memory = Memory::new(&rig, &[("upper", 20.0), ("lower", -5.0)], 80_000, false);
    for deflate in [None, Some(0), Some(4)] {
        let path = folder.path().join(format!("{deflate:?}.h5"));
        let mut heard = Vec::new();
        let options = WriteOptions { deflate, title: "shaft", ..WriteOptions::default() };
        runout_hdf5::write_measurement(&memory, &rig, &path, &options, &mut |name| heard.push(name.to_owned()))
            .unwrap();
        assert_eq!(heard, ["initial/upper", "reversed/upper", "initial/lower", "reversed/lower"]);
        let recording = load(&path, &rig).unwrap();
        assert!(recording.remarks().is_empty(), "{:?}", recording.remarks());
        assert_eq!(recording.inputs(), [path.as_path()]);
        let names: Vec<&str> = recording.stations().iter().map(|key| key.name.as_str()).collect();
        assert_eq!(names, ["lower", "upper"]);
        for (station, written) in [(0, &memory.captures[1]), (1, &memory.captures[0])] {
            for (setup, written) in written.iter().enumerate() {
                let found = read(&*recording, station, setup).unwrap();
                assert!(found.blocks > 2, "{} blocks", found.blocks);
                assert_eq!(found.samples, written.samples);
                let mut capture = found.capture;
                assert!(capture.object.ends_with(&format!("h5:/{}/{}", rig.setups[setup].id, capture.station)));
                capture.object.clone_from(&written.capture.object);
                assert_eq!(capture, written.capture);
            }
        }
        // The checksum that came of reading is that of the file.
        assert_eq!(recording.checksum().is_some(), deflate.is_none());
        if let Some(checksum) = recording.checksum() {
            assert_eq!(checksum.finish().unwrap(), Input::of(&path).unwrap());
        }
    }
}

#[test]
fn an_encoder_s_angle_comes_back_with_its_turns() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("encoder.h5");
    let memory = Memory::new(&rig, &[("s", 0.0)], 70_000, true);
    write(&memory, &rig, &path, &WriteOptions::default()).unwrap();
    let found = read(&*load(&path, &rig).unwrap(), 0, 1).unwrap();
    let written = &memory.captures[0][1];
    assert!(found.capture.encoder);
    assert_eq!(found.angle_rev.len(), written.angle_rev.len());
    for (found, written) in found.angle_rev.iter().zip(&written.angle_rev) {
        // Turns to degrees and back: two roundings of numbers up to 1400 turns.
        assert!((found - written).abs() <= 1400.0 * 2.0 * f64::EPSILON, "{found} {written}");
    }
    // The last whole turn ends just after the last sample.
    assert_eq!(found.capture.marks.len(), 70_000 / TURN - 1);
    for (found, written) in found.capture.marks.iter().zip(&written.capture.marks) {
        // That rounding at 50 samples a turn.
        assert!((found - written).abs() < 1e-10, "{found} {written}");
    }
}

#[test]
fn a_converter_s_codes_come_back_exactly_with_its_limits() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let mut memory = Memory::new(&rig, &[("s", 0.0)], 3000, false);
    // Channels of different range, the second around an offset; readings on the converters' codes, some at the limits.
    let ranges_um = [[-50.0, 50.0], [-5.0, 20.0]];
    for stream in &mut memory.captures[0] {
        stream.capture.converter_limits_um = Some(ranges_um.to_vec());
        for (index, value) in stream.samples.iter_mut().enumerate() {
            let [low_um, high_um] = ranges_um[index % 2];
            let code = (value.clamp(-12.0, 12.0) / 12.0 * 32_767.5 + 32_767.5).round();
            *value = low_um + code * (high_um - low_um) / 65_535.0;
        }
    }
    for (samples, code_um) in
        [(SampleFormat::I16(Scale::ConverterLimits), 0.0), (SampleFormat::I32(Scale::ConverterLimits), 100.0 / 4e9)]
    {
        let path = folder.path().join("codes.h5");
        write(&memory, &rig, &path, &WriteOptions { samples, ..WriteOptions::default() }).unwrap();
        let found = read(&*load(&path, &rig).unwrap(), 0, 0).unwrap();
        let limits_um = found.capture.converter_limits_um.unwrap();
        for (limits, range) in limits_um.iter().zip(&ranges_um) {
            // Two roundings at 50 µm.
            assert!((limits[0] - range[0]).abs() < 3e-14 && (limits[1] - range[1]).abs() < 3e-14, "{limits:?}");
        }
        for (index, (found, written)) in found.samples.iter().zip(&memory.captures[0][0].samples).enumerate() {
            assert!((found - written).abs() <= code_um / 2.0 + 3e-14, "{found} {written}");
            let [low, high] = ranges_um[index % 2];
            // What was clipped still meets the limit to the bit, or clipping could not be detected.
            let limits = limits_um[index % 2];
            let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
            assert_eq!(same(*written, low), same(*found, limits[0]));
            assert_eq!(same(*written, high), same(*found, limits[1]));
        }
    }
}

#[test]
fn a_given_scale_costs_half_a_code_and_refuses_what_it_cannot_hold() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("codes.h5");
    let mut memory = Memory::new(&rig, &[("s", 0.0)], 3000, false);
    memory.captures[0][0].capture.converter_limits_um = Some(vec![[-20.0, 20.0], [-20.0, 20.0]]);
    let scale = Scale::Given { scale_um: 0.01, offset_um: 0.0 };
    let options = WriteOptions { samples: SampleFormat::I16(scale), ..WriteOptions::default() };
    write(&memory, &rig, &path, &options).unwrap();
    let found = read(&*load(&path, &rig).unwrap(), 0, 0).unwrap();
    assert_eq!(found.capture.converter_limits_um, Some(vec![[-20.0, 20.0], [-20.0, 20.0]]));
    for (found, written) in found.samples.iter().zip(&memory.captures[0][0].samples) {
        assert!((found - written).abs() <= 0.005 + 1e-12, "{found} {written}");
    }

    let refused = folder.path().join("refused.h5");
    for bad in [400.0, f64::NAN] {
        memory.captures[0][1].samples[77] = bad;
        let text = message(write(&memory, &rig, &refused, &options));
        assert!(text.contains("sample 38, S2") && text.contains("i16"), "{text}");
    }
    // NaN has a place among floats.
    let options = WriteOptions { samples: SampleFormat::F32, ..WriteOptions::default() };
    write(&memory, &rig, &path, &options).unwrap();
    let found = read(&*load(&path, &rig).unwrap(), 0, 1).unwrap();
    assert!(found.samples[77].is_nan());
    assert!((found.samples[78] - memory.captures[0][1].samples[78]).abs() < 12.5 * 6e-8);
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["codes.h5"], "nothing else is left behind");
}

#[test]
fn codes_without_limits_or_scale_are_refused() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let memory = Memory::new(&rig, &[("s", 0.0)], 100, false);
    let options = WriteOptions { samples: SampleFormat::I16(Scale::ConverterLimits), ..WriteOptions::default() };
    let text = message(write(&memory, &rig, &folder.path().join("x.h5"), &options));
    assert!(text.contains("limits"), "{text}");
}

#[test]
fn the_truth_comes_back() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("truth.h5");
    let mut memory = Memory::new(&rig, &[("s", 0.0)], 100, false);
    let curve = |seed: u64| noise(seed).take(360).collect::<Vec<f64>>();
    let truth = StationTruth {
        form_um: vec![curve(1), curve(2)],
        motion: Some([curve(3), curve(4), curve(5), curve(6)]),
        z_um: Some(curve(7)),
    };
    memory.truth = Some(truth.clone());
    let scenario = "seed = 7\n".repeat(20_000);
    write(&memory, &rig, &path, &WriteOptions { scenario: Some(&scenario), ..WriteOptions::default() }).unwrap();
    assert_eq!(load(&path, &rig).unwrap().truth(0).unwrap(), Some(truth));
    assert!(inspect(&path).unwrap().truth);
    memory.truth = None;
    write(&memory, &rig, &path, &WriteOptions::default()).unwrap();
    assert_eq!(load(&path, &rig).unwrap().truth(0).unwrap(), None);
}

#[test]
fn inspection_lists_what_is_there() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("shaft.h5");
    let memory = Memory::new(&rig, &[("b", 2.0), ("a", 1.0)], 500, false);
    let scale = Scale::Given { scale_um: 0.01, offset_um: 0.0 };
    let options = WriteOptions { samples: SampleFormat::I32(scale), title: "Shaft", ..WriteOptions::default() };
    write(&memory, &rig, &path, &options).unwrap();
    let report = inspect(&path).unwrap();
    assert_eq!(report.format.as_deref(), Some("runout-measurement"));
    assert_eq!(report.version, Some(1));
    assert_eq!(report.title.as_deref(), Some("Shaft"));
    assert_eq!(report.setups, ["initial", "reversed"]);
    assert!(!report.truth);
    let stations: Vec<(&str, f64)> =
        report.stations.iter().map(|station| (station.station.as_str(), station.z_mm)).collect();
    assert_eq!(stations, [("a", 1.0), ("b", 2.0)]);
    let capture = &report.stations[0].captures[1];
    assert_eq!(capture.setup, "reversed");
    assert_eq!(capture.channels, ["S1", "S2"]);
    assert_eq!((capture.samples, capture.sample_type, capture.phase, capture.turns), (500, "i32", "index", 9));
    assert_eq!((capture.sample_rate_hz, capture.speed_rpm), (Some(50.0), Some(60.0)));
}

#[test]
fn captures_can_be_read_from_several_threads_at_once() {
    let (folder, rig) = (tempfile::tempdir().unwrap(), rig());
    let path = folder.path().join("threads.h5");
    let memory = Memory::new(&rig, &[("a", 1.0), ("b", 2.0)], 50_000, true);
    write(&memory, &rig, &path, &WriteOptions::default()).unwrap();
    let recording = load(&path, &rig).unwrap();
    std::thread::scope(|scope| {
        for capture in 0..4 {
            let (recording, memory) = (&recording, &memory);
            scope.spawn(move || {
                let (station, setup) = (capture / 2, capture % 2);
                let found = read(&**recording, station, setup).unwrap();
                assert_eq!(found.samples, memory.captures[station][setup].samples);
            });
        }
    });
}
