//! Texture values of one section around the part.

use super::{Evaluate, Filter, Group, Label, NumberFound, POINTS_A_WAVE, labelled, section::Form};
use crate::Value;
use runout_numerics::fourier::Fourier;
use runout_standards::texture::{self, Kind, Settings};

/// [`POINTS_A_WAVE`] where errors are drawn: there a value's error is sought, not the value. Differences over seven points are
/// then 0.9 % low at the highest order.
const DRAWN_POINTS_A_WAVE: usize = 6;
/// Angles at which a profile is evaluated are a multiple of this, for the sake of the transform.
const WHOLE: usize = 256;

/// Why values that count elements have no uncertainty.
const COUNTED: &str = "it counts hills and dales: an error that makes or merges one changes it by a step, and intervals by draws \
    hold the truth in fewer than 95 %";
/// Why values of a profile's material ratio curve have none.
const OF_PLATEAUS: &str = "it is read from the material ratio curve where single hills and dales of one profile decide: intervals \
    by draws hold the truth in fewer than 95 %";

/// Why intervals of a value of a profile do not cover the true value, in the order of [`texture::PARAMETERS`].
pub(super) fn no_interval(index: usize) -> Option<&'static str> {
    match index {
        // Ra, Rq, Rsk, Rku, Rt, Rdq, Rp, Rv, Rz, Rz1max.
        0..=8 | 10 => None,
        // Rsm, Rc, RPc.
        9 | 11 | 12 => Some(COUNTED),
        _ => Some(OF_PLATEAUS),
    }
}

impl Form {
    /// Texture of every profile that is asked for.
    pub(super) fn texture(&self, evaluate: &Evaluate) -> Vec<Value> {
        if !evaluate.has(Group::Texture) {
            return Vec::new();
        }
        let of = |kind: &Kind| self.profile_of(*kind, evaluate);
        evaluate.texture.profiles.iter().flat_map(of).collect()
    }

    /// Ra of the unfiltered profile.
    pub(super) fn papers_ra(&self) -> Vec<Value> {
        let filter = Filter::low_pass(None);
        let profile_um = self.profile(&filter, &mut Fourier::new(self.fine(&filter)));
        let value = texture::ra_um(&profile_um);
        let mut known = self.known(
            |order| filter.weight(order),
            self.drawn_angles(&filter),
            |profile_um, found| {
                found.push(texture::ra_um(profile_um));
            },
        );
        let found = NumberFound::of(value, known.pop().as_ref());
        let label = Label::new("Ra", "µm", "Qiao, Xu, Zhao 2024: unfiltered circumferential profile", "mean line");
        self.labelled(vec![label], vec![found], &filter)
    }

    fn profile_of(&self, kind: Kind, evaluate: &Evaluate) -> Vec<Value> {
        let Some(filter) = evaluate.profile_filter(kind, self.radius_mm) else { return Vec::new() };
        let settings = evaluate.profile_settings(kind, std::f64::consts::TAU * self.radius_mm);
        let profile_um = self.profile(&filter, &mut Fourier::new(self.fine(&filter)));
        let values = texture::around(&profile_um, self.radius_mm, &settings).values();
        let known = self.known(
            |order| filter.weight(order),
            self.drawn_angles(&filter),
            |profile_um, found| {
                found.extend(texture::heights_around(profile_um, self.radius_mm, &settings).values());
            },
        );
        let found = |index: usize, value: f64, reason: Option<&str>| match (known.get(index), reason) {
            (Some(_), Some(reason)) => NumberFound::of(value, None).without_uncertainty(reason),
            (known, _) => NumberFound::of(value, known),
        };
        let standard = |clause: &str| format!("ISO 21920-2:2021, {clause}");
        let mut labels: Vec<Label> = kind
            .parameters()
            .iter()
            .map(|(symbol, unit, clause)| Label::new(symbol, unit, standard(clause), "mean line"))
            .collect();
        let numbers = values.iter().enumerate();
        let mut numbers: Vec<NumberFound> =
            numbers.map(|(index, value)| found(index, *value, no_interval(index))).collect();
        for height_um in &evaluate.texture.heights_um {
            let reference = format!("{height_um} µm above the mean line");
            labels.push(Label::new(kind.material_ratio_symbol(), "%", standard("material ratio curve"), reference));
            let ratio = texture::material_ratio_percent(&profile_um, *height_um);
            numbers.push(found(0, ratio, Some(OF_PLATEAUS)));
        }
        labelled(labels, numbers, &filter, &self.held, self.at.coverage(self.angles))
    }

    /// Angles at which no crest of what a filter passes is far from one; a multiple of those of the average.
    fn fine(&self, filter: &Filter) -> usize {
        self.angles * (POINTS_A_WAVE * filter.highest(self.held.highest)).div_ceil(self.angles).max(1)
    }

    /// Angles on which errors are drawn.
    pub(super) fn drawn_angles(&self, filter: &Filter) -> usize {
        (DRAWN_POINTS_A_WAVE * filter.highest(self.held.highest)).next_multiple_of(WHOLE).max(WHOLE)
    }
}

/// Sections of P and W, where λf gives none, have the whole length.
impl Evaluate {
    /// The filter of a profile around a part; `None` where its cut-offs are not given.
    pub(super) fn profile_filter(&self, kind: Kind, radius_mm: f64) -> Option<Filter> {
        let (s, c, f) = (self.lambda_s_mm, self.lambda_c_mm, self.texture.lambda_f_mm);
        match kind {
            Kind::P => Some(Filter::between(s, None, radius_mm)),
            Kind::R => c.map(|c| Filter::between(s, Some(c), radius_mm)),
            Kind::W => c.map(|c| Filter::waviness(c, f, radius_mm)),
        }
    }

    /// Section length and nesting indices of a profile of this length.
    pub(super) fn profile_settings(&self, kind: Kind, length_mm: f64) -> Settings {
        let section_mm = match kind {
            Kind::R => self.lambda_c_mm,
            Kind::W => self.texture.lambda_f_mm,
            Kind::P => None,
        };
        let section_mm = Some(section_mm.unwrap_or(length_mm));
        Settings { kind, section_mm, difference_percent: self.texture.difference_percent, ..Settings::default() }
    }
}
