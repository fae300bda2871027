//! `[diagnose]`: what the closed loop may consider.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use schemars::JsonSchema;
use serde::Deserialize;

use crate::{pipeline::put_right, stage::SourceKind};
use runout_closed_loop::{Effect, Setting, Settings};
use runout_error::fault::{Fault, known_names};

/// `[diagnose]`: what the closed loop may consider. `run` leaves it alone.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub(crate) struct DiagnoseConfig {
    /// "all", or a list of effect ids.
    #[serde(default)]
    pub effects: Effects,
    /// Effects that are there and whose size is known: applied as they are, neither looked for nor fitted.
    #[serde(default)]
    pub known: Vec<KnownEffect>,
    /// Share of the turns, at the end of each recording, that no fit sees and that every effect must explain. Measured points
    /// are left out group by group instead (circle, block, point).
    pub hold_out: Option<f64>,
    /// Folder for the exports of the final model: folders of exporters become this one, files go into it. Without it they go to
    /// `diagnosed/` in the folders of `run`'s exports.
    pub out: Option<PathBuf>,
    /// Where `diagnosis.json` goes; beside the first export of the final model without it.
    pub path: Option<PathBuf>,
    /// Memory that the loop may take, in GB: it keeps all stations of recorded turns at once, and refuses those that need more.
    #[serde(default = "default_memory_gb")]
    pub memory_gb: f64,
}

fn default_memory_gb() -> f64 {
    MEMORY_GB
}

/// Memory that the loop may take where the pipeline says nothing, in GB.
const MEMORY_GB: f64 = 4.0;

/// A choice of effects.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
#[non_exhaustive]
pub(crate) enum Effects {
    /// "all".
    Word(AllEffects),
    /// Ids.
    Some(Vec<String>),
}

/// The word "all".
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub(crate) enum AllEffects {
    /// Every effect of the toolkit.
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
#[non_exhaustive]
pub struct KnownEffect {
    /// Its id.
    pub effect: String,
    /// The sensor or setup that it acts on, or two with a space between; nothing for the whole.
    pub target: Option<String>,
    /// Its parameters by name, in their units; those that are not named are 0.
    pub values: BTreeMap<String, f64>,
}

/// What the closed loop is to do, for the model of a pipeline.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Diagnose {
    /// How the loop runs.
    pub settings: Settings,
    /// Effects of known size whose targets only the data name; not yet in `settings`.
    pub named: Vec<KnownEffect>,
    /// Share of the turns held out, where it is configured.
    pub hold_out: Option<f64>,
    /// Folder of the exports as configured, relative to the TOML.
    pub out: Option<PathBuf>,
    /// Where the diagnosis goes, where it is configured.
    pub path: Option<PathBuf>,
    /// Memory that the loop may take, in GB.
    pub memory_gb: f64,
    /// Where the corrected rig goes, where it is asked for: a file of TOML that can replace `[rig]`.
    pub write_rig: Option<PathBuf>,
}

impl Default for Diagnose {
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            named: Vec::new(),
            hold_out: None,
            out: None,
            path: None,
            memory_gb: MEMORY_GB,
            write_rig: None,
        }
    }
}

impl DiagnoseConfig {
    /// Checks the values for measurements of a kind and a model with these effects.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub(crate) fn check(
        self,
        folder: &Path,
        kind: SourceKind,
        effects: &[Effect],
        data_name_targets: bool,
    ) -> Result<Diagnose, Fault> {
        if let Some(share) = self.hold_out {
            if !(share > 0.0 && share < 1.0) {
                return Err(Fault::at("hold_out", format!("expected a share between 0 and 1, found {share}")));
            }
            if matches!(kind, SourceKind::Points) {
                let fault = Fault::at("hold_out", "measured points are left out group by group, not by a share");
                return Err(fault.help("leave `hold_out` out"));
            }
        }
        let memory_gb = self.memory_gb;
        if !(memory_gb > 0.0 && memory_gb.is_finite()) {
            return Err(Fault::at("memory_gb", format!("expected a number of GB above 0, found {memory_gb}")));
        }
        if self.out.as_ref().is_some_and(|out| out.as_os_str().is_empty()) {
            return Err(Fault::at("out", "expected the name of a folder"));
        }
        let chosen = match self.effects {
            Effects::Word(AllEffects::All) => None,
            Effects::Some(chosen) => {
                for (index, id) in chosen.iter().enumerate() {
                    exists(id, ids(effects).chain(of_recordings(kind).iter().copied()))
                        .map_err(|fault| fault.under_item("effects", index))?;
                }
                Some(chosen)
            }
        };
        let known = self.known.iter().enumerate();
        let setting = |known: &KnownEffect| {
            let anywhere = KnownEffect { target: None, ..known.clone() };
            if data_name_targets { anywhere.setting(effects) } else { known.setting(effects) }
        };
        let known: Vec<Setting> = known
            .map(|(index, known)| setting(known).map_err(|fault| fault.under_item("known", index)))
            .collect::<Result<_, _>>()?;
        let (known, named) = if data_name_targets { (Vec::new(), self.known) } else { (known, Vec::new()) };
        let settings = Settings { effects: chosen, known, ..Settings::default() };
        let path = self.path.map(|path| folder.join(path));
        Ok(Diagnose { settings, named, hold_out: self.hold_out, out: self.out, path, memory_gb, write_rig: None })
    }
}

impl Diagnose {
    /// The loop's settings for effects whose targets the data name.
    ///
    /// # Errors
    /// When an effect of known size has a target that the data do not have.
    pub(crate) fn settings_for(&self, effects: &[Effect]) -> Result<Settings, Fault> {
        let known = self.named.iter().enumerate();
        let known =
            known.map(|(index, known)| known.setting(effects).map_err(|fault| fault.under_item("known", index)));
        Ok(Settings { known: known.collect::<Result<_, _>>()?, ..self.settings.clone() })
    }
}

fn ids(effects: &[Effect]) -> impl Iterator<Item = &str> {
    effects.iter().map(|effect| effect.id.as_str())
}

/// Mistakes of recordings, which are put right before the loop.
fn of_recordings(kind: SourceKind) -> &'static [&'static str] {
    if matches!(kind, SourceKind::Turns) { &put_right::IDS } else { &[] }
}

/// Refuses an id that no effect has.
fn exists<'a>(id: &str, ids: impl Iterator<Item = &'a str>) -> Result<(), Fault> {
    let mut ids: Vec<&str> = ids.collect();
    ids.sort_unstable();
    ids.dedup();
    if ids.contains(&id) {
        return Ok(());
    }
    Err(Fault::here(format!("the model has no effect `{id}`")).help(known_names(id, ids)))
}

impl KnownEffect {
    fn setting(&self, effects: &[Effect]) -> Result<Setting, Fault> {
        if put_right::IDS.contains(&self.effect.as_str()) {
            let fault = Fault::at(
                "effect",
                format!("`{}` is a mistake of the recording, which `diagnose` puts right", self.effect),
            );
            return Err(fault.help(
                "leave it out of `known`; a mark that is not once a turn is declared by `turns_per_mark` of the setup",
            ));
        }
        exists(&self.effect, ids(effects)).map_err(|fault| fault.under("effect"))?;
        let of_this_id = || effects.iter().enumerate().filter(|(_, effect)| effect.id == self.effect);
        let at = |targets: &[String]| if targets.is_empty() { "none".into() } else { targets.join(" ") };
        let named: Vec<String> =
            self.target.iter().flat_map(|target| target.split_whitespace()).map(Into::into).collect();
        let acts_there = |effect: &Effect| effect.targets.iter().eq(&self.target) || effect.targets == named;
        let Some((index, effect)) = of_this_id().find(|(_, effect)| acts_there(effect)) else {
            let targets: Vec<String> = of_this_id().map(|(_, effect)| at(&effect.targets)).collect();
            let key = if self.target.is_some() { "target" } else { "effect" };
            let fault = Fault::at(key, format!("`{}` cannot act on `{}`", self.effect, at(self.target.as_slice())));
            return Err(fault.help(format!("its targets: {}", targets.join(", "))));
        };
        let names = || effect.parameters.iter().map(|parameter| parameter.name.as_str());
        for (name, value) in &self.values {
            if !value.is_finite() {
                return Err(Fault::at(name, format!("expected a finite number, found {value}")).under("values"));
            }
            if names().all(|known| known != name) {
                let fault = Fault::at(name, format!("`{}` has no parameter `{name}`", self.effect));
                return Err(fault.help(known_names(name, names())).under("values"));
            }
        }
        let values = names().map(|name| self.values.get(name).copied().unwrap_or(0.0)).collect();
        Ok(Setting { effect: index, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use runout_closed_loop::Parameter;
    use runout_error::fault::{Place, Step};

    fn effect(target: &str) -> Effect {
        let parameter = |name: &str| Parameter { name: name.into(), unit: "um".into(), tolerance: 1.0 };
        let parameters = vec![parameter("x"), parameter("y")];
        Effect { id: "offset".into(), targets: vec![target.into()], parameters }
    }

    fn checked(text: &str) -> Result<Diagnose, Fault> {
        let config = toml::from_str::<DiagnoseConfig>(text).unwrap();
        config.check(Path::new(""), SourceKind::Turns, &[effect("S1"), effect("S2")], false)
    }

    #[test]
    fn effects_and_known_ones_are_found_by_name() {
        let found = checked("known = [{ effect = 'offset', target = 'S2', values = { y = 2.0 } }]").unwrap().settings;
        assert_eq!((found.effects, found.known), (None, vec![Setting { effect: 1, values: vec![0.0, 2.0] }]));
        assert_eq!(checked("effects = ['offset']").unwrap().settings.effects, Some(vec!["offset".to_owned()]));
    }

    #[test]
    fn what_the_model_does_not_have_is_refused_at_its_place() {
        let key = |name: &str| Step::Key(name.into());
        for (text, place, words) in [
            ("effects = ['offset', 'ofset']", vec![key("effects"), Step::Index(1)], "did you mean `offset`"),
            (
                "known = [{ effect = 'offset', values = {} }]",
                vec![key("known"), Step::Index(0), key("effect")],
                "its targets: S1, S2",
            ),
            (
                "known = [{ effect = 'offset', target = 'S3', values = {} }]",
                vec![key("known"), Step::Index(0), key("target")],
                "cannot act on `S3`",
            ),
            (
                "known = [{ effect = 'offset', target = 'S1', values = { z = 1.0 } }]",
                vec![key("known"), Step::Index(0), key("values"), key("z")],
                "no parameter `z`",
            ),
            (
                "known = [{ effect = 'offset', target = 'S1', values = { x = inf } }]",
                vec![key("known"), Step::Index(0), key("values"), key("x")],
                "finite",
            ),
        ] {
            let fault = checked(text).unwrap_err();
            let said = format!("{fault}; {}", fault.help.clone().unwrap_or_default());
            assert!(said.contains(words), "{said}");
            assert_eq!(fault.place, Place::Path(place), "{text}");
        }
    }

    #[test]
    fn memory_is_a_number_above_0() {
        assert!((checked("").unwrap().memory_gb - 4.0).abs() < 1e-12);
        for (memory_gb, fits) in [("0.0", false), ("-1", false), ("0.5", true), ("inf", false), ("nan", false)] {
            assert_eq!(checked(&format!("memory_gb = {memory_gb}")).is_ok(), fits, "{memory_gb}");
        }
    }

    #[test]
    fn a_share_is_between_none_and_all() {
        for (share, fits) in [("0.0", false), ("0.3", true), ("1.0", false), ("nan", false)] {
            assert_eq!(checked(&format!("hold_out = {share}")).is_ok(), fits, "{share}");
        }
    }
}
