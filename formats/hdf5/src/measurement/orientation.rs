//! Which dimension of the samples counts the channels: MATLAB writes dimensions reversed, LabVIEW one row a channel.

use std::ops::Range;

use hdf5_metno::{Dataset, H5Type};
use ndarray::s;

/// How the samples lie in their dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Orientation {
    /// `[samples, channels]`, as the format has it.
    SampleRows,
    /// `[channels, samples]`.
    ChannelRows,
}

impl Orientation {
    /// The number of samples and the orientation of a shape that so many channels were named for.
    ///
    /// # Errors
    /// What was expected and found, where no orientation fits or both do.
    pub(crate) fn of(shape: &[usize], names: usize) -> Result<(usize, Self), String> {
        let &[first, second] = shape else {
            return Err(format!("expected the shape [samples, channels], found {shape:?}"));
        };
        if first == 0 || second == 0 {
            return Err(format!("expected samples, found the shape {shape:?}"));
        }
        match (first == names, second == names) {
            (false, true) => Ok((first, Self::SampleRows)),
            (true, false) => Ok((second, Self::ChannelRows)),
            (true, true) => Err(format!(
                "the shape {shape:?} fits {names} channels either way: expected more samples than channels"
            )),
            (false, false) => Err(format!(
                "attribute `sensors`: expected one name for each channel of the shape {shape:?}, [samples, channels] or \
                 [channels, samples]; found {names}"
            )),
        }
    }

    /// Rows of samples of neighbouring channels, `[sample][channel]`.
    pub(crate) fn rows<T: H5Type + Copy>(
        self,
        dataset: &Dataset,
        samples: &Range<usize>,
        channels: &Range<usize>,
    ) -> hdf5_metno::Result<Vec<T>> {
        let (samples, channels) = (samples.clone(), channels.clone());
        match self {
            Self::SampleRows => {
                let found = dataset.read_slice_2d::<T, _>(s![samples, channels])?;
                // A fresh array in the order of rows begins where its memory does.
                let ordered = found.is_standard_layout();
                let (flat, _) = found.into_raw_vec_and_offset();
                if ordered { Ok(flat) } else { Err("the samples came in another order".into()) }
            }
            Self::ChannelRows => {
                let found = dataset.read_slice_2d::<T, _>(s![channels, samples])?;
                Ok(found.t().iter().copied().collect())
            }
        }
    }

    /// Some samples of one channel, as numbers are stored.
    pub(crate) fn channel(
        self,
        dataset: &Dataset,
        samples: Range<usize>,
        channel: usize,
    ) -> hdf5_metno::Result<Vec<f64>> {
        self.rows(dataset, &samples, &(channel..channel + 1))
    }

    /// Samples in a chunk of this shape.
    pub(crate) fn samples_of(self, chunk: &[usize]) -> Option<usize> {
        chunk.get(usize::from(self != Self::SampleRows)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_say_which_dimension_counts_the_channels() {
        assert_eq!(Orientation::of(&[500, 4], 4), Ok((500, Orientation::SampleRows)));
        assert_eq!(Orientation::of(&[4, 500], 4), Ok((500, Orientation::ChannelRows)));
        assert_eq!(Orientation::of(&[1, 500], 1), Ok((500, Orientation::ChannelRows)));
        for (shape, names, words) in [
            (&[4, 4][..], 4, "either way"),
            (&[1, 1], 1, "either way"),
            (&[500, 4], 3, "found 3"),
            (&[4, 500], 5, "found 5"),
            (&[0, 4], 4, "expected samples"),
            (&[4, 0], 4, "expected samples"),
            (&[500], 4, "[samples, channels]"),
            (&[2, 500, 4], 4, "[samples, channels]"),
        ] {
            let found = Orientation::of(shape, names).map_or_else(|problem| problem, |_| String::new());
            assert!(found.contains(words), "{shape:?}, {names}: {found}");
        }
    }
}
