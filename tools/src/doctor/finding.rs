//! A finding is one sentence about one subject of a recording, and says how it is meant.

/// Says how a finding is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The subject is as it should be.
    Good,
    /// The finding is worth knowing.
    Note,
    /// The subject must be cured before results are trusted.
    Bad,
}

impl Verdict {
    /// Returns the word that users see.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Note => "note",
            Self::Bad => "cure",
        }
    }
}

/// Holds one finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The subject.
    pub what: &'static str,
    /// Says how it is meant.
    pub verdict: Verdict,
    /// One sentence with its numbers.
    pub text: String,
}

impl Finding {
    pub(super) fn good(what: &'static str, text: impl Into<String>) -> Self {
        Self { what, verdict: Verdict::Good, text: text.into() }
    }

    pub(super) fn note(what: &'static str, text: impl Into<String>) -> Self {
        Self { what, verdict: Verdict::Note, text: text.into() }
    }

    pub(super) fn bad(what: &'static str, text: impl Into<String>) -> Self {
        Self { what, verdict: Verdict::Bad, text: text.into() }
    }
}
