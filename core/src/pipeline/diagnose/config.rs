//! `[diagnose]`: what the closed loop may consider.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    Error, Result,
    model::{Effect, Setting, closed_loop::Settings},
    pipeline::error::{Fault, known_names},
};

/// `[diagnose]`: what the closed loop may consider. `run` leaves it alone.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiagnoseConfig {
    /// "all", or a list of effect ids.
    #[serde(default)]
    pub effects: Effects,
    /// Effects that are there and whose size is known: applied as they are, neither looked for nor fitted.
    #[serde(default)]
    pub known: Vec<KnownEffect>,
    /// Share of the turns, at the end of each recording, that no fit sees and that every effect must explain. Measured points
    /// are left out group by group instead (circle, block, point).
    pub hold_out: Option<f64>,
    /// Where `diagnosis.json` goes; beside the first export without it.
    pub path: Option<PathBuf>,
}

/// A choice of effects.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Effects {
    /// "all".
    Word(AllEffects),
    /// Ids.
    Some(Vec<String>),
}

/// The word "all".
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AllEffects {
    /// Every effect that the toolkit knows.
    All,
}

impl Default for Effects {
    fn default() -> Self {
        Self::Word(AllEffects::All)
    }
}

/// An effect whose size is known.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownEffect {
    /// Its id.
    pub effect: String,
    /// The sensor or setup that it acts on; nothing for the whole.
    pub target: Option<String>,
    /// Its parameters by name, in their units; those that are not named are 0.
    pub values: BTreeMap<String, f64>,
}

impl DiagnoseConfig {
    /// Checks the values and resolves the path.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub(crate) fn check(mut self, folder: &Path) -> std::result::Result<Self, Fault> {
        if let Some(share) = self.hold_out
            && !(share > 0.0 && share < 1.0)
        {
            return Err(Fault::at("hold_out", format!("expected a share between 0 and 1, found {share}")));
        }
        for (index, known) in self.known.iter().enumerate() {
            if let Some((name, value)) = known.values.iter().find(|(_, value)| !value.is_finite()) {
                let fault = Fault::at(name, format!("expected a finite number, found {value}"));
                return Err(fault.under("values").under_item("known", index));
            }
        }
        self.path = self.path.map(|path| folder.join(path));
        Ok(self)
    }

    /// How to run the loop on a model with these effects.
    ///
    /// # Errors
    /// When it names an effect or a parameter that the model does not have.
    pub fn settings(&self, effects: &[Effect]) -> Result<Settings> {
        let ids = || {
            let mut ids: Vec<&str> = effects.iter().map(|effect| effect.id.as_str()).collect();
            ids.sort_unstable();
            ids.dedup();
            ids
        };
        let unknown = |id: &str| Error::new("look for", format!("`{id}`"), "the model has no such effect");
        let chosen = match &self.effects {
            Effects::Word(AllEffects::All) => None,
            Effects::Some(chosen) => {
                if let Some(id) = chosen.iter().find(|id| !ids().contains(&id.as_str())) {
                    return Err(unknown(id).help(known_names(id, ids())));
                }
                Some(chosen.clone())
            }
        };
        let known = self.known.iter().map(|known| {
            let named = |effect: &Effect| effect.id == known.effect && effect.target == known.target;
            let index = effects.iter().position(named).ok_or_else(|| {
                let targets: Vec<&str> = effects
                    .iter()
                    .filter(|effect| effect.id == known.effect)
                    .map(|effect| effect.target.as_deref().unwrap_or("none"))
                    .collect();
                if targets.is_empty() {
                    return unknown(&known.effect).help(known_names(&known.effect, ids()));
                }
                let target = known.target.as_deref().unwrap_or("none");
                let problem = format!("it cannot act on `{target}`");
                Error::new("apply", format!("`{}`", known.effect), problem)
                    .help(format!("its targets: {}", targets.join(", ")))
            })?;
            let parameters = &effects[index].parameters;
            let names = || parameters.iter().map(|parameter| parameter.name.as_str());
            if let Some(name) = known.values.keys().find(|name| names().all(|known| known != *name)) {
                let problem = format!("it has no parameter `{name}`");
                return Err(
                    Error::new("apply", format!("`{}`", known.effect), problem).help(known_names(name, names()))
                );
            }
            let values = names().map(|name| known.values.get(name).copied().unwrap_or(0.0)).collect();
            Ok(Setting { effect: index, values })
        });
        Ok(Settings { effects: chosen, known: known.collect::<Result<_>>()?, ..Settings::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Parameter;

    fn effect(target: &str) -> Effect {
        let parameter = |name: &str| Parameter { name: name.into(), unit: "um".into(), tolerance: 1.0 };
        let parameters = vec![parameter("x"), parameter("y")];
        Effect { id: "offset".into(), target: Some(target.into()), parameters }
    }

    fn settings(text: &str) -> Result<Settings> {
        toml::from_str::<DiagnoseConfig>(text).unwrap().settings(&[effect("S1"), effect("S2")])
    }

    #[test]
    fn effects_and_known_ones_are_found_by_name() {
        let found = settings("known = [{ effect = 'offset', target = 'S2', values = { y = 2.0 } }]").unwrap();
        assert_eq!((found.effects, found.known), (None, vec![Setting { effect: 1, values: vec![0.0, 2.0] }]));
        assert_eq!(settings("effects = ['offset']").unwrap().effects, Some(vec!["offset".to_owned()]));
        let refused = |text: &str| {
            let error = settings(text).unwrap_err();
            format!("{error}; {}", error.advice().unwrap_or_default())
        };
        assert!(refused("effects = ['ofset']").contains("did you mean `offset`"));
        assert!(refused("known = [{ effect = 'offset', values = {} }]").contains("its targets: S1, S2"));
        let wrong = "known = [{ effect = 'offset', target = 'S1', values = { z = 1.0 } }]";
        assert!(refused(wrong).contains("it has no parameter `z`"));
    }

    #[test]
    fn a_share_is_between_none_and_all() {
        for (share, fits) in [(0.0, false), (0.3, true), (1.0, false), (f64::NAN, false)] {
            let config = DiagnoseConfig { hold_out: Some(share), ..DiagnoseConfig::default() };
            assert_eq!(config.check(Path::new("")).is_ok(), fits, "{share}");
        }
    }
}
