//! What the tests share.

use std::{
    fs,
    path::{Path, PathBuf},
};

use runout_channels::{Channel, ChannelFile, open};
use runout_core::{Result, input_file::InputFile};

/// Where the assets are.
pub(crate) fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/assets")
}

/// Every asset that has a list of what its reference library reads, by name.
pub(crate) fn all_assets() -> Vec<PathBuf> {
    let expected = fs::read_dir(assets()).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = expected
        .filter(|path| path.extension().is_some_and(|end| end == "expected"))
        .map(|path| path.with_extension(""))
        .collect();
    files.sort();
    files
}

/// One campaign in every format, with a mark.
pub(crate) fn campaign() -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        fs::read_dir(assets().join("campaign")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

pub(crate) fn opened(path: &Path) -> Result<Box<dyn ChannelFile>> {
    open(&InputFile::new(path)?, None)
}

/// All samples of one channel, read in blocks.
pub(crate) fn samples(file: &dyn ChannelFile, channel: usize, most: usize) -> Result<Vec<f64>> {
    let mut column = [Vec::new()];
    let mut reader = file.read(&[channel])?;
    while reader.next(most, &mut column)? > 0 {}
    let [values] = column;
    Ok(values)
}

/// All channels that hold numbers, with their samples.
pub(crate) fn all(file: &dyn ChannelFile) -> Result<Vec<(Channel, Vec<f64>)>> {
    let numbers = (0..file.channels().len()).filter(|index| file.channels()[*index].kind.is_number());
    numbers.map(|index| Ok((file.channels()[index].clone(), samples(file, index, 1 << 13)?))).collect()
}

/// What is in memory as the same bits: NaN is NaN.
pub(crate) fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| if value.is_nan() { u64::MAX } else { value.to_bits() }).collect()
}

/// Whether an asset is text, whose end does not say that it is one.
pub(crate) fn is_text(path: &Path) -> bool {
    path.extension().is_some_and(|end| ["csv", "lvm", "txt", "uff"].iter().any(|text| end == *text))
}

/// Writes a file that may be there already. Over one that is cut to nothing first, ext4 waits for the disk each time.
pub(crate) fn written(path: &Path, bytes: &[u8]) {
    let _ = fs::remove_file(path);
    fs::write(path, bytes).unwrap();
}
