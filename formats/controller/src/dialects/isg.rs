//! ISG kernel and Beckhoff TF5280, volumetric compensation: parameter files of the format `ISG_CSV`.
//!
//! Beckhoff Information System, TF5280, *ISG CSV format* and *Units of measure*: a header of argument and parameters by their names of ISO
//! 230-1, records below it, `#` before the next header, `//` before a comment; mm and rad, arguments in mm and °.

use runout_core::component_curves::symbols;

use super::{Comments, Dialect, Written, fixed};
use crate::{
    chain::{AxisCurves, Chain, cross, index},
    config::ControllerConfig,
};

pub(super) struct IsgCsv(pub ControllerConfig);

/// The six errors at a node, in mm and rad, for arms that count from a point.
pub(super) fn errors(chain: &Chain, axis: &AxisCurves, node: usize, arms_from_mm: [f64; 3]) -> [f64; 6] {
    let node = &axis.nodes[node];
    let e = node.errors;
    let mut arm = [0.0; 3];
    let carried = chain.axes.iter().skip_while(|other| other.letter != axis.letter).skip(1);
    if let (false, Some(_)) = (axis.rotary, index(&axis.letter)) {
        carried
            .filter_map(|other| index(&other.letter))
            .for_each(|along| arm[along] = node.at_mm[along] - arms_from_mm[along]);
    }
    // An arm that is longer by this displaces less.
    let moved = cross([e[3], e[4], e[5]], arm);
    let [x, y, z] = [0, 1, 2].map(|along| 1e-3 * (e[along] - 1e-3 * moved[along]));
    [x, y, z, 1e-6 * e[3], 1e-6 * e[4], 1e-6 * e[5]]
}

/// Name and value, in mm or rad, of the location errors: `C0Y` of EC0Y.
pub(super) fn location(chain: &Chain) -> Vec<(String, f64)> {
    let value = |symbol: &str, value: f64| if "ABC".contains(&symbol[1..2]) { 1e-6 * value } else { 1e-3 * value };
    chain.location.iter().map(|(symbol, number)| (symbol[1..].to_owned(), value(symbol, *number))).collect()
}

/// What the user of a volumetric file has to know.
pub(super) fn notes(config: &ControllerConfig) -> Vec<String> {
    let [x, y, z] = config.arms_from_mm;
    vec![
        "unit mm and rad, arguments mm and °; values are errors, actual less command (ISO 230-1): `negate` of the control stays 0".into(),
        format!(
            "arms count from X {x} Y {y} Z {z} mm; the errors are of the measured point, so the tool that measured has length 0 for the control"
        ),
    ]
}

impl Dialect for IsgCsv {
    fn comments(&self) -> Comments {
        Comments::First("//")
    }

    fn holds(&self, _symbol: &str) -> bool {
        true
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let mut lines = Vec::new();
        let location = location(chain);
        if !location.is_empty() {
            lines.push(location.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>().join(" "));
            lines.push(location.iter().map(|(_, value)| fixed(*value, 12)).collect::<Vec<_>>().join(" "));
        }
        for axis in &chain.axes {
            if !lines.is_empty() {
                lines.push("#".into());
            }
            lines.push(format!("{} {}", axis.letter, symbols(&axis.letter).join(" ")));
            for node in 0..axis.nodes.len() {
                let errors = errors(chain, axis, node, self.0.arms_from_mm);
                let numbers: Vec<String> = errors.iter().map(|value| fixed(*value, 12)).collect();
                lines.push(format!("{} {}", fixed(axis.nodes[node].position, 6), numbers.join(" ")));
            }
        }
        Ok(Written::one(lines, notes(&self.0)))
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        chain.error_um(place_mm).map(|error| -error)
    }
}
