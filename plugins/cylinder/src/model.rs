//! The cylinder for the closed loop: the radius is declared, all else may be missing.
//!
//! With the angle α and the arm t = z − z₀ from the middle of the points, the deviation from the nominal radius is, to first
//! order,
//!
//! d = r + x cos α + y sin α + t (ϕ_y cos α − ϕ_x sin α) + k t + m (t² − t̄²) + Σ_n (a_n cos nα + b_n sin nα):
//!
//! radius, eccentricity, tilt, taper, barrel, lobes. What first order leaves out is e²/(2R) of the axis's offset e.

use runout_core::{
    Complex64, Error, Result,
    model::{
        Effect, Fit, Parameter,
        linear_terms::{Declared, LinearFit, LinearTerms, Observations, Term, Unseen},
    },
    points::Points,
    separation::{Quantity, Residual, Separation},
    stage::{Conclusion, PointModel, Shape},
};

use crate::{
    robust::correlation_factor,
    scan::Scan,
    separate::{Circle, LeastSquaresCylinder},
};

/// Lobes that may be missing.
const LOBES: std::ops::RangeInclusive<usize> = 2..=8;

/// Place, size, form: each counts from those before.
const PLACE: usize = 0;
const SIZE: usize = 1;
const FORM: usize = 2;

/// A shape along z and around: (angle in rad, arm in mm) to µm per unit of the parameter.
type Part = Box<dyn Fn(f64, f64) -> f64>;

/// Something that may be missing, before there are points.
struct Missing {
    effect: Effect,
    parts: Vec<Part>,
    rank: usize,
}

/// The effects; `mean_square` is the mean of the squared arms, in mm².
fn missing(mean_square: f64) -> Vec<Missing> {
    let one = |id: String, rank, parameters: Vec<(&str, &str, f64)>, parts: Vec<Part>| {
        let parameter =
            |(name, unit, tolerance): (&str, &str, f64)| Parameter { name: name.into(), unit: unit.into(), tolerance };
        let parameters = parameters.into_iter().map(parameter).collect();
        Missing { effect: Effect { id, target: None, parameters }, parts, rank }
    };
    let mut all = vec![
        one(
            "part-eccentricity".into(),
            PLACE,
            vec![("x", "um", 10.0), ("y", "um", 10.0)],
            vec![Box::new(|angle, _| angle.cos()), Box::new(|angle, _| angle.sin())],
        ),
        // µm per mm are mrad.
        one(
            "axis-tilt".into(),
            PLACE,
            vec![("tilt_x", "urad", 100.0), ("tilt_y", "urad", 100.0)],
            vec![Box::new(|angle, arm| -1e-3 * arm * angle.sin()), Box::new(|angle, arm| 1e-3 * arm * angle.cos())],
        ),
        one("taper".into(), SIZE, vec![("slope", "um/mm", 0.1)], vec![Box::new(|_, arm| arm)]),
        one(
            "barrel".into(),
            SIZE,
            vec![("curvature", "um/mm2", 0.01)],
            vec![Box::new(move |_, arm| arm * arm - mean_square)],
        ),
    ];
    all.extend(LOBES.map(|order| {
        let n = order as f64;
        one(
            format!("lobes-{order}"),
            FORM,
            vec![("cosine", "um", 1.0), ("sine", "um", 1.0)],
            vec![Box::new(move |angle, _| (n * angle).cos()), Box::new(move |angle, _| (n * angle).sin())],
        )
    }));
    all
}

/// The circles used without their outliers, and from where z counts.
struct Basis<'a> {
    circles: Vec<Circle<'a>>,
    middle_mm: f64,
    missing: Vec<Missing>,
}

impl<'a> Basis<'a> {
    fn of(separator: &LeastSquaresCylinder, points: &'a Points) -> Result<Self> {
        let circles = separator.circles(points)?;
        if circles.len() < 2 {
            let problem = format!("it has {} circles to use; each is left out once, so two are needed", circles.len());
            return Err(Error::new("diagnose", points.input.display().to_string(), problem));
        }
        let heights = || circles.iter().flat_map(|circle| &circle.scan.z_mm);
        let [low, high] =
            heights().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(*z), high.max(*z)]);
        let middle_mm = 0.5 * (low + high);
        let squares: f64 = heights().map(|z| (z - middle_mm).powi(2)).sum();
        let missing = missing(squares / heights().count() as f64);
        Ok(Self { circles, middle_mm, missing })
    }

    /// Columns of all effects at some points, `[effect][parameter][point]`.
    fn columns(&self, scans: &[&Scan]) -> Vec<Vec<Vec<f64>>> {
        let places = || scans.iter().flat_map(|scan| scan.iter());
        let column = |part: &Part| places().map(|(angle, z, _)| part(angle, z - self.middle_mm)).collect();
        self.missing.iter().map(|missing| missing.parts.iter().map(column).collect()).collect()
    }

    /// Points of traces that were not used, kind by kind.
    fn unseen(&self, separator: &LeastSquaresCylinder, points: &Points) -> Result<Vec<Unseen>> {
        let kinds = separator.unused(points).into_iter().map(|(kind, traces)| {
            let scans: Vec<Scan> = traces.iter().map(|trace| Scan::of(points, trace)).collect::<Result<_>>()?;
            let scans: Vec<&Scan> = scans.iter().collect();
            let values: Vec<f64> = scans.iter().flat_map(|scan| scan.deviation_um.iter().copied()).collect();
            let ids: Vec<&str> = traces.iter().map(|trace| trace.id.as_str()).collect();
            let name = format!("{kind} {}", ids.join(", "));
            Ok(Unseen { name, declared: vec![vec![1.0; values.len()]], values, terms: self.columns(&scans) })
        });
        kinds.collect()
    }
}

impl PointModel for LeastSquaresCylinder {
    fn effects(&self) -> Vec<Effect> {
        missing(0.0).into_iter().map(|missing| missing.effect).collect()
    }

    fn terms(&self, points: &Points) -> Result<LinearTerms> {
        let basis = Basis::of(self, points)?;
        let scans: Vec<&Scan> = basis.circles.iter().map(|circle| &circle.scan).collect();
        let observations = Observations {
            values: scans.iter().flat_map(|scan| scan.deviation_um.iter().copied()).collect(),
            unit: "um".into(),
            std: None,
            group: scans.iter().enumerate().flat_map(|(group, scan)| vec![group; scan.len()]).collect(),
            groups: basis.circles.iter().map(|circle| format!("{} {}", circle.trace.kind, circle.trace.id)).collect(),
        };
        let column = vec![1.0; observations.values.len()];
        let radius = Declared { name: "radius less nominal".into(), unit: "um".into(), column };
        let terms = basis.missing.iter().zip(basis.columns(&scans));
        let terms =
            terms.map(|(missing, columns)| Term { effect: missing.effect.clone(), columns, rank: missing.rank });
        let model = LinearTerms::new(observations, vec![radius], terms.collect())?;
        Ok(model.predicting(basis.unseen(self, points)?))
    }

    fn conclude(&self, points: &Points, fit: &LinearFit) -> Result<Conclusion> {
        let basis = Basis::of(self, points)?;
        let raised = correlation_factor(&fit.remainder().residual);
        let mut sections: Vec<Separation> =
            basis.circles.iter().map(|circle| section(circle, basis.middle_mm, &basis.missing, fit, raised)).collect();
        let place = |section: &Separation| section.sections.first().map_or(f64::NAN, |at| at.z_mm);
        sections.sort_by(|a, b| place(a).total_cmp(&place(b)));
        let offset_um = fit.declared().first().copied().unwrap_or(f64::NAN);
        let remarks = vec![
            format!(
                "each of {} circles is left out once and predicted from the others; outliers beyond {} MAD are set aside \
                 before, circle by circle: {} of {} points",
                basis.circles.len(),
                self.outlier_mad(),
                basis.circles.iter().map(|circle| circle.measured - circle.scan.len()).sum::<usize>(),
                basis.circles.iter().map(|circle| circle.measured).sum::<usize>()
            ),
            "the noise is not known from elsewhere, and points of one circle are no independent witnesses: evidence and \
             standard uncertainties of the effects flatter, and the circles left out decide"
                .into(),
            "form of the exports is that of the effects found (taper, barrel, lobes), not of each circle on its own"
                .into(),
        ];
        let shape = Shape { sections, radius_mm: self.nominal_mm() + 1e-3 * offset_um };
        Ok(Conclusion { shape: Some(shape), remarks })
    }
}

/// Form of one circle by the effects found: what changes the size is its level, lobes are its harmonics.
fn section(circle: &Circle, middle_mm: f64, missing: &[Missing], fit: &LinearFit, raised: f64) -> Separation {
    let at = circle.section(*LOBES.end());
    let z_mm = at.z_mm;
    let orders = LOBES.end() + 1;
    let (mut estimate, mut variance) = (vec![Complex64::ZERO; orders], vec![0.0; orders]);
    for (effect, values, variances) in fit.effects() {
        let Some(found) = missing.iter().find(|missing| missing.effect.id == effect.id) else { continue };
        let lobes = effect.id.strip_prefix("lobes-").and_then(|order| order.parse::<usize>().ok());
        match (lobes, found.rank, values) {
            // a cos nα + b sin nα = Re (a − ib) e^{inα}.
            (Some(order), FORM, [a, b]) => {
                estimate[order] += Complex64::new(*a, -b);
                variance[order] += raised * variances.iter().sum::<f64>();
            }
            (None, SIZE, _) => {
                for ((part, value), unit) in found.parts.iter().zip(values).zip(&variances) {
                    let here = part(0.0, z_mm - middle_mm);
                    estimate[0] += here * value;
                    variance[0] += raised * here * here * unit;
                }
            }
            _ => {}
        }
    }
    Separation {
        sections: vec![at],
        unknowns: vec![Quantity::Form(0)],
        observable: vec![true; orders],
        estimate,
        variance,
        motion_covariance: None,
        motion_z_mm: 0.0,
        residual: Residual {
            rms_um: fit.remainder().rms,
            expected_rms_um: f64::NAN,
            chi2_per_dof: f64::NAN,
            dof: fit.remainder().dof,
        },
        warnings: circle.warnings.clone(),
    }
}
