//! The topics of a recording that are read.

use super::bodies::{Bodies, MARKERS_TOPIC};
use super::definitions::{self, Definition};

/// The content of a channel, in the order in which messages of equal times are taken.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Topic {
    Label(Text),
    Scan,
    Echoes,
    Pose(usize),
    Markers,
    Other,
}

/// How the text of a label is encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Text {
    /// As a `std_msgs/String`.
    Message,
    /// As it is, without a schema.
    Bare,
}

/// Topic of the labels.
pub(super) const LABEL_TOPIC: &str = "/session/pose";

impl Topic {
    /// What a channel holds, by its topic and its schema; `Topic::Other` if nothing that is read.
    pub(super) fn of(topic: &str, schema: &str, encoding: &str, bodies: &Bodies) -> Result<Self, String> {
        let expect = |definition: Definition, found: Topic| {
            if schema == definition.name && encoding == "cdr" {
                return Ok(found);
            }
            Err(format!(
                "{topic} holds {schema} as {encoding:?}, {} as \"cdr\" is needed",
                definition.name
            ))
        };
        match topic {
            "/scan" => expect(definitions::LASER_SCAN, Topic::Scan),
            "/echoes" => expect(definitions::MULTI_ECHO_SCAN, Topic::Echoes),
            LABEL_TOPIC if encoding == "json" => Ok(Topic::Label(Text::Bare)),
            LABEL_TOPIC => expect(definitions::STRING, Topic::Label(Text::Message)),
            _ => match topic.strip_prefix("/mocap/") {
                Some(MARKERS_TOPIC) => expect(definitions::MARKERS, Topic::Markers),
                Some(subject) => match bodies.position(subject) {
                    Some(body) => expect(definitions::POSE_STAMPED, Topic::Pose(body)),
                    None => Ok(Topic::Other),
                },
                None => Ok(Topic::Other),
            },
        }
    }
}
