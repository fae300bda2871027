//! Kinds of error motion values (ISO 230-7:2015, clause 3).

use std::fmt;

/// Kind of an error motion value. Its symbol is the kind and the direction: `total-radial-x`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionKind {
    /// What repeats from turn to turn.
    Synchronous,
    /// What repeats, without 1/rev.
    ResidualSynchronous,
    /// What does not repeat.
    Asynchronous,
    /// Both together.
    Total,
    /// 1/rev.
    Fundamental,
}

impl MotionKind {
    const ALL: [Self; 5] =
        [Self::Synchronous, Self::ResidualSynchronous, Self::Asynchronous, Self::Total, Self::Fundamental];

    /// Kind and direction of a symbol; none where it is not one of error motion, such as `total-run-out`.
    #[must_use]
    pub fn split(symbol: &str) -> Option<(Self, &str)> {
        let split = |kind: Self| Some((kind, symbol.strip_prefix(kind.name())?.strip_prefix('-')?));
        let (kind, direction) = Self::ALL.into_iter().find_map(split)?;
        ["radial", "tilt", "axial", "face"].iter().any(|of| direction.starts_with(of)).then_some((kind, direction))
    }

    /// As symbols begin with it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Synchronous => "synchronous",
            Self::ResidualSynchronous => "residual-synchronous",
            Self::Asynchronous => "asynchronous",
            Self::Total => "total",
            Self::Fundamental => "fundamental",
        }
    }

    /// Whether it is drawn about a centre of its polar plot.
    #[must_use]
    pub fn has_centre(self) -> bool {
        !matches!(self, Self::Asynchronous | Self::Fundamental)
    }
}

impl fmt::Display for MotionKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::MotionKind;

    #[test]
    fn symbols_are_split_into_kind_and_direction() {
        let of = |symbol| MotionKind::split(symbol);
        assert_eq!(of("total-tilt-x-rms"), Some((MotionKind::Total, "tilt-x-rms")));
        assert_eq!(of("residual-synchronous-axial"), Some((MotionKind::ResidualSynchronous, "axial")));
        assert_eq!([of("total-run-out"), of("RONt")], [None, None]);
    }
}
