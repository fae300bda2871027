//! The part's surface: form over angle and z, from sections at many stations.

mod builder;
mod monotone;
mod section;

use std::f64::consts::{PI, TAU};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use builder::{SurfaceBuilder, Uncertain};
use monotone::{STENCIL, Stencil};
use runout_error::Fault;
use runout_numerics::height_map::HeightMap;
pub use section::{Noise, Section};

/// `[surface]`: how sections become a surface.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceConfig {
    /// Equally spaced angles around the part. Orders from half of it upwards do not fit and are left out of the
    /// surface.
    #[serde(default = "default_angles")]
    pub angles: usize,
    /// Distance of the surface's rings along z, in mm, counted from the first section; the last section is the last
    /// ring. Without it the sections themselves are the rings.
    #[serde(default)]
    pub step_mm: Option<f64>,
}

fn default_angles() -> usize {
    720
}

impl Default for SurfaceConfig {
    fn default() -> Self {
        Self { angles: default_angles(), step_mm: None }
    }
}

impl SurfaceConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be.
    pub fn check(self) -> std::result::Result<Self, Fault> {
        if !(8..=36_000).contains(&self.angles) {
            return Err(Fault::at("angles", format!("expected 8 to 36000 angles, found {}", self.angles)));
        }
        match self.step_mm {
            Some(step) if !(step.is_finite() && step > 0.0) => {
                Err(Fault::at("step_mm", format!("the step must be above 0 mm, found {step}")))
            }
            _ => Ok(self),
        }
    }
}

/// Form over (angle, z), on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Nominal radius that the deviation is added to, in mm.
    pub radius_mm: f64,
    /// Equally spaced angles around the part, from 0 (the part's own angle).
    pub angles: usize,
    /// Ascending positions of the rings, in mm.
    pub z_mm: Vec<f64>,
    /// Deviation from the nominal radius in µm, `[ring][angle]`.
    pub deviation_um: Vec<f64>,
    /// How the rings were filled between the sections.
    pub interpolation: &'static str,
    /// Places where sections of different sensors meet.
    pub meetings: Vec<Meeting>,
}

/// Two sections that were measured at the same z by different sensors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Meeting {
    /// Where, in mm.
    pub z_mm: f64,
    /// Section ids with their stations, `a@s31`.
    pub sections: [String; 2],
    /// Root mean square of their difference over the orders that are observable by both, in µm.
    pub rms_um: f64,
    /// Largest difference, in µm.
    pub max_um: f64,
    /// What their uncertainties let expect of the rms, in µm; absent where unknown.
    pub expected_rms_um: Option<f64>,
}

impl Surface {
    /// The surface, unrolled at its nominal radius.
    ///
    /// # Errors
    /// Where rings are not at equal distances, or fewer than two.
    pub fn height_map(&self) -> runout_error::Result<HeightMap<'_>> {
        HeightMap::unrolled(self.radius_mm, &self.z_mm, self.angles, &self.deviation_um)
    }

    /// Deviations of one ring; nothing where there is none of this number.
    #[must_use]
    pub fn ring(&self, ring: usize) -> &[f64] {
        self.deviation_um.get(ring * self.angles..(ring + 1) * self.angles).unwrap_or_default()
    }

    /// Deviation in µm anywhere between the first and the last ring; `None` beyond them.
    ///
    /// Around the part: the trigonometric polynomial through the ring's values, in barycentric form (Henrici 1979,
    /// Numer. Math. 33, 225-234), exact for orders below half the angles. Along z: the monotone cubic of
    /// [`interpolation`](Self::interpolation) through the rings. Where `step_mm` laid the rings elsewhere than the
    /// sections, it passes through the rings.
    #[must_use]
    pub fn sample(&self, angle_rad: f64, z_mm: f64) -> Option<f64> {
        if !angle_rad.is_finite() || self.deviation_um.len() != self.z_mm.len() * self.angles {
            return None;
        }
        let stencil = Stencil::locate(&self.z_mm, z_mm)?;
        Some(stencil.value(self.around(&stencil, angle_rad)))
    }

    /// Values of a stencil's rings at one angle.
    fn around(&self, stencil: &Stencil, angle_rad: f64) -> [f64; STENCIL] {
        let rings: [&[f64]; STENCIL] = std::array::from_fn(|knot| self.ring(stencil.knot(knot)));
        let angle = angle_rad.rem_euclid(TAU);
        let pitch = TAU / self.angles as f64;
        let even = self.angles.is_multiple_of(2);
        let mut sums = [0.0; STENCIL];
        let mut weights = 0.0;
        let mut sign = 1.0;
        for index in 0..self.angles {
            let (sine, cosine) = (0.5 * (angle - pitch * index as f64)).sin_cos();
            // On a grid angle the weights are infinite and the value is the ring's own.
            if sine.abs() < 1e-15 * PI {
                return rings.map(|ring| ring[index]);
            }
            let weight = sign * if even { cosine / sine } else { sine.recip() };
            weights += weight;
            for (sum, ring) in sums.iter_mut().zip(&rings) {
                *sum += weight * ring[index];
            }
            sign = -sign;
        }
        sums.map(|sum| sum / weights)
    }

    /// BLAKE3 in hexadecimal of the surface's numbers as little-endian f64, one after the other: `radius_mm`, `z_mm`,
    /// `deviation_um`.
    #[must_use]
    pub fn checksum(&self) -> String {
        /// Numbers at a time: as many as the hasher works on side by side, and small enough for a core's own cache.
        const TOGETHER: usize = 1 << 14;
        let mut hasher = blake3::Hasher::new();
        let mut bytes = vec![0; 8 * TOGETHER];
        for numbers in [std::slice::from_ref(&self.radius_mm), &self.z_mm, &self.deviation_um] {
            for chunk in numbers.chunks(TOGETHER) {
                for (place, number) in bytes.chunks_exact_mut(8).zip(chunk) {
                    place.copy_from_slice(&number.to_le_bytes());
                }
                hasher.update(&bytes[..8 * chunk.len()]);
            }
        }
        hasher.finalize().to_hex().to_string()
    }
}

#[cfg(test)]
mod tests;
