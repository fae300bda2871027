//! Points of one trace.

use runout_core::{
    Result,
    points::{Points, Trace},
};

/// Points of one trace, in the order measured.
#[derive(Debug, Clone, Default)]
pub struct Scan {
    pub angle_rad: Vec<f64>,
    pub z_mm: Vec<f64>,
    pub deviation_um: Vec<f64>,
}

impl Scan {
    /// The points of a trace.
    ///
    /// # Errors
    /// When a column is missing or shorter than the trace.
    pub fn of(points: &Points, trace: &Trace) -> Result<Self> {
        let column = |name: &str| {
            points.column(name)?.get(trace.points.clone()).map(<[f64]>::to_vec).ok_or_else(|| {
                let object = format!("{}: trace {}", points.input.display(), trace.id);
                runout_core::Error::new("read", object, format!("the column {name} ends before it"))
            })
        };
        let angle_rad = column("angle_deg")?.iter().map(|angle| angle.to_radians()).collect();
        Ok(Self { angle_rad, z_mm: column("z_mm")?, deviation_um: column("deviation_um")? })
    }

    pub fn len(&self) -> usize {
        self.angle_rad.len()
    }

    /// (angle in rad, z in mm, deviation in µm) of each point.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64, f64)> + Clone {
        self.angle_rad
            .iter()
            .zip(&self.z_mm)
            .zip(&self.deviation_um)
            .map(|((angle, z), deviation)| (*angle, *z, *deviation))
    }

    pub fn push(&mut self, angle_rad: f64, z_mm: f64, deviation_um: f64) {
        self.angle_rad.push(angle_rad);
        self.z_mm.push(z_mm);
        self.deviation_um.push(deviation_um);
    }

    /// The points that are kept.
    pub fn keep(&self, kept: &[bool]) -> Self {
        let mut some = Self::default();
        for ((angle, z, deviation), _) in self.iter().zip(kept).filter(|(_, kept)| **kept) {
            some.push(angle, z, deviation);
        }
        some
    }

    /// The same points with their deviation counted from `from` (angle in rad, z in mm).
    pub fn less(&self, from: impl Fn(f64, f64) -> f64) -> Self {
        let deviation_um = self.iter().map(|(angle, z, deviation)| deviation - from(angle, z)).collect();
        Self { deviation_um, ..self.clone() }
    }
}
