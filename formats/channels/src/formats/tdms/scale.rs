//! Scales that DAQmx and LabVIEW write as properties `NI_Scale[n]_…`: each takes the result of another one, or raw numbers.

use super::{
    Properties,
    metadata::{Scaler, Value},
};
use crate::strided::Scaling;

/// The input of a scale that takes raw numbers.
const RAW: f64 = 4_294_967_295.0;
/// More scales are none of a program.
const MOST: usize = 64;
/// More points of a table, or coefficients of a polynomial, are none.
const MOST_POINTS: usize = 1 << 16;

/// Scales in the order in which they are applied.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chain {
    steps: Vec<Step>,
    /// A digital line is one bit of the code.
    bit: Option<u32>,
}

#[derive(Debug, Clone, PartialEq)]
enum Step {
    /// The raw number.
    Raw,
    Copy(Input),
    Linear {
        slope: f64,
        intercept: f64,
        of: Input,
    },
    Polynomial {
        coefficients: Vec<f64>,
        of: Input,
    },
    Table {
        raw: Vec<f64>,
        scaled: Vec<f64>,
        of: Input,
    },
    Add(Input, Input),
    /// The right operand less the left one, as National Instruments' own readers have it.
    Subtract(Input, Input),
}

/// A step before this one; `None` is the raw number.
type Input = Option<usize>;

impl Chain {
    /// From the properties of a channel, its group or the file, the first that has scales.
    ///
    /// # Errors
    /// What is not applied.
    pub(super) fn of(levels: [&Properties; 3], scalers: &[Scaler]) -> Result<Option<Self>, String> {
        let bit = scalers.first().and_then(|scaler| scaler.bit);
        let found = levels.iter().find_map(|properties| Some((properties, count(properties)?)));
        let Some((properties, count)) = found.filter(|(properties, _)| !is_scaled(properties)) else {
            if scalers.len() > 1 {
                return Err(format!("of its {} DAQmx scalers, only the first is read", scalers.len()));
            }
            return Ok(bit.map(|bit| Self { steps: vec![Step::Raw], bit: Some(bit) }));
        };
        if count > MOST {
            return Err(format!("it has {count} scales, {MOST} are applied at most"));
        }
        let steps = (0..count).map(|index| step(properties, index, scalers)).collect::<Result<_, _>>()?;
        Ok(Some(Self { steps, bit }))
    }

    /// The result of the last step. Inputs come before a step, so that each is known when it is asked for.
    fn value(&self, raw: f64, results: &mut Vec<f64>) -> f64 {
        results.clear();
        for step in &self.steps {
            let of = |input: &Input| input.and_then(|step| results.get(step).copied()).unwrap_or(raw);
            let result = match step {
                Step::Raw => raw,
                Step::Copy(input) => of(input),
                Step::Linear { slope, intercept, of: input } => of(input) * slope + intercept,
                Step::Polynomial { coefficients, of: input } => {
                    let x = of(input);
                    coefficients.iter().rev().copied().reduce(|sum, coefficient| coefficient + sum * x).unwrap_or(0.0)
                }
                Step::Table { raw: from, scaled, of: input } => interpolated(from, scaled, of(input)),
                Step::Add(left, right) => of(left) + of(right),
                Step::Subtract(left, right) => of(right) - of(left),
            };
            results.push(result);
        }
        results.last().copied().unwrap_or(raw)
    }
}

impl Scaling for Chain {
    fn apply(&self, values: &mut [f64]) {
        if let Some(bit) = self.bit {
            for value in values.iter_mut() {
                *value = (((*value as i64) >> bit) & 1) as f64;
            }
        }
        // One straight line is what most channels have.
        if let [Step::Raw, Step::Linear { slope, intercept, .. }] | [Step::Linear { slope, intercept, of: None }] =
            &self.steps[..]
        {
            for value in values {
                *value = *value * slope + intercept;
            }
            return;
        }
        let mut results = Vec::with_capacity(self.steps.len());
        for value in values {
            *value = self.value(*value, &mut results);
        }
    }
}

/// Whether the numbers were scaled before they were written.
fn is_scaled(properties: &Properties) -> bool {
    properties.get("NI_Scaling_Status").and_then(Value::text).as_deref() == Some("scaled")
}

/// How many scales there are.
fn count(properties: &Properties) -> Option<usize> {
    let stated = properties.get("NI_Number_Of_Scales").and_then(Value::number).map(|count| count as usize);
    let index =
        |name: &String| -> Option<usize> { name.strip_prefix("NI_Scale[")?.strip_suffix("]_Scale_Type")?.parse().ok() };
    let highest = || properties.keys().filter_map(index).max().map(|highest| highest + 1);
    stated.or_else(highest).filter(|count| *count > 0)
}

fn step(properties: &Properties, index: usize, scalers: &[Scaler]) -> Result<Step, String> {
    let value = |name: &str| properties.get(&format!("NI_Scale[{index}]_{name}"));
    let number = |name: &str| {
        let found = value(name).and_then(Value::number);
        found.ok_or_else(|| format!("its scale {index} lacks the number `{name}`"))
    };
    let input = |name: &str| match value(name).and_then(Value::number).unwrap_or(RAW) {
        RAW => Ok(None),
        of if of >= 0.0 && of < index as f64 => Ok(Some(of as usize)),
        of => Err(format!("its scale {index} takes the result of {of}, which is not before it")),
    };
    let list = |name: &str, default: Option<usize>| {
        let count = match default {
            Some(default) if value(&format!("{name}_Size")).is_none() => default,
            _ => number(&format!("{name}_Size"))? as usize,
        };
        if count > MOST_POINTS {
            return Err(format!("its scale {index} has {count} numbers `{name}`, {MOST_POINTS} are read at most"));
        }
        (0..count).map(|place| number(&format!("{name}[{place}]"))).collect::<Result<Vec<f64>, String>>()
    };
    let Some(kind) = value("Scale_Type").and_then(Value::text) else {
        // A scale without a type stands for a DAQmx scaler.
        return match scalers {
            [only] if only.id as usize == index => Ok(Step::Raw),
            [] => Err(format!("its scale {index} has no type")),
            _ => Err(format!("its scale {index} is one of several DAQmx scalers")),
        };
    };
    Ok(match kind.as_str() {
        "Linear" => Step::Linear {
            slope: number("Linear_Slope")?,
            intercept: number("Linear_Y_Intercept")?,
            of: input("Linear_Input_Source")?,
        },
        "Polynomial" => Step::Polynomial {
            coefficients: list("Polynomial_Coefficients", Some(4))?,
            of: input("Polynomial_Input_Source")?,
        },
        "Table" => {
            let (mut raw, mut scaled) = (list("Table_Pre_Scaled_Values", None)?, list("Table_Scaled_Values", None)?);
            if raw.first() > raw.last() {
                raw.reverse();
                scaled.reverse();
            }
            let rises = |pair: &[f64]| pair[0] < pair[1];
            if raw.is_empty() || raw.len() != scaled.len() || !raw.windows(2).all(rises) {
                return Err(format!("the table of its scale {index} does not rise or fall from point to point"));
            }
            Step::Table { raw, scaled, of: input("Table_Input_Source")? }
        }
        "Add" => Step::Add(input("Add_Left_Operand_Input_Source")?, input("Add_Right_Operand_Input_Source")?),
        "Subtract" => {
            Step::Subtract(input("Subtract_Left_Operand_Input_Source")?, input("Subtract_Right_Operand_Input_Source")?)
        }
        "AdvancedAPI" => Step::Copy(input("AdvancedAPI_Input_Source")?),
        other => return Err(format!("its scale {index}, `{other}`, is not applied")),
    })
}

/// Linear between points, and constant beyond them.
fn interpolated(from: &[f64], to: &[f64], x: f64) -> f64 {
    let behind = from.partition_point(|point| *point <= x);
    match behind {
        0 => to[0],
        _ if behind == from.len() => to[behind - 1],
        _ => {
            let slope = (to[behind] - to[behind - 1]) / (from[behind] - from[behind - 1]);
            slope * (x - from[behind - 1]) + to[behind - 1]
        }
    }
}
