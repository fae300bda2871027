//! Tables and values of a surface.

use runout_core::{
    Result,
    height_grid::GridPlaces,
    numerics::height_map::HeightMap,
    stage::{Evaluable, Outcome, PlaneMap},
    standards::areal,
    summary::Value,
    table::{ColumnSpec, Figure, TableRows, TableSpec, numbers},
};

use crate::{config::FlyCuttingConfig, heights::Heights, passes::Line};

/// Signs and references.
const CONVENTION: &str = "heights in nm, out of the material positive; x along the feed, y = 0 below the spindle's axis; the tool \
    crosses x = y = 0 at the phase 0 of a line, A cos(2π·frequency_ratio·turns + phase)";

/// The tables of a result.
pub(crate) fn tables() -> Vec<TableSpec> {
    let place = |name: &str, about: &str| ColumnSpec::number(name, "mm", about).repeating();
    let height = |name: &str, about: &str| ColumnSpec::number(name, "nm", about);
    let places = || [place("x_mm", "place along the feed"), place("y_mm", "place across the feed")];
    let surface = [
        height("height_nm", "the height measured"),
        height("corrected_nm", "the height without the effects that were found; that of a run is the height measured"),
    ];
    let residual = [
        height("before_nm", "height less the ideal surface of the declared cut"),
        height("after_nm", "height less the final model; that of a run is the declared one"),
    ];
    vec![
        TableSpec::new("surface", "the surface point by point", [places(), surface].concat())
            .figure(Figure::map("surface", "Surface as measured", ["x_mm", "y_mm", "height_nm"]))
            .figure(Figure::map(
                "surface-corrected",
                "Surface without the effects found (of a run: as measured)",
                ["x_mm", "y_mm", "corrected_nm"],
            )),
        TableSpec::new("residual", "the residual point by point", [places(), residual].concat()).figure(Figure::map(
            "residual",
            "Residual of the final model",
            ["x_mm", "y_mm", "after_nm"],
        )),
    ]
}

/// What is known of all points.
pub(crate) struct Known<'a> {
    pub config: &'a FlyCuttingConfig,
    pub heights: &'a Heights,
    pub grid: &'a GridPlaces,
    /// Ideal surface with level, in nm.
    pub ideal_nm: &'a [f64],
    pub before_nm: &'a [f64],
    pub after_nm: &'a [f64],
    /// Lines that were found.
    pub lines: &'a [Line],
    /// Phase of the scallops and its standard uncertainty, in µm, where it shows.
    pub phase_um: Option<[f64; 2]>,
    /// Whether effects were added.
    pub corrected: bool,
}

impl Known<'_> {
    pub(crate) fn outcome(&self, remarks: Vec<String>) -> Result<Outcome> {
        let corrected = || self.ideal_nm.iter().zip(self.after_nm).map(|(ideal, left)| ideal + left);
        let mut rows = Vec::new();
        let columns = [
            [numbers(self.heights.height_nm.iter().copied()), numbers(corrected())],
            [numbers(self.before_nm.iter().copied()), numbers(self.after_nm.iter().copied())],
        ];
        let places = [numbers(self.heights.x_mm.iter().copied()), numbers(self.heights.y_mm())];
        for (spec, columns) in tables().into_iter().zip(columns) {
            let all = places.iter().cloned().chain(columns).collect();
            rows.push(TableRows { rows: spec.rows(all)?, table: spec.name });
        }
        let mut values = self.areal("measured", self.heights.height_nm.iter().copied())?;
        if self.corrected {
            values.extend(self.areal("corrected", corrected())?);
        }
        values.extend(self.areal("residual", self.after_nm.iter().copied())?);
        values.extend(self.of_cut());
        // Meshes are drawn of the first.
        let mut evaluables = Vec::new();
        if self.corrected {
            evaluables.push(self.plane("corrected", corrected()));
        }
        evaluables.push(self.plane("measured", self.heights.height_nm.iter().copied()));
        evaluables.push(self.plane("residual", self.after_nm.iter().copied()));
        Ok(Outcome { convention: CONVENTION.into(), tables: rows, values, evaluables, remarks, ..Outcome::default() })
    }

    /// Heights on the whole grid.
    fn plane(&self, of: &str, heights_nm: impl Iterator<Item = f64>) -> Evaluable {
        let grid = self.grid.heights(heights_nm, self.heights.std_nm);
        Evaluable::HeightMap(PlaneMap::new(of, grid))
    }

    /// Height parameters after removal of the least-squares plane.
    fn areal(&self, of: &str, heights_nm: impl Iterator<Item = f64>) -> Result<Vec<Value>> {
        let map: HeightMap = areal::without_polynomial(&self.grid.heights(heights_nm, None).height_map()?, 1)?;
        let found = areal::heights(&map);
        let about = |what: &str| format!("{what} after removal of the least-squares plane (ISO 25178-2, 4.2)");
        let named = |symbol: &str, number: f64, unit: &str, what: &str| {
            Value::new(symbol, number, f64::NAN, unit, &about(what)).of(of)
        };
        Ok(vec![
            named("Sq", 1e3 * found.sq, "nm", "root mean square height"),
            named("Sz", 1e3 * found.sz, "nm", "maximum height, peak to valley (PV)"),
            named("Sa", 1e3 * found.sa, "nm", "arithmetic mean height"),
            named("Sp", 1e3 * found.sp, "nm", "maximum peak height"),
            named("Sv", 1e3 * found.sv, "nm", "maximum pit depth"),
            named("Ssk", found.ssk, "", "skewness"),
            named("Sku", found.sku, "", "kurtosis"),
        ])
    }

    fn of_cut(&self) -> Vec<Value> {
        let FlyCuttingConfig { nose_radius_mm, feed_um_per_rev, speed_rpm, .. } = self.config;
        let half_mm = 0.5e-3 * feed_um_per_rev;
        let scallop_nm =
            1e6 * half_mm * half_mm / (nose_radius_mm + (nose_radius_mm * nose_radius_mm - half_mm * half_mm).sqrt());
        let known =
            |symbol: &str, number: f64, unit: &str, about: &str| Value::new(symbol, number, f64::NAN, unit, about);
        let mut values = vec![
            known("scallop", scallop_nm, "nm", "height of the scallops of the declared cut, f²/8R"),
            known("scallop_rq", scallop_nm * (4.0_f64 / 45.0).sqrt(), "nm", "their root mean square, f²/8R·√(4/45)"),
        ];
        let [phase, std] = self.phase_um.unwrap_or([f64::NAN; 2]);
        values.push(Value::new("scallop_phase", phase, std, "um", "x at which a pass crosses y = 0, nearest to x = 0"));
        let several = self.lines.len() > 1;
        for (index, line) in self.lines.iter().enumerate() {
            let of = if several { format!("line {}", index + 1) } else { "line".into() };
            let slip = (line.ratio - line.ratio.round()).abs();
            let turns_hz = speed_rpm / 60.0;
            let spacing_mm = if slip > 0.0 { 1e-3 * feed_um_per_rev / slip } else { f64::NAN };
            values.extend([
                known("stripe_spacing", spacing_mm, "mm", "distance of stripes along the feed, f/|q − round(q)|")
                    .of(of.as_str()),
                known("stripe_time", 1.0 / (slip * turns_hz), "s", "time of the feed from stripe to stripe")
                    .of(of.as_str()),
                known("line_frequency", line.ratio * turns_hz, "Hz", "frequency of the line at the declared speed")
                    .of(of.as_str()),
            ]);
        }
        values
    }
}
