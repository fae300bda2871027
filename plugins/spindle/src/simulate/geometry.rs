//! Where a sensor's line meets the displaced part.
//!
//! Everything is written in the sensor's own frame: its line is the real axis, the spindle's axis the origin, outwards
//! is positive. The part's axis stands at c = along + i·across. A point at distance R + u from the origin lies at
//! q = R + u − c from the part's axis, and is a point of the surface where
//!
//! |q| − R − h(α₀ + arg q) = 0,
//!
//! α₀ being the part's angle under the sensor if both axes coincided. The reading u is the root of this equation.

use super::series::{Phasor, Series};

/// What a sensor has before it.
pub(super) struct Sight<const L: usize> {
    /// e^{iα₀}.
    pub toward: Phasor<L>,
    /// Displacement of the part's axis along the sensor's line, outwards, in µm.
    pub along: [f64; L],
    /// Displacement across it, counter-clockwise from the line, in µm.
    pub across: [f64; L],
}

/// How far displacements and slopes may go, in µm, so that the root is unique and quickly found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// No displacement of the part's axis is larger.
    pub displacement: f64,
    /// No |h| is larger.
    pub form: f64,
    /// No |dh/dα| is larger, per rad.
    pub slope: f64,
}

impl Reach {
    /// Displacement, form, and slope per rad may each be this part of the radius.
    const LARGEST: f64 = 0.1;

    pub(crate) fn fits(&self, radius_um: f64) -> bool {
        [self.displacement, self.form, self.slope * Self::LARGEST]
            .iter()
            .all(|length| *length <= Self::LARGEST * radius_um)
    }

    /// Newton steps to the root. Their slope leaves h′ out, so that each leaves at most the part `q` of the error before;
    /// within [`fits`](Self::fits) q stays below 0.2. A fixed number makes samples independent of their neighbours.
    pub(crate) fn steps(&self, radius_um: f64) -> usize {
        // |h′ · across / |q|²| and the curvature of |q|, where |q| has shrunk as far as it may.
        let q = (self.slope + 0.5 * self.displacement) * self.displacement / (0.8 * radius_um).powi(2);
        let mut error = self.form + self.displacement;
        let mut steps = 0;
        while error > ROOT_UM && steps < 40 {
            error *= q.max(1e-9);
            steps += 1;
        }
        steps.max(1)
    }
}

/// The root is found to this at the very worst, in µm: largest slope, largest displacement, all at once.
const ROOT_UM: f64 = 1e-12;

/// Readings in µm: the exact meeting point. `profile` is h at the sensor's z.
///
/// The difference |q| − R is taken as (|q|² − R²) / (|q| + R), with R² cancelled by hand: nothing of R's rounding enters.
pub(super) fn exact<const L: usize>(
    radius_um: f64,
    profile: &(impl Series<L> + ?Sized),
    sight: &Sight<L>,
    steps: usize,
) -> [f64; L] {
    let mut reading = sight.along;
    for _ in 0..steps {
        let mut surface_angle = sight.toward;
        let (mut excess, mut step) = ([0.0; L], [0.0; L]);
        for lane in 0..L {
            let outward = reading[lane] - sight.along[lane];
            let across = sight.across[lane];
            let re = radius_um + outward;
            let modulus = (re * re + across * across).sqrt();
            excess[lane] = (outward * (2.0 * radius_um + outward) + across * across) / (modulus + radius_um);
            step[lane] = modulus / re;
            let (cos, sin) = (re / modulus, -across / modulus);
            let (a, b) = (sight.toward.re[lane], sight.toward.im[lane]);
            surface_angle.re[lane] = a * cos - b * sin;
            surface_angle.im[lane] = a * sin + b * cos;
        }
        let form = profile.sum(&surface_angle);
        for lane in 0..L {
            reading[lane] -= (excess[lane] - form[lane]) * step[lane];
        }
    }
    reading
}

/// Readings in µm as the linear equations have them: form under the sensor plus displacement along its line.
pub(super) fn linear<const L: usize>(profile: &(impl Series<L> + ?Sized), sight: &Sight<L>) -> [f64; L] {
    let mut reading = profile.sum(&sight.toward);
    for lane in 0..L {
        reading[lane] += sight.along[lane];
    }
    reading
}

#[cfg(test)]
mod tests {
    use runout_core::Complex64;

    use super::*;

    const RADIUS_UM: f64 = 30_000.0;

    fn sight(angle: f64, along: f64, across: f64) -> Sight<1> {
        Sight { toward: Phasor { re: [angle.cos()], im: [angle.sin()] }, along: [along], across: [across] }
    }

    /// A circle's meeting point has a closed form: u = e cos φ + √(R² − e² sin² φ) − R.
    #[test]
    fn displaced_circle() {
        for displacement in [0.0_f64, 8.0, 150.0, 2_000.0] {
            let reach = Reach { displacement, form: 0.0, slope: 0.0 };
            for index in 0..36 {
                let (sin, cos) = (0.3 + f64::from(index) * 0.17).sin_cos();
                let (along, across) = (displacement * cos, displacement * sin);
                let reading = exact(
                    RADIUS_UM,
                    [Complex64::ZERO; 0].as_slice(),
                    &sight(0.7, along, across),
                    reach.steps(RADIUS_UM),
                )[0];
                let drop = across * across / (RADIUS_UM + (RADIUS_UM.powi(2) - across * across).sqrt());
                // 1e-12 µm: rounding of lengths up to 2 mm.
                assert!((reading - (along - drop)).abs() < 1e-12, "{displacement}: {reading} {}", along - drop);
            }
        }
    }

    /// Any part: the reading puts a point on the surface, seen from coordinates that share nothing with the solution.
    #[test]
    fn meeting_point_lies_on_the_surface() {
        let mut harmonics = vec![Complex64::ZERO; 61];
        for (order, harmonic) in harmonics.iter_mut().enumerate().skip(2) {
            *harmonic = Complex64::from_polar(7.0 / order as f64, 1.0 + order as f64 * 2.3);
        }
        let slope = (2..61).map(|order| order as f64 * harmonics[order].norm()).sum();
        for displacement in [8.0_f64, 150.0] {
            let reach = Reach { displacement, form: 30.0, slope };
            for index in 0..90 {
                let angle = f64::from(index) * 0.21;
                let (across, along) =
                    (displacement * (1.0 + 3.0 * angle).sin(), displacement * (1.0 + 3.0 * angle).cos());
                let reading =
                    exact(RADIUS_UM, harmonics.as_slice(), &sight(angle, along, across), reach.steps(RADIUS_UM))[0];
                let (x, y) = (RADIUS_UM + reading - along, -across);
                let alpha = angle + y.atan2(x);
                let form: f64 = (2..61).map(|order| (harmonics[order] * Complex64::cis(order as f64 * alpha)).re).sum();
                // 3e-11 µm: this check's own R + h has a rounding of 4e-12 µm, its angle one of 2e-15 rad on slopes of 400 µm.
                assert!((x.hypot(y) - RADIUS_UM - form).abs() < 3e-11, "{}", x.hypot(y) - RADIUS_UM - form);
            }
        }
    }

    /// An ellipse r = ab / √(b² cos² + a² sin²), whose point on the line follows from a quadratic equation.
    #[test]
    fn displaced_ellipse() {
        let (a, b) = (RADIUS_UM + 6.0, RADIUS_UM - 6.0);
        // The ellipse's harmonics from its own equation, by a plain sum over 64 angles.
        let radius = |angle: f64| a * b / ((b * angle.cos()).powi(2) + (a * angle.sin()).powi(2)).sqrt();
        let count = 64;
        let harmonics: Vec<Complex64> = (0..12)
            .map(|order| {
                let terms = (0..count).map(|index| {
                    let angle = std::f64::consts::TAU * f64::from(index) / f64::from(count);
                    (radius(angle) - RADIUS_UM) * Complex64::cis(-f64::from(order) * angle)
                });
                terms.sum::<Complex64>() * if order == 0 { 1.0 } else { 2.0 } / f64::from(count)
            })
            .collect();
        let reach = Reach { displacement: 150.0, form: 12.0, slope: 30.0 };
        for index in 0..40 {
            let angle = 0.1 + f64::from(index) * 0.157;
            let (along, across) = (90.0 * (5.0 * angle).cos(), 150.0 * (3.0 * angle).sin());
            let reading =
                exact(RADIUS_UM, harmonics.as_slice(), &sight(angle, along, across), reach.steps(RADIUS_UM))[0];
            // In the ellipse's axes: the line starts at the spindle's axis and runs at `angle`.
            let centre = Complex64::new(along, across) * Complex64::cis(angle);
            let (dx, dy) = (angle.cos() / a, angle.sin() / b);
            let (ox, oy) = (-centre.re / a, -centre.im / b);
            let (p, q, r) = (dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - 1.0);
            let distance = (-q + (q * q - p * r).sqrt()) / p;
            // 1e-10 µm: the quadratic's own rounding on 30 mm, and the harmonics' on r − R.
            assert!((reading - (distance - RADIUS_UM)).abs() < 1e-10, "{}", reading - (distance - RADIUS_UM));
        }
    }
}
