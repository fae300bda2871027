//! The separator `fly-cutting`.

use runout_core::{
    Result,
    closed_loop::{Fit, Model, Setting},
    fault::Fault,
    height_grid::GridPlaces,
    numerics::{least_squares::dot, number::significant},
    pipeline::{Context, StageConfig},
    points::{PointColumn, PointKind::Number, Points},
    stage::{EvaluableKind, Outcome, PointModel, PointSeparator, Separator, far_below_noise},
    table::TableSpec,
};

use crate::{
    config::FlyCuttingConfig,
    effects::applied,
    heights::Heights,
    model::{CutFit, CutModel},
    outcome::{Known, tables},
    passes::{Applied, Cut},
};

/// Share of the root mean square of the scallops below which a map is too smooth for its cut.
const TOO_SMOOTH: f64 = 0.3;
/// χ² per degree of freedom from which more is left than noise.
const MORE_THAN_NOISE: f64 = 1.5;

/// The ideal surface of a cut, its residual, and a model for the closed loop.
#[derive(Debug, Clone)]
pub struct FlyCutting(pub(crate) FlyCuttingConfig);

impl FlyCuttingConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn separator(self) -> std::result::Result<FlyCutting, Fault> {
        self.checked()?;
        Ok(FlyCutting(self))
    }
}

impl StageConfig for FlyCuttingConfig {
    type Stage = Separator;

    const NAME: &'static str = "fly-cutting";
    const ABOUT: &'static str = "what a fly-cut surface has beside its scallops, and the motion of the spindle in it";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.separator()?)))
    }
}

const COLUMNS: [PointColumn; 4] = [
    PointColumn::needed("x_mm", Number, "mm", "place along the feed"),
    PointColumn::needed("y_mm", Number, "mm", "place across the feed, from below the spindle's axis"),
    PointColumn::needed("height_nm", Number, "nm", "height, out of the material positive"),
    PointColumn::optional("std_nm", Number, "nm", "standard uncertainty of a height"),
];

/// A map with its grid.
pub(crate) struct Measured {
    pub heights: Heights,
    pub grid: GridPlaces,
    pub remarks: Vec<String>,
}

impl PointSeparator for FlyCutting {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        tables()
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        let measured = self.measured(points)?;
        let model = CutModel::new(&self.0, &measured.heights, &[]);
        let fit = model.whole().fit(&[])?;
        let mut remarks = measured.remarks.clone();
        let left = fit.remainder();
        if left.noise_is_known() && left.chi2_per_dof() > MORE_THAN_NOISE {
            remarks.push(format!(
                "the ideal surface leaves more than the noise: χ² per degree of freedom is {:.2}; `diagnose` looks for the cause",
                left.chi2_per_dof()
            ));
        }
        remarks.extend(smaller(left.noise_is_known(), left.chi2_per_dof(), left.dof));
        remarks.splice(..0, self.mistake(&measured.heights));
        let checks = fit.consistency();
        Ok(Outcome { checks, ..self.fitted_outcome(&measured, (&fit, &fit), &[], remarks)? })
    }

    fn evaluables(&self) -> Vec<EvaluableKind> {
        vec![EvaluableKind::HeightMap]
    }

    fn notes(&self) -> Vec<String> {
        vec![
            "a line in the axial motion and one in the tilt about y are the same on the surface: the amplitude is that of the height of \
             the tool"
                .into(),
            "ratios of a line that differ by whole numbers differ along y only; a spindle recording shows the frequency".into(),
            "level and phase of the scallops are fitted: motion that repeats with the turn shows as a shape along y only".into(),
        ]
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl FlyCutting {
    pub(crate) fn measured(&self, points: &Points) -> Result<Measured> {
        let (heights, grid) = Heights::new(points, &self.0)?;
        let mut remarks = Vec::new();
        if grid.holes() > 0 {
            let (holes, all) = (grid.holes(), grid.rows * grid.columns);
            remarks.push(format!("{holes} of {all} points have no height: they are left out"));
        }
        let feed_mm = 1e-3 * self.0.feed_um_per_rev;
        let [[first, last], _] = heights.extent_mm();
        if last - first < 2.0 * feed_mm {
            remarks.push(
                "the map is shorter than two feeds: is the feed in µm per revolution, and are the steps in mm?".into(),
            );
        }
        remarks.extend(too_smooth(&heights, &self.0));
        Ok(Measured { heights, grid, remarks })
    }

    /// The result of the fits of the declared and of the final model.
    pub(crate) fn fitted_outcome(
        &self,
        measured: &Measured,
        (declared, last): (&CutFit, &CutFit),
        settings: &[Setting],
        mut remarks: Vec<String>,
    ) -> Result<Outcome> {
        let Measured { heights, grid, .. } = measured;
        let before_nm = left_of(heights, declared);
        let after_nm = if settings.is_empty() { before_nm.clone() } else { left_of(heights, last) };
        let applied = applied(settings);
        let mut ideal_nm = match Cut::new(&self.0, heights.extent_mm(), Applied::none()) {
            Some(ideal) => ideal.surface(heights, last.phased.phase_mm).height_nm,
            None => vec![0.0; heights.len()],
        };
        ideal_nm.iter_mut().for_each(|height| *height += last.phased.level_nm);
        let fitted = last.heights().len();
        if fitted < heights.len() {
            remarks.push(format!(
                "level, phase and effects are fitted to {fitted} of {} points; residual and values are of all of them",
                heights.len()
            ));
        }
        // Beside other effects of the passes, the phase is known together with them only.
        let phase_um = last.phase_um().map(|[phase, std]| [phase, if settings.is_empty() { std } else { f64::NAN }]);
        if phase_um.is_none() {
            remarks
                .push("the scallops do not show above the residual: their phase is not observable and set to 0".into());
        }
        let known = Known {
            config: &self.0,
            heights,
            grid,
            ideal_nm: &ideal_nm,
            before_nm: &before_nm,
            after_nm: &after_nm,
            lines: &applied.lines,
            phase_um,
            corrected: !settings.is_empty(),
        };
        known.outcome(remarks)
    }
}

/// Says that less is left than the stated noise.
pub(crate) fn smaller(noise_is_known: bool, chi2_per_dof: f64, dof: usize) -> Option<String> {
    noise_is_known.then(|| far_below_noise(chi2_per_dof, dof)).flatten()
}

/// Says that a map is smoother than the scallops of its cut: they are the least that a tool leaves.
pub(crate) fn too_smooth(heights: &Heights, config: &FlyCuttingConfig) -> Option<String> {
    let half_mm = 0.5e-3 * config.feed_um_per_rev;
    let scallop_nm = 1e6 * half_mm * half_mm / (2.0 * config.nose_radius_mm) * (4.0_f64 / 45.0).sqrt();
    let left = heights.levelled_nm();
    let sq_nm = (dot(&left, &left) / heights.len().max(1) as f64).sqrt();
    (sq_nm < TOO_SMOOTH * scallop_nm).then(|| {
        format!(
            "Sq of the map is {} nm, and the scallops of the declared cut alone have {} nm: no tool leaves a smoother \
             surface. Is `height_nm` in µm or mm, or is the feed smaller?",
            significant(sq_nm, 3),
            significant(scallop_nm, 3)
        )
    })
}

/// What a fit leaves of all points, in nm.
pub(crate) fn left_of(heights: &Heights, fit: &CutFit) -> Vec<f64> {
    let mut left = fit.cut.surface(heights, fit.phased.phase_mm).height_nm;
    let level_nm = fit.phased.level_nm;
    left.iter_mut().zip(&heights.height_nm).for_each(|(model, height)| *model = height - *model - level_nm);
    left
}
