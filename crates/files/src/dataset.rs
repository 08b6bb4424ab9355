//! Dataset folders: the session, the recording, and, separately, the truth.
//!
//! ```text
//! manifest.json         provenance, SHA-256 of every file
//! session.toml          the experimenter's knowledge
//! observations.mcap     the recording
//! truth/                scene.toml, truth.json, returns.csv, readings.csv, sub_rays.csv: delete it and the dataset is
//!                       blind
//! ```
//!
//! Reading never opens `truth/`.

use super::blocks::Place;
use super::door;
use super::error::IoError;
use super::file::{sha256, sha256_file};
use super::folder::{Occupant, StagedFile, StagedFolder, list};
use super::json::to_json;
use super::manifest::{Manifest, Provenance};
use super::paths::unread;
use super::playback::read_recording;
use super::reading::{Damage, Records, records};
use super::recording::{Encoded, RecordingEncoder, RecordingWriter};
use super::waiting;
use catoptric_model::{Dataset, Session, Stop, Stretch, session};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Name of the manifest in a dataset.
pub const MANIFEST: &str = "manifest.json";
/// Name of the session file.
pub const SESSION: &str = "session.toml";
/// Name of the recording.
pub const OBSERVATIONS: &str = "observations.mcap";
/// Name of the resolved scene.
pub const SCENE: &str = "truth/scene.toml";
/// Name of the truth about every beam.
pub const TRUTH: &str = "truth/truth.json";
/// Name of the truth about the returns of every beam.
pub const RETURNS: &str = "truth/returns.csv";
/// Name of the truth about every reading.
pub const READINGS: &str = "truth/readings.csv";
/// Name of the truth about every sub-ray.
pub const SUB_RAYS: &str = "truth/sub_rays.csv";

/// A dataset being written. [`finish`](Self::finish) publishes it as a whole; if dropped before, it never appears.
pub struct DatasetWriter {
    // The recording is dropped before the folder that contains it.
    recording: RecordingWriter<StagedFile>,
    folder: StagedFolder,
}

impl DatasetWriter {
    /// Begins a dataset that will appear at `out`, and writes the session.
    ///
    /// Missing parent folders are created. An existing empty folder is replaced; an existing dataset only with
    /// `replace` and if nothing was added to it, and it remains until the new one is complete.
    ///
    /// # Errors
    /// [`IoError::Exists`] or [`IoError::Foreign`] if `out` cannot be replaced, [`IoError::Content`] if the names
    /// in the session cannot be topics, otherwise the error in writing.
    pub fn create(out: &Path, replace: bool, session: &Session) -> Result<Self, IoError> {
        let folder = StagedFolder::create(out, occupant(out, replace)?)?;
        let shown = folder.shown(SESSION);
        let text = toml::to_string(session).map_err(|e| IoError::content(shown, e.to_string()))?;
        folder.write(SESSION, text.as_bytes())?;
        let observations = folder.open(OBSERVATIONS)?;
        let recording = RecordingWriter::create(observations, &folder.shown(OBSERVATIONS), session)?;
        Ok(Self { recording, folder })
    }

    /// Appends a stretch to the observations.
    ///
    /// # Errors
    /// [`IoError`] as [`RecordingWriter::write_stretch`].
    pub fn write_stretch(&mut self, stretch: &Stretch) -> Result<(), IoError> {
        self.recording.write_stretch(stretch)
    }

    /// The encoder of stretches into messages for [`append`](Self::append); usable on any thread.
    pub fn encoder(&self) -> Arc<RecordingEncoder> {
        self.recording.encoder()
    }

    /// Appends encoded messages, in order.
    ///
    /// # Errors
    /// [`IoError`] as [`RecordingWriter::append`].
    pub fn append(&mut self, encoded: Vec<Encoded>) -> Result<(), IoError> {
        self.recording.append(encoded)
    }

    /// Writes the resolved scene.
    ///
    /// # Errors
    /// [`IoError`] if writing fails.
    pub fn write_scene(&mut self, toml: &str) -> Result<(), IoError> {
        self.folder.write(SCENE, toml.as_bytes())
    }

    /// Writes a file named by the resolved scene, below its folder.
    ///
    /// # Errors
    /// [`IoError`] if writing fails.
    pub fn write_beside_scene(&mut self, relative: &str, bytes: &[u8]) -> Result<(), IoError> {
        self.folder.write(&format!("truth/{relative}"), bytes)
    }

    /// Writes the truth about every beam.
    ///
    /// # Errors
    /// [`IoError`] if it has no JSON form or writing fails.
    pub fn write_truth(&mut self, truth: &impl Serialize) -> Result<(), IoError> {
        let bytes = to_json(self.folder.shown(TRUTH), truth)?;
        self.folder.write(TRUTH, &bytes)
    }

    /// Opens a file such as [`RETURNS`] for writing row by row; call its `finish` at the end.
    ///
    /// # Errors
    /// [`IoError`] if the file exists already or cannot be created.
    pub fn open_file(&mut self, relative: &str) -> Result<StagedFile, IoError> {
        self.folder.open(relative)
    }

    /// Ends the recording, writes the manifest and moves the dataset to its place.
    ///
    /// # Errors
    /// [`IoError`] if writing fails; then no part of it is left, and an earlier dataset is untouched.
    pub fn finish(self, provenance: Provenance) -> Result<Manifest, IoError> {
        self.publish(provenance, |manifest| manifest)
    }

    /// As [`finish`](Self::finish), for a dataset without its truth: the manifest states that it is blind, and neither the
    /// seed nor the command.
    ///
    /// # Errors
    /// Same as [`finish`](Self::finish).
    pub fn finish_blind(self, provenance: Provenance) -> Result<Manifest, IoError> {
        self.publish(provenance, Manifest::hidden)
    }

    fn publish(
        self,
        provenance: Provenance,
        written: impl FnOnce(Manifest) -> Manifest,
    ) -> Result<Manifest, IoError> {
        let Self { recording, folder } = self;
        recording.finish()?.finish()?;
        let mut files = BTreeMap::new();
        for (name, path) in folder.files()? {
            let hash =
                sha256_file(&path, &Stop::default()).map_err(|e| IoError::read(folder.shown(&name), e))?;
            files.insert(name, hash);
        }
        let manifest = written(Manifest::new(provenance, SCENE, files));
        let bytes = to_json(folder.shown(MANIFEST), &manifest)?;
        folder.write(MANIFEST, &bytes)?;
        folder.publish()?;
        Ok(manifest)
    }
}

/// Checks whether the contents of `out`, if any, may be overwritten.
fn occupant(out: &Path, replace: bool) -> Result<Occupant, IoError> {
    let path = out.to_owned();
    let foreign = |what: &str| IoError::Foreign {
        path: path.clone(),
        what: what.to_owned(),
    };
    match fs::symlink_metadata(out) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Occupant::Nothing),
        Err(e) => return Err(IoError::read(out, e)),
        Ok(there) if there.is_symlink() => return Err(foreign("is a link")),
        Ok(there) if !there.is_dir() => return Err(foreign("is a file, not a folder")),
        Ok(_) => {}
    }
    let mut entries = fs::read_dir(out).map_err(|e| IoError::read(out, e))?;
    if entries.next().is_none() {
        return Ok(Occupant::Nothing);
    }
    let manifest = fs::read(out.join(MANIFEST)).ok();
    let Some(ours) = manifest.and_then(|bytes| serde_json::from_slice::<Manifest>(&bytes).ok()) else {
        return Err(foreign("holds files that are not a dataset of ours"));
    };
    if !replace {
        let what = "holds a dataset".to_owned();
        return Err(IoError::Exists { path, what });
    }
    let files = list(out).map_err(|e| IoError::read(out, e))?;
    if files
        .iter()
        .any(|(name, _)| name != MANIFEST && !ours.files.contains_key(name))
    {
        return Err(foreign(
            "holds a dataset and other files that would be lost with it",
        ));
    }
    Ok(Occupant::Replaceable)
}

/// Reads the session.
///
/// # Errors
/// [`IoError`] with line, column and key if `session.toml` is not a session.
pub fn read_session(dataset: &Path) -> Result<Session, IoError> {
    let hashes = read_hashes(dataset)?;
    parse_session(
        &read_checked(dataset, SESSION, hashes.as_ref())?,
        dataset.join(SESSION),
    )
}

/// Reads the session and the observations, frame by frame; everything is held in memory.
///
/// # Errors
/// [`IoError`] as [`read_dataset`].
pub fn read_stretches(dataset: &Path) -> Result<(Session, Vec<Stretch>), IoError> {
    let (session, stretches, _, _) = read(dataset, Damage::Refused, &Stop::default(), |place, session| {
        read_recording(place.path(), session)
    })?;
    Ok((session, stretches))
}

/// Reads a dataset and checks that its parts are consistent. The truth is not read.
///
/// Individual readings are not held in memory: they are read again from the same file where needed.
///
/// # Errors
/// [`IoError`] names the file that is missing, changed since the manifest was written, invalid, or inconsistent
/// with the others. A third-party dataset without a manifest is accepted unchecked.
pub fn read_dataset(dataset: &Path) -> Result<Dataset, IoError> {
    read_dataset_with(dataset, Damage::Refused, &Stop::default())
}

/// As [`read_dataset`], but damaged stretches can be left out. It can be stopped before it ends, and so can every later pass
/// over its readings.
///
/// # Errors
/// As [`read_dataset`], and [`IoError::Stopped`].
pub fn read_dataset_with(dataset: &Path, damage: Damage, stop: &Stop) -> Result<Dataset, IoError> {
    let (session, mut records, id, changed) = read(dataset, damage, stop, |place, session| {
        records(&place, session, damage, stop)
    })?;
    if changed {
        let words = format!("{OBSERVATIONS} is not the file that {MANIFEST} names");
        records.warnings.insert(0, words);
    }
    assembled(dataset, session, records, id)
}

/// As [`read_dataset`], from the session and the bytes of a recording.
///
/// # Errors
/// [`IoError`] if the recording is invalid or inconsistent with the session.
pub fn parse_dataset(session: Session, recording: impl Into<Arc<[u8]>>) -> Result<Dataset, IoError> {
    let (path, bytes) = (PathBuf::from(OBSERVATIONS), recording.into());
    let id = sha256(&bytes);
    let place = Place::Memory(path.clone(), bytes);
    let records = records(&place, &session, Damage::Refused, &Stop::default())?;
    assembled(&path, session, records, id)
}

/// Reads the session and the requested part of the observations; returns the hash of the recording as well.
fn read<T: Send>(
    dataset: &Path,
    damage: Damage,
    stop: &Stop,
    observations: impl FnOnce(Place, &Session) -> Result<T, IoError> + Send,
) -> Result<(Session, T, String, bool), IoError> {
    let hashes = read_hashes(dataset)?;
    let session = parse_session(
        &read_checked(dataset, SESSION, hashes.as_ref())?,
        dataset.join(SESSION),
    )?;
    let path = dataset.join(OBSERVATIONS);
    let (id, found) = rayon::join(
        || sha256_file(&path, stop),
        || observations(Place::File(path.clone()), &session),
    );
    stop.check()?;
    // For a changed file, the error about the change takes precedence over any other.
    let id = id.map_err(|e| IoError::read(&path, e))?;
    let unchanged = check(dataset, OBSERVATIONS, &id, hashes.as_ref());
    let changed = damage == Damage::LeftOut && matches!(unchanged, Err(IoError::Changed { .. }));
    if !changed {
        unchanged?;
    }
    Ok((session, found?, id, changed))
}

/// A dataset whose parts are consistent.
fn assembled(
    path: &Path,
    session: Session,
    Records { poses, warnings }: Records,
    id: String,
) -> Result<Dataset, IoError> {
    let fail = |source| IoError::Inconsistent {
        path: path.to_owned(),
        source,
    };
    let dataset = Dataset {
        session,
        poses,
        id: Some(id),
        warnings,
    };
    dataset.check().map_err(fail)?;
    if dataset.poses.is_empty() {
        let message = "holds no stretch: none of its topics is one that a dataset has";
        return Err(IoError::content(path, message));
    }
    Ok(dataset)
}

/// The hashes of the manifest, if there is one.
fn read_hashes(dataset: &Path) -> Result<Option<BTreeMap<String, String>>, IoError> {
    Ok(read_manifest(dataset)?.map(|manifest| manifest.files))
}

/// The manifest, if there is one.
pub(super) fn read_manifest(dataset: &Path) -> Result<Option<Manifest>, IoError> {
    // Reported before any missing file: the wrong folder was given.
    if let Err(missing) = fs::metadata(dataset) {
        return Err(IoError::read(dataset, unread(dataset, missing)));
    }
    if !dataset.join(SESSION).is_file() {
        let reason = format!("it is no dataset: there is no {SESSION} in it");
        return Err(IoError::read(
            dataset,
            io::Error::new(io::ErrorKind::NotFound, reason),
        ));
    }
    let path = dataset.join(MANIFEST);
    match waiting::read(&path) {
        Ok(bytes) => {
            let manifest = parse_manifest(&bytes, &path)?;
            Ok(Some(manifest))
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(IoError::read(path, e)),
    }
}

/// Reads a manifest from the bytes of its file; `path` names it in errors.
///
/// # Errors
/// [`IoError::Text`] with line and column if it is invalid, or has an unknown version.
pub fn parse_manifest(bytes: &[u8], path: impl AsRef<Path>) -> Result<Manifest, IoError> {
    door::from_json(bytes, path.as_ref())
}

/// The bytes of a file, which must match the manifest.
pub(super) fn read_checked(
    dataset: &Path,
    name: &str,
    hashes: Option<&BTreeMap<String, String>>,
) -> Result<Vec<u8>, IoError> {
    let path = dataset.join(name);
    let bytes = waiting::read(&path).map_err(|e| IoError::read(&path, e))?;
    // An editor may have changed the ends of lines, which mean nothing.
    let plain = String::from_utf8_lossy(&bytes).replace("\r\n", "\n");
    check(dataset, name, &sha256(plain.as_bytes()), hashes)
        .or_else(|_| check(dataset, name, &sha256(&bytes), hashes))?;
    Ok(bytes)
}

/// Checks the SHA-256 of a file against the manifest.
fn check(
    dataset: &Path,
    name: &str,
    found: &String,
    hashes: Option<&BTreeMap<String, String>>,
) -> Result<(), IoError> {
    match hashes {
        Some(hashes) if hashes.get(name) != Some(found) => Err(IoError::Changed {
            path: dataset.join(name),
            manifest: dataset.join(MANIFEST),
        }),
        _ => Ok(()),
    }
}

/// Reads a session from the bytes of its file; `path` names it in errors.
///
/// # Errors
/// As [`read_session`].
pub fn parse_session(bytes: &[u8], path: impl AsRef<Path>) -> Result<Session, IoError> {
    let session: Session = door::from_toml(bytes, path.as_ref())?;
    // Entries missing in version 1 take their defaults here.
    Ok(Session {
        schema_version: session::SCHEMA_VERSION,
        ..session
    })
}
