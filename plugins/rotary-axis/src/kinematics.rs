//! Where a ball is: q = e + Rot(θ)·(d + Rot(ε)·R(φ)·(p + b)), an axis along z, and its derivatives.

use nalgebra::{Matrix3, Vector3};

/// Rotation by |v| rad about v (Rodrigues).
pub(crate) fn rotation(v: &Vector3<f64>) -> Matrix3<f64> {
    let angle = v.norm();
    let cross = v.cross_matrix();
    // Both series hold to rounding below this angle.
    let (first, second) = if angle < 1e-4 {
        (1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0)
    } else {
        (angle.sin() / angle, (1.0 - angle.cos()) / (angle * angle))
    };
    Matrix3::identity() + cross * first + cross * cross * second
}

/// Rotation by φ about z, right-handed.
pub(crate) fn turn(phi: f64) -> Matrix3<f64> {
    let (sine, cosine) = phi.sin_cos();
    Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0)
}

/// Derivative of Rot(v)·w by v: −[Rot(v)·w]× · J(v), with J(v) ≈ 1 + ½[v]× + ⅙[v]×².
fn by_rotation(v: &Vector3<f64>, turned: &Vector3<f64>) -> Matrix3<f64> {
    let cross = v.cross_matrix();
    -turned.cross_matrix() * (Matrix3::identity() + cross * 0.5 + cross * cross / 6.0)
}

/// Location and component errors at one command; mm and rad.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Errors {
    /// e; z is 0.
    pub offset: Vector3<f64>,
    /// θ; z is 0.
    pub tilt: Vector3<f64>,
    /// d(φ).
    pub shift: Vector3<f64>,
    /// ε(φ).
    pub angle: Vector3<f64>,
}

/// A ball's place and its derivatives.
pub(crate) struct Place {
    pub at: Vector3<f64>,
    pub by_tilt: Matrix3<f64>,
    pub by_shift: Matrix3<f64>,
    pub by_angle: Matrix3<f64>,
    /// By the ball's place on the table, p + b.
    pub by_ball: Matrix3<f64>,
}

/// The place at command φ of a ball that stands at `ball` (p + b) at command 0.
pub(crate) fn place(errors: &Errors, phi: f64, ball: &Vector3<f64>) -> Place {
    let (table, component, axis) = (turn(phi), rotation(&errors.angle), rotation(&errors.tilt));
    let turned = component * (table * ball);
    let whole = axis * (errors.shift + turned);
    Place {
        at: errors.offset + whole,
        by_tilt: by_rotation(&errors.tilt, &whole),
        by_shift: axis,
        by_angle: axis * by_rotation(&errors.angle, &turned),
        by_ball: axis * component * table,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_differences() {
        let errors = Errors {
            offset: Vector3::new(0.02, -0.03, 0.0),
            tilt: Vector3::new(4e-4, -3e-4, 0.0),
            shift: Vector3::new(0.004, 0.002, -0.003),
            angle: Vector3::new(2e-4, 5e-4, -4e-4),
        };
        let (phi, ball) = (0.7, Vector3::new(110.0, 20.0, 60.0));
        let found = place(&errors, phi, &ball);
        for coordinate in 0..3 {
            let step = 1e-5;
            let moved = |change: fn(&mut Errors) -> &mut Vector3<f64>, sign: f64| {
                let mut errors = errors;
                change(&mut errors)[coordinate] += sign * step;
                place(&errors, phi, &ball).at
            };
            let slope = |change| (moved(change, 1.0) - moved(change, -1.0)) / (2.0 * step);
            // 1e-7 per unit: the series ends after the third power of 5e-4 rad, times 130 mm.
            assert!((slope(|errors| &mut errors.tilt) - found.by_tilt.column(coordinate)).norm() < 1e-6);
            assert!((slope(|errors| &mut errors.angle) - found.by_angle.column(coordinate)).norm() < 1e-6);
            assert!((slope(|errors| &mut errors.shift) - found.by_shift.column(coordinate)).norm() < 1e-8);
            let mut ball = ball;
            ball[coordinate] += step;
            let change = (place(&errors, phi, &ball).at - found.at) / step;
            assert!((change - found.by_ball.column(coordinate)).norm() < 1e-8);
        }
    }
}
