//! What is wrong with a pair of signals, as components that rotate.
//!
//! The pair is one complex signal, cosine + i·sine, of the true angle θ:
//!
//! z(θ) = R e^{iθ} + Σ_m p_m e^{imθ}, m ≠ 1.
//!
//! - m = 0 is the offset: p = x₀ + i·y₀.
//! - m = −1 is gain ratio and quadrature angle: (cos θ, (1 + ε)·sin(θ + α)) has p/R = (1 − u)/(1 + u), u = (1 + ε)·e^{−iα}, which
//!   is (−ε + iα)/2 to first order; its share at m = 1 changes the radius and turns the zero of the angle by α/2.
//! - The k-th harmonics of both signals, a cos kθ + b sin kθ of the cosine and c cos kθ + d sin kθ of the sine, are a component
//!   forward, p_k = ((a + d) + i(c − b))/2, and one backward, p_₋k = ((a − d) + i(c + b))/2.
//!
//! Seen from the turning vector, z e^{−iθ} − R = Σ p_m e^{i(m−1)θ}: its real part is the change of the radius, its imaginary
//! part over R the error of the angle, both to first order. At order n, m = 1 + n (forward) and m = 1 − n (backward) meet:
//!
//! radius: Re (p_{1+n} + p̄_{1−n}) e^{inθ}; angle: Im (p_{1+n} − p̄_{1−n}) e^{inθ} / R.
//!
//! **The radius holds the sum of the two, the angle has their difference.** Whatever the radius shows at an order, the
//! error of the angle may have either sign, or none. So offset and forward second harmonics are confounded at order 1, gain
//! ratio and quadrature angle with forward third harmonics at order 2, backward second with forward fourth harmonics at order 3,
//! and so on. Only a reference angle, or knowing that one of the two is absent, decides.
//! (Heydemann, Appl. Opt. 20 (1981) 3382, knows that both signals are sines: orders 1 and 2 are then decided.)

use runout_core::{
    Complex64,
    closed_loop::{Effect, Parameter},
};

/// A component that rotates m times as fast as the pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Component(pub i32);

/// Expected size of offset, gain ratio and quadrature angle, relative to the radius; a k-th harmonic has 1/k of it.
pub(crate) const USUAL: f64 = 0.01;
pub(crate) const UNIT: &str = "counts";

impl Component {
    /// All up to an order of the radius, backward before forward at each order.
    pub(crate) fn all(max_order: usize) -> Vec<Self> {
        (1..=max_order).flat_map(Self::of_order).collect()
    }

    /// The backward and the forward one of an order of the radius.
    pub(crate) fn of_order(order: usize) -> [Self; 2] {
        let order = i32::try_from(order).unwrap_or(i32::MAX - 1);
        [Self(1 - order), Self(1 + order)]
    }

    /// Its order in radius and angle.
    pub(crate) fn order(self) -> usize {
        (self.0 - 1).unsigned_abs() as usize
    }

    /// The other component of the same order in the radius.
    pub(crate) fn partner(self) -> Self {
        Self(2 - self.0)
    }

    pub(crate) fn is_forward(self) -> bool {
        self.0 > 1
    }

    pub(crate) fn id(self) -> String {
        match self.0 {
            0 => "quadrature-offset".into(),
            -1 => "quadrature-gain-and-angle".into(),
            forward @ 2.. => format!("harmonic-{forward}-forward"),
            backward => format!("harmonic-{}-backward", -backward),
        }
    }

    /// The component of an effect.
    pub(crate) fn of(id: &str, max_order: usize) -> Option<Self> {
        Self::all(max_order).into_iter().find(|component| component.id() == id)
    }

    /// Standard deviation that is expected of real and imaginary part of p, of a pair of unit radius.
    pub(crate) fn usual(self) -> f64 {
        match self.0 {
            0 => USUAL,
            -1 => 0.5 * USUAL,
            other => USUAL / f64::from(other.abs()),
        }
    }

    /// The effect on a pair of a radius. Parameters are what the radius has: c cos nφ + s sin nφ.
    pub(crate) fn effect(self, radius: f64) -> Effect {
        let wave = ["cosine", "sine"].map(|name| (name, UNIT, radius * self.usual()));
        let parameters =
            if self.0 == -1 { [("gain_ratio_less_1", "", USUAL), ("angle_error", "rad", USUAL)] } else { wave };
        let parameter =
            |(name, unit, tolerance): (&str, &str, f64)| Parameter { name: name.into(), unit: unit.into(), tolerance };
        Effect { id: self.id(), targets: Vec::new(), parameters: parameters.map(parameter).into() }
    }

    /// What the radius has, c and s, of parameters of the [`effect`](Self::effect).
    pub(crate) fn waves(self, radius: f64, parameters: [f64; 2]) -> [f64; 2] {
        if self.0 != -1 {
            return parameters;
        }
        let turned = Complex64::from_polar(1.0 + parameters[0], -parameters[1]);
        let share = radius * (1.0 - turned) / (1.0 + turned);
        [share.re, share.im]
    }

    /// The parameters of what the radius has.
    pub(crate) fn parameters(self, radius: f64, waves: [f64; 2]) -> [f64; 2] {
        if self.0 != -1 {
            return waves;
        }
        let share = Complex64::new(waves[0], waves[1]) / radius;
        let turned = (1.0 - share) / (1.0 + share);
        [turned.norm() - 1.0, -turned.arg()]
    }

    /// Change of c and of s per unit of each parameter, `[parameter][wave]`.
    pub(crate) fn slopes(self, radius: f64, parameters: [f64; 2]) -> [[f64; 2]; 2] {
        if self.0 != -1 {
            return [[1.0, 0.0], [0.0, 1.0]];
        }
        let turned = Complex64::from_polar(1.0 + parameters[0], -parameters[1]);
        let slope = -2.0 * radius / (1.0 + turned).powi(2);
        [slope * Complex64::cis(-parameters[1]), -slope * Complex64::i() * turned].map(|slope| [slope.re, slope.im])
    }

    /// p from what the radius has, c cos nφ + s sin nφ.
    pub(crate) fn of_radius(self, [cosine, sine]: [f64; 2]) -> Complex64 {
        Complex64::new(cosine, if self.is_forward() { -sine } else { sine })
    }

    /// What c and s of the radius add to the angle, times the radius, at an angle.
    pub(crate) fn along(self, angle_rad: f64) -> [f64; 2] {
        let (sine, cosine) = (self.order() as f64 * angle_rad).sin_cos();
        if self.is_forward() { [sine, -cosine] } else { [-sine, cosine] }
    }

    /// What c and s of the radius add to it at an angle.
    pub(crate) fn across(self, angle_rad: f64) -> [f64; 2] {
        let (sine, cosine) = (self.order() as f64 * angle_rad).sin_cos();
        [cosine, sine]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    type Signal = Box<dyn Fn(f64) -> [f64; 2]>;

    /// Small errors of two real signals, by what they do to radius and angle of the pair itself.
    #[test]
    fn what_each_error_does_to_radius_and_angle() {
        let small = 1e-7;
        let (radius, samples) = (1.0, 64);
        let wave = |row: usize, order: f64, sine: bool| -> Signal {
            Box::new(move |angle| {
                let value = if sine { (order * angle).sin() } else { (order * angle).cos() };
                std::array::from_fn(|signal| if signal == row { value } else { 0.0 })
            })
        };
        // Of each error: the signals that it adds, and its components (m, p).
        let half = |re: f64, im: f64| Complex64::new(0.5 * re, 0.5 * im);
        let mut cases: Vec<(Signal, Vec<(i32, Complex64)>)> = vec![
            (Box::new(|_| [1.0, 0.0]), vec![(0, Complex64::new(1.0, 0.0))]),
            (Box::new(|_| [0.0, 1.0]), vec![(0, Complex64::new(0.0, 1.0))]),
            // Gain ratio of the sine, and its phase.
            (Box::new(|angle: f64| [0.0, angle.sin()]), vec![(-1, half(-1.0, 0.0))]),
            (Box::new(|angle: f64| [0.0, angle.cos()]), vec![(-1, half(0.0, 1.0))]),
        ];
        for order in 2_i32..=4 {
            let k = f64::from(order);
            cases.push((wave(0, k, false), vec![(order, half(1.0, 0.0)), (-order, half(1.0, 0.0))]));
            cases.push((wave(0, k, true), vec![(order, half(0.0, -1.0)), (-order, half(0.0, 1.0))]));
            cases.push((wave(1, k, false), vec![(order, half(0.0, 1.0)), (-order, half(0.0, 1.0))]));
            cases.push((wave(1, k, true), vec![(order, half(1.0, 0.0)), (-order, half(-1.0, 0.0))]));
        }
        for (index, (signal, components)) in cases.iter().enumerate() {
            for sample in 0..samples {
                let angle = TAU * f64::from(sample) / f64::from(samples);
                let [x, y] = signal(angle);
                let pair = Complex64::new(angle.cos() + small * x, angle.sin() + small * y) * Complex64::cis(-angle);
                let found = [(pair.norm() - 1.0) / small, pair.arg() / small];
                // Of gain and angle a part is at m = 1: radius ε/2, zero α/2.
                let mut expected = match index {
                    2 => [0.5, 0.0],
                    3 => [0.0, 0.5],
                    _ => [0.0; 2],
                };
                for (turns, p) in components {
                    let component = Component(*turns);
                    let waves = [p.re, if component.is_forward() { -p.im } else { p.im }];
                    assert_eq!(component.of_radius(waves), *p);
                    let product = |rows: [f64; 2]| rows[0] * waves[0] + rows[1] * waves[1];
                    expected[0] += product(component.across(angle));
                    expected[1] += product(component.along(angle)) / radius;
                }
                // Second order of 1e-7, and rounding over 1e-7.
                let near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6);
                assert!(near, "case {index} at {angle}: {found:?} instead of {expected:?}");
            }
        }
    }

    #[test]
    fn gain_and_angle_are_exact_at_any_size() {
        let (component, radius) = (Component(-1), 300.0);
        for parameters in [[0.2, -0.1], [-0.15, 0.3], [0.0, 0.0]] {
            // The pair's own components by their definition, with the angle's zero where p₁ is real.
            let [gain, angle] = parameters;
            let own = 0.5 * (1.0 + Complex64::from_polar(1.0 + gain, angle));
            let back = 0.5 * (1.0 - Complex64::from_polar(1.0 + gain, -angle)) * Complex64::cis(own.arg());
            let waves = component.waves(radius, parameters);
            assert!((component.of_radius(waves) / radius - back / own.norm()).norm() < 1e-14);
            let again = component.parameters(radius, waves);
            assert!(again.iter().zip(parameters).all(|(found, truth)| (found - truth).abs() < 1e-14));
            for (index, slopes) in component.slopes(radius, parameters).into_iter().enumerate() {
                let at = |step: f64| {
                    let mut moved = parameters;
                    moved[index] += step;
                    component.waves(radius, moved)
                };
                let (above, below) = (at(1e-5), at(-1e-5));
                for wave in 0..2 {
                    let difference = (above[wave] - below[wave]) / 2e-5;
                    // Third order of 1e-5, and rounding of 300 over 1e-5.
                    assert!((slopes[wave] - difference).abs() < 1e-6, "{slopes:?} instead of {difference}");
                }
            }
        }
    }

    #[test]
    fn components_of_one_order_look_alike_in_the_radius_only() {
        for component in Component::all(8) {
            let partner = component.partner();
            assert_eq!((component.order(), partner.partner()), (partner.order(), component));
            let same = |a: [f64; 2], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
            assert!(same(component.across(0.3), partner.across(0.3)));
            assert!(same(component.along(0.3), partner.along(0.3).map(|entry| -entry)));
            assert_eq!(Component::of(&component.id(), 8), Some(component));
        }
        let ids: Vec<String> = Component::all(3).into_iter().map(Component::id).collect();
        assert_eq!(ids[..3], ["quadrature-offset", "harmonic-2-forward", "quadrature-gain-and-angle"]);
        assert_eq!(ids[3..], ["harmonic-3-forward", "harmonic-2-backward", "harmonic-4-forward"]);
    }
}
