//! How often the tests of the data on themselves speak on sound campaigns, and what they find on troubled ones: whole pipelines, from points
//! to a diagnosis, of campaigns that share no formula with the solvers.

mod campaigns;

use std::{fmt::Write as _, path::Path};

use runout_core::{
    Error, Result,
    closed_loop::diagnosis::{Diagnosis, Verdict},
    consistency::Check,
    pipeline::{
        INCLUDE_KEY, Pipeline, Registry,
        diagnose::diagnose,
        document::Sources,
        run::{Silent, run},
    },
    summary::Summary,
};

use crate::{chance::Chance, each::each};
pub use campaigns::ROWS;

/// A kind of campaign.
pub struct Kind {
    /// The domain.
    pub domain: &'static str,
    /// What is in the data beside the noise that the domain declares.
    pub trouble: &'static str,
    /// The pipeline; it reads `points.csv`.
    pub pipeline: &'static str,
    /// Draws the points, as CSV.
    pub points: fn(&mut Chance) -> String,
    /// Words of which a finding or a warning has one; without them, a finding is false.
    pub expected: &'static [&'static str],
    /// Effects that are there; others are false.
    pub there: &'static [&'static str],
    /// A parameter of an effect with its true value, whose interval is counted.
    pub truth: Option<(&'static str, usize, f64)>,
}

/// What came of the campaigns of one kind.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// Campaigns.
    pub campaigns: usize,
    /// With any finding.
    pub found: usize,
    /// With an expected word, in findings and warnings of `run` and `diagnose`.
    pub named: usize,
    /// With an effect that is not there.
    pub false_effects: usize,
    /// With the verdict that noise only is left.
    pub at_the_floor: usize,
    /// Intervals that cover the true parameter, and those stated.
    pub held: [usize; 2],
    /// Their standard uncertainties.
    pub std: Vec<f64>,
    /// Findings of sound campaigns and effects that are not there, each with its chance.
    pub falsely: Vec<String>,
}

/// Judges so many campaigns of a kind.
///
/// # Errors
/// When a stage fails.
pub fn row(kind: &Kind, campaigns: u64, seed: u64) -> Result<Row> {
    let judged = each(campaigns, seed, |index| {
        let folder = tempfile::tempdir().map_err(|error| Error::new("make", "a temporary folder", error))?;
        judge(kind, &mut Chance::new(seed, index), folder.path())
    })?;
    let mut row = Row::default();
    for (summary, diagnosis) in &judged {
        row.campaigns += 1;
        let checks = summary.consistency.iter().chain(&diagnosis.consistency);
        let found: Vec<&Check> = checks.filter(|check| !check.finding.is_empty()).collect();
        let findings: Vec<&str> = found.iter().map(|check| check.finding.as_str()).collect();
        let said = summary.warnings.iter().cloned().chain(diagnosis.warnings.iter().cloned());
        let said: Vec<String> = said.chain(findings.iter().map(|finding| (*finding).to_owned())).collect();
        row.found += usize::from(!findings.is_empty());
        row.named += usize::from(kind.expected.iter().any(|word| said.iter().any(|text| text.contains(word))));
        let is_false = |effect: &str| !kind.there.iter().any(|known| effect.starts_with(known));
        row.false_effects += usize::from(diagnosis.added.iter().any(|one| is_false(&one.effect)));
        let number = row.campaigns - 1;
        let wrong = diagnosis.added.iter().filter(|one| is_false(&one.effect));
        row.falsely.extend(wrong.map(|one| {
            let values: Vec<String> =
                one.parameters.iter().map(|parameter| format!("{:.4}", parameter.value)).collect();
            let targets = one.targets.join(" ");
            format!("{number}: {} {targets} {} (p {:.1e})", one.effect, values.join(", "), one.p_value)
        }));
        if kind.expected.is_empty() {
            row.falsely.extend(found.iter().map(|check| format!("{number}: {} (p {:.1e})", check.finding, check.p)));
        }
        row.at_the_floor += usize::from(matches!(diagnosis.verdict, Verdict::AtNoiseFloor | Verdict::Explained));
        let Some((effect, parameter, truth)) = kind.truth else { continue };
        let found = diagnosis.added.iter().find(|one| one.effect == effect);
        let Some(found) = found.and_then(|one| one.parameters.get(parameter)) else { continue };
        if let Some(std) = found.std {
            row.held[0] += usize::from((found.value - truth).abs() <= 1.96 * std);
            row.held[1] += 1;
            row.std.push(std);
        }
    }
    row.std.sort_by(f64::total_cmp);
    Ok(row)
}

fn judge(kind: &Kind, chance: &mut Chance, folder: &Path) -> Result<(Summary, Diagnosis)> {
    let path = folder.join("points.csv");
    std::fs::write(&path, (kind.points)(chance))
        .map_err(|error| Error::new("write", path.display().to_string(), error))?;
    let mut registry = Registry::default();
    for register in [
        runout_points::register,
        runout_rotary_axis::register,
        runout_spatial_error::register,
        runout_cylinder::register,
        runout_quadrature::register,
        runout_straightness::register,
        runout_touch_probe::register,
    ] {
        register(&mut registry);
    }
    let sources = Sources::from_text("pipeline.toml", kind.pipeline, folder.to_owned(), &[], INCLUDE_KEY)
        .map_err(|error| Error::new("read", "the pipeline", error))?;
    let pipeline =
        Pipeline::from_sources(&sources, &registry).map_err(|error| Error::new("check", "the pipeline", error))?;
    Ok((run(&pipeline, None, &Silent)?, diagnose(&pipeline, None, &Silent)?))
}

/// The rows as a table in Markdown.
#[must_use]
pub fn table(rows: &[(&Kind, Row)]) -> String {
    let mut text = String::from(
        "| domain | data | campaigns | with a finding | named | false effects | \"noise only\" | 95 % intervals contain the truth | median std |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for (kind, row) in rows {
        let share = |count: usize| format!("{:.1} %", 100.0 * count as f64 / row.campaigns.max(1) as f64);
        let named = if kind.expected.is_empty() { "-".into() } else { share(row.named) };
        let [held, stated] = row.held;
        let holds =
            if stated == 0 { "-".into() } else { format!("{:.1} % of {stated}", 100.0 * held as f64 / stated as f64) };
        let median = row.std.get(row.std.len() / 2).map_or_else(|| "-".into(), |std| format!("{std:.3}"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {named} | {} | {} | {holds} | {median} |",
            kind.domain,
            kind.trouble,
            row.campaigns,
            share(row.found),
            share(row.false_effects),
            share(row.at_the_floor)
        );
    }
    text
}
