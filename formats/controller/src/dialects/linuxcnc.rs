//! LinuxCNC: `COMP_FILE` with `COMP_FILE_TYPE = 0`, one file a joint.
//!
//! Its source (`src/emc/motion/usrmotintf.cc`, `motion.h`): lines of nominal, forward and reverse position, nominal ascending, at most 256;
//! the joint moves by nominal less forward (reverse). Reading stops at the first other line.

use super::{Comments, Dialect, Written, few_enough, fixed, is_positioning, positions};
use crate::{
    chain::{Chain, index},
    config::ControllerConfig,
};

/// `EMCMOT_COMP_SIZE`.
const MOST_POINTS: usize = 256;

pub(super) struct Linuxcnc(pub ControllerConfig);

impl Linuxcnc {
    fn axis(&self) -> &str {
        self.0.axis.as_deref().unwrap_or("X")
    }
}

impl Dialect for Linuxcnc {
    fn comments(&self) -> Comments {
        Comments::Last("# ", "")
    }

    /// Errors of other axes are those of other files.
    fn holds(&self, symbol: &str) -> bool {
        is_positioning(symbol) && symbol.ends_with(self.axis())
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let axis = self.axis();
        let points = positions(&self.0, chain, axis).ok_or_else(|| format!("there is no curve of the axis {axis}"))?;
        few_enough(points.len(), self.0.most_points.unwrap_or(MOST_POINTS).min(MOST_POINTS), axis)?;
        let row = |[at, error]: &[f64; 2]| [*at, at + error, at + error].map(|number| fixed(number, 6)).join(" ");
        let notes = vec![
            "COMP_FILE_TYPE = 0: nominal, forward and reverse position, in mm or °, of a machine in these units".to_owned(),
            "forward and reverse are equal: the curves do not tell directions apart; BACKLASH is ignored beside COMP_FILE".to_owned(),
        ];
        Ok(Written::one(points.iter().map(row).collect(), notes))
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        let mut adds = [0.0; 3];
        if let (Some(own), Some(axis)) = (index(self.axis()), chain.axis(self.axis())) {
            adds[own] = -axis.at(place_mm[own])[own];
        }
        adds
    }
}
