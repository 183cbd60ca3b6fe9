//! What a check of a file or of a structure found.

/// The severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Worth knowing, but pictures are right.
    Warning,
    /// Pictures may be wrong, or nothing can be read.
    Error,
}

/// A violated invariant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// The name of this kind of finding, the same in every release: `sphere`, `cone`, `size`,
    /// `order`, …
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// The place: a block and a node, a page, or the header.
    pub place: String,
    /// What was found and what was expected.
    pub message: String,
}

impl Finding {
    /// Creates a finding of severity [`Severity::Error`].
    pub fn error(code: &'static str, place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { code, severity: Severity::Error, place: place.into(), message: message.into() }
    }

    /// Returns the finding as JSON: `code`, `severity`, `where` and `message`.
    pub fn to_json(&self) -> serde_json::Value {
        serde_json::json!({
            "code": self.code,
            "severity": self.severity.name(),
            "where": self.place,
            "message": self.message,
        })
    }
}

impl Severity {
    /// Returns `warning` or `error`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Findings, with at most `MOST` of each kind; the rest are counted.
#[derive(Debug, Default)]
pub struct Findings {
    list: Vec<Finding>,
    left_out: Vec<(&'static str, usize)>,
}

/// The maximum number of findings of one kind that are listed.
const MOST: usize = 16;

impl Findings {
    pub fn push(&mut self, finding: Finding) {
        let code = finding.code;
        if self.list.iter().filter(|other| other.code == code).count() < MOST {
            self.list.push(finding);
        } else if let Some((_, count)) = self.left_out.iter_mut().find(|(other, _)| *other == code)
        {
            *count += 1;
        } else {
            self.left_out.push((code, 1));
        }
    }

    pub fn finish(mut self) -> Vec<Finding> {
        let more = self.left_out.iter();
        let more = more.map(|(code, count)| {
            Finding::error(code, "further places", format!("{count} more of these"))
        });
        self.list.extend(more.collect::<Vec<_>>());
        self.list
    }
}

/// The result of a check of a file.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Empty for a sound file.
    pub findings: Vec<Finding>,
}

impl Report {
    /// Returns whether the check found nothing.
    pub fn is_sound(&self) -> bool {
        self.findings.is_empty()
    }
}
