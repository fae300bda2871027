//! Siemens SINUMERIK: `$AA_ENC_COMP` (positioning of an axis) and `$AN_CEC` (one axis by the position of another).
//!
//! Function manual *Extended functions*, K3 (6FC5397-1BP40): linear between evenly spaced points, the value of the end beyond, modulo for a
//! turn. Values in mm or °. A positive value of `$AA_ENC_COMP` moves the axis in its negative direction (808D, function manual).

use super::{
    Comments, Dialect, Written,
    cross::{self, tables},
    few_enough, fixed, is_positioning, is_turn, name, positioning_adds_um, positions,
};
use crate::{
    chain::Chain,
    config::{ControllerConfig, Moves},
};

/// Interpolation points of an axis that the 840D has at most by its machine data.
const MOST_POINTS: usize = 5000;

pub(super) struct EncComp(pub ControllerConfig);
pub(super) struct Cec(pub ControllerConfig);

impl Dialect for EncComp {
    fn comments(&self) -> Comments {
        Comments::First(";")
    }

    fn holds(&self, symbol: &str) -> bool {
        is_positioning(symbol)
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let most = self.0.most_points.unwrap_or(MOST_POINTS);
        let mut lines = vec!["%_N_AX_EEC_INI".to_owned(), "CHANDATA(1)".to_owned()];
        let mut notes = vec![
            "unit mm and °; a positive value moves the axis in its negative direction: the value is the error, actual less command".into(),
        ];
        for axis in &chain.axes {
            let own = name(&self.0, &axis.letter);
            let points = positions(&self.0, chain, &axis.letter).unwrap_or_default();
            few_enough(points.len(), most, &axis.letter)?;
            let value =
                |(point, [_, value]): (usize, &[f64; 2])| format!("$AA_ENC_COMP[0,{point},{own}]={}", fixed(*value, 6));
            lines.extend(points.iter().enumerate().map(value));
            let [from, to] = axis.ends();
            lines.push(format!("$AA_ENC_COMP_STEP[0,{own}]={:.6}", axis.step()));
            lines.push(format!("$AA_ENC_COMP_MIN[0,{own}]={from:.6}"));
            lines.push(format!("$AA_ENC_COMP_MAX[0,{own}]={to:.6}"));
            lines.push(format!("$AA_ENC_COMP_IS_MODULO[0,{own}]={}", u8::from(is_turn(axis.rotary, [from, to]))));
            notes.push(format!("{own}: MD38000 $MA_MM_ENC_COMP_MAX_POINTS[0,{own}] of at least {}", points.len()));
        }
        lines.push("M17".into());
        Ok(Written::one(lines, notes))
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        positioning_adds_um(chain, place_mm)
    }
}

impl Dialect for Cec {
    fn comments(&self) -> Comments {
        Comments::First(";")
    }

    fn holds(&self, symbol: &str) -> bool {
        cross::holds(symbol)
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let sign = if self.0.positive_moves == Some(Moves::Positive) { 1.0 } else { -1.0 };
        let tables = tables(chain);
        if let Some(most) = self.0.most_tables.filter(|most| tables.len() > *most) {
            return Err(format!(
                "{} tables are needed, and the control has {most}: name errors in `leave_out`",
                tables.len()
            ));
        }
        let mut lines = vec!["%_N_NC_CEC_INI".to_owned(), "CHANDATA(1)".to_owned()];
        let moves = if sign > 0.0 { "positive" } else { "negative" };
        let mut notes = vec![
            format!("unit mm; a positive value has to move the output axis in its {moves} direction: `positive_moves`"),
            "enable with SD41300 $SN_CEC_TABLE_ENABLE and MD32710 $MA_CEC_ENABLE of the output axis".to_owned(),
        ];
        for (number, table) in tables.iter().enumerate() {
            let Some(axis) = chain.axis(table.input) else { continue };
            let at = self.0.first_table + number;
            let (input, output) = (name(&self.0, table.input), name(&self.0, table.output));
            let of = format!("the table of {input} on {output}");
            few_enough(table.wanted_mm.len(), self.0.most_points.unwrap_or(MOST_POINTS), &of)?;
            let value = |(point, wanted): (usize, &f64)| format!("$AN_CEC[{at},{point}]={}", fixed(sign * wanted, 6));
            lines.extend(table.wanted_mm.iter().enumerate().map(value));
            let [from, to] = axis.ends();
            lines.push(format!("$AN_CEC_INPUT_AXIS[{at}]=({input})"));
            lines.push(format!("$AN_CEC_OUTPUT_AXIS[{at}]=({output})"));
            lines.push(format!("$AN_CEC_STEP[{at}]={:.6}", axis.step()));
            lines.push(format!("$AN_CEC_MIN[{at}]={from:.6}"));
            lines.push(format!("$AN_CEC_MAX[{at}]={to:.6}"));
            lines.push(format!("$AN_CEC_DIRECTION[{at}]=0"));
            lines.push(format!("$AN_CEC_MULT_BY_TABLE[{at}]=0"));
            lines.push(format!("$AN_CEC_IS_MODULO[{at}]={}", u8::from(is_turn(axis.rotary, [from, to]))));
            notes
                .push(format!("table {at}: MD18342 $MN_MM_CEC_MAX_POINTS[{at}] of at least {}", table.wanted_mm.len()));
        }
        lines.push("M17".into());
        Ok(Written::one(lines, notes))
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        cross::adds_um(chain, place_mm)
    }
}
