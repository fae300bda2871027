//! The cylinder for the closed loop: the radius is declared, all else may be missing.
//!
//! With the angle α and the arm t = z − z₀ about the fitted axis, the distance from the nominal radius is
//!
//! d = r + x cos α + y sin α + t (ϕ_y cos α − ϕ_x sin α) + k t + m (t² − t̄²) + Σ_n (a_n cos nα + b_n sin nα):
//!
//! radius, eccentricity, tilt, taper, barrel, lobes. The points are placed about the least-squares axis first, exactly, and
//! only its first-order run-out is added again: so the linear model has no error of second order where it is fitted.

use std::f64::consts::TAU;

use runout_core::{
    Complex64, Result,
    closed_loop::{
        Effect, Fit, Parameter,
        diagnosis::Unexplained,
        linear_terms::{Declared, HeldOut, LinearFit, LinearTerms, Observations, Term},
    },
    points::Points,
    separation::{Quantity, Residual, Separation, VarianceFrom},
    stage::{Evaluable, Form, LinearModel, Outcome},
};

use crate::{
    consistency::structure,
    defects::set_aside,
    generatrix::open_profiles,
    scan::Scan,
    separate::{Circle, LeastSquaresCylinder},
    shape::Cylinder,
};

/// Arcs of a single circle that are left out one after the other: shorter than half a wave of the lobes.
const ARCS: usize = 36;

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
    /// Their number, where it is lobes.
    lobes: Option<usize>,
}

/// The effects, with lobes to an order; `mean_square` is the mean of the squared arms, in mm².
fn missing(max_lobes: usize, mean_square: f64) -> Vec<Missing> {
    let one = |id: String, rank, parameters: Vec<(&str, &str, f64)>, parts: Vec<Part>| {
        let parameter =
            |(name, unit, tolerance): (&str, &str, f64)| Parameter { name: name.into(), unit: unit.into(), tolerance };
        let parameters = parameters.into_iter().map(parameter).collect();
        Missing { effect: Effect { id, targets: Vec::new(), parameters }, parts, rank, lobes: None }
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
    all.extend((2..=max_lobes).map(|order| {
        let n = order as f64;
        let lobes = one(
            format!("lobes-{order}"),
            FORM,
            vec![("cosine", "um", 1.0), ("sine", "um", 1.0)],
            vec![Box::new(move |angle, _| (n * angle).cos()), Box::new(move |angle, _| (n * angle).sin())],
        );
        Missing { lobes: Some(order), ..lobes }
    }));
    all
}

/// The circles used without their outliers and local defects, about the least-squares axis.
struct Basis<'a> {
    circles: Vec<Circle<'a>>,
    defects: Vec<Unexplained>,
    /// The points of each circle about the axis, their distances with its first-order run-out.
    placed: Vec<Scan>,
    cylinder: Cylinder,
    missing: Vec<Missing>,
}

impl<'a> Basis<'a> {
    fn of(separator: &LeastSquaresCylinder, points: &'a Points) -> Result<Self> {
        let mut circles = separator.circles(points)?;
        let mut defects = Vec::new();
        // Where outliers are asked for to be left out, they are.
        for circle in circles.iter_mut().filter(|_| separator.outlier_mad().is_none()) {
            let (scan, found) = set_aside(&circle.scan, &circle.name());
            circle.scan = scan;
            defects.extend(found);
        }
        let cylinder = separator.fit_cylinder(points, &circles)?;
        let placed: Vec<Scan> = circles.iter().map(|circle| place(&cylinder, &circle.scan)).collect();
        let arms = || placed.iter().flat_map(|scan| &scan.z_mm).map(|z| arm_mm(&cylinder, *z));
        let mean_square = arms().map(|arm| arm * arm).sum::<f64>() / arms().count() as f64;
        let missing = missing(separator.max_lobes(), mean_square);
        Ok(Self { circles, defects, placed, cylinder, missing })
    }

    /// Columns of all effects at some points, `[effect][parameter][point]`.
    fn columns(&self, scans: &[Scan]) -> Vec<Vec<Vec<f64>>> {
        let places = || scans.iter().flat_map(Scan::iter);
        let column = |part: &Part| places().map(|(angle, z, _)| part(angle, arm_mm(&self.cylinder, z))).collect();
        self.missing.iter().map(|missing| missing.parts.iter().map(column).collect()).collect()
    }

    /// Points of traces that were not used, kind by kind.
    fn unseen(&self, separator: &LeastSquaresCylinder, points: &Points) -> Result<Vec<HeldOut>> {
        let kinds = separator.unused(points).into_iter().map(|(kind, traces)| {
            let scans: Vec<Scan> = traces.iter().map(|trace| Scan::of(points, trace)).collect::<Result<_>>()?;
            let scans: Vec<Scan> = scans.iter().map(|scan| place(&self.cylinder, scan)).collect();
            let values: Vec<f64> = scans.iter().flat_map(|scan| scan.deviation_um.iter().copied()).collect();
            let ids: Vec<&str> = traces.iter().map(|trace| trace.id.as_str()).collect();
            let name = format!("{kind} {}", ids.join(", "));
            Ok(HeldOut { name, declared: vec![vec![1.0; values.len()]], values, terms: self.columns(&scans) })
        });
        kinds.collect()
    }

    /// The group of each point and the groups' names: circles, or arcs of a single one.
    fn groups(&self) -> (Vec<usize>, Vec<String>) {
        if let [only] = &self.placed[..] {
            let arc = |angle: &f64| ((angle.rem_euclid(TAU) / TAU * ARCS as f64) as usize).min(ARCS - 1);
            let width = 360 / ARCS;
            let names = (0..ARCS).map(|arc| format!("{}…{}°", width * arc, width * (arc + 1)));
            return (only.angle_rad.iter().map(arc).collect(), names.collect());
        }
        let group = self.placed.iter().enumerate().flat_map(|(group, scan)| vec![group; scan.len()]).collect();
        (group, self.names())
    }

    fn names(&self) -> Vec<String> {
        self.circles.iter().map(Circle::name).collect()
    }
}

/// Points about an axis, their distances from the nominal radius with the axis's first-order run-out.
fn place(cylinder: &Cylinder, scan: &Scan) -> Scan {
    cylinder.place(scan).less(|angle, z| -cylinder.radius_offset_um - cylinder.run_out_um(angle, z))
}

/// Height from the middle of the points; 0 where they stand at one height, and what changes along z is not observable.
fn arm_mm(cylinder: &Cylinder, z_mm: f64) -> f64 {
    if cylinder.tilted { z_mm - cylinder.z_mm } else { 0.0 }
}

impl LinearModel for LeastSquaresCylinder {
    fn candidates(&self) -> Vec<Effect> {
        missing(self.max_lobes(), 0.0).into_iter().map(|missing| missing.effect).collect()
    }

    fn terms(&self, points: &Points) -> Result<LinearTerms> {
        let basis = Basis::of(self, points)?;
        let (group, groups) = basis.groups();
        let observations = Observations {
            values: basis.placed.iter().flat_map(|scan| scan.deviation_um.iter().copied()).collect(),
            unit: "um".into(),
            std: None,
            group,
            groups,
            structure: structure(&basis.placed, &basis.names()),
            ..Observations::default()
        };
        let column = vec![1.0; observations.values.len()];
        let radius = Declared { name: "radius less nominal".into(), unit: "um".into(), column };
        let terms = basis.missing.iter().zip(basis.columns(&basis.placed));
        let terms =
            terms.map(|(missing, columns)| Term { effect: missing.effect.clone(), columns, rank: missing.rank });
        let model = LinearTerms::new(observations, vec![radius], terms.collect())?;
        let highest = self.max_lobes();
        let limit = format!("order {highest} is the highest one looked for: higher ones need a larger `max_lobes`");
        let model = model.ending_at(format!("lobes-{highest}"), limit);
        Ok(model.predicting(basis.unseen(self, points)?).setting_aside(basis.defects))
    }

    fn outcome(&self, points: &Points, fit: &LinearFit) -> Result<Outcome> {
        let basis = Basis::of(self, points)?;
        let circles = basis.circles.iter().zip(&basis.placed);
        let mut sections: Vec<Separation> =
            circles.map(|(circle, placed)| self.shape(circle, placed, &basis, fit)).collect();
        let place = |section: &Separation| section.sections.first().map_or(f64::NAN, |at| at.z_mm);
        sections.sort_by(|a, b| place(a).total_cmp(&place(b)));
        let offset_um = fit.declared().first().copied().unwrap_or(f64::NAN);
        let left_out = match basis.circles.len() {
            1 => format!("each of {ARCS} arcs of the circle is held out once and predicted from the others"),
            count => format!("each of {count} circles is held out once and predicted from the others"),
        };
        let mut notes = vec![
            left_out,
            "form of the exports is that of the effects found (taper, barrel, lobes), not of each circle on its own"
                .into(),
        ];
        if let Some(outlier_mad) = self.outlier_mad() {
            notes.push(format!(
                "outliers beyond {outlier_mad} MAD are left out before, circle by circle: {} of {} points",
                basis.circles.iter().map(|circle| circle.measured - circle.scan.len()).sum::<usize>(),
                basis.circles.iter().map(|circle| circle.measured).sum::<usize>()
            ));
        }
        if !basis.cylinder.tilted {
            notes.push("the circles are at one height: tilt, taper and barrel are not observable".into());
        }
        let form = Form { sections, radius_mm: self.nominal_mm() + 1e-3 * offset_um };
        let mut evaluables = vec![Evaluable::ClosedProfiles(form)];
        evaluables.extend(open_profiles(points, &basis.cylinder)?.into_iter().map(Evaluable::OpenProfile));
        Ok(Outcome { evaluables, notes, ..Outcome::default() })
    }
}

impl LeastSquaresCylinder {
    /// Form of one circle by the effects found: what changes the size is its level, lobes are its harmonics.
    fn shape(&self, circle: &Circle, placed: &Scan, basis: &Basis, fit: &LinearFit) -> Separation {
        let at = circle.section(placed, self.max_lobes(), &basis.cylinder);
        let arm = arm_mm(&basis.cylinder, at.z_mm);
        let orders = self.max_lobes() + 1;
        let (mut estimate, mut variance) = (vec![Complex64::ZERO; orders], vec![0.0; orders]);
        for (effect, values, variances) in fit.effects() {
            let Some(found) = basis.missing.iter().find(|missing| missing.effect.id == effect.id) else { continue };
            match (found.lobes, found.rank, values) {
                // a cos nα + b sin nα = Re (a − ib) e^{inα}.
                (Some(order), FORM, [a, b]) => {
                    estimate[order] += Complex64::new(*a, -b);
                    variance[order] += variances.iter().sum::<f64>();
                }
                (None, SIZE, _) => {
                    for ((part, value), unit) in found.parts.iter().zip(values).zip(&variances) {
                        let here = part(0.0, arm);
                        estimate[0] += here * value;
                        variance[0] += here * here * unit;
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
            freedom: fit.remainder().dof,
            variance_from: VarianceFrom::Readings,
            residual: Residual {
                rms_um: fit.remainder().rms,
                expected_rms_um: f64::NAN,
                chi2_per_dof: f64::NAN,
                dof: fit.remainder().dof,
                ..Residual::default()
            },
            warnings: circle.warnings.clone(),
            ..Separation::default()
        }
    }
}
