//! Work on neighbouring channels side by side, so that the compiler can use vector registers.

/// Channels that are worked on at once, at most.
const WIDEST: usize = 8;

/// Work that is written once for any number of lanes.
pub trait LaneWork {
    /// Works on the channels `offset..offset + C`.
    fn lanes<const C: usize>(&mut self, offset: usize);
}

/// Does the work for all channels, in groups of at most 8.
pub fn in_lanes(channels: usize, work: &mut impl LaneWork) {
    for offset in (0..channels).step_by(WIDEST) {
        match (channels - offset).min(WIDEST) {
            1 => work.lanes::<1>(offset),
            2 => work.lanes::<2>(offset),
            3 => work.lanes::<3>(offset),
            4 => work.lanes::<4>(offset),
            5 => work.lanes::<5>(offset),
            6 => work.lanes::<6>(offset),
            7 => work.lanes::<7>(offset),
            _ => work.lanes::<8>(offset),
        }
    }
}

/// The lanes of one frame, all channels of one instant.
#[must_use]
pub fn load<const C: usize>(frame: &[f64], offset: usize) -> [f64; C] {
    let mut lanes = [0.0; C];
    lanes.copy_from_slice(&frame[offset..offset + C]);
    lanes
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Widths(Vec<(usize, usize)>);

    impl LaneWork for Widths {
        fn lanes<const C: usize>(&mut self, offset: usize) {
            self.0.push((offset, C));
        }
    }

    #[test]
    fn every_channel_is_worked_on_once() {
        for channels in 0..=19 {
            let mut widths = Widths(Vec::new());
            in_lanes(channels, &mut widths);
            let worked: Vec<usize> = widths.0.iter().flat_map(|(offset, width)| *offset..offset + width).collect();
            assert_eq!(worked, (0..channels).collect::<Vec<_>>());
        }
    }
}
