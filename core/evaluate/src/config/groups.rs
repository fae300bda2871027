//! Groups of values, and how a file names them.

use schemars::JsonSchema;
use serde::{
    Deserialize, Deserializer,
    de::{SeqAccess, Unexpected, Visitor},
};

/// Values that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Group {
    /// RONt about each reference; RONp, RONv, RONq and the steepest slope dr/dθ about LSCI; of each section.
    Roundness,
    /// Amplitude and phase of each order from 2 on of each section's form.
    Harmonics,
    /// STRt about LSLI and MZLI; STRp, STRv and STRq about LSLI; of open profiles.
    Straightness,
    /// Ra of each section's unfiltered profile; with λc the values of ISO 21920-2, of the profiles in [evaluate.texture].
    /// Of open profiles the latter.
    Texture,
    /// CYLt about each reference, CYLp, CYLv, CYLq about LSCY, of all sections together.
    Cylindricity,
    /// ISO 25178-2 on the surface without its form, which is a cylinder unless [evaluate.areal] says otherwise.
    Areal,
    /// Twist of a turned or ground shaft (MBN 31007-07): the strongest helix on the surface.
    Twist,
    /// ISO 230-7, of each station; of an axis at standing positions its synchronous values.
    ErrorMotion,
    /// TIR of each averaged reading; size and part angle of the eccentricity of each section in each setup.
    RunOut,
}

impl Group {
    /// All of them.
    pub(super) const ALL: [Self; 9] = [
        Self::Roundness,
        Self::Harmonics,
        Self::Straightness,
        Self::Texture,
        Self::Cylindricity,
        Self::Areal,
        Self::Twist,
        Self::ErrorMotion,
        Self::RunOut,
    ];

    /// Its name in a file.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Roundness => "roundness",
            Self::Harmonics => "harmonics",
            Self::Straightness => "straightness",
            Self::Texture => "texture",
            Self::Cylindricity => "cylindricity",
            Self::Areal => "areal",
            Self::Twist => "twist",
            Self::ErrorMotion => "error-motion",
            Self::RunOut => "run-out",
        }
    }
}

/// Groups of values as they stand in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Groups {
    /// "all".
    All,
    /// A list.
    Listed(Vec<Group>),
}

/// [`Groups`] for the schema.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is made")]
pub(super) enum GroupsSchema {
    Word(All),
    Listed(Vec<Group>),
}

#[derive(JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[allow(dead_code, reason = "only its schema is made")]
pub(super) enum All {
    All,
}

impl<'de> Deserialize<'de> for Groups {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Words;

        impl<'de> Visitor<'de> for Words {
            type Value = Groups;

            fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
                formatter.write_str("\"all\" or a list of groups")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Groups, E> {
                if word == "all" { Ok(Groups::All) } else { Err(E::invalid_value(Unexpected::Str(word), &self)) }
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Groups, A::Error> {
                let mut groups = Vec::new();
                while let Some(group) = items.next_element()? {
                    groups.push(group);
                }
                Ok(Groups::Listed(groups))
            }
        }

        deserializer.deserialize_any(Words)
    }
}
