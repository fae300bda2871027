//! What a run knows of one station, and gives to exporters.

use crate::{
    Complex64,
    evaluate::{Value, roundness, texture},
    measurement::StationTruth,
    numerics::fourier::Fourier,
    profile::Profile,
    rig::Rig,
    separation::{Assessment, Quantity, Separation},
};

/// What exporters know when they begin.
#[derive(Debug, Clone)]
pub struct RunInfo {
    /// The pipeline's title.
    pub title: String,
    /// Sensors and setups, where there are any.
    pub rig: Option<Rig>,
    /// What the separator can tell with the rig.
    pub assessment: Option<Assessment>,
}

/// One station, done.
#[derive(Debug, Clone, PartialEq)]
pub struct StationResult {
    /// Its name.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// Equal angles on which form and motion are given.
    pub angles: usize,
    /// Form and motion.
    pub separation: Separation,
    /// The averages that it came from; empty for measured points.
    pub profiles: Vec<Profile>,
    /// The standards' values, section by section.
    pub values: Vec<Vec<Value>>,
    /// What the recording says is true.
    pub truth: Option<StationTruth>,
}

impl StationResult {
    /// One unknown on [`angles`](Self::angles) equal angles from 0: form over the part's, motion over the spindle's.
    /// Orders that the layout cannot tell are left out.
    #[must_use]
    pub fn over_angle(&self, unknown: usize) -> Vec<f64> {
        let motion = !self.separation.unknowns[unknown].is_form();
        let turned = |value: Complex64| if motion { value.conj() } else { value };
        Fourier::new(self.angles).synthesise(self.separation.coefficients(unknown).map(turned)).to_vec()
    }
}

/// Adds the standards' values to a separation.
pub(super) fn complete(
    station: String,
    z_mm: f64,
    angles: usize,
    separation: Separation,
    profiles: Vec<Profile>,
    truth: Option<StationTruth>,
) -> StationResult {
    let mut result = StationResult { station, z_mm, angles, separation, profiles, values: Vec::new(), truth };
    let sections = 0..result.separation.sections.len();
    result.values = sections.map(|section| section_values(&result, section)).collect();
    result
}

fn section_values(result: &StationResult, section: usize) -> Vec<Value> {
    let Some(unknown) = result.separation.position(Quantity::Form(section)) else { return Vec::new() };
    // Level and centring are no form deviation, also where the method knows them.
    let harmonics = result.separation.coefficients(unknown);
    let from_two = harmonics.enumerate().map(|(order, value)| if order < 2 { Complex64::ZERO } else { value });
    let mut fourier = Fourier::new(result.angles);
    let form_um = fourier.synthesise(from_two);
    let highest = result.separation.max_order();
    let lost: Vec<usize> = result.separation.lost_orders(unknown).into_iter().filter(|order| *order >= 2).collect();
    let value = |symbol: &str, value, source: &str, reference: &str| Value {
        symbol: symbol.into(),
        unit: "um".into(),
        value,
        source: source.into(),
        band_upr: [2, highest],
        lost_orders: lost.clone(),
        filter: "none".into(),
        reference: reference.into(),
    };
    vec![
        value("RONt", roundness::ront_lsci_um(form_um), "ISO 12181-1:2011, peak-to-valley roundness deviation", "LSCI"),
        value("Ra", texture::ra_um(form_um), "Qiao, Xu, Zhao 2024: unfiltered circumferential profile", "mean line"),
    ]
}

/// Root mean square of estimate minus truth over the orders from 2 that could be told.
pub(super) fn true_error(result: &StationResult, quantity: Quantity) -> Option<f64> {
    let truth = result.truth.as_ref()?;
    let curve = match quantity {
        Quantity::Form(section) => truth.form_um.get(section)?,
        motion => {
            let axis =
                [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY].iter().position(|axis| *axis == motion)?;
            &truth.motion.as_ref()?[axis]
        }
    };
    let unknown = result.separation.position(quantity)?;
    if curve.len() < 2 {
        return None;
    }
    let mut fourier = Fourier::new(curve.len());
    let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
    fourier.analyse(curve.iter().copied(), &mut harmonics);
    let width = result.separation.unknowns.len();
    let told = result.separation.observable.iter().skip(unknown).step_by(width);
    let squares =
        result.separation.coefficients(unknown).zip(told).enumerate().skip(2).filter(|(_, (_, told))| **told).map(
            |(order, (value, _))| {
                let truth = harmonics.get(order).copied().unwrap_or_default();
                let truth = if quantity.is_form() { truth } else { truth.conj() };
                (value - truth).norm_sqr()
            },
        );
    Some((0.5 * squares.sum::<f64>()).sqrt())
}
