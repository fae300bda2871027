//! Form and motion, one harmonic at a time: estimates, covariance, and what the layout cannot tell.

use crate::{Complex64, rig::Gaps};

/// What the numbers of form, motion and harmonics are, for files that explain themselves.
pub const CONVENTION: &str = "Form is Re sum c exp(+i n alpha) over the part's angle alpha, outward positive; motion is \
    Re sum c exp(-i n Phi) over the spindle's angle Phi. Lost orders cannot be told by the layout: NaN in the \
    harmonics, left out of form and motion.";

/// Displacement in µm at a lever of 1 mm per 1 µrad.
pub const UM_PER_MM_URAD: f64 = 1e-3;

/// Something that a separation solves for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Form of a section (its index), µm; Re Σ c e^{+inα} over the part's angle α.
    Form(usize),
    /// Error motion along x, µm; Re Σ c e^{−inΦ} over the spindle's angle Φ, as are all motions.
    X,
    /// Error motion along y, µm.
    Y,
    /// Tilt about x, right-handed, µrad.
    TiltX,
    /// Tilt about y, right-handed, µrad.
    TiltY,
}

impl Quantity {
    /// Its id in files.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Form(_) => "form",
            Self::X => "x",
            Self::Y => "y",
            Self::TiltX => "tilt_x",
            Self::TiltY => "tilt_y",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::TiltX | Self::TiltY => "urad",
            _ => "um",
        }
    }

    /// Whether it belongs to the part.
    #[must_use]
    pub fn is_form(self) -> bool {
        matches!(self, Self::Form(_))
    }
}

/// What a separator can and cannot tell with a rig, before any data.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// What it solves for.
    pub unknowns: Vec<Quantity>,
    /// One entry an order, ascending from 1.
    pub orders: Vec<OrderAssessment>,
    /// Ids of the rig's sensors and setups that it does not use.
    pub unused: Vec<String>,
    /// What the user should know: conventions, assumptions, definitions.
    pub notes: Vec<String>,
}

/// One order of an [`Assessment`].
#[derive(Debug, Clone, PartialEq)]
pub struct OrderAssessment {
    /// Undulations per revolution.
    pub order: usize,
    /// Rank of the layout's matrix.
    pub rank: usize,
    /// Readings (complex) that are left over for a residual.
    pub residual_dof: usize,
    /// Whether each unknown can be told.
    pub observable: Vec<bool>,
    /// Standard deviation of each unknown per unit standard deviation of every reading; NaN where it cannot be told.
    pub noise_gain: Vec<f64>,
    /// Why something cannot be told.
    pub lost_because: Option<String>,
}

impl Assessment {
    /// Orders at which a form cannot be told.
    #[must_use]
    pub fn lost_form_orders(&self) -> Vec<usize> {
        self.lost(Quantity::is_form)
    }

    /// Orders at which a motion cannot be told.
    #[must_use]
    pub fn lost_motion_orders(&self) -> Vec<usize> {
        self.lost(|quantity| !quantity.is_form())
    }

    fn lost(&self, of: impl Fn(Quantity) -> bool) -> Vec<usize> {
        let any_lost = |entry: &&OrderAssessment| {
            self.unknowns.iter().zip(&entry.observable).any(|(quantity, seen)| of(*quantity) && !seen)
        };
        self.orders.iter().filter(any_lost).map(|entry| entry.order).collect()
    }
}

/// Form and motion at one station.
///
/// Order 0 is the mean level, which displacement sensors do not share: 0 unless the method knows better.
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// The sections it gives the form of.
    pub sections: Vec<SectionAt>,
    /// What was solved for; forms first, in the order of `sections`.
    pub unknowns: Vec<Quantity>,
    /// Estimates `[order][unknown]` from order 0; NaN where the layout cannot tell.
    pub estimate: Vec<Complex64>,
    /// Variance E|δ|² of each estimate `[order][unknown]`; NaN where not known.
    pub variance: Vec<f64>,
    /// Covariance E[δ δᴴ] of the motions among `unknowns`, `[order][motion][motion]` from order 0; what cannot be told means
    /// nothing. `None` where it is not known.
    pub motion_covariance: Option<Vec<Complex64>>,
    /// Whether the layout can tell it, `[order][unknown]`.
    pub observable: Vec<bool>,
    /// Where x and y are the axis's displacement, in mm along the spindle: 0 where tilt is told, the sensors' plane
    /// where it is not.
    pub motion_z_mm: f64,
    /// What the fit leaves of the readings.
    pub residual: Residual,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// How small changes of the averaged readings move the estimates: δ estimate = operator · δ readings.
///
/// With it, two methods' results on the same readings can be compared: their errors are not independent.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Readings an order: the channels of all profiles of the station, in their order.
    pub readings: usize,
    /// `[order][unknown][reading]` from order 0; 0 where the layout cannot tell. Forms of a clockwise part are meant
    /// before they are conjugated.
    pub operator: Vec<Complex64>,
}

/// A circle of the part.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionAt {
    /// Its id in the rig.
    pub id: String,
    /// Its place along the spindle, in mm.
    pub z_mm: f64,
    /// Where nothing is known of it: a keyway, a stretch without readings. Every value leaves these out.
    pub gaps: Gaps,
    /// Share of its readings that the form was computed from.
    pub used: f64,
}

impl SectionAt {
    /// A circle that was measured all around.
    #[must_use]
    pub fn whole(id: impl Into<String>, z_mm: f64) -> Self {
        Self { id: id.into(), z_mm, gaps: Gaps::default(), used: 1.0 }
    }

    /// Share of the profile that was there: of so many equal angles, and of the readings.
    #[must_use]
    pub fn coverage(&self, angles: usize) -> f64 {
        self.gaps.coverage(angles).min(self.used)
    }
}

/// What a fit leaves of the averaged readings.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Residual {
    /// Root mean square over all readings and angles, in µm; NaN where nothing is redundant.
    pub rms_um: f64,
    /// What the covariance of the averages lets expect of it, in µm; NaN without a covariance.
    pub expected_rms_um: f64,
    /// Weighted sum of squares per degree of freedom; NaN where not known.
    pub chi2_per_dof: f64,
    /// Real degrees of freedom.
    pub dof: usize,
}

impl Separation {
    /// Highest order held.
    #[must_use]
    pub fn max_order(&self) -> usize {
        (self.estimate.len() / self.unknowns.len().max(1)).saturating_sub(1)
    }

    /// Index of an unknown.
    #[must_use]
    pub fn position(&self, quantity: Quantity) -> Option<usize> {
        self.unknowns.iter().position(|unknown| *unknown == quantity)
    }

    /// Coefficients of one unknown by order from 0, with 0 where the layout cannot tell.
    pub fn coefficients(&self, unknown: usize) -> impl Iterator<Item = Complex64> + '_ {
        let width = self.unknowns.len();
        let picked = self.estimate.iter().skip(unknown).step_by(width);
        let seen = self.observable.iter().skip(unknown).step_by(width);
        picked.zip(seen).map(|(value, seen)| if *seen { *value } else { Complex64::ZERO })
    }

    /// Whether no order (from 1) of an unknown can be told.
    #[must_use]
    pub fn is_lost(&self, unknown: usize) -> bool {
        let width = self.unknowns.len();
        let mut seen = self.observable.iter().skip(unknown).step_by(width).skip(1);
        self.max_order() > 0 && !seen.any(|seen| *seen)
    }

    /// Orders (from 1) at which one unknown cannot be told.
    #[must_use]
    pub fn lost_orders(&self, unknown: usize) -> Vec<usize> {
        let width = self.unknowns.len();
        let seen = self.observable.iter().skip(unknown).step_by(width).enumerate();
        seen.filter(|(order, seen)| *order > 0 && !**seen).map(|(order, _)| order).collect()
    }

    /// Standard uncertainty of one unknown at any one angle, from the covariance of the averages.
    ///
    /// With errors that do not favour a phase and do not couple orders, Var Re Σ δₙ e^{inα} = ½ Σ E|δₙ|², the same at
    /// every angle. NaN where no variance is known.
    #[must_use]
    pub fn angle_std(&self, unknown: usize) -> f64 {
        if self.is_lost(unknown) {
            return f64::NAN;
        }
        let width = self.unknowns.len();
        let seen = self.observable.iter().skip(unknown).step_by(width);
        let sum: f64 = self
            .variance
            .iter()
            .skip(unknown)
            .step_by(width)
            .zip(seen)
            .skip(1)
            .filter(|(_, seen)| **seen)
            .map(|(variance, _)| variance)
            .sum();
        (0.5 * sum).sqrt()
    }
}
