//! The exchange format of ETALON, as ISG and Beckhoff TF5280 read it.
//!
//! Beckhoff Information System, TF5280, *Etalon exchange format*: `[C0B]` and `VALUE = …`, `[EXY]` and `Gridpoints = { … }` with a pair of
//! argument and value a line, `//` before a comment. Units as in `ISG_CSV`.

use runout_core::component_curves::symbols;

use super::{
    Comments, Dialect, Written, fixed,
    isg::{errors, location, notes},
};
use crate::{chain::Chain, config::ControllerConfig};

pub(super) struct Etalon(pub ControllerConfig);

impl Dialect for Etalon {
    fn comments(&self) -> Comments {
        Comments::First("//")
    }

    fn holds(&self, _symbol: &str) -> bool {
        true
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let mut lines = Vec::new();
        for (name, value) in location(chain) {
            lines.extend([format!("[{name}]"), format!("VALUE = {}", fixed(value, 12)), String::new()]);
        }
        for axis in &chain.axes {
            for (error, symbol) in symbols(&axis.letter).into_iter().enumerate() {
                lines.extend([format!("[{symbol}]"), "Gridpoints = {".to_owned()]);
                for node in 0..axis.nodes.len() {
                    let value = errors(chain, axis, node, self.0.arms_from_mm)[error];
                    lines.push(format!("{} {}", fixed(axis.nodes[node].position, 6), fixed(value, 12)));
                }
                lines.extend([format!("}} // end of {symbol}"), String::new()]);
            }
        }
        Ok(Written::one(lines, notes(&self.0)))
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        chain.error_um(place_mm).map(|error| -error)
    }
}
