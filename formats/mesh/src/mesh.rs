//! The surface as vertices and triangles.

use std::f64::consts::TAU;

use runout_core::{Error, Result, surface::Surface};

use crate::colour::ColourScale;

/// A surface to be drawn: rings of vertices around z, in mm as measured (z along the spindle).
///
/// Vertex `ring · angles + angle` lies at that ring and angle; triangles of the last angle reach back to the first, so
/// the wall is closed at 0° without a second row of vertices.
#[derive(Debug)]
pub struct Mesh<'a> {
    surface: &'a Surface,
    scale: f64,
    capped: bool,
    colours: ColourScale,
    range_um: f64,
    /// (cos, sin) of each angle.
    directions: Vec<[f64; 2]>,
}

/// A point of the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Where it is drawn, magnified.
    pub position_mm: [f64; 3],
    /// Outward unit normal of what is drawn.
    pub normal: [f64; 3],
    /// True deviation, whatever the magnification.
    pub deviation_um: f64,
    /// Place in the [`palette`](crate::palette).
    pub colour: usize,
}

/// A flat end, from the axis to a ring. Drawn, not measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cap {
    /// The ring that it closes.
    pub ring: usize,
    /// Where its centre lies on the axis, in mm.
    pub z_mm: f64,
    /// Its normal along z: −1 at the first ring, +1 at the last.
    pub normal_z: f64,
}

impl Cap {
    /// Its triangles, counter-clockwise seen from outside; `centre` is the centre's vertex, `rim` the rim's first.
    pub fn triangles(&self, angles: u32, centre: u32, rim: u32) -> impl Iterator<Item = [u32; 3]> + use<> {
        let up = self.normal_z > 0.0;
        (0..angles).map(move |angle| {
            let here = rim + angle;
            let next = rim + if angle + 1 == angles { 0 } else { angle + 1 };
            if up { [centre, here, next] } else { [centre, next, here] }
        })
    }
}

impl<'a> Mesh<'a> {
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
        let (mut lowest, mut highest, mut finite) = (f64::INFINITY, f64::NEG_INFINITY, true);
        for deviation in &surface.deviation_um {
            lowest = lowest.min(*deviation);
            highest = highest.max(*deviation);
            finite &= deviation.is_finite();
        }
        if !finite {
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
        if surface.deviation_um.len() + 2 * (surface.angles + 1) >= u32::MAX as usize {
            return Err(failure("it has more points than 32 bits can count".into()).help("take fewer angles"));
        }
        let range_um = range_um.unwrap_or(highest.max(-lowest));
        let pitch = TAU / surface.angles as f64;
        let directions = (0..surface.angles)
            .map(|angle| {
                let (sine, cosine) = (pitch * angle as f64).sin_cos();
                [cosine, sine]
            })
            .collect();
        Ok(Self { surface, scale, capped, colours: ColourScale::new(range_um), range_um, directions })
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

    /// What the strongest colours stand for, ± µm.
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
        self.surface.ring(ring).iter().zip(&self.directions).map(move |(deviation, [cosine, sine])| {
            let radius = self.surface.radius_mm + 1e-3 * self.scale * deviation;
            [radius * cosine, radius * sine, z_mm]
        })
    }

    /// Visits the vertices of one ring, angle by angle.
    ///
    /// With r(α, z), the outward normal has the direction (r, −∂r/∂α, −r ∂r/∂z) along (radial, tangential, z); the
    /// derivatives are those of the parabola through the neighbours, around the seam as anywhere.
    pub fn ring(&self, ring: usize, mut visit: impl FnMut(Vertex)) {
        let z = &self.surface.z_mm;
        let (below, above) = (ring.saturating_sub(1), (ring + 1).min(z.len() - 1));
        let [weight_below, weight_here, weight_above] = slope_weights(z[ring] - z[below], z[above] - z[ring]);
        let angles = self.directions.len();
        let here = &self.surface.ring(ring)[..angles];
        let below = &self.surface.ring(below)[..angles];
        let above = &self.surface.ring(above)[..angles];
        let mm = 1e-3 * self.scale;
        let per_angle = mm * angles as f64 / (2.0 * TAU);
        for angle in 0..angles {
            let next = here[if angle + 1 == angles { 0 } else { angle + 1 }];
            let previous = here[if angle == 0 { angles - 1 } else { angle - 1 }];
            let deviation_um = here[angle];
            let [cosine, sine] = self.directions[angle];
            let radius = self.surface.radius_mm + mm * deviation_um;
            let along = mm * (weight_below * below[angle] + weight_here * deviation_um + weight_above * above[angle]);
            let (tangential, axial) = (-per_angle * (next - previous), -radius * along);
            let length = (radius * radius + tangential * tangential + axial * axial).sqrt().recip();
            let (radial, tangential) = (radius * length, tangential * length);
            visit(Vertex {
                position_mm: [radius * cosine, radius * sine, z[ring]],
                normal: [radial * cosine - tangential * sine, radial * sine + tangential * cosine, axial * length],
                deviation_um,
                colour: self.colours.index(deviation_um),
            });
        }
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
        let mesh = Mesh::new(&surface, 1000.0, false, None).unwrap();
        for ring in [1, 2] {
            let mut angle = 0.0_f64;
            mesh.ring(ring, |vertex| {
                let radius = 20.0 + form(angle, z[ring]);
                let (around, along) = ((2.0 * angle).cos(), 0.04 * z[ring]);
                let (sine, cosine) = angle.sin_cos();
                // Cross product of the tangents ∂p/∂α and ∂p/∂z.
                let t = [around * cosine - radius * sine, around * sine + radius * cosine];
                let cross = [t[1], -t[0], t[0] * along * sine - t[1] * along * cosine];
                let length = cross.iter().map(|value| value * value).sum::<f64>().sqrt();
                for (found, exact) in vertex.normal.iter().zip(cross) {
                    // (nΔ)²/6 = 5e-5 of a slope of 1/20 at n = 2 and Δ = 0.5°.
                    assert!((found - exact / length).abs() < 3e-6, "{vertex:?}");
                }
                angle += TAU / 720.0;
            });
        }
    }

    #[test]
    fn a_shape_that_folds_is_refused() {
        let surface = surface(&[0.0, 1.0], 8, |_, _| -25.0);
        assert!(Mesh::new(&surface, 1.0, false, None).is_ok());
        let error = Mesh::new(&surface, 1000.0, false, None).unwrap_err();
        assert!(error.to_string().contains("through the axis"), "{error}");
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let good = surface(&[0.0, 1.0], 8, |_, _| 1.0);
        let refused = |change: fn(&mut Surface)| {
            let mut bad = good.clone();
            change(&mut bad);
            Mesh::new(&bad, 1.0, false, None).is_err()
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
