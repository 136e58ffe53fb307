//! Kinds of painted wakes.

/// Line along the axis of a painted wake. All kinds but [`Kind::Arms`] may also have Kelvin arms; beside a bright axis, arms are fainter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A dark line with a bright streak at one side.
    DarkBesideBright,
    /// A dark line alone.
    Dark,
    /// A bright line alone.
    Bright,
    /// A bright line with a fainter dark streak at one side.
    BrightBesideDark,
    /// No line, but two bright arms.
    Arms,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 5] = [
        Self::DarkBesideBright,
        Self::Dark,
        Self::Bright,
        Self::BrightBesideDark,
        Self::Arms,
    ];
    /// Share of each kind among painted wakes, in the order of [`Kind::ALL`].
    pub(super) const SHARES: [f32; 5] = [0.36, 0.2, 0.2, 0.14, 0.1];

    /// Its name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::DarkBesideBright => "dark line with bright side",
            Self::Dark => "dark line",
            Self::Bright => "bright line",
            Self::BrightBesideDark => "bright line with dark side",
            Self::Arms => "two arms",
        }
    }
}
