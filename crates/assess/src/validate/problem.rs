//! A problem of a calibration file, with its severity and location.

use std::fmt;

/// Severity of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Unusual, but the calibration can be scored and applied.
    Warning,
    /// A required value is missing or impossible.
    Error,
}

/// A problem of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Severity.
    pub severity: Severity,
    /// Key in the file, such as `beams[3].azimuth_rad`.
    pub key: String,
    /// Beam concerned, if any.
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

/// Collects problems.
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

/// Collects the problems of one element.
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
