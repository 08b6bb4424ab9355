//! A problem and where in the file it is.

use std::fmt;

/// How grave a problem is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Odd, but it can be scored and applied.
    Warning,
    /// The file does not say what it has to, or says what cannot be.
    Error,
}

/// Something wrong with a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// How grave it is.
    pub severity: Severity,
    /// Key in the file, such as `beams[3].azimuth_rad`.
    pub key: String,
    /// Beam it is about.
    pub beam: Option<usize>,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{severity}: {}", self.key)?;
        if let Some(beam) = self.beam {
            write!(f, " (beam {beam})")?;
        }
        write!(f, ": {}", self.message)
    }
}

/// A list in the making.
#[derive(Default)]
pub(super) struct Problems {
    pub(super) list: Vec<Problem>,
}

impl Problems {
    pub(super) fn error(&mut self, key: &str, message: String) {
        self.list.push(Problem {
            severity: Severity::Error,
            key: key.to_owned(),
            beam: None,
            message,
        });
    }

    pub(super) fn of_beam(&mut self, place: usize, beam: usize) -> OfBeam<'_> {
        OfBeam {
            list: &mut self.list,
            place,
            beam,
        }
    }
}

/// The list, for problems of one element.
pub(super) struct OfBeam<'a> {
    list: &'a mut Vec<Problem>,
    place: usize,
    beam: usize,
}

impl OfBeam<'_> {
    pub(super) fn error(&mut self, key: &str, message: String) {
        self.push(Severity::Error, key, message);
    }

    pub(super) fn warning(&mut self, key: &str, message: String) {
        self.push(Severity::Warning, key, message);
    }

    fn push(&mut self, severity: Severity, key: &str, message: String) {
        self.list.push(Problem {
            severity,
            key: format!("beams[{}].{key}", self.place),
            beam: Some(self.beam),
            message,
        });
    }
}
