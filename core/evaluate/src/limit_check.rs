//! Whether a limit names a value that is computed.

use super::{Evaluate, Limit, ascii_unit};
use crate::error_motion::{self, Centre, WITH_FUNDAMENTAL};
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
        let mut symbols = evaluate.symbols();
        symbols.extend(own.iter().map(|(symbol, unit)| ((*symbol).to_owned(), *unit)));
        match symbols.iter().find(|(symbol, _)| *symbol == self.symbol) {
            Some((symbol, unit)) if ascii_unit(unit) != ascii_unit(&self.unit) => {
                let message = format!("{symbol} is given in `{}`, found `{}`", ascii_unit(unit), self.unit);
                return Err(Fault::at("unit", message));
            }
            None => {
                let fault = Fault::at("symbol", format!("no value `{}` is computed", self.symbol));
                let mut known: Vec<&str> = symbols.iter().map(|(symbol, _)| &**symbol).collect();
                known.dedup();
                let more = "`values` and `lambda_c_mm` in [evaluate] give more";
                return Err(fault.help(format!("{}; {more}", known_names(&self.symbol, known))));
            }
            Some(_) => {}
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
        let symbols = |of: &dyn Fn(&runout_standards::roundness::Reference) -> &'static str| {
            evaluate.references.iter().map(|reference| of(reference).to_owned()).collect()
        };
        match &*self.symbol {
            "RONt" | "RONp" | "RONv" | "RONq" | "dr/dtheta" => {
                known("reference", &self.reference, symbols(&|one| one.symbol()))?;
            }
            "STRt" | "STRp" | "STRv" | "STRq" => {
                let lines = evaluate.references.iter().filter_map(|reference| reference.line_symbol());
                known("reference", &self.reference, lines.map(str::to_owned).collect())?;
            }
            "CYLt" | "CYLp" | "CYLv" | "CYLq" => {
                known("reference", &self.reference, symbols(&|one| one.cylinder_symbol()))?;
            }
            symbol if symbol.ends_with(WITH_FUNDAMENTAL) || error_motion::is_along_axis(symbol) => {
                known("reference", &self.reference, vec![Centre::PolarChart.symbol().to_owned()])?;
            }
            symbol if ["synchronous-", "residual-", "total-"].iter().any(|kind| symbol.starts_with(kind)) => {
                let centres = evaluate.centres.iter().map(|centre| centre.symbol().to_owned());
                known("reference", &self.reference, centres.collect())?;
            }
            _ => {}
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
