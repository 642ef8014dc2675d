//! A finding is one sentence about one subject of a recording, with a verdict.

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Good,
    /// The finding is information; it may limit the use of the recording.
    Note,
    /// The defect must be fixed before results are trusted.
    Bad,
}

impl Verdict {
    pub fn word(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Note => "note",
            Self::Bad => "fix",
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    pub what: &'static str,
    pub verdict: Verdict,
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
