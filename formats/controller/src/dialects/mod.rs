//! What each control reads.

mod etalon;
mod isg;
mod klipper;
mod linuxcnc;
mod siemens;

use runout_core::component_curves::symbols;

use crate::{
    chain::Chain,
    config::{ControllerConfig, DialectName},
};

/// What a dialect makes of a chain.
pub(crate) struct Written {
    /// The lines, without what the header says.
    pub lines: Vec<String>,
    /// What one has to know of them.
    pub notes: Vec<String>,
}

/// A dialect.
pub(crate) trait Dialect {
    /// Before a line that the control does not read.
    fn comment(&self) -> &'static str;

    /// Whether comments come after the data: the control stops to read at the first one.
    fn comments_last(&self) -> bool {
        false
    }

    /// Whether it holds an error.
    fn holds(&self, symbol: &str) -> bool;

    /// The file. The reason where a number is beyond what the control takes.
    fn write(&self, chain: &Chain) -> Result<Written, String>;

    /// What the control adds to a command of the linear axes, in µm.
    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3];
}

/// The dialect of a configuration.
pub(crate) fn dialect(config: &ControllerConfig) -> Box<dyn Dialect> {
    let config = config.clone();
    match config.dialect {
        DialectName::SiemensEncComp => Box::new(siemens::EncComp(config)),
        DialectName::SiemensCec => Box::new(siemens::Cec(config)),
        DialectName::IsgCsv => Box::new(isg::IsgCsv(config)),
        DialectName::Etalon => Box::new(etalon::Etalon(config)),
        DialectName::Linuxcnc => Box::new(linuxcnc::Linuxcnc(config)),
        DialectName::Klipper => Box::new(klipper::Klipper(config)),
    }
}

/// Place of the positioning error among the six errors of an axis: EXX, ECC.
pub(crate) fn positioning(axis: &str) -> usize {
    symbols(axis).iter().position(|symbol| symbol[1..2] == symbol[2..3]).unwrap_or(0)
}

/// Position, and positioning error there, of each node of an axis, less that at `zero_at`: in mm or °.
pub(crate) fn positions(config: &ControllerConfig, chain: &Chain, axis: &str) -> Option<Vec<[f64; 2]>> {
    let curves = chain.axis(axis)?;
    let error = positioning(axis);
    let unit = if curves.rotary { 1e-6_f64.to_degrees() } else { 1e-3 };
    let zero = config.zero_at.get(axis).map_or(0.0, |position| curves.at(*position)[error]);
    Some(curves.nodes.iter().map(|node| [node.position, unit * (node.errors[error] - zero)]).collect())
}

/// Refuses more points than the control takes.
pub(crate) fn few_enough(found: usize, most: usize, of: &str) -> Result<(), String> {
    if found <= most {
        return Ok(());
    }
    Err(format!("{of} has {found} points, and the control takes {most}: take a wider pitch of the component curves"))
}

/// A number with digits behind the point; 0 without a sign.
pub(crate) fn fixed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|letter| matches!(letter, b'0' | b'.')) => rest.to_owned(),
        _ => text,
    }
}
