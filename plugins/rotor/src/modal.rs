//! Natural frequencies: eigenvalues λ of (λ²·M + λ·(C + Ω·G) + K + N)·q = 0 at a speed Ω.
//!
//! The basis Φ of the rotor at rest and without damping (ΦᵀMΦ = 1, ΦᵀKΦ = Λ) makes the first-order form nearly normal: with
//! u = √Λ·p and v = p′, u′ = √Λ·v and v′ = −(Λ + ΦᵀNΦ)/√Λ·u − Φᵀ(C + ΩG)Φ·v. Without damping its matrix is skew-symmetric, and
//! eigenvalues keep the accuracy of the largest one.

use faer::{Mat, Side, c64, linalg::solvers::Solve};
use runout_core::{Error, Result};

use crate::equations::Equations;

/// Eigenvalues of the scaled stiffness below so much of the largest are zero: motion as a rigid body.
const RIGID: f64 = 1e-12;
/// Eigenvalues below minus so much of it are no rounding of numbers in a file.
const NEGATIVE: f64 = 1e-8;
/// Frequencies below so much of the lowest elastic one are zero, where there are rigid-body motions.
const STANDSTILL: f64 = 1e-3;

/// Motion with a damping ratio above this decays by nineteen powers of ten within a period: it does not oscillate. With strong
/// damping, gyroscopic moments give such motions a small imaginary part.
const OVERDAMPED: f64 = 0.99;

/// A rotor in the coordinates of its modes at rest.
#[derive(Debug, Clone)]
pub struct Modal {
    /// ω² of the rotor at rest without damping, ascending; 0 for motion as a rigid body.
    squares: Vec<f64>,
    /// How many of them are 0.
    rigid: usize,
    /// Φ.
    shapes: Mat<f64>,
    gyroscopic: Mat<f64>,
    damping: Mat<f64>,
    circulatory: Mat<f64>,
    conservative: bool,
}

/// A mode at a speed.
#[derive(Debug, Clone)]
pub struct Mode {
    /// Its eigenvalue, in 1/s; the imaginary part is positive.
    pub eigenvalue: c64,
    /// Its complex amplitude at each degree of freedom.
    pub shape: Vec<c64>,
}

impl Mode {
    /// Damped natural frequency, in rad/s.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.eigenvalue.im
    }

    /// −Re λ/|λ|.
    #[must_use]
    pub fn damping_ratio(&self) -> f64 {
        -self.eigenvalue.re / self.eigenvalue.norm()
    }
}

impl Modal {
    /// The modes of these equations at rest.
    ///
    /// # Errors
    /// When the stiffness is not positive semidefinite.
    pub fn new(equations: &Equations) -> Result<Self> {
        let object = "the rotor";
        let Ok(factor) = equations.mass.llt(Side::Lower) else {
            return Err(Error::new("solve", object, "the mass matrix is not positive definite"));
        };
        let lower = factor.L();
        let root = StiffnessRoot::new(&equations.stiffness)?;
        // K = B·Bᵀ: singular values of L⁻¹·B are the frequencies, with the accuracy of the largest; as eigenvalues they would be squared.
        let mut reduced = root.factor;
        lower.solve_lower_triangular_in_place(reduced.as_mut());
        let decomposed = reduced.svd().map_err(|_| not_converged(0.0))?;
        let size = equations.size();
        let singular = decomposed.S().column_vector();
        let mut squares: Vec<f64> = (0..size).rev().map(|index| singular[index].powi(2)).collect();
        squares[..root.rigid].fill(0.0);
        let basis = decomposed.U();
        let mut shapes = Mat::from_fn(size, size, |row, column| basis[(row, size - 1 - column)]);
        lower.transpose().solve_upper_triangular_in_place(shapes.as_mut());
        let in_modes = |matrix: &Mat<f64>| shapes.transpose() * matrix * &shapes;
        let zero = |matrix: &Mat<f64>| matrix.col_iter().all(|column| column.iter().all(|value| *value == 0.0));
        Ok(Self {
            squares,
            rigid: root.rigid,
            gyroscopic: in_modes(&equations.gyroscopic),
            damping: in_modes(&equations.damping),
            circulatory: in_modes(&equations.circulatory),
            conservative: zero(&equations.damping) && zero(&equations.circulatory),
            shapes,
        })
    }

    /// Number of degrees of freedom.
    #[must_use]
    pub fn size(&self) -> usize {
        self.squares.len()
    }

    /// Number of motions as a rigid body at rest.
    #[must_use]
    pub fn rigid(&self) -> usize {
        self.rigid
    }

    /// Whether there is neither damping nor circulatory stiffness.
    #[must_use]
    pub fn is_conservative(&self) -> bool {
        self.conservative
    }

    /// Frequency below which motion counts as that of a rigid body, in rad/s.
    #[must_use]
    pub fn standstill(&self) -> f64 {
        if self.rigid == 0 { 0.0 } else { STANDSTILL * self.lowest() }
    }

    /// The modes at a speed in rad/s, by ascending frequency: those that oscillate.
    ///
    /// # Errors
    /// When the eigenvalues do not converge.
    pub fn at(&self, speed: f64) -> Result<Vec<Mode>> {
        if speed == 0.0 && self.conservative {
            return Ok((self.rigid..self.squares.len()).map(|mode| self.at_rest(mode)).collect());
        }
        let size = self.squares.len();
        let eigen = self.first_order(speed).eigen().map_err(|_| not_converged(speed))?;
        let (values, vectors) = (eigen.S().column_vector(), eigen.U());
        let mut found: Vec<usize> = (0..2 * size).filter(|index| self.oscillates(values[*index])).collect();
        found.sort_by(|a, b| values[*a].im.total_cmp(&values[*b].im));
        let mode = |index: usize| {
            let in_modes: Vec<c64> = (0..size).map(|mode| vectors[(mode, index)] / self.root(mode)).collect();
            Mode { eigenvalue: values[index], shape: self.displacement(&in_modes) }
        };
        Ok(found.into_iter().map(mode).collect())
    }

    /// Damped natural frequencies at a speed, in rad/s: as many as there are degrees of freedom, ascending, 0 for each motion that
    /// does not oscillate. The n-th of them is a continuous function of the speed, but where a motion begins to oscillate.
    ///
    /// # Errors
    /// When the eigenvalues do not converge.
    pub fn frequencies(&self, speed: f64) -> Result<Vec<f64>> {
        if speed == 0.0 && self.conservative {
            return Ok(self.squares.iter().map(|square| square.sqrt()).collect());
        }
        let values = self.first_order(speed).eigenvalues().map_err(|_| not_converged(speed))?;
        let mut found: Vec<f64> =
            values.into_iter().filter(|value| self.oscillates(*value)).map(|value| value.im).collect();
        found.resize(self.squares.len().max(found.len()), 0.0);
        found.sort_by(f64::total_cmp);
        Ok(found)
    }

    /// Where a mode's frequency is `ratio` times the speed, without damping and circulatory stiffness: the speeds in rad/s,
    /// ascending, with their shapes. Λ·p = ω²·(1 − i·G/ratio)·p is a Hermitian problem in 1/ω², so this is exact.
    ///
    /// # Errors
    /// When the eigenvalues do not converge.
    pub fn crossings(&self, ratio: f64) -> Result<Vec<(f64, Mode)>> {
        let (size, rigid) = (self.squares.len(), self.rigid);
        let inertia = Mat::<c64>::from_fn(size, size, |row, column| {
            c64::new(f64::from(u8::from(row == column)), -self.gyroscopic[(row, column)] / ratio)
        });
        // Motion as a rigid body follows the elastic one: 0 = H_rr·p_r + H_re·p_e.
        let elastic = size - rigid;
        let follows = if rigid == 0 {
            Mat::zeros(0, elastic)
        } else {
            let corner = inertia.submatrix(0, 0, rigid, rigid);
            -corner.partial_piv_lu().solve(inertia.submatrix(0, rigid, rigid, elastic))
        };
        let mut reduced = inertia.submatrix(rigid, rigid, elastic, elastic).to_owned();
        reduced += inertia.submatrix(rigid, 0, elastic, rigid) * &follows;
        let root = |index: usize| self.squares[rigid + index].sqrt();
        let scaled = Mat::<c64>::from_fn(elastic, elastic, |row, column| {
            let mean = (reduced[(row, column)] + reduced[(column, row)].conj()) * 0.5;
            mean / (root(row) * root(column))
        });
        let eigen = scaled.self_adjoint_eigen(Side::Lower).map_err(|_| not_converged(0.0))?;
        let (values, vectors) = (eigen.S().column_vector(), eigen.U());
        let mut found = Vec::new();
        // Descending in 1/ω²; the others are negative: a line that no mode meets.
        for index in (0..elastic).rev() {
            let inverse = values[index].re;
            if inverse <= 1e-14 * values[elastic - 1].re {
                break;
            }
            let frequency = inverse.sqrt().recip();
            let moving: Vec<c64> = (0..elastic).map(|row| vectors[(row, index)] / root(row)).collect();
            let following = (0..rigid).map(|row| {
                moving.iter().enumerate().map(|(column, value)| follows[(row, column)] * value).sum::<c64>()
            });
            let in_modes: Vec<c64> = following.chain(moving.iter().copied()).collect();
            let eigenvalue = c64::new(0.0, frequency);
            found.push((frequency / ratio, Mode { eigenvalue, shape: self.displacement(&in_modes) }));
        }
        Ok(found)
    }

    fn at_rest(&self, mode: usize) -> Mode {
        let shape = (0..self.squares.len()).map(|dof| c64::new(self.shapes[(dof, mode)], 0.0)).collect();
        Mode { eigenvalue: c64::new(0.0, self.squares[mode].sqrt()), shape }
    }

    fn displacement(&self, in_modes: &[c64]) -> Vec<c64> {
        let size = self.squares.len();
        (0..size).map(|dof| (0..size).map(|mode| in_modes[mode] * self.shapes[(dof, mode)]).sum()).collect()
    }

    /// √Λ; of a rigid body the lowest elastic one, which only scales its coordinate.
    fn root(&self, mode: usize) -> f64 {
        if mode < self.rigid { self.lowest() } else { self.squares[mode].sqrt() }
    }

    /// Lowest elastic frequency, in rad/s.
    fn lowest(&self) -> f64 {
        self.squares.get(self.rigid).map_or(1.0, |square| square.sqrt())
    }

    fn oscillates(&self, eigenvalue: c64) -> bool {
        eigenvalue.im > self.standstill() && eigenvalue.re.abs() <= OVERDAMPED * eigenvalue.norm()
    }

    fn first_order(&self, speed: f64) -> Mat<f64> {
        let size = self.squares.len();
        Mat::from_fn(2 * size, 2 * size, |row, column| match (row.checked_sub(size), column.checked_sub(size)) {
            (None, None) => 0.0,
            (None, Some(column)) => {
                if row == column {
                    self.root(row)
                } else {
                    0.0
                }
            }
            (Some(row), None) => {
                let own = if row == column { self.squares[row] } else { 0.0 };
                -(own + self.circulatory[(row, column)]) / self.root(column)
            }
            (Some(row), Some(column)) => -(self.damping[(row, column)] + speed * self.gyroscopic[(row, column)]),
        })
    }
}

/// B of K = B·Bᵀ, by the eigenvalues of K with its diagonal scaled to 1, so that soft parts of a stiff model keep their accuracy.
struct StiffnessRoot {
    factor: Mat<f64>,
    rigid: usize,
}

impl StiffnessRoot {
    fn new(stiffness: &Mat<f64>) -> Result<Self> {
        let size = stiffness.nrows();
        let refuse =
            |problem: String| Err(Error::new("use", "the stiffness", problem).help("check the signs of its elements"));
        if let Some(dof) = (0..size).find(|dof| stiffness[(*dof, *dof)] < 0.0) {
            return refuse(format!(
                "expected a positive semidefinite matrix; row {row}, column {row} is {value:e}",
                row = dof + 1,
                value = stiffness[(dof, dof)]
            ));
        }
        let scale: Vec<f64> =
            (0..size).map(|dof| if stiffness[(dof, dof)] > 0.0 { stiffness[(dof, dof)].sqrt() } else { 1.0 }).collect();
        let scaled = Mat::from_fn(size, size, |row, column| stiffness[(row, column)] / (scale[row] * scale[column]));
        let eigen = scaled.self_adjoint_eigen(Side::Lower).map_err(|_| not_converged(0.0))?;
        let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
        let largest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        if largest == 0.0 {
            return refuse("expected numbers other than 0".into());
        }
        if let Some(lowest) = values.first().filter(|lowest| **lowest < -NEGATIVE * largest) {
            return refuse(format!(
                "expected a positive semidefinite matrix; with its diagonal scaled to 1 its lowest eigenvalue is {lowest:.3e}: the \
                 rotor would move away from rest by itself"
            ));
        }
        let rigid = values.iter().take_while(|value| **value <= RIGID * largest).count();
        let vectors = eigen.U();
        let factor = Mat::from_fn(size, size, |row, column| {
            if column < rigid { 0.0 } else { scale[row] * vectors[(row, column)] * values[column].sqrt() }
        });
        Ok(Self { factor, rigid })
    }
}

fn not_converged(speed: f64) -> Error {
    let rpm = rpm(speed);
    Error::new("solve", format!("the eigenvalue problem at {rpm} rpm"), "it does not converge")
        .help("check the model for numbers that differ by many powers of ten")
}

/// A speed in rad/s as one in rpm.
#[must_use]
pub fn rpm(speed: f64) -> f64 {
    speed * 30.0 / std::f64::consts::PI
}

/// A frequency in rad/s as one in Hz.
#[must_use]
pub fn hertz(frequency: f64) -> f64 {
    frequency / std::f64::consts::TAU
}
