//! What each control reads.

mod cross;
mod etalon;
mod fanuc_3d;
mod fanuc_pitch;
mod heidenhain;
mod isg;
mod klipper;
mod linuxcnc;
mod siemens;

use std::path::PathBuf;

use runout_core::component_curves::symbols;

use crate::{
    chain::{Chain, LETTERS, index},
    config::{ControllerConfig, DialectName},
};

/// What a dialect makes of a chain.
pub(crate) struct Written {
    /// The lines, without what the header says.
    pub lines: Vec<String>,
    /// What one has to know of them.
    pub notes: Vec<String>,
    /// Other files beside it.
    pub beside: Vec<(PathBuf, Vec<String>)>,
}

impl Written {
    fn one(lines: Vec<String>, notes: Vec<String>) -> Self {
        Self { lines, notes, beside: Vec::new() }
    }
}

/// Where a dialect has its comments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Comments {
    /// Before the data, each behind this mark.
    First(&'static str),
    /// After the data, where the control has stopped to read, each between these marks.
    Last(&'static str, &'static str),
    /// In a text file of their own: the control's tables have none.
    Apart,
}

/// A dialect.
pub(crate) trait Dialect {
    /// Where what the header says goes.
    fn comments(&self) -> Comments;

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
        DialectName::Heidenhain => Box::new(heidenhain::Heidenhain(config)),
        DialectName::FanucPitch => Box::new(fanuc_pitch::FanucPitch(config)),
        DialectName::Fanuc3d => Box::new(fanuc_3d::Fanuc3d(config)),
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

/// Name of an axis at the control.
pub(crate) fn name<'a>(config: &'a ControllerConfig, axis: &'a str) -> &'a str {
    config.axes.get(axis).map_or(axis, String::as_str)
}

/// Whether a rotary axis has nodes over its whole turn.
pub(crate) fn is_turn(rotary: bool, [from, to]: [f64; 2]) -> bool {
    rotary && (to - from - 360.0).abs() < 1e-9
}

/// Whether an error is that of positioning.
pub(crate) fn is_positioning(symbol: &str) -> bool {
    symbol.len() == 3 && symbol[1..2] == symbol[2..3]
}

/// What positioning tables add to a command of the linear axes, in µm.
pub(crate) fn positioning_adds_um(chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
    LETTERS.map(|letter| {
        let own = index(letter).unwrap_or(0);
        chain.axis(letter).map_or(0.0, |axis| -axis.at(place_mm[own])[own])
    })
}
