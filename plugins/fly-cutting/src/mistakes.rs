//! Mistakes of a height map: mirrored, turned by 90°, heights or places in another unit. Scallops of the declared feed, bent as the cutter
//! describes its arc, are in the map as the declaration has them, or in the map as it would be without the mistake.

use runout_core::{
    closed_loop::{Fit, Model},
    points::{Column, Points, mistakes},
};

use crate::{heights::Heights, model::CutModel, separate::FlyCutting};

/// Mistakes are looked for where the cut explains less than half of the square of the residual of a plane.
const FAR: f64 = 0.7;
/// And said where the correction leaves less than this share of it.
const SHARE: f64 = 0.5;
/// Points that are evaluated.
const LOOKED_AT: usize = 40_000;
/// Units by which heights or places are exchanged.
const UNITS: [(f64, &str); 4] = [
    (1e3, "a thousand times too small"),
    (1e-3, "a thousand times too large"),
    (25.4, "25.4 times too small"),
    (1.0 / 25.4, "25.4 times too large"),
];

impl FlyCutting {
    /// The likeliest mistake, where the declared cut explains little of the map.
    pub(crate) fn mistake(&self, heights: &Heights) -> Option<String> {
        let points = &as_points(heights.thinned(LOOKED_AT));
        let declared = self.share(points).filter(|share| *share > FAR)?;
        let turned = mistakes::columns(points, &[["x_mm", "y_mm"]], &[&["x_mm"]]);
        let scaled = |columns: &'static [&'static str], what: &'static str| {
            UNITS.map(|(factor, times)| (format!("{what} are {times}"), times_factor(points, columns, factor)))
        };
        let scaled = scaled(&["height_nm"], "heights").into_iter().chain(scaled(&["x_mm", "y_mm"], "places"));
        let left = |(what, points): (String, Points)| Some((what, self.share(&points)?));
        mistakes::likeliest(declared, SHARE * declared, turned.chain(scaled).filter_map(left))
    }

    /// Root mean square of what the cut leaves of a map without its plane, over that of the map.
    fn share(&self, points: &Points) -> Option<f64> {
        let (mut heights, _) = Heights::new(points, &self.0).ok()?;
        heights.height_nm = heights.levelled_nm();
        let rms_nm =
            (heights.height_nm.iter().map(|height| height * height).sum::<f64>() / heights.len() as f64).sqrt();
        let left_um = CutModel::new(&self.0, &heights, &[]).fit(&[]).ok()?.remainder().rms;
        (rms_nm > 0.0).then_some(1e3 * left_um / rms_nm)
    }
}

fn as_points(heights: Heights) -> Points {
    let y_mm = heights.y_mm().collect();
    let columns = [("x_mm", heights.x_mm), ("y_mm", y_mm), ("height_nm", heights.height_nm)];
    let columns = columns.map(|(name, values)| Column { name: name.into(), values });
    Points { columns: columns.into(), ..Points::default() }
}

fn times_factor(points: &Points, columns: &[&str], factor: f64) -> Points {
    let mut points = points.clone();
    for column in points.columns.iter_mut().filter(|column| columns.contains(&column.name.as_str())) {
        column.values.iter_mut().for_each(|value| *value *= factor);
    }
    points
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]
mod tests {
    use runout_core::stage::PointSeparator;

    use super::*;
    use crate::simulate::FlyCuttingScenario;

    const CUT: &str = "nose_radius_mm = 6.0\nfeed_um_per_rev = 80.0\ncutter_radius_mm = 25.0\nspeed_rpm = 390.0\n";
    const GRID: &str = "[grid]\nrows = 150\ncolumns = 160\nstep_x_mm = 0.0131\nstep_y_mm = 0.0133\norigin_x_mm = -1.3\norigin_y_mm = 1.0\n";

    fn map(effects: &str) -> Points {
        let text = format!("noise_nm = 2.0\n[cut]\n{CUT}{GRID}{effects}");
        let scenario: FlyCuttingScenario = toml::from_str(&text).unwrap();
        Points::of_grid(scenario.heights().unwrap(), "map.h5".into())
    }

    fn said(points: &Points) -> Option<String> {
        let separator = toml::from_str::<crate::config::FlyCuttingConfig>(CUT).unwrap().separator().unwrap();
        println!("simulated, the cut leaves {:.3?} of the map", separator.share(points));
        let remarks = separator.separate(points).unwrap().remarks;
        remarks.into_iter().find(|remark| remark.starts_with("it looks as if"))
    }

    #[test]
    fn a_map_in_another_unit_mirrored_or_turned_is_said() {
        let tilted = "[[effect]]\nplugin = 'workpiece-tilt'\nx_urad = 300.0\ny_urad = -90.0\n";
        let map = map(tilted);
        assert_eq!(said(&map), None);
        for (columns, factor, words) in [
            (&["height_nm"][..], 1e-3, "heights are a thousand times too small"),
            (&["height_nm"], 1e3, "heights are a thousand times too large"),
            (&["x_mm", "y_mm"], 1e-3, "places are a thousand times too small"),
            (&["x_mm"], -1.0, "`x_mm` has the other sign"),
        ] {
            let found = said(&times_factor(&map, columns, factor)).unwrap_or_default();
            println!("simulated, {words}: {found}");
            assert!(found.contains(words), "{words}: {found}");
        }
        let (what, turned) = mistakes::columns(&map, &[["x_mm", "y_mm"]], &[]).next().unwrap();
        let found = said(&turned).unwrap_or_default();
        println!("simulated, {what}: {found}");
        assert!(found.contains("`x_mm` and `y_mm` are exchanged"), "{found}");
    }
}
