//! Timoshenko's beam element in one plane, with the four degrees of freedom (w₁, θ₁, w₂, θ₂) and θ = w′ less the shear angle.
//!
//! Shape functions are the exact static ones, with Φ = 12·E·I/(κ·G·A·l²) (Friedman and Kosmatka 1993, equations 12 and 13); matrices are
//! integrals of their products, by a Gauss rule that is exact for them. The gyroscopic matrix is that of Nelson (1980).

use std::f64::consts::PI;

/// A 4 × 4 matrix of an element.
pub type Square = [[f64; 4]; 4];

/// A circular section of one material, in SI units.
#[derive(Debug, Clone, Copy)]
pub struct Section {
    /// Outer diameter, in m.
    pub outer: f64,
    /// Inner diameter, in m.
    pub inner: f64,
    /// Young's modulus, in Pa.
    pub youngs: f64,
    /// Shear modulus, in Pa.
    pub shear: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, in kg/m³.
    pub density: f64,
}

impl Section {
    /// Area, in m².
    #[must_use]
    pub fn area(&self) -> f64 {
        PI / 4.0 * (self.outer.powi(2) - self.inner.powi(2))
    }

    /// Second moment of area about a diameter, in m⁴.
    #[must_use]
    pub fn second_moment(&self) -> f64 {
        PI / 64.0 * (self.outer.powi(4) - self.inner.powi(4))
    }

    /// Cowper's shear coefficient of a hollow circle (Cowper 1966, J. Appl. Mech. 33, 335), m the ratio of the diameters:
    /// 6(1 + ν)(1 + m²)² / ((7 + 6ν)(1 + m²)² + (20 + 12ν)m²).
    #[must_use]
    pub fn shear_coefficient(&self) -> f64 {
        let (nu, m2) = (self.poisson, (self.inner / self.outer).powi(2));
        let squared = (1.0 + m2).powi(2);
        6.0 * (1.0 + nu) * squared / ((7.0 + 6.0 * nu) * squared + (20.0 + 12.0 * nu) * m2)
    }
}

/// Matrices of an element.
#[derive(Debug, Clone, Copy, Default)]
pub struct Element {
    /// Stiffness of bending and shear.
    pub stiffness: Square,
    /// Mass of displacement and rotation.
    pub mass: Square,
    /// Polar inertia of rotation, ∫ρ·2I·NᵀN: the gyroscopic coupling of the two planes.
    pub polar: Square,
}

/// Nodes and weights of Gauss's rule on 0 to 1, exact up to order 7; products of shape functions are of order 6.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

impl Element {
    /// The element of a section with a length in m.
    #[must_use]
    pub fn new(section: &Section, length: f64) -> Self {
        let (bending, shearing) =
            (section.youngs * section.second_moment(), section.shear_coefficient() * section.shear * section.area());
        let phi = 12.0 * bending / (shearing * length * length);
        let rotary = section.density * section.second_moment();
        let mut element = Self::default();
        for (place, weight) in GAUSS {
            let weight = weight * length;
            let shape = Shape::at(place, length, phi);
            add(&mut element.stiffness, weight * bending, &shape.curvature);
            add(&mut element.stiffness, weight * shearing, &shape.shear);
            add(&mut element.mass, weight * section.density * section.area(), &shape.displacement);
            add(&mut element.mass, weight * rotary, &shape.rotation);
            add(&mut element.polar, weight * 2.0 * rotary, &shape.rotation);
        }
        element
    }
}

fn add(sum: &mut Square, factor: f64, row: &[f64; 4]) {
    for i in 0..4 {
        for j in 0..4 {
            sum[i][j] += factor * row[i] * row[j];
        }
    }
}

/// Displacement, rotation, curvature and shear angle at a place, by each degree of freedom.
struct Shape {
    displacement: [f64; 4],
    rotation: [f64; 4],
    curvature: [f64; 4],
    shear: [f64; 4],
}

impl Shape {
    /// `s` runs from 0 to 1.
    fn at(s: f64, length: f64, phi: f64) -> Self {
        let (l, scale) = (length, 1.0 / (1.0 + phi));
        let displacement = [
            1.0 - 3.0 * s * s + 2.0 * s.powi(3) + phi * (1.0 - s),
            l * (s - 2.0 * s * s + s.powi(3) + 0.5 * phi * (s - s * s)),
            3.0 * s * s - 2.0 * s.powi(3) + phi * s,
            l * (s.powi(3) - s * s - 0.5 * phi * (s - s * s)),
        ];
        let slope = [
            (6.0 * s * s - 6.0 * s - phi) / l,
            1.0 - 4.0 * s + 3.0 * s * s + 0.5 * phi * (1.0 - 2.0 * s),
            (6.0 * s - 6.0 * s * s + phi) / l,
            3.0 * s * s - 2.0 * s - 0.5 * phi * (1.0 - 2.0 * s),
        ];
        let rotation = [
            6.0 / l * (s * s - s),
            1.0 - 4.0 * s + 3.0 * s * s + phi * (1.0 - s),
            6.0 / l * (s - s * s),
            3.0 * s * s - 2.0 * s + phi * s,
        ];
        let curvature = [
            6.0 / (l * l) * (2.0 * s - 1.0),
            (6.0 * s - 4.0 - phi) / l,
            6.0 / (l * l) * (1.0 - 2.0 * s),
            (6.0 * s - 2.0 + phi) / l,
        ];
        let scaled = |row: [f64; 4]| row.map(|value| value * scale);
        let shear = std::array::from_fn(|i| slope[i] - rotation[i]);
        Self {
            displacement: scaled(displacement),
            rotation: scaled(rotation),
            curvature: scaled(curvature),
            shear: scaled(shear),
        }
    }
}
