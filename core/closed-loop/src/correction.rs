//! What results are corrected for, as files name it.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::diagnosis::{Added, Estimated, rounded};

/// An effect that results are corrected for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Correction {
    /// Its id.
    pub effect: String,
    /// Where it acts; of a confounded set, one representative.
    pub targets: Vec<String>,
    /// What these data do not distinguish it from: "effect target".
    pub confounded_with: Vec<String>,
    /// Its parameters.
    pub parameters: Vec<Estimated>,
    /// Whether `[diagnose] known` declares it; the loop added it else.
    pub known: bool,
}

impl From<&Added> for Correction {
    fn from(added: &Added) -> Self {
        Self {
            effect: added.effect.clone(),
            targets: added.targets.clone(),
            confounded_with: added.confounded_with.clone(),
            parameters: added.parameters.clone(),
            known: false,
        }
    }
}

/// "reversal-angle b: angle 0.340012 deg (standard uncertainty 0.00058)", on one line.
impl fmt::Display for Correction {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.effect)?;
        for target in &self.targets {
            write!(formatter, " {target}")?;
        }
        for other in &self.confounded_with {
            write!(formatter, " or {other}")?;
        }
        for (index, one) in self.parameters.iter().enumerate() {
            let separator = if index == 0 { ":" } else { "," };
            write!(formatter, "{separator} {} {}", one.name, rounded(one.value, 6))?;
            if one.unit != "1" {
                write!(formatter, " {}", one.unit)?;
            }
            if let Some(std) = one.std {
                write!(formatter, " (standard uncertainty {})", rounded(std, 2))?;
            }
        }
        if self.known { formatter.write_str(" (declared as known)") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_correction_is_one_line() {
        let angle = Estimated { name: "angle".into(), value: 0.340_012_345, std: Some(0.000_578), unit: "deg".into() };
        let gain = Estimated { name: "gain".into(), value: -0.05, std: None, unit: "1".into() };
        let correction = |effect: &str, target: &str, others: &[&str], parameter, known| Correction {
            effect: effect.into(),
            targets: vec![target.into()],
            confounded_with: others.iter().map(|other| (*other).into()).collect(),
            parameters: vec![parameter],
            known,
        };
        assert_eq!(
            correction("reversal-angle", "b", &[], angle, false).to_string(),
            "reversal-angle b: angle 0.340012 deg (standard uncertainty 0.00058)"
        );
        assert_eq!(
            correction("sensor-gain", "S3", &["sensor-gain S4"], gain, true).to_string(),
            "sensor-gain S3 or sensor-gain S4: gain -0.05 (declared as known)"
        );
        let shown = [rounded(100.183_987_234, 6), rounded(-1.7e-5, 9), rounded(0.0, 3)].map(|value| value.to_string());
        assert_eq!(shown, ["100.184", "-0.000017", "0"]);
    }
}
