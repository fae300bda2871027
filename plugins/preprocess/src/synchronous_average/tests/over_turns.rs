//! Scatter, covariance and spread over the turns.

use super::*;

#[test]
fn the_scatter_is_that_of_the_turns() {
    let (length, turns, channels) = (64, 12, 3);
    for channels in [channels, 5] {
        let mut scatter = scatter(4);
        let mut data = vec![Vec::new(); channels];
        for _ in 0..turns * length {
            // What all sensors see, and what each sees alone, on top of a level of 100 µm.
            let common = scatter();
            data.iter_mut().enumerate().for_each(|(index, channel)| {
                channel.push(100.0 + (1.0 - index as f64) * common + 0.3 * scatter());
            });
        }
        let profile = average(length, stream(&data, marks(0.0, length as f64, turns + 1))).unwrap();
        let transform = |turn: usize, channel: usize, order: usize| -> Complex64 {
            let samples = &data[channel][turn * length..(turn + 1) * length];
            let terms = samples
                .iter()
                .enumerate()
                .map(|(index, value)| value * Complex64::cis(TAU * (order * index) as f64 / length as f64));
            terms.sum::<Complex64>() * if order == 0 { 1.0 } else { 2.0 } / length as f64
        };
        for order in [0, 1, 7, 31] {
            let all: Vec<Vec<Complex64>> =
                (0..turns).map(|turn| (0..channels).map(|channel| transform(turn, channel, order)).collect()).collect();
            let mean = |channel: usize| all.iter().map(|turn| turn[channel]).sum::<Complex64>() / turns as f64;
            for row in 0..channels {
                assert!((profile.order(order)[row] - mean(row)).norm() < 1e-12);
                for column in 0..channels {
                    let products =
                        all.iter().map(|turn| (turn[row] - mean(row)) * (turn[column] - mean(column)).conj());
                    let expected = products.sum::<Complex64>() / (turns * (turns - 1)) as f64;
                    let found = profile.scatter.as_ref().unwrap()[(order * channels + row) * channels + column];
                    // 1e-13: rounding of the test's own sums beside a level of 100.
                    assert!((found - expected).norm() < 1e-13, "order {order}: {found} {expected}");
                }
            }
        }
    }
    let one = stream(&[(0..64).map(f64::from).collect()], marks(0.0, 64.0, 2));
    let profile = average_with(SynchronousAverageConfig { min_turns: 1, ..config(64) }, one).unwrap();
    assert_eq!((profile.turns.used, profile.covariance, profile.scatter), (1, None, None));
}

/// The scatter without the neighbours, from the turns' harmonics freed of e^{±2πikm/T}, k = 1, 2, by least squares.
#[test]
fn the_scatter_beside_the_neighbours_is_what_they_leave() {
    // Of fewer channels, the weights use a part of so many turns only.
    let (length, turns) = (32, 40);
    let mut random = scatter(6);
    let data: Vec<Vec<f64>> = (0..3).map(|_| (0..turns * length).map(|_| 5.0 + random()).collect()).collect();
    let profile = average(length, stream(&data, marks(0.0, length as f64, turns + 1))).unwrap();
    let found = profile.scatter_beside.unwrap();
    for order in [0, 1, 7] {
        let of = |channel: usize| -> Vec<Complex64> {
            let transform = |turn: &[f64]| -> Complex64 {
                let terms = turn.iter().enumerate();
                let sum: Complex64 = terms
                    .map(|(index, value)| value * Complex64::cis(TAU * (order * index) as f64 / length as f64))
                    .sum();
                sum * if order == 0 { 1.0 } else { 2.0 } / length as f64
            };
            let mut all: Vec<Complex64> = data[channel].chunks_exact(length).map(transform).collect();
            for cycles in [0_i32, 1, -1, 2, -2] {
                let phase = |turn: usize| Complex64::cis(TAU * f64::from(cycles) * turn as f64 / turns as f64);
                let share: Complex64 = all.iter().enumerate().map(|(turn, value)| value * phase(turn).conj()).sum();
                all.iter_mut().enumerate().for_each(|(turn, value)| *value -= share / turns as f64 * phase(turn));
            }
            all
        };
        let channels = [of(0), of(1), of(2)];
        for (row, a) in channels.iter().enumerate() {
            for (column, b) in channels.iter().enumerate() {
                let products: Complex64 = a.iter().zip(b).map(|(a, b)| a * b.conj()).sum();
                let expected = products / ((turns - 5) * turns) as f64;
                let found = found[(order * 3 + row) * 3 + column];
                assert!((found - expected).norm() < 1e-13, "order {order}: {found} {expected}");
            }
        }
    }
    // Of fewer turns, all is needed.
    let few = average(length, stream(&data, marks(0.0, length as f64, turns))).unwrap();
    assert!(few.scatter_beside.is_none() && few.scatter.is_some());
}

/// Over many captures the mean square of the mean's error is its stated variance: for noise that forgets, and for tones of
/// any phase, whose turns are anything but independent.
#[test]
fn the_covariance_is_that_of_the_mean() {
    let (length, turns, captures) = (64, 40, 300);
    let mut uniform = scatter(8);
    // Tones by their order; none is noise. The scatter over the turns is off by factors of up to ten.
    for tone in [None, Some(0.037), Some(0.43), Some(3.317), Some(11.52), Some(20.913)] {
        let (mut errors, mut stated, mut independent) = (0.0, 0.0, 0.0);
        for _ in 0..captures {
            let phase = TAU * uniform();
            let samples = (0..turns * length).map(|frame| match tone {
                None => 0.1 * uniform(),
                Some(order) => (TAU * order * frame as f64 / length as f64 + phase).cos(),
            });
            let data = [samples.collect::<Vec<f64>>()];
            let profile = average(length, stream(&data, marks(0.0, length as f64, turns + 1))).unwrap();
            for order in 2..=12 {
                errors += profile.order(order)[0].norm_sqr();
                stated += profile.order_covariance(order).unwrap()[0].re;
                independent += profile.scatter.as_ref().unwrap()[order].re;
            }
        }
        let [ratio, with_independent_turns] = [errors / stated, errors / independent];
        println!("tone {tone:?}: error² / stated {ratio:.2}, / that of independent turns {with_independent_turns:.3}");
        // Neighbours at ±1/T and ±2/T of a tone far away are as strong to (2/(T·distance))², and the estimate itself
        // scatters: 25 %.
        assert!((ratio - 1.0).abs() < 0.25, "tone {tone:?}: {ratio}");
    }
}

fn both_channels() -> Projection {
    Projection { rows: vec![(Quantity::X, vec![(0, 1.0)]), (Quantity::Y, vec![(1, 1.0)])], z_mm: 0.0, rotation: -1.0 }
}

#[test]
fn the_spread_is_that_of_the_turns_used() {
    let (turns, length) = (40, 512);
    let clean = turning(2, turns * length, 0.0, 512.0);
    let mut random = scatter(5);
    let mut data: Vec<Vec<f64>> =
        clean.iter().map(|channel| channel.iter().map(|value| value + 0.1 * random()).collect()).collect();
    // Far off in turn 21, no number in turn 8: neither may leave a trace.
    data[1][21 * 512 + 100..21 * 512 + 180].iter_mut().for_each(|value| *value += 5.0);
    data[0][8 * 512 + 7] = f64::NAN;
    let used: Vec<usize> = (0..turns).filter(|turn| ![8, 21].contains(turn)).collect();
    for outlier_sigma in [None, Some(3.0)] {
        let projection = both_channels();
        let wanted = AverageRequest { projection: Some(&projection), ..AverageRequest::default() };
        let config = SynchronousAverageConfig { outlier_sigma, ..config(512) };
        let input = Inspection::new(Box::new(stream(&data, marks(0.0, 512.0, turns + 1))));
        let profile = averager(config).average_requested(Box::new(input), wanted).unwrap();
        let spread = profile.spread.unwrap();
        assert_eq!((spread.angles, spread.turns), (length, profile.turns.used));
        assert_eq!(spread.directions, [Direction::X, Direction::Y, Direction::Rotating]);
        if outlier_sigma.is_none() {
            assert_eq!(spread.turns, 39);
            continue;
        }
        assert_eq!(spread.turns, used.len());
        for direction in spread.directions.clone() {
            let (low, high) = spread.in_direction(direction).unwrap();
            for angle in 0..length {
                let (sin, cos) = (TAU * angle as f64 / 512.0).sin_cos();
                let motion = |turn: &usize| {
                    let [x, y] = [0, 1].map(|channel: usize| data[channel][turn * length + angle]);
                    match direction {
                        Direction::X => x,
                        Direction::Y => y,
                        // Clockwise.
                        _ => x * cos - y * sin,
                    }
                };
                let mean = used.iter().map(motion).sum::<f64>() / used.len() as f64;
                let lowest = used.iter().map(motion).fold(f64::INFINITY, f64::min) - mean;
                let highest = used.iter().map(motion).fold(f64::NEG_INFINITY, f64::max) - mean;
                // Rounding of sums over 38 values near 10.
                assert!((low[angle] - lowest).abs() < 1e-13 && (high[angle] - highest).abs() < 1e-13);
            }
        }
    }
}

#[test]
fn no_spread_of_one_turn_or_without_its_sensor() {
    let wanted_of = |projection: &Projection, turns: usize| {
        let input = stream(&turning(2, turns * 512, 0.0, 512.0), marks(0.0, 512.0, turns + 1));
        let config = SynchronousAverageConfig { min_turns: 1, ..config(512) };
        let wanted = AverageRequest { projection: Some(projection), ..AverageRequest::default() };
        averager(config).average_requested(Box::new(input), wanted).unwrap().spread
    };
    assert!(wanted_of(&both_channels(), 2).is_some());
    assert!(wanted_of(&both_channels(), 1).is_none());
    let elsewhere = Projection { rows: vec![(Quantity::X, vec![(5, 1.0)])], ..both_channels() };
    assert!(wanted_of(&elsewhere, 3).is_none());
}

#[test]
fn orders_that_scattering_marks_take_away_are_in_no_value() {
    let (length, first, turns) = (1000.0, 40.0, 400);
    let absent_um = |jitter: f64| {
        let (mut of_marks, mut noise) = (scatter(3), scatter(4));
        let mut normal = || (0..12).map(|_| of_marks()).sum::<f64>() / 2.0;
        let marked: Vec<f64> = marks(first, length, turns + 1).iter().map(|mark| mark + jitter * normal()).collect();
        let wave = |(order, size): &(f64, f64), angle: f64| size * (order * angle + 0.3 * size).cos();
        let form = |angle: f64| {
            [(2.0, 5.0), (3.0, 2.0), (5.0, 1.5), (20.0, 1.0)].iter().map(|one| wave(one, angle)).sum::<f64>()
        };
        let channel = |frame: usize| form(TAU * (frame as f64 - first) / length) + 0.01 * noise();
        let input = stream(&[(0..(turns + 2) * 1000).map(channel).collect()], marked);
        let config = SynchronousAverageConfig { turn_tolerance_percent: 10.0, ..config(200) };
        average_with(config, input).unwrap().absent_um
    };
    assert!(absent_um(0.0) < f64::MIN_POSITIVE, "{}", absent_um(0.0));
    // The average keeps a quarter of order 20, which beside the scatter of 400 turns is seen.
    assert!((0.05..0.4).contains(&absent_um(16.0)), "{}", absent_um(16.0));
}
