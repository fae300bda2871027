//! Equations of motion of a rotor: M·q″ + (C + Ω·G)·q′ + (K + N)·q = 0.

use faer::{Mat, Side};
use runout_core::{Error, Result};

/// Matrices of a rotor, in SI units. Values of this type are checked: M is symmetric and positive definite, K is symmetric, G and
/// N are skew-symmetric, all are finite and of one size.
#[derive(Debug, Clone)]
pub struct Equations {
    /// M.
    pub mass: Mat<f64>,
    /// K.
    pub stiffness: Mat<f64>,
    /// G, for a rotation of 1 rad/s about +z.
    pub gyroscopic: Mat<f64>,
    /// C.
    pub damping: Mat<f64>,
    /// N: the skew-symmetric part of the stiffness.
    pub circulatory: Mat<f64>,
    /// Where displacements are.
    pub nodes: Vec<Node>,
}

/// A place of the shaft, and which degrees of freedom its displacements are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Its place, in mm.
    pub z_mm: f64,
    /// Index of its displacement along x; `None` where it cannot move or the model has none.
    pub x: Option<usize>,
    /// Index of its displacement along y; `None` where it cannot move or the model has none.
    pub y: Option<usize>,
}

/// A matrix of the equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// K.
    Stiffness,
    /// M.
    Mass,
    /// G.
    Gyroscopic,
    /// C.
    Damping,
    /// N.
    Circulatory,
}

impl Role {
    /// All of them; the first two are needed.
    pub const ALL: [Self; 5] = [Self::Stiffness, Self::Mass, Self::Gyroscopic, Self::Damping, Self::Circulatory];

    /// Its key in TOML.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Mass => "mass",
            Self::Gyroscopic => "gyroscopic",
            Self::Damping => "damping",
            Self::Circulatory => "circulatory",
        }
    }
}

/// Elements that mirror each other may differ by so much of √(rᵢ·rⱼ), r the largest number of a row: files hold six digits and more.
const MIRRORED: f64 = 1e-6;

impl Equations {
    /// Checks matrices and joins them; those that are missing are zero. `object` is the file, for messages.
    ///
    /// # Errors
    /// When K or M is missing, sizes differ, a number is not finite, or a matrix has not the symmetry of its role.
    pub fn new(object: &str, matrices: Vec<(Role, Mat<f64>)>, nodes: Vec<Node>) -> Result<Self> {
        let refuse = |role: Role, problem: String| Error::new("use", format!("{object}: {}", role.name()), problem);
        let mut by_role: [Option<Mat<f64>>; 5] = Default::default();
        for (role, matrix) in matrices {
            by_role[role as usize] = Some(matrix);
        }
        for role in [Role::Stiffness, Role::Mass] {
            if by_role[role as usize].is_none() {
                return Err(refuse(role, "the matrix is missing".into()));
            }
        }
        let size = by_role[Role::Mass as usize].as_ref().map_or(0, Mat::nrows);
        if size == 0 {
            return Err(refuse(Role::Mass, "expected at least one degree of freedom, found none".into()));
        }
        for role in Role::ALL {
            let Some(matrix) = &by_role[role as usize] else { continue };
            if (matrix.nrows(), matrix.ncols()) != (size, size) {
                let found = format!("found {} rows and {} columns", matrix.nrows(), matrix.ncols());
                let problem = format!("expected {size} rows and {size} columns as the mass has, {found}");
                return Err(refuse(role, problem));
            }
            for (row, column) in (0..size).flat_map(|row| (0..size).map(move |column| (row, column))) {
                if !matrix[(row, column)].is_finite() {
                    let place = format!("row {}, column {}", row + 1, column + 1);
                    return Err(refuse(role, format!("expected finite numbers, {place} is {}", matrix[(row, column)])));
                }
            }
        }
        for role in [Role::Stiffness, Role::Mass] {
            let elements =
                by_role[role as usize].iter().flat_map(Mat::col_iter).flat_map(|column| column.iter().copied());
            if elements.into_iter().all(|element| element == 0.0) {
                return Err(refuse(role, "expected numbers other than 0, found none".into()));
            }
        }
        for (role, sign) in
            [(Role::Stiffness, 1.0), (Role::Mass, 1.0), (Role::Gyroscopic, -1.0), (Role::Circulatory, -1.0)]
        {
            if let Some(matrix) = &mut by_role[role as usize] {
                mirror(matrix, sign).map_err(|problem| {
                    let error = refuse(role, problem);
                    match role {
                        Role::Stiffness => error.help(
                            "give the symmetric part as `stiffness`; the skew-symmetric part of a bearing's cross-coupling goes \
                             into `circulatory`",
                        ),
                        Role::Gyroscopic | Role::Circulatory => error.help("rows and columns change sign with each other"),
                        _ => error,
                    }
                })?;
            }
        }
        let mut take = |role: Role| by_role[role as usize].take().unwrap_or_else(|| Mat::zeros(size, size));
        let equations = Self {
            mass: take(Role::Mass),
            stiffness: take(Role::Stiffness),
            gyroscopic: take(Role::Gyroscopic),
            damping: take(Role::Damping),
            circulatory: take(Role::Circulatory),
            nodes,
        };
        if equations.mass.llt(Side::Lower).is_err() {
            let problem = "expected a positive definite matrix; some motion would have no inertia, or a negative one";
            let help = "condense degrees of freedom without mass, and check the signs";
            return Err(refuse(Role::Mass, problem.into()).help(help));
        }
        Ok(equations)
    }

    /// Number of degrees of freedom.
    #[must_use]
    pub fn size(&self) -> usize {
        self.mass.nrows()
    }

    /// A matrix by its role.
    #[must_use]
    pub fn matrix(&self, role: Role) -> &Mat<f64> {
        match role {
            Role::Stiffness => &self.stiffness,
            Role::Mass => &self.mass,
            Role::Gyroscopic => &self.gyroscopic,
            Role::Damping => &self.damping,
            Role::Circulatory => &self.circulatory,
        }
    }
}

/// Makes a matrix exactly symmetric (`sign` 1) or skew-symmetric (−1), where it nearly is.
fn mirror(matrix: &mut Mat<f64>, sign: f64) -> std::result::Result<(), String> {
    let size = matrix.nrows();
    let scale: Vec<f64> = (0..size)
        .map(|row| {
            (0..size).map(|column| matrix[(row, column)].abs().max(matrix[(column, row)].abs())).fold(0.0, f64::max)
        })
        .collect();
    for row in 0..size {
        for column in 0..=row {
            let (lower, upper) = (matrix[(row, column)], matrix[(column, row)]);
            if (lower - sign * upper).abs() > MIRRORED * (scale[row] * scale[column]).sqrt() {
                let kind = if sign > 0.0 { "symmetric" } else { "skew-symmetric" };
                let at = |row: usize, column: usize| format!("row {}, column {}", row + 1, column + 1);
                let (here, there) = (at(row, column), at(column, row));
                return Err(format!("expected a {kind} matrix; {here} is {lower:e}, {there} is {upper:e}"));
            }
            let mean = f64::midpoint(lower, sign * upper);
            matrix[(row, column)] = mean;
            matrix[(column, row)] = sign * mean;
        }
    }
    Ok(())
}
