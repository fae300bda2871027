//! Least-squares circles and cylinders against 60 digits computed elsewhere: `golden/least_squares.py`.

use runout_core::standards::{cylindricity, roundness};

struct Case {
    points: Vec<[f64; 3]>,
    answers: Vec<(String, f64)>,
}

impl Case {
    fn named(name: &str) -> Self {
        let mut case = Self { points: vec![], answers: vec![] };
        for line in include_str!("golden/least_squares.csv").lines() {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |cell: usize| cells[cell].parse().unwrap_or(0.0);
            match cells[..2] {
                [of, "point"] if of == name => case.points.push([number(2), number(3), number(4)]),
                [of, symbol] if of == name => case.answers.push((symbol.to_owned(), number(2))),
                _ => {}
            }
        }
        case
    }

    fn is(&self, symbol: &str, found: f64, tolerance: f64) {
        let answer = self.answers.iter().find(|(known, _)| known == symbol).map_or(f64::NAN, |(_, value)| *value);
        assert!((found - answer).abs() <= tolerance, "{symbol}: {found} instead of {answer}");
    }
}

#[test]
fn circles_to_rounding() {
    // Coordinates of 32 mm round at 7e-12 µm; a third of a turn magnifies that by some tens. The plot's are 500 times smaller.
    for (name, tolerance) in [("part", 2e-11), ("arc", 1e-9), ("plot", 2e-13), ("far", 2e-11)] {
        let case = Case::named(name);
        let mut points = roundness::Points::default();
        let [x, y] = [0, 1].map(|k| case.points.iter().map(|point| point[k]).collect::<Vec<f64>>());
        points.set_plane(&x, &y);
        let circle = points.reference(roundness::Reference::LeastSquares).unwrap();
        case.is("x", circle.x_um, tolerance);
        case.is("y", circle.y_um, tolerance);
        case.is("r", points.radius_um() + circle.deviation_um, tolerance);
    }
}

#[test]
fn a_plot_about_a_base_circle_is_the_same_circle() {
    let case = Case::named("plot");
    let angles: roundness::Angles = case.points.iter().map(|[x, y, _]| y.atan2(*x)).collect();
    let form: Vec<f64> = case.points.iter().map(|[x, y, _]| x.hypot(*y) - 40.0).collect();
    let mut points = roundness::Points::default();
    points.set_profile(&angles, &form, 0.04);
    let circle = points.reference(roundness::Reference::LeastSquares).unwrap();
    case.is("x", circle.x_um, 2e-13);
    case.is("r", 40.0 + circle.deviation_um, 2e-13);
}

#[test]
fn cylinders_to_rounding() {
    for name in ["wall", "steep"] {
        let case = Case::named(name);
        let points = case.points.iter().map(|[x, y, z]| (y.atan2(*x), 1e-3 * z, x.hypot(*y) - 32_500.0));
        let points = cylindricity::Points::new(32.5, points);
        let found = points.reference(cylindricity::Reference::LeastSquares).unwrap();
        // Rounding of coordinates of 40 mm, carried on over half the wall.
        let tolerance = 5e-11;
        case.is("x", found.x_um - 1e-3 * found.slope_x_urad * found.z_mm, tolerance);
        case.is("y", found.y_um - 1e-3 * found.slope_y_urad * found.z_mm, tolerance);
        case.is("a", 1e-6 * found.slope_x_urad, tolerance / 20e3);
        case.is("b", 1e-6 * found.slope_y_urad, tolerance / 20e3);
        case.is("r", 32_500.0 + found.deviation_um, tolerance);
    }
}
