use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use super::*;

/// A map over 20 mm around (closed) and 10 mm along, 20 points a millimetre.
fn map(height: impl Fn(f64, f64) -> f64) -> HeightMap<'static> {
    let heights: Vec<f64> =
        (0..200 * 400).map(|point| height(f64::from(point % 400) / 20.0, f64::from(point / 400) / 20.0)).collect();
    HeightMap::new(heights, 400, 0.05, 0.05, true).unwrap()
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} instead of {expected}");
}

#[test]
fn a_wave_around_has_its_closed_forms() {
    // 2 µm, 1 mm: the area of a sine is that of its mean slope, √(1 + s²) ≈ 1 + s²/2.
    let wave = map(|x, _| 5.0 + 2.0 * (TAU * x + 0.1).sin());
    let found = areal(&wave, &Settings::default());
    assert_eq!((found.points, found.missing), (80_000, 0));
    // 20 points a wave: the rectangle rule is exact for powers, and errs by some (1/20)² on |sin|.
    near(found.height.sq, 2.0 * FRAC_1_SQRT_2, 1e-12);
    near(found.height.sku, 1.5, 1e-12);
    near(found.height.ssk, 0.0, 1e-12);
    near(found.height.sa, 4.0 / PI, 0.01);
    near(found.height.sz, 4.0, 0.05);
    let sdq = TAU * 2e-3 * FRAC_1_SQRT_2;
    // Seven points: (2π/20)⁶/140 of the slope.
    near(found.hybrid.sdq, sdq, 1e-5 * sdq);
    // Two points: (2π/20)²/12 of the area's excess, 50 s² in %.
    near(found.hybrid.sdr_percent, 50.0 * sdq * sdq, 0.01 * 50.0 * sdq * sdq);
    near(found.spatial.ssw_mm, 1.0, 1e-12);
    near(found.spatial.std_deg, 0.0, 0.0);
    // The autocorrelation is a cosine of the lag; along the wave it does not fall.
    near(found.spatial.sal_mm, 0.2_f64.acos() / TAU, 1e-4);
    assert!(found.spatial.str.is_nan());
}

#[test]
fn the_autocorrelation_of_crossed_waves_falls_along_both() {
    let found = Spatial::of(&map(|x, y| (TAU * x).sin() * (TAU * y / 2.5).sin()), 0.2);
    near(found.sal_mm, 0.2_f64.acos() / TAU, 1e-3);
    // Along, four whole waves end: the pairs at a lag are no longer whole waves, 2 %.
    near(found.str, 0.4, 0.02);
    near(found.ssw_mm, 1.0 / 1_f64.hypot(0.4), 1e-12);
}

#[test]
fn a_lay_has_its_direction() {
    for (around, along, degrees) in [(1.0, 1.0, 45.0), (1.0, -1.0, 135.0), (0.0, 1.0, 90.0), (2.0, 1.0, 26.5)] {
        let found = Spatial::of(&map(|x, y| (TAU * (around * x + along * y)).sin()), 0.2);
        near(found.std_deg, degrees, 0.5);
    }
}

#[test]
fn heights_as_frequent_as_each_other_are_all_core() {
    let ramp =
        HeightMap::new((0..10_201).map(|step| f64::from(step) / 10_200.0).collect::<Vec<_>>(), 101, 1.0, 1.0, false);
    let curve = MaterialRatio::of(&ramp.unwrap());
    let found = curve.functional([2.5, 50.0], [10.0, 80.0]);
    let expected = [
        (found.sk, 1.0),
        (found.spk, 0.0),
        (found.svk, 0.0),
        (found.smrk1_percent, 0.0),
        (found.smrk2_percent, 100.0),
        (found.sdc, 0.475),
        (found.sxp, 0.475),
        (found.vmp, 0.005),
        (found.vmc, 0.315),
        (found.vvv, 0.02),
        (found.vvc, 0.385),
        (curve.smc_um(25.0), 0.75),
        (curve.smr_percent(0.4), 60.0),
        (curve.smr_percent(2.0), 0.0),
        (curve.smr_percent(-1.0), 100.0),
        (curve.vm(100.0), 0.5),
        (curve.vv(0.0), 0.5),
    ];
    for (found, expected) in expected {
        near(found, expected, 1e-9);
    }
}

#[test]
fn hills_and_dales_of_an_egg_box_are_counted() {
    // Waves of 2 mm by 2.5 mm, with ripples of 0.25 mm that are lower than 5 % of the height.
    let box_of = |ripple: f64| {
        map(move |x, y| {
            0.5 * ((PI * x).cos() + (TAU * y / 2.5).cos()) + ripple * ((8.0 * PI * x).cos() * (8.0 * PI * y).cos())
        })
    };
    let plain = areal(&box_of(0.0), &Settings::default());
    // Ten around. Along, peaks at 0, 2.5 … 10 mm and pits at 1.25 … 8.75 mm: three peaks and all four pits keep clear of the ends,
    // of which the pits' dales reach a saddle before the ends, but for the first and the last.
    assert_eq!((plain.features.hills, plain.features.dales), (30, 20));
    near(plain.features.spd_per_mm2, 30.0 / (20.0 * 9.95), 1e-9);
    near(plain.features.s10z, 2.0, 0.01);
    // −½ (∂²/∂x² + ∂²/∂y²) of the peak, in 1/mm; second differences err by (2π·0.05/2)²/12.
    let bend = 0.25e-3 * (PI * PI + (TAU / 2.5).powi(2));
    near(plain.features.spc_per_mm, bend, 0.01 * bend);
    near(plain.features.svc_per_mm, -bend, 0.01 * bend);
    // A dale reaches from crest to crest: a cell of 2 mm by 2.5 mm. Below the saddles, at height 0, lies half of its mean
    // |½ (cos u + cos v)| = 4/π².
    near(plain.features.sda_mm2, 5.0, 0.03 * 5.0);
    near(plain.features.sha_mm2, 5.0, 0.03 * 5.0);
    let held = 1e-3 * 5.0 * 2.0 / (PI * PI);
    near(plain.features.sdv_mm3, held, 0.01 * held);
    near(plain.features.shv_mm3, held, 0.01 * held);
    let rippled = areal(&box_of(0.02), &Settings::default());
    assert_eq!((rippled.features.hills, rippled.features.dales), (30, 20));
    let finer = areal(&box_of(0.02), &Settings { pruning_percent: 0.1, ..Settings::default() });
    assert!(finer.features.hills > 100, "{:?}", finer.features);
}

#[test]
fn a_hill_across_the_seam_is_one() {
    let hill = |x: f64, y: f64| (-((x.min(20.0 - x)).powi(2) + (y - 5.0).powi(2))).exp();
    let found = areal(&map(hill), &Settings::default()).features;
    assert_eq!(found.hills, 0, "the only hill fills the map, and so reaches its edge");
    let ringed = areal(
        &map(|x, y| {
            hill(x, y)
                - 0.3 * (-((y - 2.0) * 2.0).powi(2)).exp()
                - 0.3 * (-((y - 8.0) * 2.0).powi(2)).exp()
                - 0.3 * (-((x - 10.0) / 3.0).powi(2)).exp()
        }),
        &Settings::default(),
    )
    .features;
    assert_eq!(ringed.hills, 1);
}

/// A surface like a ground one: waves and noise by a fixed recipe.
fn ground(x: f64, y: f64) -> f64 {
    let wave = |fx: f64, fy: f64, phase: f64| (TAU * (fx * x + fy * y) + phase).sin();
    wave(2.0, 0.3, 0.1) + 0.7 * wave(1.35, -1.1, 0.6) + 0.5 * wave(0.6, 2.3, 2.0) + 0.2 * wave(4.0, 1.7, 1.0)
}

#[test]
fn missing_points_are_left_out_of_every_value() {
    let whole = map(ground);
    let mut heights = whole.heights_um().to_vec();
    // A keyway of 0.5 mm along, and a hundredth of the points here and there.
    for (point, height) in heights.iter_mut().enumerate() {
        if (90..100).contains(&(point % 400)) || point % 101 == 7 {
            *height = f64::NAN;
        }
    }
    let gapped = whole.with(heights);
    let (all, some) = (areal(&whole, &Settings::default()), areal(&gapped, &Settings::default()));
    assert_eq!(some.points + some.missing, 80_000);
    assert_eq!(some.missing, gapped.missing());
    for (a, b) in all.parameters().into_iter().zip(some.parameters()) {
        // 3.5 % of the points are gone; hills and dales at the gaps are incomplete, and nearly all are. Ssk is 0 here.
        if !a.clause.starts_with('5') && a.value.abs() > 1e-9 {
            assert!((b.value / a.value - 1.0).abs() < 0.06, "{}: {} and {}", a.symbol, a.value, b.value);
        }
    }
    assert!(some.features.hills < all.features.hills);
}

#[test]
fn a_flat_map_has_values_or_none() {
    let found = areal(&map(|_, _| 3.0), &Settings::default());
    assert_eq!((found.height.sz, found.hybrid.sdr_percent, found.functional.sk), (0.0, 0.0, 0.0));
    assert!(found.height.ssk.is_nan() && found.spatial.sal_mm.is_nan() && found.spatial.ssw_mm.is_nan());
    let smallest = HeightMap::new(vec![1.0, f64::NAN, 2.0, f64::INFINITY], 2, 1.0, 1.0, false).unwrap();
    let found = areal(&smallest, &Settings::default());
    assert_eq!((found.points, found.height.sz), (2, 1.0));
    assert!(found.hybrid.sdq.is_nan() && found.hybrid.sdr_percent.is_nan());
}

#[test]
fn form_is_removed_and_texture_stays() {
    let texture = |x: f64, y: f64| 0.1 * (TAU * 7.0 * x / 20.0).cos() * (1.0 + y);
    let eccentric = map(|x, y| {
        let angle = TAU * x / 20.0;
        4.0 + (30.0 - 2.0 * y) * angle.cos() + (5.0 + y) * angle.sin() + texture(x, y)
    });
    let left = without_cylinder(&eccentric).unwrap();
    for (found, expected) in left.heights_um().iter().zip(map(texture).heights_um()) {
        near(*found, *expected, 1e-11);
    }
    let polynomial = |x: f64, y: f64| 1.0 - 0.4 * x + 0.02 * x * x * y - 0.001 * y.powi(3);
    let mut heights = map(polynomial).heights_um().to_vec();
    heights[1000..3000].fill(f64::NAN);
    let open = HeightMap::new(heights, 400, 0.05, 0.05, false).unwrap();
    let left = without_polynomial(&open, 3).unwrap();
    assert_eq!(left.missing(), 2000);
    assert!(left.heights_um().iter().all(|height| height.is_nan() || height.abs() < 1e-11));
    assert!(without_cylinder(&open).is_err() && without_polynomial(&eccentric, 1).is_err());
    assert!(without_polynomial(&open, 9).is_err() && without_polynomial(&eccentric, 0).is_ok());
}

#[test]
fn a_map_is_what_it_says() {
    let error =
        |heights: Vec<f64>, columns, dx| HeightMap::new(heights, columns, dx, 1.0, true).unwrap_err().to_string();
    assert!(error(vec![1.0; 7], 2, 1.0).contains("do not fill"));
    assert!(error(vec![1.0; 8], 1, 1.0).contains("do not fill") && error(vec![1.0; 8], 8, 1.0).contains("do not fill"));
    assert!(error(vec![1.0; 8], 2, 0.0).contains("above 0"));
    assert!(error(vec![f64::NAN; 8], 2, 1.0).contains("0 of its points"));

    let rows = |z_mm: &[f64]| {
        let heights_um = vec![1.0; 8 * z_mm.len()];
        let map = HeightMap::unrolled(10.0, z_mm, 8, &heights_um);
        map.map(|map| (map.rows(), map.dy_mm(), map.closed()))
    };
    assert_eq!(rows(&[1.0, 3.0, 5.0, 7.0]).unwrap(), (4, 2.0, true));
    assert_eq!(rows(&[1.0, 3.0, 5.0, 6.0]).unwrap().0, 3);
    assert!(rows(&[1.0, 3.0, 6.0]).is_err() && rows(&[1.0, 3.0, 4.0, 5.0]).is_err() && rows(&[1.0]).is_err());
    near(HeightMap::unrolled(10.0, &[0.0, 1.0], 8, &[1.0; 16]).unwrap().dx_mm(), TAU * 10.0 / 8.0, 1e-12);
}

/// Crossed waves of random direction and phase, hills of some 0.6 mm, on a plane map: with holes, hills and dales are those without.
#[test]
fn hills_and_dales_with_holes_are_those_without() {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(17);
    let (rows, columns) = (170, 230);
    let waves: Vec<[f64; 3]> = (0..60)
        .map(|_| {
            let (angle, frequency) = (PI * random.random::<f64>(), 1.0 + random.random::<f64>());
            [frequency * angle.cos(), frequency * angle.sin(), TAU * random.random::<f64>()]
        })
        .collect();
    let height = |point: usize| -> f64 {
        let (x, y) = (0.05 * (point % columns) as f64, 0.05 * (point / columns) as f64);
        waves.iter().map(|[fx, fy, phase]| (TAU * (fx * x + fy * y) + phase).sin()).sum()
    };
    let heights: Vec<f64> = (0..rows * columns).map(height).collect();
    let of = |heights: &[f64]| {
        let map = HeightMap::new(heights.to_vec(), columns, 0.05, 0.05, false).unwrap();
        areal(&map, &Settings::default()).features
    };
    let numbers = |found: &Features| {
        [
            found.spd_per_mm2,
            found.svd_per_mm2,
            found.spc_per_mm,
            found.svc_per_mm,
            found.s5p,
            found.s5v,
            found.s10z,
            found.sda_mm2,
            found.sha_mm2,
            found.sdv_mm3,
            found.shv_mm3,
        ]
    };
    let whole = of(&heights);
    assert!(whole.hills > 100 && whole.problem().is_none(), "{whole:?}");
    // Squares of holes, so many points wide, at random, over a share of the points; and how far values may be off.
    for (wide, share, off) in
        [(1, 0.001, 0.002), (1, 0.01, 0.004), (1, 0.08, 0.02), (2, 0.03, 0.02), (4, 0.02, 0.03), (8, 0.02, 0.12)]
    {
        let mut with_holes = heights.clone();
        for _ in 0..(share * (rows * columns) as f64 / f64::from(wide * wide)) as usize {
            let (row, column) = (random.random_range(0..rows - 8), random.random_range(0..columns - 8));
            for hole in 0..(wide * wide) as usize {
                with_holes[(row + hole / wide as usize) * columns + column + hole % wide as usize] = f64::NAN;
            }
        }
        let found = of(&with_holes);
        let pairs = numbers(&found).into_iter().zip(numbers(&whole));
        let worst = pairs.map(|(found, whole)| (found / whole - 1.0).abs());
        let worst = worst.fold(0.0, |worst: f64, off| if off <= worst { worst } else { off });
        println!(
            "{wide} wide, {share}: off by {worst:.4}, bridged {:.2} %, cut {:.1} %",
            found.bridged_percent, found.cut_percent
        );
        assert!(worst < off, "{wide} {share}: {worst}\n{found:?}\n{whole:?}");
    }
    // Too much, here and there or at one place.
    let mut scattered = heights.clone();
    scattered.iter_mut().step_by(8).for_each(|height| *height = f64::NAN);
    let mut torn = heights;
    torn[60 * columns..110 * columns].fill(f64::NAN);
    for (missing, said) in [(scattered, "12.5 % of the points"), (torn, "of the area are holes")] {
        let found = of(&missing);
        assert!(numbers(&found).iter().all(|value| value.is_nan()));
        assert!(found.problem().unwrap().contains(said), "{:?}", found.problem());
    }
}
