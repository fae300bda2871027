//! The element against closed forms: rigid motion, a cantilever, limits of the shear coefficient.

use runout_rotor::beam::{Element, Section, Square};

const STEEL: Section =
    Section { outer: 0.05, inner: 0.02, youngs: 211e9, shear: 81.2e9, poisson: 0.3, density: 7810.0 };

fn times(matrix: &Square, vector: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| (0..4).map(|j| matrix[i][j] * vector[j]).sum())
}

#[test]
fn rigid_motion_needs_no_force_and_has_the_body_s_inertia() {
    let length = 0.12;
    let element = Element::new(&STEEL, length);
    let (shift, turn) = ([1.0, 0.0, 1.0, 0.0], [0.0, 1.0, length, 1.0]);
    for motion in [shift, turn] {
        for force in times(&element.stiffness, motion) {
            assert!(force.abs() < 1e-12 * element.stiffness[0][0], "{force}");
        }
    }
    let energy = |matrix: &Square, motion: [f64; 4]| -> f64 {
        times(matrix, motion).iter().zip(motion).map(|(one, other)| one * other).sum()
    };
    let mass = STEEL.density * STEEL.area() * length;
    assert!((energy(&element.mass, shift) / mass - 1.0).abs() < 1e-13);
    // About the first node: a rod of two radii.
    let inertia = mass * (length * length / 3.0 + (STEEL.outer.powi(2) + STEEL.inner.powi(2)) / 16.0);
    assert!((energy(&element.mass, turn) / inertia - 1.0).abs() < 1e-13);
    let polar = mass * (STEEL.outer.powi(2) + STEEL.inner.powi(2)) / 8.0;
    assert!((energy(&element.polar, turn) / polar - 1.0).abs() < 1e-13);
    assert!(energy(&element.polar, shift).abs() < 1e-18);
}

#[test]
fn a_cantilever_bends_by_bending_and_shear() {
    // A short, thick one: shear is half of it. One element is exact for a force at its end.
    let length = 0.06_f64;
    let element = Element::new(&STEEL, length);
    let (a, b, d) = (element.stiffness[2][2], element.stiffness[2][3], element.stiffness[3][3]);
    let deflection = d / (a * d - b * b);
    let bending = length.powi(3) / (3.0 * STEEL.youngs * STEEL.second_moment());
    let shear = length / (STEEL.shear_coefficient() * STEEL.shear * STEEL.area());
    assert!((deflection / (bending + shear) - 1.0).abs() < 1e-12, "{deflection} {bending} {shear}");
    assert!(shear > 0.3 * bending);
}

#[test]
fn cowper_s_coefficient_has_its_limits() {
    let of = |inner: f64| Section { inner, ..STEEL }.shear_coefficient();
    // Solid: 6(1 + ν)/(7 + 6ν) = 0.886; a thin tube: 2(1 + ν)/(4 + 3ν) = 0.531 (Cowper's table 1, ν = 0.3).
    assert!((of(0.0) - 0.8864).abs() < 1e-4, "{}", of(0.0));
    assert!((of(0.049_999_9) - 0.5306).abs() < 1e-4, "{}", of(0.049_999_9));
}
