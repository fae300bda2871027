//! The separator `least-squares-cylinder`.

mod circles;

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use runout_core::{
    Complex64, Error, ErrorKind, Result,
    fault::Fault,
    numerics::{number::significant, statistics::median},
    pipeline::{Context, StageConfig},
    points::{
        PointColumn,
        PointKind::{Number, Trace as TraceId, TraceKind},
        Points, Trace,
    },
    separation::{Quantity, Residual, Separation, VarianceFrom},
    stage::{Evaluable, EvaluableKind, Form, Outcome, PointModel, PointSeparator, Separator, residual_table},
    surface::Surface,
    table::TableSpec,
};

pub(crate) use circles::Circle;
use circles::unseen;

use crate::{
    circle::Harmonics,
    config::LeastSquaresCylinderConfig,
    consistency::{absent, closes, hidden_noise, unlike},
    generatrix::open_profiles,
    predict::Prediction,
    robust::rms,
    scan::Scan,
    shape::Cylinder,
};

/// Gaps of a circle that are said one by one.
const MOST_SAID: usize = 3;

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
        self.check_values()?;
        Ok(LeastSquaresCylinder(self))
    }
}

/// Removes the least-squares cylinder and gives the form of each circle by harmonics.
///
/// 1. With `outlier_mad`, harmonics 0 to `outlier_order` are fitted to each circle on its own, on its actual angles; points too far
///    from them are left out. Without it every point stays.
/// 2. The cylinder (radius, offset and slope of the axis) is fitted to all points kept (LSCY of ISO 12180-1), and each
///    point becomes angle, height and distance about its axis, exactly. At one height the slope is not observable: then
///    radius and centre are fitted (LSCI of ISO 12181-1).
/// 3. The harmonics 0 to `max_order` of the distances are the form. Orders 0 and 1 belong to it: a measuring machine knows
///    the level and the centre of each circle relative to the others, which is taper and bend of the part.
///
/// A trace that overlaps its own beginning is fitted as it is: least squares need no even angles. A helix is cut into its
/// turns; what changes along z within a turn (its level and its centre) is found from it and half a turn on either side, and
/// removed before the harmonics of the turn are fitted.
#[derive(Debug, Clone)]
pub struct LeastSquaresCylinder(LeastSquaresCylinderConfig);

/// Median absolute deviations from which points of traces that were not used are counted apart, where nothing else is asked for.
const FAR_OFF_MAD: f64 = 5.0;

/// The columns that the separator takes.
pub const COLUMNS: [PointColumn; 5] = [
    PointColumn::needed("trace", TraceId, "", "name of the trace, whose points follow one another"),
    PointColumn::needed("kind", TraceKind, "", "what the trace runs along: circle, helix, generatrix"),
    PointColumn::needed("z_mm", Number, "mm", "height"),
    PointColumn::needed("angle_deg", Number, "deg", "angle about the measuring machine's axis"),
    PointColumn::needed("deviation_um", Number, "um", "distance from that axis less the nominal radius").measured(),
];

impl PointSeparator for LeastSquaresCylinder {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![residual_table("um").optional()]
    }

    fn evaluables(&self) -> Vec<EvaluableKind> {
        vec![EvaluableKind::ClosedProfiles, EvaluableKind::OpenProfile]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let circles = self.circles(points)?;
        let cylinder = cylinder(points, &circles, self.0.radius_mm)?;
        let mut evaluables = vec![Evaluable::ClosedProfiles(self.form(points)?)];
        evaluables.extend(open_profiles(points, &cylinder)?.into_iter().map(Evaluable::OpenProfile));
        let mut notes = Self::describe(&circles, &cylinder);
        notes.push(format!(
            "form counts from it; the stated uncertainty is the scatter about orders 0 to {}: it does not include errors of the \
             machine that vary more slowly along a circle",
            self.0.max_order
        ));
        Ok(Outcome { evaluables, notes, ..Outcome::default() })
    }

    fn needs_surface(&self) -> bool {
        true
    }

    fn remarks(&self, points: &Points, surface: Option<&Surface>) -> Result<Vec<String>> {
        let Some(surface) = surface else { return Ok(Vec::new()) };
        let predictions = self.predictions(points, &self.cylinder(points)?, surface)?;
        Ok(predictions.iter().map(Prediction::to_string).collect())
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl LeastSquaresCylinder {
    /// Form of each circle, in the order of z.
    ///
    /// # Errors
    /// When the points do not hold what the method needs.
    pub fn form(&self, points: &Points) -> Result<Form> {
        let circles = self.circles(points)?;
        let cylinder = cylinder(points, &circles, self.0.radius_mm)?;
        let mut sections: Vec<Separation> =
            circles.into_iter().map(|circle| self.section(points, circle, &cylinder)).collect::<Result<_>>()?;
        let place = |section: &Separation| section.sections.first().map_or(f64::NAN, |at| at.z_mm);
        sections.sort_by(|a, b| place(a).total_cmp(&place(b)));
        Ok(Form { sections, radius_mm: cylinder.radius_mm() })
    }

    /// The cylinder that is fitted to the traces used, their outliers left out.
    ///
    /// # Errors
    /// When the traces do not determine it.
    pub fn cylinder(&self, points: &Points) -> Result<Cylinder> {
        cylinder(points, &self.circles(points)?, self.0.radius_mm)
    }

    pub(crate) fn fit_cylinder(&self, points: &Points, circles: &[Circle]) -> Result<Cylinder> {
        cylinder(points, circles, self.0.radius_mm)
    }

    /// How well a surface predicts the traces that were not used, one entry a kind.
    ///
    /// # Errors
    /// When the points lack a column.
    pub fn predictions(&self, points: &Points, cylinder: &Cylinder, surface: &Surface) -> Result<Vec<Prediction>> {
        let compare = |(kind, traces): (&str, Vec<&Trace>)| {
            let scans: Vec<Scan> = traces.iter().map(|trace| Scan::of(points, trace)).collect::<Result<_>>()?;
            let scans: Vec<Scan> = scans.iter().map(|scan| cylinder.place(scan)).collect();
            let ends = surface.z_mm.first().copied().zip(surface.z_mm.last().copied());
            let sample = |angle, z| surface.sample(angle, cylinder.at_end(z, ends));
            let prediction = Prediction::of(&scans, sample, self.0.outlier_mad.unwrap_or(FAR_OFF_MAD));
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

    pub(crate) fn outlier_mad(&self) -> Option<f64> {
        self.0.outlier_mad
    }

    pub(crate) fn nominal_mm(&self) -> f64 {
        self.0.radius_mm
    }

    pub(crate) fn max_lobes(&self) -> usize {
        self.0.max_lobes
    }

    fn section(&self, points: &Points, mut circle: Circle, cylinder: &Cylinder) -> Result<Separation> {
        let mut placed = cylinder.place(&circle.scan);
        let unfit = |problem: String| {
            Error::new("fit harmonics to", format!("{} of {}", circle.id, points.input.display()), problem)
                .of(ErrorKind::InsufficientData)
                .help(remedy(std::iter::once(&circle.scan), "leave the trace out of `use`"))
        };
        let mut level_variance = [0.0; 2];
        let mut height_mm = 0.0;
        if let Some(window) = &circle.window {
            let (along, _) =
                Harmonics::fit(&cylinder.place(window), self.0.max_order, Some(placed.mean_z_mm())).map_err(unfit)?;
            placed = placed.less(|angle, z| along.sloped_um(angle, z));
            let [low, high] = placed.z_range_mm();
            (level_variance, height_mm) = (along.level_variance, high - low);
        }
        let (fit, basis) = Harmonics::fit(&placed, self.0.max_order, None).map_err(unfit)?;
        let order = fit.max_order();
        let named = circle.name();
        let closes = if circle.window.is_none() { closes(&placed, &named) } else { None };
        let checks = unlike(&placed, &basis, &circle.scan, "the point").into_iter().chain(closes).collect();
        circle.warnings.extend(fit.limit.iter().map(|limit| format!("{named}: {limit}")));
        let gaps: Vec<[f64; 2]> = unseen(&placed, order).map(|ends| ends.map(f64::to_degrees)).collect();
        if gaps.len() > MOST_SAID {
            let all: f64 = gaps.iter().map(|[from, to]| to - from).sum();
            circle.warnings.push(format!(
                "{named}: {} arcs, {all:.0}° in all, have no point and are longer than half a wave of order {order}: they are left out of every \
                 value; a lower `max_order` has longer waves",
                gaps.len()
            ));
        } else {
            let gap = |[from, to]: &[f64; 2]| {
                format!("{named}: no point is used between {from:.2}° and {to:.2}°: it is left out of every value")
            };
            circle.warnings.extend(gaps.iter().map(gap));
        }
        let orders = self.0.max_order + 1;
        let (mut estimate, mut variance) = (fit.coefficients, fit.variance);
        // Over a turn of height h, t has the coefficients h/(πn), and t² has h²/(πn)².
        for (order, variance) in variance.iter_mut().enumerate().skip(1) {
            let share = (height_mm / (PI * order as f64)).powi(2);
            *variance += level_variance[0] * share + level_variance[1] * share * share;
        }
        if let Some(reason) = hidden_noise(&placed, &basis) {
            variance.fill(f64::NAN);
            circle.warnings.push(format!("{named}: {reason}"));
        }
        let mut section = circle.section(&placed, order, cylinder);
        if let Some((above, size_um)) = absent(&placed, &basis) {
            section.absent_um = FRAC_1_SQRT_2 * size_um;
            let size_um = significant(size_um, 2);
            let what =
                format!("order {above} has {size_um} µm, above {order}, the highest (`max_order`): it is in no value");
            circle.warnings.push(format!("{named}: {what}"));
        }
        let mut observable = vec![true; estimate.len()];
        estimate.resize(orders, Complex64::new(f64::NAN, f64::NAN));
        variance.resize(orders, f64::NAN);
        observable.resize(orders, false);
        Ok(Separation {
            sections: vec![section],
            unknowns: vec![Quantity::Form(0)],
            observable,
            estimate,
            variance,
            freedom: fit.dof,
            variance_from: VarianceFrom::Readings,
            residual: Residual {
                rms_um: fit.residual_rms_um,
                expected_rms_um: f64::NAN,
                chi2_per_dof: f64::NAN,
                dof: fit.dof,
                checks,
                ..Residual::default()
            },
            warnings: circle.warnings,
            ..Separation::default()
        })
    }

    fn describe(circles: &[Circle], cylinder: &Cylinder) -> Vec<String> {
        let rms_um = rms(circles.iter().flat_map(|circle| cylinder.place(&circle.scan).deviation_um));
        let used: usize = circles.iter().map(|circle| circle.scan.len()).sum();
        let measured: usize = circles.iter().map(|circle| circle.measured).sum();
        let counted = format!("{} ({used} of {measured} points)", count_of(circles.len()));
        let Cylinder { x_um, y_um, z_mm, .. } = cylinder;
        let radius_mm = cylinder.radius_mm();
        if !cylinder.tilted {
            let ellipse_um = 1e3 * radius_mm * 0.25e-6;
            return vec![
                format!(
                    "least-squares circle of {counted} at one height, z = {z_mm:.3} mm: radius {radius_mm:.5} mm; centre \
                     ({x_um:.3}, {y_um:.3}) µm; it leaves {rms_um:.3} µm rms"
                ),
                format!(
                    "the tilt of the axis is not observable at one height: a tilt of 1 mrad adds an ellipse of \
                     {ellipse_um:.4} µm at 2/rev, and grows with its square"
                ),
            ];
        }
        let [tilt_x, tilt_y] = cylinder.tilt_urad();
        vec![format!(
            "least-squares cylinder of {counted}: radius {radius_mm:.5} mm; axis through ({x_um:.3}, {y_um:.3}) µm at \
             z = {z_mm:.3} mm, tilted by {tilt_x:.1} µrad about x and {tilt_y:.1} µrad about y; it leaves {rms_um:.3} µm rms"
        )]
    }
}

/// Angles that are all below, in degrees, are none of a circle.
const NO_DEGREES: f64 = 7.0;

fn count_of(circles: usize) -> String {
    if circles == 1 { "1 circle".into() } else { format!("{circles} circles") }
}

fn cylinder(points: &Points, circles: &[Circle], nominal_mm: f64) -> Result<Cylinder> {
    let object = points.input.display().to_string();
    let refuse = |problem: &str| Error::new("fit a cylinder to", &object, problem).of(ErrorKind::InsufficientData);
    if circles.is_empty() {
        return Err(refuse("every trace that could be used is held out").help("shorten `hold_out`"));
    }
    let scans: Vec<Scan> = circles.iter().map(|circle| circle.scan.clone()).collect();
    Cylinder::fit(&scans, nominal_mm, tilt_observable(circles)).ok_or_else(|| {
        let help = remedy(scans.iter(), "points all around the part determine them");
        refuse("its points do not determine radius and axis").help(help)
    })
}

/// What to do with points that determine nothing: angles of a few degrees only are those of another unit.
fn remedy<'a>(mut scans: impl Iterator<Item = &'a Scan>, usual: &'static str) -> &'static str {
    let is_far = |angle: &f64| angle.abs() > NO_DEGREES.to_radians();
    let are_degrees = scans.any(|scan| scan.angle_rad.iter().any(is_far));
    if are_degrees { usual } else { "are the angles in radians or turns? `angle_deg` is in degrees" }
}

/// Whether circles stand further apart than each wavers along z, or are turns of a helix: else the axis's slope is not
/// observable.
fn tilt_observable(circles: &[Circle]) -> bool {
    let heights = || circles.iter().map(|circle| median(circle.scan.z_mm.iter().copied()));
    let waver = |circle: &Circle| {
        let [low, high] = circle.scan.z_range_mm();
        if circle.window.is_some() { 0.0 } else { high - low }
    };
    let widest = circles.iter().map(waver).fold(0.0, f64::max);
    heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min) > widest
}
