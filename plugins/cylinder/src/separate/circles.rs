//! Circles of the traces: whole, or the turns of a helix, each without its outliers.

use std::f64::consts::PI;

use runout_core::{
    Error, ErrorKind, Result,
    fault::known_names,
    points::{Points, Trace},
    rig::Gaps,
    separation::SectionAt,
};

use super::LeastSquaresCylinder;
use crate::{
    circle::{Cleaned, empty_stretches},
    scan::{Helix, Scan, Turn},
    shape::Cylinder,
};

/// Kinds of traces that go round the part.
const AROUND: [&str; 2] = ["circle", "helix"];

/// A circle, or a turn of a helix, without its outliers.
pub(crate) struct Circle<'a> {
    pub id: String,
    pub kind: &'a str,
    pub measured: usize,
    pub scan: Scan,
    /// Of a turn of a helix: it and half a turn on either side.
    pub(super) window: Option<Scan>,
    pub warnings: Vec<String>,
}

impl Circle<'_> {
    /// What messages call it.
    pub(crate) fn name(&self) -> String {
        if self.id == self.kind { self.id.clone() } else { format!("{} {}", self.kind, self.id) }
    }

    /// Its place about an axis, and the arcs that harmonics up to an order only bridge. Circles at one height share it.
    pub(crate) fn section(&self, placed: &Scan, max_order: usize, cylinder: &Cylinder) -> SectionAt {
        let z_mm = if cylinder.tilted { placed.mean_z_mm() } else { cylinder.z_mm };
        let mut gaps = Gaps::default();
        unseen(placed, max_order).for_each(|[from, to]| gaps.add(from, to - from));
        let used = self.scan.len() as f64 / self.measured as f64;
        SectionAt { declared_gaps: gaps.clone(), gaps, used, ..SectionAt::whole(self.id.clone(), z_mm) }
    }
}

/// Arcs without a point that are longer than half a wave of the highest order, as angles in rad.
pub(super) fn unseen(scan: &Scan, max_order: usize) -> impl Iterator<Item = [f64; 2]> {
    empty_stretches(&scan.angle_rad).into_iter().filter(move |[from, to]| to - from > PI / max_order as f64)
}

impl LeastSquaresCylinder {
    pub(super) fn uses(&self, trace: &Trace) -> bool {
        let named = |names: &[String]| names.iter().any(|name| *name == trace.kind || *name == trace.id);
        let used = self.0.used.as_ref().map_or_else(|| AROUND.contains(&trace.kind.as_str()), |names| named(names));
        used && !named(&self.0.hold_out)
    }

    /// The traces used, each without its outliers.
    pub(crate) fn circles<'a>(&self, points: &'a Points) -> Result<Vec<Circle<'a>>> {
        let known: Vec<&str> =
            points.traces.iter().flat_map(|trace| [trace.kind.as_str(), trace.id.as_str()]).collect();
        for name in self.0.used.iter().flatten().chain(&self.0.hold_out) {
            if !known.contains(&name.as_str()) {
                let mut known = known.clone();
                known.sort_unstable();
                known.dedup();
                let object = points.input.display().to_string();
                return Err(Error::new("use", object, format!("it has no trace of kind or id `{name}`"))
                    .help(known_names(name, known)));
            }
        }
        let used = points.traces.iter().filter(|trace| self.uses(trace));
        let revolutions: Result<Vec<Vec<Circle>>> = used.map(|trace| self.revolutions(points, trace)).collect();
        Ok(revolutions?.into_iter().flatten().collect())
    }

    /// A circle, or the turns of a helix.
    fn revolutions<'a>(&self, points: &'a Points, trace: &'a Trace) -> Result<Vec<Circle<'a>>> {
        let all = Scan::of(points, trace)?;
        let Some(helix) = Helix::of(&all) else {
            let whole = Turn { points: 0..all.len(), window: 0..all.len() };
            return Ok(vec![self.circle(points, trace, &all, &whole, None)?]);
        };
        let turns = helix.turns.iter().zip(1..);
        turns.map(|(turn, number)| self.circle(points, trace, &all, turn, Some((&helix, number)))).collect()
    }

    /// One revolution of a trace; `helix` and the number of the turn where it is one.
    fn circle<'a>(
        &self,
        points: &Points,
        trace: &'a Trace,
        all: &Scan,
        turn: &Turn,
        helix: Option<(&Helix, usize)>,
    ) -> Result<Circle<'a>> {
        let window = all.range(turn.window.clone());
        let measured = all.range(turn.points.clone());
        let about_mm = helix.map(|_| measured.mean_z_mm());
        let (mut scan, mut kept_window) = (measured.clone(), window);
        let mut outliers = None;
        if let Some(outlier_mad) = self.0.outlier_mad {
            let cleaned = Cleaned::of(&kept_window, self.0.outlier_order, about_mm, outlier_mad)
                .map_err(|problem| unfit(points, trace, &problem))?;
            kept_window = kept_window.keep(&cleaned.kept);
            let cleaned = cleaned.range(turn.points.start - turn.window.start, measured.len());
            scan = measured.keep(&cleaned.kept);
            outliers = (cleaned.left_out() > 0).then(|| left_out(&cleaned, &measured, outlier_mad));
        }
        let id = helix.map_or_else(|| trace.id.clone(), |(_, number)| format!("{}.{number}", trace.id));
        let mut warnings = Vec::new();
        if let Some((helix, 1)) = helix {
            warnings.push(format!(
                "{} {}: it is a helix of {:.4} mm a turn; each of its {} turns is a section, and {} points behind the last \
                 one are not used",
                trace.kind,
                trace.id,
                helix.pitch_mm,
                helix.turns.len(),
                helix.behind
            ));
        }
        warnings.extend(outliers.map(|left_out| format!("{} {id}: {left_out}", trace.kind)));
        let window = helix.map(|_| kept_window);
        Ok(Circle { id, kind: &trace.kind, measured: measured.len(), scan, window, warnings })
    }
}

/// "left out 3 of 1046 points …", with their places.
fn left_out(cleaned: &Cleaned, scan: &Scan, outlier_mad: f64) -> String {
    /// A line holds no more than these; whatever has more is bad throughout.
    const PLACES: usize = 20;
    let stretches = cleaned.stretches(scan);
    let place = |(from, to, count): &(f64, f64, usize)| match count {
        1 => format!("{from:.1}°"),
        _ => format!("{from:.1}…{to:.1}° ({count})"),
    };
    let mut places: Vec<String> = stretches.iter().take(PLACES).map(place).collect();
    if stretches.len() > PLACES {
        places.push(format!("{} more places", stretches.len() - PLACES));
    }
    let farthest = cleaned.distance_um.iter().fold(0.0_f64, |far, off| if off.abs() > far.abs() { *off } else { far });
    format!(
        "left out {} of {} points, further than {outlier_mad} MAD ({:.2} µm) from the fit of orders 0 to {}, the \
         farthest {farthest:.1} µm: at {}",
        cleaned.left_out(),
        scan.len(),
        cleaned.limit_um,
        cleaned.max_order,
        places.join(", ")
    )
}

fn unfit(points: &Points, trace: &Trace, problem: &str) -> Error {
    Error::new("fit harmonics to", format!("trace {} of {}", trace.id, points.input.display()), problem)
        .of(ErrorKind::InsufficientData)
        .help("leave the trace out of `use`")
}
