//! What makes a scene cheaper, in words.

/// What makes a scene cheaper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Advice {
    /// Most is for pixels.
    Pixels,
    /// Most is for the waves of ships that turn.
    Turn,
    /// Most is for looks through an impulse response.
    Looks,
    /// Most is for the table of σ⁰.
    Tolerance,
}

impl Advice {
    /// What to change, beginning with a verb.
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Pixels => {
                "lower grid.rows, grid.columns, grid.oversampling or radar.range_to_velocity, or raise grid.spacing"
            }
            Self::Turn => {
                "set ship.turn_rate to 0 or farther from it, for most is for the waves of a wide turn, or raise grid.spacing"
            }
            Self::Looks => "lower radar.looks or grid.oversampling",
            Self::Tolerance => "raise model.tolerance",
        }
    }
}
