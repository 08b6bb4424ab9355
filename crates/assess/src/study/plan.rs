//! The plan of a study, written to its folder: what was requested, by which folders are recognized as parts of one study.

use super::names::{PLAN as FILE, remove_study};
use super::{Cell, Contestant, Part, Program, SCHEMA_VERSION, Study, StudyError};
use catoptric_files::folder::clear_leftovers;
use catoptric_files::scene::{self, Template};
use catoptric_files::{IoError, Output, file, read_json, write_json};
use catoptric_model::Stop;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A study and a part of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    schema_version: u32,
    version: String,
    /// Name of the scene.
    pub name: String,
    /// The values of every cell and the SHA-256 of its scene.
    cells: Vec<PlannedCell>,
    seeds: u64,
    contestants: Vec<String>,
    /// The contestants that are programs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    programs: Vec<Program>,
    /// The part that the folder contains.
    pub shard: Part,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlannedCell {
    values: Vec<(String, String)>,
    scene_sha256: String,
}

impl Plan {
    /// Creates the plan of a part of a study.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] if a scene has no TOML form.
    pub fn of(study: &Study, shard: Part) -> Result<Self, StudyError> {
        let cells = study.cells.iter().map(|cell| {
            let text = scene::to_toml(&cell.scene).map_err(|e| {
                StudyError::invalid(format!("the scene cannot be written: {e}"), "see `schema`")
            })?;
            Ok(PlannedCell {
                values: cell.values.clone(),
                scene_sha256: file::sha256(text.as_bytes()),
            })
        });
        let program = |contestant: &Contestant| match contestant {
            Contestant::Program(program) => Some(program.clone()),
            _ => None,
        };
        Ok(Self {
            schema_version: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            name: study
                .cells
                .first()
                .map_or(String::new(), |c| c.scene.name.clone()),
            cells: cells.collect::<Result<_, StudyError>>()?,
            seeds: study.seeds,
            contestants: study.contestants.iter().map(Contestant::name).collect(),
            programs: study.contestants.iter().filter_map(program).collect(),
            shard,
        })
    }

    /// Reads the plan of a folder.
    ///
    /// # Errors
    /// [`StudyError::File`] if it is missing or not a plan.
    pub fn read(folder: &Path) -> Result<Self, StudyError> {
        Ok(read_json(folder.join(FILE))?)
    }

    /// Claims a folder that is new, or belongs to the same part of the same study; on request also one of another study,
    /// which is removed.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] if the folder contains something else, [`StudyError::File`] if writing fails.
    pub fn claim(&self, place: &Output) -> Result<(), StudyError> {
        let out = place.path();
        clear_leftovers(out);
        if out.join(FILE).exists() {
            let there = Self::read(out);
            if matches!(&there, Ok(there) if there == self) {
                return Ok(());
            }
            if !place.replaces() {
                let what = there?.difference(self);
                return Err(StudyError::invalid(
                    format!("{} contains another study: {what}", out.display()),
                    "choose another --out, give the same arguments to resume it, or --replace to begin anew",
                ));
            }
            remove_study(out)?;
        } else if out.read_dir().is_ok_and(|mut entries| entries.next().is_some()) {
            return Err(StudyError::invalid(
                format!("{} is not empty and contains no study", out.display()),
                "choose another --out",
            ));
        }
        if out.exists() && !out.is_dir() {
            return Err(StudyError::invalid(
                format!("{} is a file, and a study is a folder", out.display()),
                "choose another --out",
            ));
        }
        std::fs::create_dir_all(out).map_err(|e| IoError::write(out, e))?;
        Ok(write_json(out.join(FILE), self)?)
    }

    /// Describes how this plan differs from another one.
    pub fn difference(&self, wanted: &Self) -> String {
        if self.version != wanted.version {
            format!(
                "it was started by version {}, this is {}",
                self.version, wanted.version
            )
        } else if self.seeds != wanted.seeds {
            format!("{} seeds, {} requested", self.seeds, wanted.seeds)
        } else if self.contestants != wanted.contestants {
            let names = |plan: &Self| plan.contestants.join(",");
            format!("methods {}, {} requested", names(self), names(wanted))
        } else if self.programs != wanted.programs {
            "a program's command or time limit differs".to_owned()
        } else if self.shard != wanted.shard {
            format!("shard {}, {} requested", self.shard, wanted.shard)
        } else if self.cells.len() == wanted.cells.len()
            && self
                .cells
                .iter()
                .zip(&wanted.cells)
                .all(|(a, b)| a.values == b.values)
        {
            "its scene differs".to_owned()
        } else {
            "its axes differ".to_owned()
        }
    }

    /// Reconstructs the study with its names and values, but not its scenes, which merging does not need.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] if a contestant is unknown.
    pub fn study(&self) -> Result<Study, StudyError> {
        let scene = scene::parse(Template::Prototype.text(), "prototype.toml", &[])?;
        let contestant = |name: &String| {
            if let Some(program) = self.programs.iter().find(|p| p.name == *name) {
                return Ok(Contestant::Program(program.clone()));
            }
            if name == "oracle" {
                return Ok(Contestant::Oracle);
            }
            match (name.parse(), name.strip_suffix(" uncorrected").map(str::parse)) {
                (Ok(method), _) => Ok(Contestant::Method(method)),
                (_, Some(Ok(method))) => Ok(Contestant::Uncorrected(method)),
                _ => Err(StudyError::invalid(
                    format!("{FILE}: {name:?} is neither one of our methods nor a program of the plan"),
                    "a plan is written by `catoptric study`; run the study again",
                )),
            }
        };
        Ok(Study {
            cells: self
                .cells
                .iter()
                .map(|c| Cell {
                    values: c.values.clone(),
                    scene: scene.clone(),
                })
                .collect(),
            seeds: self.seeds,
            contestants: self
                .contestants
                .iter()
                .map(contestant)
                .collect::<Result<_, _>>()?,
            stop: Stop::default(),
        })
    }
}
