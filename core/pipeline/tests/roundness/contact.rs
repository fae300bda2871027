//! Contact conditions: what proves a reference circle.

use runout_core::standards::{
    reference::Reference,
    roundness::{Angles, Circle, Points},
};

use super::profiles::{Profile, profile};

/// Rounding of coordinates of 300 mm and of distances from them, in µm, with room.
const TOLERANCE_UM: f64 = 2e-9;

/// Distances from the centre and directions to the points that are there.
pub(crate) fn seen(profile: &Profile, circle: &Circle) -> Vec<(usize, f64, f64)> {
    let from = |[x, y]: [f64; 2]| (x - circle.x_um, y - circle.y_um);
    let places = profile.places().into_iter().map(|(index, place)| (index, from(place)));
    places.map(|(index, (x, y))| (index, x.hypot(y), y.atan2(x))).collect()
}

fn extremes(seen: &[(usize, f64, f64)]) -> (f64, f64) {
    seen.iter().fold((f64::INFINITY, 0.0), |(low, high), (_, distance, _)| (low.min(*distance), high.max(*distance)))
}

/// Checks one reference circle; says what does not hold.
pub(crate) fn check(profile: &Profile, reference: Reference) -> Result<(), String> {
    let points = profile.points();
    let circle = points.reference(reference).ok_or("none found")?;
    let seen = seen(profile, &circle);
    let (low, high) = extremes(&seen);
    let at = |contact: &usize| {
        let Some(point) = seen.iter().find(|(index, ..)| index == contact) else { panic!("{contact} is missing") };
        *point
    };
    for contact in &circle.outer {
        let lacks = high - at(contact).1;
        if lacks > TOLERANCE_UM {
            return Err(format!("outer contact {contact} is {lacks} µm inside"));
        }
    }
    for contact in &circle.inner {
        let lacks = at(contact).1 - low;
        if lacks > TOLERANCE_UM {
            return Err(format!("inner contact {contact} is {lacks} µm outside"));
        }
    }
    let radius = 1e3 * profile.radius_mm + circle.deviation_um;
    let expected = match reference {
        Reference::MinimumZone => 0.5 * (low + high),
        Reference::MaximumInscribed => low,
        _ => high,
    };
    if (radius - expected).abs() > TOLERANCE_UM {
        return Err(format!("radius {radius} instead of {expected}"));
    }
    let angles = |contacts: &[usize]| contacts.iter().map(|contact| at(contact).2).collect::<Vec<f64>>();
    let (outer, inner) = (angles(&circle.outer), angles(&circle.inner));
    let held = match reference {
        Reference::MinimumZone if high - low < TOLERANCE_UM => true,
        Reference::MinimumZone => outer.len() == 2 && inner.len() == 2 && alternate(&outer, &inner),
        Reference::MaximumInscribed => outer.is_empty() && (within(&inner) || high - low < TOLERANCE_UM),
        _ => inner.is_empty() && within(&outer),
    };
    let values = points.values(&circle);
    if (values.ront_um - (high - low)).abs() > TOLERANCE_UM {
        return Err(format!("RONt {} instead of {}", values.ront_um, high - low));
    }
    held.then_some(()).ok_or_else(|| format!("contacts balance nothing: outer {outer:?}, inner {inner:?}"))
}

/// Outer and inner contacts in turns around the centre.
fn alternate(outer: &[f64], inner: &[f64]) -> bool {
    let mut around: Vec<(f64, bool)> =
        outer.iter().map(|angle| (*angle, true)).chain(inner.iter().map(|angle| (*angle, false))).collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    around.windows(2).all(|pair| pair[0].1 != pair[1].1)
}

/// Whether the centre lies in the polygon of the contacts: no gap between their angles is above half a turn.
fn within(angles: &[f64]) -> bool {
    let mut sorted = angles.to_vec();
    sorted.sort_by(f64::total_cmp);
    let turn = std::f64::consts::TAU;
    let gaps = sorted.iter().zip(sorted.iter().cycle().skip(1)).map(|(a, b)| (b - a).rem_euclid(turn));
    // 1e-9 rad: of two opposite contacts, half a turn on both sides.
    angles.len() >= 2 && gaps.fold(0.0, f64::max) <= std::f64::consts::PI + 1e-9
}

#[test]
fn contact_conditions_hold_on_ten_thousand_profiles() {
    let mut wrong = Vec::new();
    for seed in 0..10_000 {
        let profile = profile(seed, if seed % 10 == 0 { 200..=3000 } else { 3..=100 });
        if profile.places().len() < 3 {
            continue;
        }
        for reference in [Reference::MinimumZone, Reference::MaximumInscribed, Reference::MinimumCircumscribed] {
            if let Err(problem) = check(&profile, reference) {
                let (kind, count) = (profile.kind, profile.form_um.len());
                wrong.push(format!("{seed} ({kind}, {count} points), {}: {problem}", reference.symbol()));
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong, such as\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
}

/// Deviations up to a third of the radius: what a polar plot about a small base circle looks like.
pub(crate) fn plot(seed: u64) -> Profile {
    let mut plot = profile(seed, 4..=12);
    let largest =
        plot.form_um.iter().filter(|form| form.is_finite()).fold(0.0, |largest: f64, form| largest.max(form.abs()));
    plot.radius_mm = 3e-3 * largest;
    plot
}

#[test]
fn contact_conditions_hold_on_polar_plots() {
    let (mut wrong, mut found) = (Vec::new(), 0);
    for seed in 0..2000 {
        let plot = plot(seed);
        for reference in [Reference::MinimumZone, Reference::MaximumInscribed, Reference::MinimumCircumscribed] {
            // Few points of a bad circle may not surround any; those that have a circle have a proven one.
            match check(&plot, reference) {
                Ok(()) => found += 1,
                Err(problem) if problem == "none found" => {}
                Err(problem) => wrong.push(format!("{seed} ({}), {}: {problem}", plot.kind, reference.symbol())),
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong, such as\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
    assert!(found > 5000, "only {found} of 6000 have a circle");
}

/// Deviations so large that their squares are no numbers have no reference circle, and the search for one ends.
#[test]
fn deviations_without_bound_have_no_reference_circle() {
    for reference in
        [Reference::LeastSquares, Reference::MinimumZone, Reference::MaximumInscribed, Reference::MinimumCircumscribed]
    {
        let mut points = Points::default();
        let deviations_um: Vec<f64> = (0..720).map(|index| if index % 2 == 0 { 1e300 } else { 0.5e300 }).collect();
        points.set_profile(&Angles::equal(720), &deviations_um, 15.0);
        let ront_um = points.reference(reference).map(|circle| points.values(&circle).ront_um);
        assert!(ront_um.is_none_or(|ront_um| !ront_um.is_nan()), "{reference:?}: {ront_um:?}");
        points.set_profile(&Angles::equal(720), &[1e300; 720], 15.0);
        let _ends = points.reference(reference);
    }
}
