//! The tracked bodies of a session, and the names of their markers in motion capture.

use super::error::IoError;
use catoptric_model::Session;
use catoptric_model::dataset::RIG_SUBJECT;
use std::collections::BTreeMap;
use std::path::Path;

/// Last part of the topic `/mocap/markers`; not allowed as the name of a body.
pub(super) const MARKERS_TOPIC: &str = "markers";

/// A tracked body.
#[derive(Debug, Clone)]
pub(super) struct Body {
    /// Name, which is the motion-capture subject.
    pub(super) subject: String,
    /// Labels "subject/marker", in the order of its template.
    pub(super) labels: Vec<String>,
}

/// The rig and the boards, in the order of the session.
#[derive(Debug, Clone, Default)]
pub(super) struct Bodies {
    /// The rig first.
    pub(super) all: Vec<Body>,
    by_label: BTreeMap<String, (usize, usize)>,
}

impl Bodies {
    /// The bodies of a session.
    ///
    /// `path` names the file in errors. Names that are duplicate, empty, contain a slash or equal a topic's are
    /// rejected, because a recording could not tell them apart.
    pub(super) fn of(session: &Session, path: &Path) -> Result<Self, IoError> {
        let boards = session.boards.iter().map(|b| (b.name.as_str(), &b.markers));
        let named = std::iter::once((RIG_SUBJECT, &session.rig_markers)).chain(boards);
        let mut bodies = Self {
            all: Vec::new(),
            by_label: BTreeMap::new(),
        };
        for (subject, markers) in named {
            if subject.is_empty() || subject.contains('/') || subject == MARKERS_TOPIC {
                return Err(IoError::content(
                    path,
                    format!("{subject:?} cannot name a board: it becomes the topic /mocap/NAME"),
                ));
            }
            if bodies.position(subject).is_some() {
                return Err(IoError::content(
                    path,
                    format!("two bodies are named {subject:?}"),
                ));
            }
            let body = bodies.all.len();
            let labels: Vec<_> = markers.iter().map(|m| format!("{subject}/{}", m.name)).collect();
            for (i, label) in labels.iter().enumerate() {
                if bodies.by_label.insert(label.clone(), (body, i)).is_some() {
                    return Err(IoError::content(path, format!("two markers are named {label:?}")));
                }
            }
            bodies.all.push(Body {
                subject: subject.to_owned(),
                labels,
            });
        }
        Ok(bodies)
    }

    /// Index of a subject in the list.
    pub(super) fn position(&self, subject: &str) -> Option<usize> {
        self.all.iter().position(|b| b.subject == subject)
    }

    /// Body of a label, and index in the body's template.
    pub(super) fn find(&self, label: &str) -> Option<(usize, usize)> {
        self.by_label.get(label).copied()
    }
}
