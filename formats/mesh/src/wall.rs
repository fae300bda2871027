//! A surface around an axis as vertices and triangles.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use std::f64::consts::TAU;

use runout_core::{
    Error, Result,
    numerics::lanes::{NullaryFnOnce, load, vectorised},
    surface::Surface,
};

use crate::{
    cap::Cap,
    colour::ColourScale,
    extremes::{Extremes, ends, widen},
    vertices::{LANES, Vertices},
};

/// A surface to be drawn: rings of vertices around z, in mm as measured (z along the spindle).
///
/// Vertex `ring · angles + angle` lies at that ring and angle; triangles of the last angle reach back to the first, so
/// the wall is closed at 0° without a second row of vertices.
#[derive(Debug)]
pub struct Wall<'a> {
    surface: &'a Surface,
    scale: f64,
    capped: bool,
    colours: ColourScale,
    range_um: f64,
    /// Of each angle, [padded].
    cosines: Vec<f64>,
    sines: Vec<f64>,
    bounds_mm: [[f64; 3]; 2],
}

impl<'a> Wall<'a> {
    /// A surface with its deviations drawn `scale` times larger than they are, coloured up to ±`range_um` or else to
    /// the largest deviation.
    ///
    /// # Errors
    /// When the surface is none, holds what is no number, or folds through the axis at this scale.
    pub fn new(surface: &'a Surface, scale: f64, capped: bool, range_um: Option<f64>) -> Result<Self> {
        let failure = |problem: String| Error::new("draw", "the surface", problem);
        let rings = surface.z_mm.len();
        if rings < 2 || surface.angles < 3 || surface.deviation_um.len() != rings * surface.angles {
            return Err(failure(format!(
                "{rings} rings of {} angles with {} values make none",
                surface.angles,
                surface.deviation_um.len()
            )));
        }
        if !surface.z_mm.windows(2).all(|pair| pair[0] < pair[1]) {
            return Err(failure("its rings do not ascend along z".into()));
        }
        let [lowest, highest] = vectorised(Extremes(&surface.deviation_um));
        if !(lowest.is_finite() && highest.is_finite()) {
            return Err(failure("a deviation is not a number".into()));
        }
        let narrowest = surface.radius_mm + 1e-3 * scale * lowest;
        // Written so that a radius that is no number is refused too.
        if !(narrowest > 0.0 && surface.radius_mm.is_finite()) {
            let problem = format!(
                "deviations of {lowest} µm drawn {scale} times larger reach through the axis of a part of {} mm radius",
                surface.radius_mm
            );
            return Err(failure(problem).help("lower the magnification"));
        }
        if surface.deviation_um.len() + 2 * Cap::vertex_count(surface.angles) >= u32::MAX as usize {
            return Err(failure("it has more points than 32 bits can count".into()).help("take fewer angles"));
        }
        let range_um = range_um.unwrap_or(highest.max(-lowest));
        let angle = |index: usize| TAU / surface.angles as f64 * index as f64;
        let (sines, cosines): (Vec<f64>, Vec<f64>) = (0..surface.angles).map(|index| angle(index).sin_cos()).unzip();
        let [cosines, sines] = [&cosines, &sines].map(|values| padded(values));
        let colours = ColourScale::new(range_um);
        let mut wall = Self { surface, scale, capped, colours, range_um, cosines, sines, bounds_mm: [[0.0; 3]; 2] };
        wall.bounds_mm = vectorised(Bounds(&wall));
        Ok(wall)
    }

    /// Rings along z, at least two.
    #[must_use]
    pub fn rings(&self) -> usize {
        self.surface.z_mm.len()
    }

    /// Vertices of each ring, at least three.
    #[must_use]
    pub fn angles(&self) -> usize {
        self.surface.angles
    }

    /// How many times larger than they are the deviations are drawn.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Deviation of the strongest colours, ± µm.
    #[must_use]
    pub fn range_um(&self) -> f64 {
        self.range_um
    }

    /// The ends, where they are drawn.
    #[must_use]
    pub fn caps(&self) -> Vec<Cap> {
        if !self.capped {
            return Vec::new();
        }
        let cap = |ring: usize, normal_z| Cap { ring, z_mm: self.surface.z_mm[ring], normal_z };
        vec![cap(0, -1.0), cap(self.rings() - 1, 1.0)]
    }

    /// Positions of one ring in mm, angle by angle.
    pub fn rim(&self, ring: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
        let z_mm = self.surface.z_mm[ring];
        let directions = self.cosines.iter().zip(&self.sines);
        self.surface.ring(ring).iter().zip(directions).map(move |(deviation_um, (cosine, sine))| {
            let radius = self.radius_mm(*deviation_um);
            [radius * cosine, radius * sine, z_mm]
        })
    }

    /// Where a deviation is drawn.
    #[inline(always)]
    fn radius_mm(&self, deviation_um: f64) -> f64 {
        self.surface.radius_mm + 1e-3 * self.scale * deviation_um
    }

    /// Smallest and largest x, y and z, in mm.
    #[must_use]
    pub fn bounds_mm(&self) -> [[f64; 3]; 2] {
        self.bounds_mm
    }

    /// Visits the vertices of one ring, some angles at a time.
    ///
    /// With r(α, z), the outward normal has the direction (r, −∂r/∂α, −r ∂r/∂z) along (radial, tangential, z); the
    /// derivatives are those of the parabola through the neighbours, around the seam as anywhere.
    pub fn ring(&self, ring: usize, visit: impl FnMut(&Vertices)) {
        let z = &self.surface.z_mm;
        let (below, above) = (ring.saturating_sub(1), (ring + 1).min(z.len() - 1));
        let here = self.surface.ring(ring);
        let seam = here.len() - 1;
        vectorised(Ring {
            wall: self,
            z_mm: z[ring],
            around: padded(&[&here[seam..], here, &here[..1]].concat()),
            below: padded(self.surface.ring(below)),
            above: padded(self.surface.ring(above)),
            slope: slope_weights(z[ring] - z[below], z[above] - z[ring]),
            visit,
        });
    }

    /// Triangles of the wall between a ring and the next, counter-clockwise seen from outside.
    pub fn band(&self, ring: usize) -> impl Iterator<Item = [[u32; 3]; 2]> + use<> {
        let angles = self.surface.angles as u32;
        let lower = ring as u32 * angles;
        let upper = lower + angles;
        (0..angles).map(move |angle| {
            let next = if angle + 1 == angles { 0 } else { angle + 1 };
            [[lower + angle, lower + next, upper + next], [lower + angle, upper + next, upper + angle]]
        })
    }
}

/// A ring on its way to its vertices.
struct Ring<'a, V> {
    wall: &'a Wall<'a>,
    z_mm: f64,
    /// Its deviations, between the last and the first once more; [padded].
    around: Vec<f64>,
    /// Those of its neighbours along z; [padded].
    below: Vec<f64>,
    above: Vec<f64>,
    /// See [`slope_weights`].
    slope: [f64; 3],
    visit: V,
}

impl<V: FnMut(&Vertices)> NullaryFnOnce for Ring<'_, V> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        // Not `for_each`, which would be a call.
        for first in (0..self.wall.angles()).step_by(LANES) {
            self.vertices(first);
        }
    }
}

impl<V: FnMut(&Vertices)> Ring<'_, V> {
    /// The vertices at some angles.
    #[inline(always)]
    fn vertices(&mut self, first: usize) {
        let wall = self.wall;
        let [previous, here, next]: [[f64; LANES]; 3] = std::array::from_fn(|ahead| load(&self.around, first + ahead));
        let [below, above, cosine, sine]: [[f64; LANES]; 4] =
            [&self.below, &self.above, &wall.cosines, &wall.sines].map(|values| load(values, first));
        let mm = 1e-3 * wall.scale;
        let per_angle = mm * wall.angles() as f64 / (2.0 * TAU);
        let mut found = Vertices {
            count: LANES.min(wall.angles() - first),
            position_mm: [[self.z_mm; LANES]; 3],
            normal: [[0.0; LANES]; 3],
            deviation_um: here,
            colour: [0; LANES],
        };
        for lane in 0..LANES {
            let radius = wall.radius_mm(here[lane]);
            let along = mm * (self.slope[0] * below[lane] + self.slope[1] * here[lane] + self.slope[2] * above[lane]);
            let (tangential, axial) = (-per_angle * (next[lane] - previous[lane]), -radius * along);
            let length = (radius * radius + tangential * tangential + axial * axial).sqrt().recip();
            found.position_mm[0][lane] = radius * cosine[lane];
            found.position_mm[1][lane] = radius * sine[lane];
            let (radial, tangential) = (radius * length, tangential * length);
            found.normal[0][lane] = radial * cosine[lane] - tangential * sine[lane];
            found.normal[1][lane] = radial * sine[lane] + tangential * cosine[lane];
            found.normal[2][lane] = axial * length;
        }
        for lane in 0..LANES {
            found.colour[lane] = wall.colours.index(here[lane]);
        }
        (self.visit)(&found);
    }
}

/// See [`Wall::bounds_mm`].
struct Bounds<'a>(&'a Wall<'a>);

impl NullaryFnOnce for Bounds<'_> {
    type Output = [[f64; 3]; 2];

    #[inline(always)]
    fn call(self) -> Self::Output {
        let wall = self.0;
        // The axis is always between them.
        let mut range = [[[0.0; LANES]; 2]; 2];
        for ring in 0..wall.rings() {
            let (eights, rest) = wall.surface.ring(ring).as_chunks();
            // What is behind the last angle has no direction: it stays on the axis.
            let mut last = [0.0; LANES];
            last[..rest.len()].copy_from_slice(rest);
            for (index, deviations) in eights.iter().chain([&last]).enumerate() {
                for (directions, range) in [&wall.cosines, &wall.sines].into_iter().zip(&mut range) {
                    let mut places: [f64; LANES] = load(directions, LANES * index);
                    for lane in 0..LANES {
                        places[lane] *= wall.radius_mm(deviations[lane]);
                    }
                    widen(range, places);
                }
            }
        }
        let [x, y] = range.map(ends);
        let z = [wall.surface.z_mm[0], wall.surface.z_mm[wall.rings() - 1]];
        [0, 1].map(|end| [x[end], y[end], z[end]])
    }
}

/// Values and, behind them, enough zeros for [`LANES`] to begin at each.
fn padded(values: &[f64]) -> Vec<f64> {
    let mut padded = Vec::with_capacity(values.len() + LANES);
    padded.extend_from_slice(values);
    padded.resize(values.len() + LANES, 0.0);
    padded
}

/// Weights of the values below, here and above in the slope here of the parabola through them; at an end (a distance
/// of 0) of the line through two.
fn slope_weights(below: f64, above: f64) -> [f64; 3] {
    if below <= 0.0 {
        [0.0, -1.0 / above, 1.0 / above]
    } else if above <= 0.0 {
        [-1.0 / below, 1.0 / below, 0.0]
    } else {
        let whole = below + above;
        [-above / (below * whole), (above - below) / (below * above), below / (above * whole)]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn surface(z_mm: &[f64], angles: usize, deviation_um: impl Fn(f64, f64) -> f64) -> Surface {
        let pitch = TAU / angles as f64;
        let value = |z: f64| (0..angles).map(move |angle| (z, pitch * angle as f64));
        Surface {
            radius_mm: 20.0,
            angles,
            z_mm: z_mm.to_vec(),
            deviation_um: z_mm.iter().flat_map(|z| value(*z)).map(|(z, angle)| deviation_um(angle, z)).collect(),
            interpolation: "",
            meetings: Vec::new(),
        }
    }

    #[test]
    fn normals_are_those_of_the_shape_on_uneven_rings_and_at_the_seam() {
        // r = 20 + 0.5 sin 2α + 0.02 z² mm, drawn from µm at scale 1000.
        let form = |angle: f64, z: f64| 0.5 * (2.0 * angle).sin() + 0.02 * z * z;
        let z = [0.0, 1.0, 1.5, 4.0];
        let surface = surface(&z, 720, form);
        let wall = Wall::new(&surface, 1000.0, false, None).unwrap();
        for ring in [1, 2] {
            let mut angle = 0.0_f64;
            wall.ring(ring, |vertices| {
                for lane in 0..vertices.count {
                    let radius = 20.0 + form(angle, z[ring]);
                    let (around, along) = ((2.0 * angle).cos(), 0.04 * z[ring]);
                    let (sine, cosine) = angle.sin_cos();
                    // Cross product of the tangents ∂p/∂α and ∂p/∂z.
                    let t = [around * cosine - radius * sine, around * sine + radius * cosine];
                    let cross = [t[1], -t[0], t[0] * along * sine - t[1] * along * cosine];
                    let length = cross.iter().map(|value| value * value).sum::<f64>().sqrt();
                    for (found, exact) in vertices.normal.iter().map(|axis| axis[lane]).zip(cross) {
                        // (nΔ)²/6 = 5e-5 of a slope of 1/20 at n = 2 and Δ = 0.5°.
                        assert!((found - exact / length).abs() < 3e-6, "{vertices:?}");
                    }
                    angle += TAU / 720.0;
                }
            });
        }
    }

    #[test]
    fn a_shape_that_folds_is_refused() {
        let surface = surface(&[0.0, 1.0], 8, |_, _| -25.0);
        assert!(Wall::new(&surface, 1.0, false, None).is_ok());
        let error = Wall::new(&surface, 1000.0, false, None).unwrap_err();
        assert!(error.to_string().contains("through the axis"), "{error}");
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let good = surface(&[0.0, 1.0], 8, |_, _| 1.0);
        let refused = |change: fn(&mut Surface)| {
            let mut bad = good.clone();
            change(&mut bad);
            Wall::new(&bad, 1.0, false, None).is_err()
        };
        assert!(refused(|bad| bad.deviation_um[3] = f64::NAN));
        assert!(refused(|bad| bad.deviation_um[3] = f64::INFINITY));
        assert!(refused(|bad| bad.radius_mm = f64::NAN));
        assert!(refused(|bad| bad.z_mm[1] = 0.0));
        assert!(refused(|bad| bad.z_mm[1] = f64::NAN));
        assert!(refused(|bad| bad.z_mm.truncate(1)));
        assert!(refused(|bad| bad.deviation_um.truncate(15)));
        assert!(refused(|bad| bad.angles = 0));
    }
}
