//! Extremes, between equal angles, of the distance of a profile from a centre.

use std::f64::consts::TAU;

use runout_numerics::interpolation::Curve;

const MOST_NEWTON: usize = 8;
/// Extremes between angles are evaluated where the parabola through three angles brings them within this many times the
/// largest rise between angles of the highest (lowest) one; at 16 angles a wave the parabola's own rise is good to a few percent.
const MARGIN: f64 = 0.5;

/// An extreme between angles, as the parabola through three of them has it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extreme {
    angle_rad: f64,
    /// Within which the true extreme lies, to either side.
    step_rad: f64,
    pub outward: bool,
}

/// Extremes of heights on equal angles around a turn that may be below the lowest or above the highest of all (`ends`).
pub(crate) fn extremes(heights: &[f64], [low, high]: [f64; 2]) -> Vec<Extreme> {
    let count = heights.len();
    let step_rad = TAU / count as f64;
    // No parabola through three heights rises above their middle by more than an eighth of their bend.
    let rise = 0.125 * largest_bend(heights);
    let [above, below] = [high - (1.0 + MARGIN) * rise, low + (1.0 + MARGIN) * rise];
    let mut found = Vec::new();
    for (index, here) in heights.iter().enumerate().filter(|(_, here)| **here > above || **here < below) {
        let [before, after] = [(index + count - 1) % count, (index + 1) % count].map(|index| heights[index]);
        let (ahead, behind) = (here - after, here - before);
        let is_top = ahead >= 0.0 && behind > 0.0;
        let is_bottom = ahead <= 0.0 && behind < 0.0;
        if is_top || is_bottom {
            let bend = ahead + behind;
            let (aside, top) = (0.5 * (behind - ahead) / bend, here + (behind - ahead).powi(2) / (8.0 * bend));
            if if is_top { top > high - MARGIN * rise } else { top < low + MARGIN * rise } {
                found.push(Extreme { angle_rad: (index as f64 + aside) * step_rad, step_rad, outward: is_top });
            }
        }
    }
    found
}

impl Extreme {
    /// The angle at which the squared distance of R + r(θ) from a centre is stationary, by Newton's method.
    pub(crate) fn stationary(&self, curve: &Curve, radius_um: f64, [x_um, y_um]: [f64; 2]) -> f64 {
        let (start, step) = (self.angle_rad, self.step_rad);
        let mut angle = start;
        for _ in 0..MOST_NEWTON {
            let [form, slope, bend] = curve.at(angle);
            let (rho, (sin, cos)) = (radius_um + form, angle.sin_cos());
            let (along, across) = (x_um * cos + y_um * sin, y_um * cos - x_um * sin);
            // Derivatives of ½(ρ² − 2ρ c·e + c²).
            let first = rho * slope - slope * along - rho * across;
            let second = slope * slope + rho * bend - bend * along - 2.0 * slope * across + rho * along;
            let moved = first / second;
            if !moved.is_finite() {
                break;
            }
            angle = (angle - moved).clamp(start - step, start + step);
            if moved.abs() < 1e-9 * step {
                break;
            }
        }
        angle
    }
}

/// The largest |second difference| of heights around a turn.
fn largest_bend(heights: &[f64]) -> f64 {
    const LANES: usize = 8;
    let [first, second, .., before, last] = *heights else { return f64::INFINITY };
    let mut largest = [0.0; LANES];
    let mut look = |lane: usize, bend: f64| {
        // Comparisons with NaN are false: what is not there changes nothing.
        largest[lane] = if bend.abs() > largest[lane] { bend.abs() } else { largest[lane] };
    };
    let inner = heights[1..].chunks(LANES).zip(heights.chunks(LANES)).zip(heights[2..].chunks(LANES));
    for ((here, before), after) in inner {
        for (lane, ((here, before), after)) in here.iter().zip(before).zip(after).enumerate() {
            look(lane, 2.0 * here - before - after);
        }
    }
    look(0, 2.0 * first - last - second);
    look(1, 2.0 * last - before - first);
    largest.into_iter().fold(0.0, f64::max)
}
