//! Where points have one height.

use runout_numerics::cloud::Cloud;

/// Where three points have one height: the centre of the circle through them.
pub(super) fn equal_heights(cloud: &Cloud<2>, [a, b, c]: [usize; 3]) -> Option<[f64; 2]> {
    let from_c = |point: usize| {
        let ([x, y], [x_c, y_c]) = (cloud.features(point), cloud.features(c));
        (x - x_c, y - y_c, cloud.levels()[point] - cloud.levels()[c])
    };
    let ((x_a, y_a, level_a), (x_b, y_b, level_b)) = (from_c(a), from_c(b));
    let area = x_a * y_b - y_a * x_b;
    let place = [(level_a * y_b - level_b * y_a) / area, (x_a * level_b - x_b * level_a) / area];
    place.iter().all(|place| place.is_finite()).then_some(place)
}
