//! JSON Schemas of the files that people and their programs write, with the limits that the readers enforce.

use super::door::schema_of;
use super::manifest::Manifest;
use super::scene;
use catoptric_model::{Calibration, Characterization, Session};
use catoptric_sim::Truth;
use serde_json::Value as Json;

catoptric_model::closed_set! {
    /// A kind of file that has a schema.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum FileKind {
        /// A scene, in which numbers may be expressions.
        Scene,
        /// `session.toml` of a dataset.
        Session,
        /// `truth.json` of a dataset.
        Truth,
        /// `calibration.json`.
        Calibration,
        /// `characterization.json`.
        Characterization,
        /// `manifest.json` of a dataset.
        Manifest,
    }
}

impl FileKind {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Session => "session",
            Self::Truth => "truth",
            Self::Calibration => "calibration",
            Self::Characterization => "characterization",
            Self::Manifest => "manifest",
        }
    }

    /// A one-line description.
    pub fn about(self) -> &'static str {
        match self {
            Self::Scene => "A scene, for editors: numbers may be expressions",
            Self::Session => "What the experimenter knows: session.toml of a dataset",
            Self::Truth => "What was simulated: truth/truth.json of a dataset",
            Self::Calibration => "The result for every beam: calibration.json, ours or third-party",
            Self::Characterization => "The bare sensor's errors: characterization.json",
            Self::Manifest => "Provenance and hashes of a dataset: manifest.json",
        }
    }

    /// Its JSON Schema.
    ///
    /// ```
    /// use catoptric_files::schema::FileKind;
    /// let session = FileKind::Session.json_schema();
    /// assert_eq!(session["properties"]["schema_version"]["maximum"], 2);
    /// ```
    pub fn json_schema(self) -> Json {
        match self {
            Self::Scene => scene::file_schema(),
            Self::Session => schema_of::<Session>(),
            Self::Truth => schema_of::<Truth>(),
            Self::Calibration => schema_of::<Calibration>(),
            Self::Characterization => schema_of::<Characterization>(),
            Self::Manifest => schema_of::<Manifest>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Paths of numbers without a limit on either side; a seed is any whole number of 64 bits.
    fn without_limits(node: &Json, path: &str, found: &mut Vec<String>) {
        let is = |name: &str| match &node["type"] {
            Json::String(only) => only == name,
            Json::Array(all) => all.iter().any(|t| t == name),
            _ => false,
        };
        let limited = node["minimum"].is_number() && node["maximum"].is_number();
        if (is("number") || is("integer")) && !limited && node["format"] != "uint64" {
            found.push(path.to_owned());
        }
        let children: Vec<(String, &Json)> = match node {
            Json::Object(map) => map.iter().map(|(k, v)| (k.clone(), v)).collect(),
            Json::Array(all) => all.iter().enumerate().map(|(i, v)| (i.to_string(), v)).collect(),
            _ => Vec::new(),
        };
        for (key, child) in children {
            without_limits(child, &format!("{path}/{key}"), found);
        }
    }

    /// A number without limits would be a number that nothing checks.
    #[test]
    fn every_number_of_every_file_has_limits() {
        for kind in FileKind::ALL {
            let (schema, mut found) = (kind.json_schema(), Vec::new());
            without_limits(&schema, "", &mut found);
            assert_eq!(found, Vec::<String>::new(), "{}", kind.name());
            assert!(
                schema["properties"].as_object().is_some_and(|p| p.len() > 3),
                "{}",
                kind.name()
            );
            assert_eq!(schema["additionalProperties"], false, "{}", kind.name());
        }
    }
}
