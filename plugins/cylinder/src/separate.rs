//! The separator `least-squares-cylinder`.

use std::f64::consts::PI;

use runout_core::{
    Error, Result,
    pipeline::{
        error::{Fault, known_names, within},
        registry::{Context, StageConfig},
    },
    points::{Points, Trace},
    rig::Gaps,
    separation::{Quantity, Residual, SectionAt, Separation},
    stage::{PointModel, PointSeparator, Separator},
    surface::Surface,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    circle::{Cleaned, Harmonics, empty_stretches},
    predict::Prediction,
    robust::{median, rms},
    scan::Scan,
    shape::Cylinder,
};

/// `[separate] plugin = "least-squares-cylinder"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeastSquaresCylinderConfig {
    /// Nominal radius that the deviations are measured from, in mm.
    pub radius_mm: f64,
    /// Traces to use, by kind or id; each must go round the part.
    #[serde(default = "default_use", rename = "use")]
    pub used: Vec<String>,
    /// Traces to hold out although `use` names them, by kind or id. The surface has to predict whatever is not used.
    #[serde(default)]
    pub hold_out: Vec<String>,
    /// Highest order (undulations per revolution) fitted to each circle.
    #[serde(default = "default_max_order")]
    pub max_order: usize,
    /// Points further than this many median absolute deviations from the fit of their circle are left out, and counted.
    #[serde(default = "default_outlier_mad")]
    pub outlier_mad: f64,
}

fn default_use() -> Vec<String> {
    vec!["circle".into()]
}

fn default_max_order() -> usize {
    50
}

fn default_outlier_mad() -> f64 {
    5.0
}

/// Above this, one circle's matrix alone would take gigabytes.
const HIGHEST_ORDER: usize = 2_000;

impl StageConfig for LeastSquaresCylinderConfig {
    type Stage = Separator;

    const NAME: &'static str = "least-squares-cylinder";
    const ABOUT: &'static str = "form of measured circles, from the least-squares cylinder";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.separator()?)))
    }
}

impl LeastSquaresCylinderConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn separator(self) -> std::result::Result<LeastSquaresCylinder, Fault> {
        if !(self.radius_mm.is_finite() && self.radius_mm > 0.0) {
            return Err(Fault::at("radius_mm", format!("the radius must be above 0 mm, found {}", self.radius_mm)));
        }
        if self.used.is_empty() {
            return Err(Fault::at("use", "expected at least one kind or trace").help("use = [\"circle\"]"));
        }
        within("max_order", "an order", self.max_order, 2..=HIGHEST_ORDER)?;
        if !(self.outlier_mad.is_finite() && self.outlier_mad >= 1.0) {
            let message = format!("expected at least 1 (half of the points lie nearer), found {}", self.outlier_mad);
            return Err(Fault::at("outlier_mad", message).help("a large number keeps every point"));
        }
        Ok(LeastSquaresCylinder(self))
    }
}

/// Removes the least-squares cylinder and gives the form of each circle by harmonics.
///
/// 1. Harmonics 0 to `max_order` are fitted to each circle on its own, on its actual angles; points too far from them
///    are left out.
/// 2. The cylinder of five parameters (radius, offset and slope of the axis) is fitted to all points kept (LSCY of ISO
///    12180-1), and removed.
/// 3. The harmonics of what remains are the form. Orders 0 and 1 belong to it: a measuring machine knows the level and
///    the centre of each circle relative to the others, which is taper and bend of the part.
///
/// A trace that overlaps its own beginning is fitted as it is: least squares need no even angles.
#[derive(Debug, Clone)]
pub struct LeastSquaresCylinder(LeastSquaresCylinderConfig);

/// A circle without its outliers.
pub(crate) struct Circle<'a> {
    pub trace: &'a Trace,
    pub measured: usize,
    pub scan: Scan,
    pub warnings: Vec<String>,
}

impl Circle<'_> {
    /// Its place, and what the harmonics up to an order only bridge.
    pub(crate) fn section(&self, max_order: usize) -> SectionAt {
        let mut gaps = Gaps::default();
        unseen(&self.scan, max_order).for_each(|[from, to]| gaps.add(from, to - from));
        let z_mm = self.scan.z_mm.iter().sum::<f64>() / self.scan.len() as f64;
        let used = self.scan.len() as f64 / self.measured as f64;
        SectionAt { gaps, used, ..SectionAt::whole(self.trace.id.clone(), z_mm) }
    }
}

/// Stretches without a point that are longer than half a wave of the highest order, as angles in rad.
fn unseen(scan: &Scan, max_order: usize) -> impl Iterator<Item = [f64; 2]> {
    empty_stretches(&scan.angle_rad).into_iter().filter(move |[from, to]| to - from > PI / max_order as f64)
}

impl PointSeparator for LeastSquaresCylinder {
    fn separate(&self, points: &Points) -> Result<Vec<Separation>> {
        let circles = self.circles(points)?;
        let cylinder = cylinder(points, &circles)?;
        let mut sections: Vec<Separation> =
            circles.into_iter().map(|circle| self.section(points, circle, &cylinder)).collect::<Result<_>>()?;
        let place = |section: &Separation| section.sections.first().map_or(f64::NAN, |at| at.z_mm);
        sections.sort_by(|a, b| place(a).total_cmp(&place(b)));
        Ok(sections)
    }

    fn reference_radius_mm(&self, points: &Points) -> Result<f64> {
        Ok(self.radius_mm(&self.cylinder(points)?))
    }

    fn needs_surface(&self) -> bool {
        true
    }

    fn remarks(&self, points: &Points, surface: Option<&Surface>) -> Result<Vec<String>> {
        let circles = self.circles(points)?;
        let cylinder = cylinder(points, &circles)?;
        let mut remarks = vec![self.describe(&circles, &cylinder)];
        remarks.push(format!(
            "form is counted from that cylinder; its uncertainty is the scatter about orders 0 to {}, and holds nothing \
             of errors of the machine that vary more slowly along a circle",
            self.0.max_order
        ));
        if let Some(surface) = surface {
            remarks.extend(self.predictions(points, &cylinder, surface)?.iter().map(Prediction::to_string));
        }
        Ok(remarks)
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl LeastSquaresCylinder {
    /// The cylinder that is fitted to the traces used, their outliers left out.
    ///
    /// # Errors
    /// When the traces cannot tell it.
    pub fn cylinder(&self, points: &Points) -> Result<Cylinder> {
        cylinder(points, &self.circles(points)?)
    }

    /// How well a surface predicts the traces that were not used, one entry a kind.
    ///
    /// # Errors
    /// When the points lack a column.
    pub fn predictions(&self, points: &Points, cylinder: &Cylinder, surface: &Surface) -> Result<Vec<Prediction>> {
        let compare = |(kind, traces): (&str, Vec<&Trace>)| {
            let scans: Vec<Scan> = traces.iter().map(|trace| Scan::of(points, trace)).collect::<Result<_>>()?;
            let sample = |angle, z| surface.sample(angle, z);
            let prediction = Prediction::of(&scans, cylinder, sample, self.0.outlier_mad);
            let traces = traces.iter().map(|trace| trace.id.clone()).collect();
            Ok(Prediction { kind: kind.to_owned(), traces, ..prediction })
        };
        self.unused(points).into_iter().map(compare).collect()
    }

    /// The traces that are not used, one entry a kind.
    pub(crate) fn unused<'a>(&self, points: &'a Points) -> Vec<(&'a str, Vec<&'a Trace>)> {
        let mut kinds: Vec<(&str, Vec<&Trace>)> = Vec::new();
        for trace in points.traces.iter().filter(|trace| !self.uses(trace)) {
            match kinds.iter_mut().find(|(kind, _)| *kind == trace.kind) {
                Some((_, traces)) => traces.push(trace),
                None => kinds.push((&trace.kind, vec![trace])),
            }
        }
        kinds
    }

    pub(crate) fn outlier_mad(&self) -> f64 {
        self.0.outlier_mad
    }

    pub(crate) fn nominal_mm(&self) -> f64 {
        self.0.radius_mm
    }

    fn uses(&self, trace: &Trace) -> bool {
        let named = |names: &[String]| names.iter().any(|name| *name == trace.kind || *name == trace.id);
        named(&self.0.used) && !named(&self.0.hold_out)
    }

    /// The traces used, each without its outliers.
    pub(crate) fn circles<'a>(&self, points: &'a Points) -> Result<Vec<Circle<'a>>> {
        let known: Vec<&str> =
            points.traces.iter().flat_map(|trace| [trace.kind.as_str(), trace.id.as_str()]).collect();
        for name in self.0.used.iter().chain(&self.0.hold_out) {
            if !known.contains(&name.as_str()) {
                let mut known = known.clone();
                known.sort_unstable();
                known.dedup();
                let object = points.input.display().to_string();
                return Err(Error::new("use", object, format!("it has no trace of kind or id `{name}`"))
                    .help(known_names(name, known)));
            }
        }
        points.traces.iter().filter(|trace| self.uses(trace)).map(|trace| self.circle(points, trace)).collect()
    }

    fn circle<'a>(&self, points: &'a Points, trace: &'a Trace) -> Result<Circle<'a>> {
        let (max_order, outlier_mad) = (self.0.max_order, self.0.outlier_mad);
        let all = Scan::of(points, trace)?;
        let cleaned = Cleaned::of(&all, max_order, outlier_mad).map_err(|problem| unfit(points, trace, &problem))?;
        let scan = all.keep(&cleaned.kept);
        let mut warnings = Vec::new();
        if cleaned.left_out() > 0 {
            warnings.push(format!("{} {}: {}", trace.kind, trace.id, left_out(&cleaned, &all, outlier_mad)));
        }
        for [from, to] in unseen(&scan, max_order).map(|ends| ends.map(f64::to_degrees)) {
            let gap = format!("no point is used between {from:.2}° and {to:.2}°: it is left out of every value");
            warnings.push(format!("{} {}: {gap}", trace.kind, trace.id));
        }
        Ok(Circle { trace, measured: all.len(), scan, warnings })
    }

    fn section(&self, points: &Points, circle: Circle, cylinder: &Cylinder) -> Result<Separation> {
        let remainder = circle.scan.less(|angle, z| cylinder.deviation_um(angle, z));
        let fit =
            Harmonics::fit(&remainder, self.0.max_order).map_err(|problem| unfit(points, circle.trace, &problem))?;
        Ok(Separation {
            sections: vec![circle.section(self.0.max_order)],
            unknowns: vec![Quantity::Form(0)],
            observable: vec![true; fit.coefficients.len()],
            estimate: fit.coefficients,
            variance: fit.variance,
            motion_covariance: None,
            motion_z_mm: 0.0,
            residual: Residual {
                rms_um: fit.residual_rms_um,
                expected_rms_um: f64::NAN,
                chi2_per_dof: f64::NAN,
                dof: fit.dof,
            },
            warnings: circle.warnings,
        })
    }

    /// Radius of a cylinder that was fitted to deviations from the nominal one.
    fn radius_mm(&self, cylinder: &Cylinder) -> f64 {
        self.0.radius_mm + 1e-3 * cylinder.radius_offset_um
    }

    fn describe(&self, circles: &[Circle], cylinder: &Cylinder) -> String {
        let left = |circle: &Circle| circle.scan.less(|angle, z| cylinder.deviation_um(angle, z)).deviation_um;
        let rms_um = rms(circles.iter().flat_map(left));
        let used: usize = circles.iter().map(|circle| circle.scan.len()).sum();
        let measured: usize = circles.iter().map(|circle| circle.measured).sum();
        let [tilt_x, tilt_y] = cylinder.tilt_urad();
        format!(
            "least-squares cylinder of {} circles ({used} of {measured} points): radius {:.5} mm; axis through \
             ({:.3}, {:.3}) µm at z = {:.3} mm, tilted by {tilt_x:.1} µrad about x and {tilt_y:.1} µrad about y; it leaves \
             {rms_um:.3} µm rms",
            circles.len(),
            self.radius_mm(cylinder),
            cylinder.x_um,
            cylinder.y_um,
            cylinder.z_mm,
        )
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
        "left out {} of {} points, further than {outlier_mad} MAD ({:.2} µm) from the fit, the farthest {farthest:.1} µm: \
         at {}",
        cleaned.left_out(),
        scan.len(),
        cleaned.limit_um,
        places.join(", ")
    )
}

fn cylinder(points: &Points, circles: &[Circle]) -> Result<Cylinder> {
    let object = points.input.display().to_string();
    let refuse = |problem: &str| Error::new("fit a cylinder to", &object, problem);
    if circles.is_empty() {
        return Err(refuse("every trace that could be used is held out").help("shorten `hold_out`"));
    }
    // The axis's slope needs circles that stand further apart than each wavers along z.
    let heights: Vec<f64> = circles.iter().map(|circle| median(circle.scan.z_mm.iter().copied())).collect();
    let waver = |circle: &Circle| {
        let range = circle
            .scan
            .z_mm
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(*z), high.max(*z)]);
        range[1] - range[0]
    };
    let widest = circles.iter().map(waver).fold(0.0, f64::max);
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if high - low <= widest {
        let problem =
            format!("its {} circles stand at one height, z = {low:.3} mm: the axis's tilt is unknown", circles.len());
        return Err(refuse(&problem).help("a cylinder takes circles at two heights or more"));
    }
    let scans: Vec<Scan> = circles.iter().map(|circle| circle.scan.clone()).collect();
    Cylinder::fit(&scans).ok_or_else(|| refuse("its points cannot tell the five parameters"))
}

fn unfit(points: &Points, trace: &Trace, problem: &str) -> Error {
    Error::new("fit harmonics to", format!("trace {} of {}", trace.id, points.input.display()), problem)
        .help("lower `max_order`, or leave the trace out of `use`")
}
