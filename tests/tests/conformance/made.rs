//! Points of domains that have no simulator, by formulas of their own.

use std::{f64::consts::TAU, fmt::Write};

/// A file of points, by its name.
///
/// # Panics
/// When there is none of that name.
#[allow(clippy::too_many_lines, reason = "the points of one separator after the other")]
pub(crate) fn points(name: &str) -> String {
    let mut text = String::new();
    match name {
        // A slide of 1.5 µm and a part of 0.9 µm, whose sum and difference the two setups read, up and down.
        "traces" => {
            text.push_str("trace,setup,z_mm,reading_um\n");
            for repeat in 0..3 {
                for (setup, sign) in [("initial", 1.0), ("reversed", -1.0)] {
                    for step in 0..60 {
                        let z_mm = 2.0 * f64::from(step);
                        let slide = 1.5 * (TAU * z_mm / 95.0).sin();
                        let part = 0.9 * (TAU * z_mm / 61.0).cos();
                        let _ = writeln!(text, "{setup}-{repeat},{setup},{z_mm},{}", part + sign * slide);
                    }
                }
            }
        }
        // A circle about the origin.
        "quadrature" => {
            text.push_str("phase_deg,radius_counts\n");
            for step in 0..800 {
                let phase = TAU * f64::from(step) * 0.034_13;
                let [cosine, sine] = [1000.0 * phase.cos(), 1000.0 * phase.sin()];
                let _ = writeln!(text, "{},{}", sine.atan2(cosine).to_degrees(), cosine.hypot(sine));
            }
        }
        // Three circles with lobes of orders 2, 3 and 7.
        "circles" => {
            text.push_str("trace,kind,z_mm,angle_deg,deviation_um\n");
            for circle in 0..3 {
                for step in 0..180 {
                    let (angle, more) = (TAU * f64::from(step) / 180.0, f64::from(circle));
                    let form = 3.0 * (2.0 * angle).cos()
                        + (1.0 + 0.2 * more) * (3.0 * angle).sin()
                        + 0.5 * (7.0 * angle).cos();
                    let deviation = form + 4.0 * (angle - more).cos();
                    let _ = writeln!(text, "C{circle},circle,{},{},{deviation}", 10.0 * more, 2.0 * f64::from(step));
                }
            }
        }
        // Diagonals, edges and centre lines of a plate of 400 mm x 300 mm, in steps of 50 mm.
        "plate" => {
            text.push_str("line,from_x_mm,from_y_mm,to_x_mm,to_y_mm,slope_urad\n");
            let height_um = |[x, y]: [f64; 2]| 2.0 * (x / 90.0).cos() + 1.5 * (x - y).powi(2) / 4e4;
            for (line, [x0, y0, x1, y1]) in [
                ("AC", [0.0, 0.0, 400.0, 300.0]),
                ("BD", [400.0, 0.0, 0.0, 300.0]),
                ("AB", [0.0, 0.0, 400.0, 0.0]),
                ("BC", [400.0, 0.0, 400.0, 300.0]),
                ("CD", [400.0, 300.0, 0.0, 300.0]),
                ("DA", [0.0, 300.0, 0.0, 0.0]),
                ("EG", [200.0, 0.0, 200.0, 300.0]),
                ("HF", [0.0, 150.0, 400.0, 150.0]),
            ] {
                let steps = (f64::hypot(x1 - x0, y1 - y0) / 50.0).round();
                let at = |step: f64| [x0 + (x1 - x0) * step / steps, y0 + (y1 - y0) * step / steps];
                for step in 0..steps as usize {
                    let [from, to] = [at(step as f64), at(step as f64 + 1.0)];
                    let slope = 20.0 * (height_um(to) - height_um(from));
                    let _ = writeln!(text, "{line},{},{},{},{},{slope}", from[0], from[1], to[0], to[1]);
                }
            }
        }
        // Two hours of an exponential rise of each axis.
        "drift" => {
            text.push_str("time_s,x_um,y_um,z_um\n");
            for step in 0..720 {
                let time_s = 10.0 * f64::from(step);
                let rise = 1.0 - (-time_s / 1800.0).exp();
                let _ = writeln!(text, "{time_s},{},{},{}", 4.0 * rise, -2.5 * rise, 11.0 * rise);
            }
        }
        // Five runs of each direction at eleven targets.
        "positioning" => {
            text.push_str("target_mm,deviation_um,direction,run\n");
            for run in 1..=5 {
                for direction in [1, -1] {
                    for step in 0..11 {
                        let step = if direction > 0 { step } else { 10 - step };
                        let target_mm = 50.0 * f64::from(step) + 1.7 * f64::from(step % 3);
                        let error = 0.01 * target_mm + 2.0 * (target_mm / 130.0).sin() - 0.6 * f64::from(direction);
                        let _ = writeln!(text, "{target_mm},{error},{direction},{run}");
                    }
                }
            }
        }
        // Five runs of each direction along two body diagonals and one of a face.
        "diagonals" => {
            text.push_str("diagonal,target_mm,deviation_um,direction\n");
            for (diagonal, slope) in [("PPP", 0.012), ("NPP", -0.007), ("PP0", 0.020)] {
                for _ in 0..5 {
                    for direction in [1, -1] {
                        for step in 0..11 {
                            let step = if direction > 0 { step } else { 10 - step };
                            let target_mm = 50.0 * f64::from(step) + 1.7 * f64::from(step % 3);
                            let error = slope * target_mm + 2.0 * (target_mm / 90.0).cos() - 0.6 * f64::from(direction);
                            let _ = writeln!(text, "{diagonal},{target_mm},{error},{direction}");
                        }
                    }
                }
            }
        }
        // Four sets of touches of a sphere of 15 mm, by a probe with three lobes.
        "touches" => {
            text.push_str("x_mm,y_mm,z_mm,repeat\n");
            for repeat in 1..=4 {
                for touch in 0..25 {
                    let height = f64::from(touch) / 25.0;
                    let (angle, across) = (2.4 * f64::from(touch), (1.0 - height * height).sqrt());
                    let radius = 15.0 + 2e-3 * across * across * (3.0 * angle).cos();
                    let [x, y] = [radius * across * angle.cos(), radius * across * angle.sin()];
                    let _ = writeln!(text, "{x},{y},{},{repeat}", radius * height);
                }
            }
        }
        // Three passes of a table ahead and back: an axis that is off, a wave of it, and lost motion.
        "rotary-path" => {
            text.push_str("ball,c_deg,dx_mm,dy_mm,dz_mm,direction,repeat\n");
            for repeat in 1..=3 {
                for direction in [1, -1] {
                    for step in 0..24 {
                        let step = if direction > 0 { step } else { 23 - step };
                        let angle = TAU * f64::from(step) / 24.0;
                        let lost = 1e-3 * f64::from(direction);
                        let [x, y] = [4e-3 + lost * angle.sin(), -2e-3 - lost * angle.cos()];
                        let z = 3e-3 * (2.0 * angle).cos();
                        let _ = writeln!(text, "P1,{},{x},{y},{z},{direction},{repeat}", 15.0 * f64::from(step));
                    }
                }
            }
        }
        // Twenty seconds of a hum of 50 Hz that beats.
        "vibration" => {
            text.push_str("time_s,x_um,y_um\n");
            for step in 0..4000 {
                let time_s = f64::from(step) / 200.0;
                let hum = (1.0 + 0.3 * (TAU * 1.7 * time_s).sin()) * (TAU * 47.3 * time_s).sin();
                let _ = writeln!(text, "{time_s},{},{}", 0.4 * hum, 0.2 * hum);
            }
        }
        // Three turns ahead and three back, with lost motion and lobes.
        "path" => {
            text.push_str("angle_deg,deviation_um,direction\n");
            for direction in [1, -1] {
                for step in 0..3 * 360 {
                    let step = if direction > 0 { step } else { 3 * 360 - 1 - step } % 360;
                    let angle = TAU * f64::from(step) / 360.0;
                    let lost_motion = 0.8 * f64::from(direction) * angle.sin();
                    let deviation = 4.0 * (2.0 * angle).cos() + 1.5 * (angle - 0.7).cos() + lost_motion;
                    let _ = writeln!(text, "{step},{deviation},{direction}");
                }
            }
        }
        _ => panic!("no points are made under the name {name}"),
    }
    text
}
