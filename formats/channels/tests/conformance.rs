//! What every format does alike, on every asset.

use std::{fs, path::Path};

use runout_channels::{Channel, FORMATS, format_of};
use runout_core::{Result, input_file::InputFile};

use crate::{
    support::{all, all_assets, assets, bits, opened, samples, written},
    trials::trials,
};

/// What a file gives, or what was wrong with it.
fn read(path: &Path) -> Result<Vec<(Channel, Vec<f64>)>> {
    all(&*opened(path)?)
}

#[test]
fn every_format_has_assets_and_is_recognised_by_its_first_bytes() {
    let found: Vec<&str> =
        all_assets().iter().map(|path| format_of(&InputFile::new(path).unwrap(), None).unwrap().name).collect();
    for format in &FORMATS {
        assert!(found.contains(&format.name), "{} has no asset", format.name);
    }
}

#[test]
fn samples_do_not_depend_on_the_size_of_blocks_nor_on_what_is_read_beside() {
    for path in all_assets() {
        let file = opened(&path).unwrap();
        let together: Vec<usize> =
            (0..file.channels().len()).filter(|index| file.channels()[*index].kind.is_number()).collect();
        let whole: Vec<Vec<f64>> = together.iter().map(|index| samples(&*file, *index, 1 << 20).unwrap()).collect();
        for most in [1, 2, 3, 7, 64, 1000] {
            let mut columns = vec![Vec::new(); together.len()];
            let mut reader = file.read(&together).unwrap();
            loop {
                let before: Vec<usize> = columns.iter().map(Vec::len).collect();
                let taken = reader.next(most, &mut columns).unwrap();
                let grown = columns.iter().zip(before).map(|(column, before)| column.len() - before).max().unwrap_or(0);
                assert_eq!(taken, grown, "{}", path.display());
                assert!(taken <= most, "{}: {taken} samples in a block of {most}", path.display());
                if taken == 0 {
                    break;
                }
            }
            for (column, whole) in columns.iter().zip(&whole) {
                assert_eq!(bits(column), bits(whole), "{}, blocks of {most}", path.display());
            }
        }
    }
}

#[test]
fn channels_that_are_not_there_or_hold_text_are_refused() {
    for path in all_assets() {
        let file = opened(&path).unwrap();
        assert!(file.read(&[file.channels().len()]).is_err(), "{}", path.display());
        for (index, channel) in file.channels().iter().enumerate() {
            assert_eq!(file.read(&[index]).is_ok(), channel.kind.is_number(), "{}: {}", path.display(), channel.path());
        }
    }
}

/// A file that was cut is an error, or what is there of it is a beginning of what the whole file has.
#[test]
fn a_file_cut_at_every_length_gives_an_error_or_its_beginning() {
    let folder = tempfile::tempdir().unwrap();
    for path in all_assets() {
        let (bytes, whole) = (fs::read(&path).unwrap(), read(&path).unwrap());
        let cut = folder.path().join(path.file_name().unwrap());
        // Each length of a small file, and of a large one each behind a step and those around its ends.
        let step = (bytes.len() / 150).max(1);
        let mut without_words = 0;
        let ends = |length: &usize| length.is_multiple_of(step) || *length < 64 || *length + 64 > bytes.len();
        for length in (0..bytes.len()).filter(ends) {
            written(&cut, &bytes[..length]);
            let Ok(file) = opened(&cut) else { continue };
            let Ok(found) = all(&*file) else { continue };
            let names = format!("{} cut to {length} of {}", path.display(), bytes.len());
            let mut is_shorter = false;
            for (channel, values) in &found {
                // The same name may be that of several channels.
                // The last number of a text may be cut itself.
                let end = values.len() - usize::from(crate::support::is_text(&path)).min(values.len());
                let same = |(other, more): &&(Channel, Vec<f64>)| {
                    other.path() == channel.path() && bits(more).starts_with(&bits(&values[..end]))
                };
                let of_whole = whole.iter().find(same);
                // A text that is cut in its header or first rows is another text.
                let is_lvm = path.extension().is_some_and(|end| end == "lvm");
                let is_other = crate::support::is_text(&path) && (is_lvm || 2 * length < bytes.len());
                assert!(of_whole.is_some() || values.is_empty() || is_other, "{names}: {} differs", channel.path());
                is_shorter |= of_whole.is_some_and(|(_, more)| more.len() > values.len());
            }
            without_words += usize::from(is_shorter && file.remarks().is_empty());
        }
        // Where a part of the file ends, a whole file may end too.
        let most = if crate::support::is_text(&path) { usize::MAX } else { 8 };
        assert!(
            without_words <= most,
            "{}: of {without_words} lengths readings are missing without a word",
            path.display()
        );
    }
}

#[test]
fn an_empty_file_is_of_no_format() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty");
    fs::write(&path, "").unwrap();
    let error = opened(&path).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("no format"), "{error}");
    assert!(error.advice().unwrap().contains("Lion SEA"), "{error}");
    for format in &FORMATS {
        let opened = (format.open)(&InputFile::new(&path).unwrap());
        assert!(
            opened.map_or(true, |file| file.channels().iter().all(|channel| channel.samples == 0)),
            "{}",
            format.name
        );
    }
}

/// Numbers of four or eight bytes, evenly over the file, become lengths of gigabytes.
#[test]
fn lengths_that_lie_take_no_memory_and_no_time() {
    let folder = tempfile::tempdir().unwrap();
    for path in all_assets() {
        let bytes = fs::read(&path).unwrap();
        let lying = folder.path().join(path.file_name().unwrap());
        let step = (bytes.len() / trials(25)).max(1);
        for at in (0..bytes.len().saturating_sub(8)).step_by(step) {
            for length in [10_000_000_000_u64.to_le_bytes(), 10_000_000_000_u64.to_be_bytes(), [0xFF; 8], [0x7F; 8]] {
                let mut bytes = bytes.clone();
                bytes[at..at + 8].copy_from_slice(&length);
                written(&lying, &bytes);
                crate::mutations::check(&lying, bytes.len());
            }
        }
    }
}

#[test]
fn names_of_any_script_are_read() {
    let file = opened(&assets().join("types.tdms")).unwrap();
    assert!(file.channels().iter().any(|channel| channel.path() == "Läufe / 運転/it's a 'name'"));
}
