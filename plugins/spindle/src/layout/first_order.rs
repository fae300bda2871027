//! Order 1, where form is clamping and half of the motion turns with the part.

use runout_core::{Complex64, separation::Quantity};

use super::{Layout, Reading, UM_PER_MM_URAD, View};

/// The unknowns at order 1, where each clamping has an eccentricity of its own in each section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FirstOrder {
    /// Eccentricity of a section in a setup, or how far its face is off square at the sensors' radius: Re C e^{+iα}.
    Eccentricity {
        /// Index of the setup.
        setup: usize,
        /// Index of the section.
        section: usize,
    },
    /// The part of (x, y) that turns against the spindle: X, with Y = −iX.
    CounterRotatingShift,
    /// The part of the tilt that turns against the spindle: E_y, with E_x = iE_y.
    CounterRotatingTilt,
    /// All of z: along the axis no clamping makes 1/rev.
    Axial,
}

impl Layout {
    /// The unknowns at order 1.
    #[must_use]
    pub fn first_order_unknowns(&self) -> Vec<FirstOrder> {
        let setups = 0..self.setups;
        let on_axis = |section: usize| {
            self.readings.iter().any(|reading| reading.section == section && reading.view == View::OnAxis)
        };
        // Whatever a bounded form on the axis adds to 1/rev is within its bound.
        let sections = self.sections.iter().copied();
        let clamped: Vec<usize> =
            sections.filter(|section| !on_axis(*section) || self.form_bound_um(*section).is_none()).collect();
        let each = |setup| clamped.iter().map(move |section| FirstOrder::Eccentricity { setup, section: *section });
        let mut unknowns: Vec<FirstOrder> = setups.flat_map(each).collect();
        if self.readings.iter().any(|reading| !reading.view.is_axial()) {
            unknowns.push(FirstOrder::CounterRotatingShift);
        }
        if self.unknowns.iter().any(|unknown| unknown.is_tilt()) {
            unknowns.push(FirstOrder::CounterRotatingTilt);
        }
        if self.unknowns.contains(&Quantity::Z) {
            unknowns.push(FirstOrder::Axial);
        }
        unknowns
    }

    /// The matrix at order 1, `[reading][first-order unknown]`.
    ///
    /// cos θ' X + sin θ' Y = X e^{−iθ'} where Y = −iX, and likewise z(cos θ' E_y − sin θ' E_x) = z E_y e^{−iθ'} where
    /// E_x = iE_y; the other half, e^{+iθ'}, turns with the part and is what ISO 230-7 removes as centring.
    #[must_use]
    pub fn first_order_matrix(&self) -> Vec<Complex64> {
        let unknowns = self.first_order_unknowns();
        let row = |reading: &Reading| {
            let against = Complex64::from_polar(reading.motion_ratio, -self.direction * reading.angle_rad);
            let axial = reading.view.is_axial();
            unknowns
                .iter()
                .map(|unknown| match unknown {
                    FirstOrder::Eccentricity { setup, section } => {
                        let seen = *setup == reading.setup && *section == reading.section;
                        if seen { self.form_phase(reading, 1) } else { Complex64::ZERO }
                    }
                    FirstOrder::CounterRotatingShift if axial => Complex64::ZERO,
                    FirstOrder::CounterRotatingShift => against,
                    FirstOrder::CounterRotatingTilt => against * reading.lever_mm * UM_PER_MM_URAD,
                    FirstOrder::Axial => Complex64::from(if axial { reading.motion_ratio } else { 0.0 }),
                })
                .collect::<Vec<_>>()
        };
        self.readings.iter().flat_map(row).collect()
    }
}
