//! What a separation solves for.

use crate::azimuth::{Azimuth, FacePlace};

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
    /// Error motion along one line that is neither x nor y, µm: all that sensors can observe which all look along it.
    Along(Azimuth),
    /// Tilt towards that line (right-handed about the direction a quarter turn further), µrad.
    TiltAlong(Azimuth),
    /// Form of a face (the index of its section), µm, positive along +z; Re Σ c e^{+inα} over the part's angle α.
    FaceForm(usize),
    /// Error motion along the axis, µm.
    Z,
    /// Face error motion: that along the axis at a place of the face, z − ρ·(tilt towards the place), µm.
    FaceMotion(FacePlace),
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
            Self::Along(_) => "along",
            Self::TiltAlong(_) => "tilt_along",
            Self::FaceForm(_) => "face",
            Self::Z => "z",
            Self::FaceMotion(_) => "face_motion",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        if self.is_tilt() { "urad" } else { "um" }
    }

    /// Whether it belongs to the part.
    #[must_use]
    pub fn is_form(self) -> bool {
        matches!(self, Self::Form(_) | Self::FaceForm(_))
    }

    /// Index of the section that it is the form of.
    #[must_use]
    pub fn section(self) -> Option<usize> {
        match self {
            Self::Form(section) | Self::FaceForm(section) => Some(section),
            _ => None,
        }
    }

    /// Whether it is a motion along the axis.
    #[must_use]
    pub fn is_axial(self) -> bool {
        matches!(self, Self::Z | Self::FaceMotion(_))
    }

    /// Whether it is a tilt of the axis.
    #[must_use]
    pub fn is_tilt(self) -> bool {
        matches!(self, Self::TiltX | Self::TiltY | Self::TiltAlong(_))
    }

    /// Whether it is a displacement of the axis across itself.
    #[must_use]
    pub fn is_shift(self) -> bool {
        matches!(self, Self::X | Self::Y | Self::Along(_))
    }

    /// The line along which it is, where that is neither x nor y.
    #[must_use]
    pub fn azimuth(self) -> Option<Azimuth> {
        match self {
            Self::Along(azimuth) | Self::TiltAlong(azimuth) => Some(azimuth),
            _ => None,
        }
    }

    /// The tilt that changes this displacement along z, and its factor: x(z) = X + z·E_y, y(z) = Y − z·E_x.
    #[must_use]
    pub fn moved_by_tilt(self) -> Option<(Self, f64)> {
        match self {
            Self::X => Some((Self::TiltY, 1.0)),
            Self::Y => Some((Self::TiltX, -1.0)),
            Self::Along(azimuth) => Some((Self::TiltAlong(azimuth), 1.0)),
            _ => None,
        }
    }

    /// What a unit of it is in [x, y, tilt about x, tilt about y]; zeros of a form and of a motion along the axis.
    #[must_use]
    pub fn cartesian(self) -> [f64; 4] {
        match self {
            Self::Form(_) | Self::FaceForm(_) | Self::Z | Self::FaceMotion(_) => [0.0; 4],
            Self::X => [1.0, 0.0, 0.0, 0.0],
            Self::Y => [0.0, 1.0, 0.0, 0.0],
            Self::TiltX => [0.0, 0.0, 1.0, 0.0],
            Self::TiltY => [0.0, 0.0, 0.0, 1.0],
            Self::Along(azimuth) => {
                let (sine, cosine) = azimuth.radians().sin_cos();
                [cosine, sine, 0.0, 0.0]
            }
            Self::TiltAlong(azimuth) => {
                let (sine, cosine) = azimuth.radians().sin_cos();
                [0.0, 0.0, -sine, cosine]
            }
        }
    }
}

/// A motion as tables give it, one column of values and one of their standard uncertainty, `std_…`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MotionColumn {
    /// What it holds.
    pub quantity: Quantity,
    /// Name of the column.
    pub name: &'static str,
    /// What it is, in words.
    pub about: String,
}

/// Name of the column that holds the line of `along_um` and `tilt_along_urad`, its unit, and what it is.
pub const ALONG_COLUMN: (&str, &str, &str) =
    ("along_deg", "deg", "the line of along_um and tilt_along_urad: its angle from x towards y");

/// Columns of motion: those of x, y and the tilts about them always, those along a line where motion is known there only, and that
/// along the axis where the rig has an axial sensor.
#[must_use]
pub fn motion_columns(line: Option<Azimuth>, axial: bool) -> Vec<MotionColumn> {
    let column = |quantity, name, about: &str| MotionColumn { quantity, name, about: about.into() };
    let mut columns = vec![
        column(Quantity::X, "x_um", "error motion along x"),
        column(Quantity::Y, "y_um", "error motion along y"),
        column(Quantity::TiltX, "tilt_x_urad", "tilt about x, right-handed"),
        column(Quantity::TiltY, "tilt_y_urad", "tilt about y, right-handed"),
    ];
    if let Some(line) = line {
        let along = format!("error motion along {line} from x towards y; across it no motion is observable");
        let tilt = format!("tilt towards {line} from x towards y: points at z > 0 move along the line");
        columns.push(column(Quantity::Along(line), "along_um", &along));
        columns.push(column(Quantity::TiltAlong(line), "tilt_along_urad", &tilt));
    }
    if axial {
        columns.push(column(Quantity::Z, "z_um", "error motion along the axis, without its mean level"));
    }
    columns
}
