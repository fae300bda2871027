//! Rotors whose frequencies have a closed form.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::PI;

use crate::support::{equations, frequencies, modal, near, rad_per_s};
use runout_rotor::{Mode, Search, Whirl, whirl};

/// Bending stiffness E·I of a solid shaft of steel, in N·m².
fn bending(diameter_mm: f64) -> f64 {
    210e9 * PI / 64.0 * (1e-3 * diameter_mm).powi(4)
}

const DISK: [f64; 3] = [12.0, 0.09, 0.05];

/// A disk at the end of a slender shaft without mass, clamped at the other end (Stodola).
fn overhung(length_mm: f64, diameter_mm: f64) -> String {
    let [mass, polar, diametral] = DISK;
    format!(
        r#"segments = [{{ length_mm = {length_mm}, outer_mm = {diameter_mm}, material = "light", elements = 3 }}]
        supports = [{{ z_mm = 0, kind = "clamped" }}]
        disks = [{{ z_mm = {length_mm}, mass_kg = {mass}, polar_kg_m2 = {polar}, diametral_kg_m2 = {diametral} }}]"#
    )
}

/// Frequencies of circular whirl by Stodola's equation, ω > 0 forward and ω < 0 backward. At the free end the shaft gives
/// w = a·F + c·M and φ = c·F + b·M with a = l³/3EI, b = l/EI, c = l²/2EI; the disk gives F = m·ω²·w and M = (D·ω² − P·Ω·ω)·φ. Roots of
/// the determinant are bracketed by a scan and halved.
fn stodola(length: f64, stiffness: f64, speed: f64) -> Vec<f64> {
    let [mass, polar, diametral] = DISK;
    let (a, b, c) = (length.powi(3) / (3.0 * stiffness), length / stiffness, length.powi(2) / (2.0 * stiffness));
    let determinant = |frequency: f64| {
        let force = mass * frequency.powi(2);
        let moment = diametral * frequency.powi(2) - polar * speed * frequency;
        (1.0 - a * force) * (1.0 - b * moment) - c * c * force * moment
    };
    let mut roots = Vec::new();
    let steps = 400_000;
    let at = |step: i32| (f64::from(step) + 0.5) * 0.05;
    for step in -steps..steps {
        let (mut low, mut high) = (at(step), at(step + 1));
        if determinant(low) * determinant(high) < 0.0 {
            for _ in 0..60 {
                let middle = f64::midpoint(low, high);
                if determinant(low) * determinant(middle) <= 0.0 { high = middle } else { low = middle }
            }
            roots.push(low);
        }
    }
    roots.sort_by(|x, y| x.abs().total_cmp(&y.abs()));
    roots
}

#[test]
fn a_disk_splits_each_mode_by_its_gyroscopic_moment() {
    let parts = overhung(600.0, 8.0);
    let all = equations(&parts);
    for speed in [0.0, 50.0, 300.0, 2000.0] {
        let expected = stodola(0.6, bending(8.0), speed);
        let modes = modal(&parts).at(speed).unwrap();
        println!("{speed} rad/s: {expected:.4?} {:.4?}", modes.iter().take(4).map(Mode::frequency).collect::<Vec<_>>());
        assert_eq!(expected.len(), 4, "{speed}: {expected:?}");
        for (mode, root) in modes.iter().zip(&expected) {
            // Shear of the slender shaft softens it by some 1e-4.
            near(mode.frequency(), root.abs(), 3e-4);
            if speed > 0.0 {
                let direction = if *root > 0.0 { Whirl::Forward } else { Whirl::Backward };
                assert_eq!(whirl(&mode.shape, &all.nodes), direction, "{speed} {root}");
            }
        }
    }
}

#[test]
fn critical_speeds_are_those_of_the_closed_form() {
    // With Ω = ω the moment is (D − P)·ω²: one forward critical speed, as P > D; backward, Ω = −ω, two.
    let parts = overhung(600.0, 20.0);
    let [mass, polar, diametral] = DISK;
    let (length, stiffness) = (0.6f64, bending(20.0));
    let (a, b, c) = (length.powi(3) / (3.0 * stiffness), length / stiffness, length.powi(2) / (2.0 * stiffness));
    let squares = |inertia: f64| {
        // (1 − a·m·s)(1 − b·J·s) − c²·m·J·s² = 0 in s = ω².
        let (two, one) = (mass * inertia * (a * b - c * c), -(a * mass + b * inertia));
        let root = (one * one - 4.0 * two).sqrt();
        [(-one - root) / (2.0 * two), (-one + root) / (2.0 * two)]
    };
    let mut expected: Vec<f64> = squares(diametral - polar).into_iter().chain(squares(diametral + polar)).collect();
    expected.retain(|square| *square > 0.0);
    expected.sort_by(f64::total_cmp);
    assert_eq!(expected.len(), 3);
    let rotor = modal(&parts);
    let found = Search::new(&rotor).crossings(1.0, 3).unwrap();
    for (crossing, square) in found.iter().zip(&expected) {
        near(crossing.speed, square.sqrt(), 1e-3);
        near(crossing.mode.frequency(), crossing.speed, 1e-12);
        // The eigenproblem at this speed has this frequency.
        let modes = rotor.at(crossing.speed).unwrap();
        let nearest =
            modes.iter().map(|mode| (mode.frequency() / crossing.speed - 1.0).abs()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-8, "{nearest:e}");
    }
}

/// A disk that turns freely in space: no spring, so its frequency is that of nutation, P/D·Ω.
#[test]
fn a_free_body_nutates() {
    let parts = r#"segments = [{ length_mm = 40, outer_mm = 30, material = "steel", elements = 2 }]
        disks = [{ z_mm = 20, mass_kg = 20, polar_kg_m2 = 0.3, diametral_kg_m2 = 0.16 }]"#;
    let rotor = modal(parts);
    assert_eq!(rotor.rigid(), 4);
    // The shaft of 0.22 kg adds to both moments.
    let mass = 7850.0 * PI / 4.0 * 0.03f64.powi(2) * 0.04;
    let polar = 0.3 + mass * 0.03f64.powi(2) / 8.0;
    let diametral = 0.16 + mass * (0.04f64.powi(2) / 12.0 + 0.03f64.powi(2) / 16.0);
    let speed = 5000.0;
    near(frequencies(parts, speed)[0], polar / diametral * speed, 1e-4);
}

/// A stiff shaft on two equal damped bearings moves as one mass on one spring: λ = −c/m ± i·√(2k/m − (c/m)²).
#[test]
fn a_damped_bearing_is_a_damped_oscillator() {
    let mass = 7850.0 * PI / 4.0 * 0.1f64.powi(2) * 0.2;
    for damping in [0.0, 20.0, 2000.0, 4500.0] {
        let bearing = |z_mm: f64| {
            format!(
                "{{ z_mm = {z_mm}, kxx_n_per_m = 1e6, kyy_n_per_m = 1e6, cxx_n_s_per_m = {damping}, cyy_n_s_per_m = {damping} }}"
            )
        };
        let parts = format!(
            r#"segments = [{{ length_mm = 200, outer_mm = 100, material = "steel", elements = 2 }}]
            bearings = [{}, {}]"#,
            bearing(0.0),
            bearing(200.0)
        );
        let modes = modal(&parts).at(0.0).unwrap();
        let natural = (2e6 / mass).sqrt();
        let ratio = damping / mass / natural;
        assert!(ratio < 1.0, "{ratio}");
        // Up and down along x and y; tilt is faster, as the bearings are at the ends.
        for mode in &modes[..2] {
            near(mode.frequency(), natural * (1.0 - ratio * ratio).sqrt(), 2e-3);
            assert!((mode.damping_ratio() - ratio).abs() < 2e-3, "{} {ratio}", mode.damping_ratio());
        }
    }
}

/// Cross-coupled stiffness drives forward whirl: λ² = −(k ∓ i·q)/m for a mass on k with kxy = q = −kyx.
#[test]
fn cross_coupling_makes_whirl_grow() {
    let mass = 7850.0 * PI / 4.0 * 0.1f64.powi(2) * 0.2;
    let bearing = |z_mm: f64| {
        format!("{{ z_mm = {z_mm}, kxx_n_per_m = 1e6, kyy_n_per_m = 1e6, kxy_n_per_m = 1e5, kyx_n_per_m = -1e5 }}")
    };
    let parts = format!(
        r#"segments = [{{ length_mm = 200, outer_mm = 100, material = "steel", elements = 2 }}]
        bearings = [{}, {}]"#,
        bearing(0.0),
        bearing(200.0)
    );
    let all = equations(&parts);
    let modes = modal(&parts).at(0.0).unwrap();
    let eigenvalue = root(-2e6 / mass, 2e5 / mass);
    let growing = modes[..2].iter().find(|mode| mode.eigenvalue.re > 0.0).unwrap();
    near(growing.eigenvalue.im, eigenvalue.1, 2e-3);
    near(growing.eigenvalue.re, eigenvalue.0, 1e-2);
    // Force in x is −kxy·y: it pushes along +x where y < 0, which is with an orbit from x towards y.
    assert_eq!(whirl(&growing.shape, &all.nodes), Whirl::Forward);
}

/// Cross-coupled bearings make one mode of each pair grow and the other decay, at one frequency: a critical speed of each, forward and
/// backward. Gyroscopic moments are next to none.
#[test]
fn critical_speeds_of_an_unstable_pair_are_forward_and_backward() {
    for (cross, length_mm, elements) in [(1e5, 300, 2), (3e4, 500, 4), (4e5, 700, 3), (2.5e5, 450, 5), (7e3, 640, 6)] {
        let bearing = |z_mm: i32, k: f64| {
            format!(
                "{{ z_mm = {z_mm}, kxx_n_per_m = {k}, kyy_n_per_m = {k}, kxy_n_per_m = {cross}, kyx_n_per_m = -{cross} }}"
            )
        };
        let parts = format!(
            r#"segments = [{{ length_mm = {length_mm}, outer_mm = 12, material = "steel", elements = {elements} }}]
            bearings = [{}, {}]"#,
            bearing(0, 1e6),
            bearing(length_mm, 2e6)
        );
        let all = equations(&parts);
        let found = Search::new(&modal(&parts)).crossings(1.0, 4).unwrap();
        assert_eq!(found.len(), 4);
        for pair in found.chunks(2) {
            let whirls = [&pair[0], &pair[1]].map(|crossing| whirl(&crossing.mode.shape, &all.nodes));
            assert!(whirls.contains(&Whirl::Forward) && whirls.contains(&Whirl::Backward), "{cross} {whirls:?}");
            let damping = [&pair[0], &pair[1]].map(|crossing| crossing.mode.damping_ratio());
            assert!(damping[0] * damping[1] < 0.0, "{cross} {damping:?}");
        }
    }
}

/// √(re + i·im) with both parts positive.
fn root(re: f64, im: f64) -> (f64, f64) {
    let size = re.hypot(im);
    (f64::midpoint(size, re).sqrt(), ((size - re) / 2.0).sqrt())
}

/// Frequencies of a coarser mesh are higher (Rayleigh). The error falls with the fourth power of the element's length where elements
/// are slender, and with its square where shear bends them.
#[test]
fn finer_meshes_converge_from_above() {
    let errors = |outer_mm: f64, elements: [usize; 3], mode: usize| {
        let frequency = |elements: usize| {
            let parts = format!(
                r#"segments = [{{ length_mm = 500, outer_mm = {outer_mm}, material = "steel", elements = {elements} }}]
                supports = [{{ z_mm = 0, kind = "pinned" }}, {{ z_mm = 500, kind = "pinned" }}]"#
            );
            frequencies(&parts, 0.0)[mode]
        };
        let exact = frequency(64);
        elements.map(|elements| frequency(elements) - exact)
    };
    let slender = errors(5.0, [2, 4, 8], 0);
    for pair in slender.windows(2) {
        assert!(pair[1] > 0.0 && (12.0..20.0).contains(&(pair[0] / pair[1])), "{slender:?}");
    }
    let thick = errors(50.0, [3, 6, 12], 4);
    for pair in thick.windows(2) {
        assert!(pair[1] > 0.0 && pair[0] / pair[1] > 3.8, "{thick:?}");
    }
}

/// Nodes between elements come by themselves, and the order of parts does not matter.
#[test]
fn a_disk_may_be_anywhere() {
    let parts = |elements: usize, cut: &str| {
        format!(
            r#"segments = [{cut}{{ length_mm = 300, outer_mm = 40, material = "steel", elements = {elements} }}]
            disks = [{{ z_mm = 123.4, mass_kg = 3, polar_kg_m2 = 0.01, diametral_kg_m2 = 0.006 }}]
            bearings = [
                {{ z_mm = 287.3, kxx_n_per_m = 1e8, kyy_n_per_m = 1e8 }}, {{ z_mm = 11.9, kxx_n_per_m = 1e8, kyy_n_per_m = 1e8 }},
            ]"#
        )
    };
    let (coarse, fine) = (frequencies(&parts(4, ""), 100.0), frequencies(&parts(40, ""), 100.0));
    for (one, other) in coarse.iter().zip(&fine).take(6) {
        near(*one, *other, 5e-3);
    }
}

/// With unequal springs, slow rotation gives backward and forward whirl of the two planes, and what a critical speed is does not
/// depend on how it is found: a rotor with next to no damping takes the search, one without the eigenvalue problem.
#[test]
fn both_ways_to_a_critical_speed_agree() {
    let parts = |damping: f64| {
        format!(
            r#"segments = [{{ length_mm = 800, outer_mm = 40, material = "steel", elements = 5 }}]
            disks = [{{ z_mm = 320, mass_kg = 15, polar_kg_m2 = 0.15, diametral_kg_m2 = 0.08 }}]
            bearings = [
                {{ z_mm = 0, kxx_n_per_m = 4e6, kyy_n_per_m = 5e6, cxx_n_s_per_m = {damping} }},
                {{ z_mm = 800, kxx_n_per_m = 8e6, kyy_n_per_m = 7e6 }},
            ]"#
        )
    };
    let (without, with) = (modal(&parts(0.0)), modal(&parts(1e-3)));
    let exact = Search::new(&without).crossings(1.0, 6).unwrap();
    let searched = Search::new(&with).crossings(1.0, 6).unwrap();
    assert_eq!(exact.len(), searched.len());
    for (one, other) in exact.iter().zip(&searched) {
        near(one.speed, other.speed, 1e-7);
    }
    // Strong damping: every speed that is found is a frequency at that speed.
    let damped = modal(&parts(5e3));
    let found = Search::new(&damped).crossings(1.0, 6).unwrap();
    assert!(found.len() >= 5, "{}", found.len());
    for crossing in &found {
        near(crossing.mode.frequency(), crossing.speed, 1e-8);
        assert!(crossing.mode.damping_ratio() > 0.0);
    }
}

/// A rotor has the same frequencies when it turns the other way.
#[test]
fn frequencies_do_not_depend_on_the_direction_of_rotation() {
    let parts = overhung(400.0, 25.0);
    let (one, other) = (frequencies(&parts, rad_per_s(9000.0)), frequencies(&parts, -rad_per_s(9000.0)));
    for (one, other) in one.iter().zip(&other).take(4) {
        near(*one, *other, 1e-9);
    }
}
