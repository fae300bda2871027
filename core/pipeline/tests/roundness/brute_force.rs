//! All subsets of contacts of small profiles.

use runout_core::standards::{
    reference::{Reference, Undetermined},
    roundness::Points,
};

use super::profiles::{Profile, profile};

type Place = [f64; 2];

fn distance(a: Place, b: Place) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Where the bisectors of two pairs meet.
fn meet([a, b]: [Place; 2], [c, d]: [Place; 2]) -> Place {
    let line = |a: Place, b: Place| {
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        (x, y, 0.5 * (x * (a[0] + b[0]) + y * (a[1] + b[1])))
    };
    let ((p, q, r), (s, t, u)) = (line(a, b), line(c, d));
    let area = p * t - q * s;
    [(r * t - q * u) / area, (p * u - r * s) / area]
}

fn extremes(places: &[Place], centre: Place) -> (f64, f64) {
    let distances = places.iter().map(|place| distance(*place, centre));
    distances.fold((f64::INFINITY, 0.0), |(low, high), distance| (low.min(distance), f64::max(high, distance)))
}

fn pairs(places: &[Place]) -> impl Iterator<Item = [Place; 2]> + Clone + '_ {
    (0..places.len()).flat_map(move |a| (0..a).map(move |b| [places[a], places[b]]))
}

/// The narrowest zone about the meeting point of any two bisectors; any centre bounds it from above.
fn zone(places: &[Place]) -> f64 {
    let centres = pairs(places).flat_map(|first| pairs(places).map(move |second| meet(first, second)));
    let widths = centres.filter(|centre| centre[0].is_finite()).map(|centre| {
        let (low, high) = extremes(places, centre);
        high - low
    });
    widths.fold(f64::INFINITY, f64::min)
}

/// The largest empty circle whose three contacts surround its centre.
fn inscribed(places: &[Place], tolerance: f64) -> f64 {
    let mut best = 0.0;
    for [a, b] in pairs(places) {
        for c in places {
            let centre = meet([a, b], [b, *c]);
            let turn =
                |a: Place, b: Place| (a[0] - centre[0]) * (b[1] - centre[1]) - (a[1] - centre[1]) * (b[0] - centre[0]);
            let turns = [turn(a, b), turn(b, *c), turn(*c, a)];
            let low = extremes(places, centre).0;
            if (turns.iter().all(|turn| *turn > 0.0) || turns.iter().all(|turn| *turn < 0.0))
                && distance(a, centre) <= low + tolerance
            {
                best = f64::max(best, low);
            }
        }
    }
    best
}

fn circumscribed(places: &[Place]) -> f64 {
    let middles = pairs(places).map(|[a, b]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]);
    let triples = pairs(places).flat_map(|[a, b]| places.iter().map(move |c| meet([a, b], [b, *c])));
    let centres = middles.chain(triples).filter(|centre| centre[0].is_finite());
    centres.map(|centre| extremes(places, centre).1).fold(f64::INFINITY, f64::min)
}

fn compare(profile: &Profile, points: &Points, wrong: &mut Vec<String>, seed: u64) {
    let places: Vec<Place> = profile.places().into_iter().map(|(_, place)| place).collect();
    // Rounding of coordinates, magnified by bisectors of points that lie near each other; µm.
    let tolerance = 1e-12 * 1e3 * profile.radius_mm + 1e-9;
    for reference in [Reference::MinimumZone, Reference::MaximumInscribed, Reference::MinimumCircumscribed] {
        let circle = points.reference(reference);
        let found = circle.map(|circle| match reference {
            Reference::MinimumZone => points.values(&circle).ront_um,
            _ => 1e3 * profile.radius_mm + circle.deviation_um,
        });
        let expected = match reference {
            Reference::MinimumZone => zone(&places),
            Reference::MaximumInscribed => inscribed(&places, tolerance),
            _ => circumscribed(&places),
        };
        if found.is_none_or(|found| (found - expected).abs() > tolerance) {
            let (kind, count) = (profile.kind, places.len());
            let found = found.map(|found| found - expected);
            wrong.push(format!("{seed} ({kind}, {count}), {}: {found:?} off {expected}", reference.symbol()));
        }
    }
}

#[test]
fn small_profiles_have_no_better_circle() {
    let mut wrong = Vec::new();
    for seed in 0..800 {
        let profile = profile(seed, 4..=12);
        if profile.places().len() > 3 {
            compare(&profile, &profile.points(), &mut wrong, seed);
        }
    }
    assert!(wrong.is_empty(), "{} wrong, such as\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
}

#[test]
fn plots_have_the_smallest_circle_and_no_better_one_than_all_subsets() {
    let mut wrong = Vec::new();
    let (mut best, mut all) = ([0; 2], [0; 2]);
    for seed in 0..400 {
        let plot = super::contact::plot(seed);
        let places: Vec<Place> = plot.places().into_iter().map(|(_, place)| place).collect();
        let points = plot.points();
        // Rounding relative to the plot's size, magnified by bisectors of points that lie near each other.
        let tolerance = 1e-9 * points.radius_um();
        let radius = |reference| points.reference(reference).map(|circle| points.radius_um() + circle.deviation_um);
        if radius(Reference::MinimumCircumscribed)
            .is_none_or(|found| (found - circumscribed(&places)).abs() > tolerance)
        {
            wrong.push(format!("{seed}: MCCI"));
        }
        // Never better than the best of all. MICI is the best, MZCI mostly: its local optima are more.
        let zone =
            points.reference(Reference::MinimumZone).map(|circle| points.values(&circle).ront_um - zone(&places));
        let inscribed = radius(Reference::MaximumInscribed).map(|found| inscribed(&places, tolerance) - found);
        for (kind, off) in [zone, inscribed].into_iter().enumerate().filter_map(|(kind, off)| Some((kind, off?))) {
            all[kind] += 1;
            best[kind] += usize::from(off <= tolerance);
            if off < -tolerance {
                wrong.push(format!("{seed}: {kind} better than all by {off}"));
            }
        }
    }
    println!("MZCI, MICI: the best of all in {best:?} of {all:?} plots with deviations of a third of the radius");
    assert!(wrong.is_empty(), "{} wrong, such as {:?}", wrong.len(), &wrong[..wrong.len().min(20)]);
    assert!(best[1] == all[1] && 10 * best[0] > 9 * all[0], "{best:?} of {all:?}");
}

/// Smooth profiles of many points with deviations of up to 30 % of the radius, against a dense search of the centre.
#[test]
fn wide_profiles_have_the_largest_inscribed_circle() {
    use rand::{RngExt, SeedableRng};
    let mut wrong = Vec::new();
    for seed in 0..60 {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let waves: Vec<[f64; 2]> =
            (0..5).map(|_| [random.random_range(-1.0..1.0), random.random_range(0.0..6.3)]).collect();
        let form = |angle: f64| -> f64 {
            waves.iter().zip(2..).map(|([a, phase], order)| a * (f64::from(order) * angle + phase).cos()).sum()
        };
        let angles: Vec<f64> = (0..180).map(|point| f64::from(point).to_radians() * 2.0).collect();
        let largest = angles.iter().map(|angle| form(*angle).abs()).fold(0.0, f64::max);
        let radius_um = 1000.0;
        let form_um: Vec<f64> = angles.iter().map(|angle| 0.3 * radius_um * form(*angle) / largest).collect();
        let profile = Profile { kind: "wide", angles, form_um, radius_mm: 1e-3 * radius_um };
        let places: Vec<Place> = profile.places().into_iter().map(|(_, place)| place).collect();
        // Least distances on a grid, then ever finer about the best ten places.
        let mut best: Vec<(f64, Place)> = (-30..=30)
            .flat_map(|i| (-30..=30).map(move |j| [f64::from(i) * 20.0, f64::from(j) * 20.0]))
            .filter(|place| place[0].hypot(place[1]) < 600.0)
            .map(|place| (extremes(&places, place).0, place))
            .collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        best.truncate(10);
        for (low, place) in &mut best {
            let mut size = 20.0;
            while size > 1e-7 {
                let around = (0..16).map(|step| {
                    let (sin, cos) = (f64::from(step) * std::f64::consts::FRAC_PI_8).sin_cos();
                    [place[0] + size * cos, place[1] + size * sin]
                });
                let next = around.map(|place| (extremes(&places, place).0, place)).max_by(|a, b| a.0.total_cmp(&b.0));
                match next {
                    Some((better, next)) if better > *low => (*low, *place) = (better, next),
                    _ => size *= 0.7,
                }
            }
        }
        let searched = best.iter().map(|(low, _)| *low).fold(0.0, f64::max);
        let found =
            profile.points().determine(Reference::MaximumInscribed).map(|circle| radius_um + circle.deviation_um);
        if found.is_ok_and(|found| found < searched - 1e-4) || found.is_err() {
            wrong.push(format!("{seed}: {found:?} instead of {searched}"));
        }
    }
    assert!(wrong.is_empty(), "{} wrong, such as {:?}", wrong.len(), &wrong[..wrong.len().min(20)]);
}

#[test]
fn partial_arcs_say_that_a_circle_is_not_bounded() {
    for (covered, bounded) in [(100, false), (170, false), (200, true), (300, true)] {
        let angles: Vec<f64> = (0..covered).map(|point| f64::from(point).to_radians()).collect();
        let form_um = angles.iter().map(|angle| (9.0 * angle).cos()).collect();
        let points = Profile { kind: "arc", angles, form_um, radius_mm: 20.0 }.points();
        let inscribed = points.determine(Reference::MaximumInscribed);
        assert_eq!(
            inscribed.as_ref().err(),
            (!bounded).then_some(&Undetermined::NotBounded),
            "{covered}: {inscribed:?}"
        );
        let others = [Reference::LeastSquares, Reference::MinimumZone, Reference::MinimumCircumscribed];
        assert!(others.iter().all(|reference| points.determine(*reference).is_ok()), "{covered}");
    }
    let two = Profile { kind: "two points", angles: vec![0.0, 3.0], form_um: vec![0.0; 2], radius_mm: 20.0 }.points();
    assert_eq!(two.determine(Reference::MinimumZone), Err(Undetermined::TooFewPoints));
    assert!(two.determine(Reference::MinimumCircumscribed).is_ok());
}
