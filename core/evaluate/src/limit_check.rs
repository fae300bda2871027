//! Whether a limit names a value that is computed.

use super::{Evaluate, Limit, ascii_unit};
use crate::{
    error_motion::Centre,
    known::{KnownValue, Referred},
};
use runout_error::fault::{Fault, known_names};
use runout_turning::rig::Rig;

impl Limit {
    /// Checks it for what will be evaluated, and for a domain's own values, by symbol and unit.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn check(
        self,
        evaluate: &Evaluate,
        own: &[(&'static str, &'static str)],
        rig: Option<&Rig>,
    ) -> Result<Self, Fault> {
        let mut values = evaluate.known_values();
        values.extend(own.iter().map(|(symbol, unit)| KnownValue::new(*symbol, unit, Referred::Other)));
        let Some(KnownValue { symbol, unit, referred }) = values.iter().find(|value| value.symbol == self.symbol)
        else {
            let fault = Fault::at("symbol", format!("no value `{}` is computed", self.symbol));
            let mut known: Vec<&str> = values.iter().map(|value| &*value.symbol).collect();
            known.dedup();
            let more = "`values` and `lambda_c_mm` in [evaluate] give more";
            return Err(fault.help(format!("{}; {more}", known_names(&self.symbol, known))));
        };
        if ascii_unit(unit) != ascii_unit(&self.unit) {
            let message = format!("{symbol} is given in `{}`, found `{}`", ascii_unit(unit), self.unit);
            return Err(Fault::at("unit", message));
        }
        let known = |key: &str, asked: &Option<String>, names: Vec<String>| match asked {
            Some(asked) if !names.contains(asked) => {
                let fault = Fault::at(key, format!("no value has the {key} `{asked}`"));
                Err(fault.help(known_names(asked, names.iter().map(String::as_str))))
            }
            _ => Ok(()),
        };
        self.check_orders()?;
        known("filter", &self.filter, evaluate.filter_names())?;
        let references = || evaluate.references.iter();
        let references: Option<Vec<&str>> = match referred {
            Referred::Circles => Some(references().map(|one| one.symbol()).collect()),
            Referred::Lines => Some(references().filter_map(|one| one.line_symbol()).collect()),
            Referred::Cylinders => Some(references().map(|one| one.cylinder_symbol()).collect()),
            Referred::Chart => Some(vec![Centre::PolarChart.symbol()]),
            Referred::Centres => Some(evaluate.centres.iter().map(|centre| centre.symbol()).collect()),
            Referred::Other => None,
        };
        if let Some(names) = references {
            known("reference", &self.reference, names.into_iter().map(str::to_owned).collect())?;
        }
        if let Some(rig) = rig {
            known("section", &self.section, rig.sections.clone())?;
        }
        let ends = [("lower", self.lower), ("upper", self.upper)];
        for (key, end) in ends {
            match end {
                Some(end) if !end.is_finite() => {
                    return Err(Fault::at(key, format!("expected a finite number, found {end}")));
                }
                _ => {}
            }
        }
        match (self.lower, self.upper) {
            (None, None) if self.upper_curve.is_none() => {
                Err(Fault::here("a limit needs `upper`, `lower` or both, or `upper_curve`"))
            }
            (Some(lower), Some(upper)) if lower > upper => {
                Err(Fault::at("upper", format!("expected a limit from lower = {lower} on, found {upper}")))
            }
            _ => Ok(self),
        }
    }
}
