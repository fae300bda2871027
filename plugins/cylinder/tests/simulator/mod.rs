//! Points on a cylinder with form, off centre and tilted, as a machine measures them along a radius from its own axis.
//! Exact geometry: each point is searched where the ray meets the surface. Nothing here is shared with the separator.

use std::f64::consts::TAU;

use runout_core::points::{Column, Points, Trace};

/// A part: (angle about its axis in rad, height along it in mm) to form in µm.
pub(crate) struct Part<'a> {
    pub radius_um: f64,
    /// Where the axis passes z = 0, in µm.
    pub through_um: [f64; 2],
    /// dx/dz and dy/dz of the axis.
    pub slope: [f64; 2],
    pub form_um: &'a dyn Fn(f64, f64) -> f64,
}

impl Part<'_> {
    /// Radius at which the ray of an angle at a height meets the surface, in µm.
    pub(crate) fn radius_seen_um(&self, angle_rad: f64, z_mm: f64) -> f64 {
        let mut reach = self.radius_um;
        for _ in 0..60 {
            reach -= self.above_um([reach * angle_rad.cos(), reach * angle_rad.sin(), 1e3 * z_mm]);
        }
        reach
    }

    /// Height of a point above the surface, in µm: the point is turned back about y, then about x, until the axis is z.
    fn above_um(&self, point_um: [f64; 3]) -> f64 {
        let [x, y, z] = [point_um[0] - self.through_um[0], point_um[1] - self.through_um[1], point_um[2]];
        let about_y = self.slope[0].atan();
        let (x, z) = (x * about_y.cos() - z * about_y.sin(), x * about_y.sin() + z * about_y.cos());
        let about_x = (self.slope[1] * about_y.cos()).atan();
        let (y, z) = (y * about_x.cos() - z * about_x.sin(), y * about_x.sin() + z * about_x.cos());
        x.hypot(y) - self.radius_um - (self.form_um)(y.atan2(x), 1e-3 * z)
    }
}

/// A recording: traces of (height in mm, angle in rad), with uniform noise of a standard deviation.
pub(crate) struct Recording<'a> {
    pub part: Part<'a>,
    pub nominal_mm: f64,
    pub noise_um: f64,
    pub seed: u64,
    columns: [Vec<f64>; 3],
    traces: Vec<Trace>,
}

impl<'a> Recording<'a> {
    pub(crate) fn of(part: Part<'a>, nominal_mm: f64, noise_um: f64, seed: u64) -> Self {
        let (columns, traces) = (std::array::from_fn(|_| Vec::new()), Vec::new());
        Self { part, nominal_mm, noise_um, seed, columns, traces }
    }

    fn uniform(&mut self) -> f64 {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    pub(crate) fn trace(mut self, id: &str, kind: &str, places: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let start = self.columns[0].len();
        for (z_mm, angle_rad) in places {
            let noise = 12.0_f64.sqrt() * self.noise_um * self.uniform();
            let deviation = self.part.radius_seen_um(angle_rad, z_mm) - 1e3 * self.nominal_mm + noise;
            let row = [z_mm, angle_rad.to_degrees(), deviation];
            self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        }
        self.traces.push(Trace { id: id.into(), kind: kind.into(), points: start..self.columns[0].len() });
        self
    }

    /// A circle of even angles.
    pub(crate) fn circle(self, id: &str, z_mm: f64, points: usize) -> Self {
        self.trace(id, "circle", around(z_mm, points))
    }

    pub(crate) fn points(self) -> Points {
        let columns = ["z_mm", "angle_deg", "deviation_um"].into_iter().zip(self.columns);
        let columns = columns.map(|(name, values)| Column { name: name.into(), values }).collect();
        Points { input: "simulated.csv".into(), columns, traces: self.traces, ..Points::default() }
    }
}

/// Even angles at one height.
pub(crate) fn around(z_mm: f64, points: usize) -> impl Iterator<Item = (f64, f64)> {
    (0..points).map(move |point| (z_mm, TAU * point as f64 / points as f64))
}
