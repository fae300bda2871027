//! A random field as a sum of waves.

use nalgebra::Vector3;
use rand::{Rng, RngExt};
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Waves of each component.
const WAVES: usize = 600;

/// A random field, of its own for each component.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// Standard deviation along x, y, z, in µm.
    pub std_um: [f64; 3],
    /// Ranges along x, y, z, in mm.
    pub range_mm: [f64; 3],
    /// Smoothness ν of Matérn's family: 0.5 is exponential; the limit of smooth fields (gaussian) without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub smoothness: Option<f64>,
}

/// A drawn field.
#[derive(Debug, Clone)]
pub struct Waves {
    /// Wave vector, phase and amplitude of each wave of each component.
    each: [Vec<(Vector3<f64>, f64, f64)>; 3],
}

impl Waves {
    /// Draws wave vectors from the field's spectrum: normal for the smooth limit, Student's with 2ν degrees of freedom for Matérn's
    /// family (a normal vector over the root of a χ² number).
    pub fn draw(field: &Field, random: &mut impl Rng) -> Self {
        let tail = field.smoothness.and_then(|nu| ChiSquared::new(2.0 * nu).ok().map(|chi2| (nu, chi2)));
        let mut of = |component: usize| {
            let mut wave = || {
                let normal = Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
                let stretch = tail.as_ref().map_or(1.0, |(nu, chi2)| (2.0 * nu / chi2.sample(random)).sqrt());
                let vector = stretch * normal.component_div(&Vector3::from(field.range_mm));
                let phase = random.random_range(0.0..std::f64::consts::TAU);
                // A normal amplitude of each wave makes the sum nearer to a normal field.
                let amplitude = random.sample::<f64, _>(StandardNormal) * field.std_um[component];
                (vector, phase, amplitude * (2.0 / WAVES as f64).sqrt())
            };
            (0..WAVES).map(|_| wave()).collect()
        };
        Self { each: [of(0), of(1), of(2)] }
    }

    /// The field at a place, in µm.
    #[must_use]
    pub fn at(&self, place_mm: [f64; 3]) -> Vector3<f64> {
        let place = Vector3::from(place_mm);
        Vector3::from_fn(|component, _| {
            let waves = self.each[component].iter();
            waves.map(|(vector, phase, amplitude)| amplitude * (vector.dot(&place) + phase).cos()).sum::<f64>()
        })
    }
}
