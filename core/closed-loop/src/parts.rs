//! Effects of the whole that differ from part to part: the same everywhere, or each part its own, as the data say.

use super::{Model, Setting, fit::Refit, found::FoundEffect, search::Tracing};

/// A part's own effect is there where a parameter is this many standard deviations long.
const SIGNIFICANT: f64 = 4.0;

impl<M: Model> Tracing<'_, M> {
    /// Where an effect of the whole and the same effect of a part were found, the effect differs: every part gets its own instead.
    /// Gives where a refit starts; nothing where no effect differs.
    pub(super) fn split_common(&mut self, current: &Refit<M::Fit>) -> Option<Vec<Setting>> {
        let mut start = current.settings.clone();
        let mut split = false;
        let common: Vec<usize> = self.found.iter().map(|found| found.members[0]).collect();
        for effect in common {
            let parts = self.model.parts(effect);
            if !self.found.iter().any(|found| parts.contains(&found.members[0])) {
                continue;
            }
            let Some(place) = self.found.iter().position(|found| found.members == [effect]) else { continue };
            let Some(values) = start.iter().find(|setting| setting.effect == effect).map(|found| found.values.clone())
            else {
                continue;
            };
            let whole = self.found.remove(place);
            start.retain(|setting| setting.effect != effect);
            for part in parts.iter().copied() {
                match start.iter_mut().find(|setting| setting.effect == part) {
                    Some(own) => own.values.iter_mut().zip(&values).for_each(|(own, common)| *own += common),
                    None => start.push(Setting { effect: part, values: values.clone() }),
                }
                if self.found.iter().all(|found| found.members[0] != part) {
                    self.found.push(FoundEffect { members: vec![part], alone: vec![values.clone()], ..whole.clone() });
                }
            }
            // With all parts there, none stands for another.
            for found in self.found.iter_mut().filter(|found| parts.contains(&found.members[0])) {
                found.members.truncate(1);
                found.alone.truncate(1);
            }
            split = true;
        }
        split.then_some(start)
    }

    /// Withdraws effects of parts that are 0 within their uncertainty. Says whether there were any.
    pub(super) fn drop_insignificant_parts(&mut self, current: &Refit<M::Fit>) -> bool {
        let is_part = |effect: usize| {
            let found = self.found.iter().map(|found| found.members[0]);
            let beside = (0..self.model.effects().len()).filter(|whole| self.model.parts(*whole).contains(&effect));
            beside.count() > 0 && found.filter(|other| *other == effect).count() == 1
        };
        let mut position = 0;
        let mut dropped = Vec::new();
        for setting in &current.settings[self.settings.known.len()..] {
            let places = position..position + setting.values.len();
            let mut sized = setting.values.iter().zip(places.clone());
            let within =
                sized.all(|(value, place)| value.abs() < SIGNIFICANT * current.covariance[place][place].sqrt());
            if within && is_part(setting.effect) {
                dropped.push(setting.effect);
            }
            position = places.end;
        }
        self.found.retain(|found| !dropped.contains(&found.members[0]));
        !dropped.is_empty()
    }
}
