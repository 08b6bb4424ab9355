//! Simulation of an experiment directly into a dataset folder: excerpts are simulated in parallel and written in order,
//! in memory that does not grow with their number.

use super::stream::{Made, Stream, Table};
use super::sub_rays;
use super::tables::{READINGS_HEADER, RETURNS_HEADER};
use crate::{Control, Error, Scene};
use catoptric_files::folder::StagedFile;
use catoptric_files::paths::quoted;
use catoptric_files::{DatasetWriter, IoError, Provenance, dataset, scene as scenes};
use catoptric_sim::{Laboratory, noise};
use serde::Serialize;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What to write in addition to the recording, and whether to replace a dataset.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Recording {
    /// Replace an existing dataset.
    pub replace: bool,
    /// Write no truth: the dataset is blind, and its manifest states neither seed nor command.
    pub blind: bool,
    /// Also write what every beam hits, `truth/returns.csv`.
    pub returns: bool,
    /// Also write every error of every reading, `truth/readings.csv`; large.
    pub readings: bool,
    /// Also write the path of every sub-ray, `truth/sub_rays.csv`; large.
    pub sub_rays: bool,
    /// The command that creates this dataset, for its manifest; `None` for the equivalent `catoptric simulate`.
    pub command_line: Option<String>,
}

/// Size and times of a simulation: `simulate --json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Scans recorded.
    pub scans: usize,
    /// Beams of a scan.
    pub beams: usize,
    /// Sub-rays of a beam.
    pub sub_rays: usize,
    /// Legs of all sub-rays, counted by the path of each beam's first echo.
    pub segments: usize,
    /// Time to set up the laboratory, in seconds.
    pub build_s: f64,
    /// Time to trace rays, in seconds, summed over threads.
    pub trace_s: f64,
    /// Time to draw readings, in seconds, summed over threads.
    pub sample_s: f64,
    /// Time to encode, summed over threads, and to write, in seconds.
    pub write_s: f64,
    /// Maximum number of readings in memory at a time, between the sensor and the file.
    #[serde(rename = "readings_held")]
    pub held: usize,
    /// Size of the dataset, in bytes.
    pub bytes: u64,
    /// Number of threads used.
    pub threads: usize,
}

/// Simulates the experiment of a scene and writes it as a dataset.
///
/// The folder appears complete or not at all; an existing dataset is replaced only on request, anything else never.
///
/// ```
/// use catoptric::{Control, Recording, Scene, Template, read_dataset, simulate_into};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let scene = Scene::template(Template::TwoMirror).with(&["experiment.scans_per_pose=2", "scanner.sub_rays=1"])?;
/// let folder = tempfile::tempdir()?;
/// let out = folder.path().join("data");
/// let figures = simulate_into(&scene, &out, &Recording::default(), &Control::default())?;
/// assert_eq!(read_dataset(&out)?.poses.iter().map(|p| p.label.scans).sum::<usize>(), figures.scans);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Setup`] if the scene cannot be set up, [`Error::File`] if writing fails or something else exists there,
/// [`Error::Stopped`]; no incomplete files are left behind.
pub fn simulate_into(
    scene: &Scene,
    out: impl AsRef<Path>,
    recording: &Recording,
    control: &Control,
) -> Result<Figures, Error> {
    let out = out.as_ref();
    control.run(|| record(scene, out, recording, control))
}

fn record(scene: &Scene, out: &Path, recording: &Recording, control: &Control) -> Result<Figures, Error> {
    let command_line = recording
        .command_line
        .clone()
        .unwrap_or_else(|| command_line(scene, recording));
    let scene = scene.resolved();
    let begin = Instant::now();
    let laboratory = Laboratory::new(scene, scene.seed)?;
    let (session, truth) = (laboratory.session()?, laboratory.truth()?);
    let mut figures = Figures {
        scans: laboratory.scans(),
        beams: laboratory.sensor().scan().beams(),
        sub_rays: laboratory.sub_rays(),
        build_s: begin.elapsed().as_secs_f64(),
        threads: rayon::current_num_threads(),
        ..Figures::default()
    };
    let mut write_time = Duration::ZERO;
    let mut writer = DatasetWriter::create(out, recording.replace, &session)?;
    if !recording.blind {
        let (kept, meshes) = scenes::kept(scene);
        for (name, bytes) in &meshes {
            writer.write_beside_scene(name, bytes)?;
        }
        let resolved =
            scenes::to_toml(&kept).map_err(|e| IoError::content(out.join(dataset::SCENE), e.to_string()))?;
        writer.write_scene(&resolved)?;
        writer.write_truth(&truth)?;
    }
    let mut tables = tables(out, recording, &mut writer)?;
    let wanted: Vec<Table> = tables.iter().map(|(_, _, kind)| *kind).collect();
    let encoder = writer.encoder();
    let mut stream = Stream::new(&laboratory, &encoder, wanted, &control.stop);
    control.report("simulating", 0, figures.scans);
    let mut made: Vec<Made<'_>> = Vec::new();
    loop {
        control.check()?;
        // The previous excerpts are written while the next ones are simulated.
        let (written, next) = rayon::join(
            || write(&mut writer, &mut tables, &laboratory, made),
            || stream.next(figures.threads),
        );
        let (scans, time) = written?;
        write_time += time;
        control.report("simulating", scans, figures.scans);
        made = next?;
        // The excerpts just written were in memory while these were simulated.
        let made_now: usize = made.iter().map(|m| m.scans.len()).sum();
        figures.held = figures.held.max((scans + made_now) * figures.beams);
        for m in &made {
            figures.trace_s += m.trace.as_secs_f64();
            figures.sample_s += m.sample.as_secs_f64();
            write_time += m.encode;
            figures.segments += figures.sub_rays * m.segments;
        }
        if made.is_empty() {
            break;
        }
    }
    control.check()?;
    let finish = Instant::now();
    for (file, _, _) in tables {
        file.finish()?;
    }
    let provenance = Provenance {
        seed: scene.seed,
        command_line,
        rng_rule: noise::RULE.to_owned(),
    };
    let manifest = if recording.blind {
        writer.finish_blind(provenance)?
    } else {
        writer.finish(provenance)?
    };
    figures.write_s = (write_time + finish.elapsed()).as_secs_f64();
    let names = manifest.files.keys().map(String::as_str);
    for name in names.chain([dataset::MANIFEST]) {
        let path = out.join(name);
        let file = std::fs::metadata(&path).map_err(|e| IoError::read(&path, e))?;
        figures.bytes += file.len();
    }
    Ok(figures)
}

/// The command line without options that differ between machines and have no effect: folders, threads, printing.
fn command_line(scene: &Scene, recording: &Recording) -> String {
    let file = Path::new(scene.name())
        .file_name()
        .unwrap_or(scene.name().as_ref());
    let seed = scene.resolved().seed;
    let mut line = format!("catoptric simulate {} --seed {seed}", quoted(file.as_ref()));
    for setting in scene.settings() {
        line.push_str(&format!(" --set {}", quoted(setting.as_ref())));
    }
    for (given, flag) in [
        (recording.blind, " --blind"),
        (recording.returns, " --returns"),
        (recording.readings, " --readings"),
        (recording.sub_rays, " --sub-rays"),
    ] {
        if given {
            line.push_str(flag);
        }
    }
    line
}

/// A table of the truth that is written row by row: the file, its path for errors, and its kind.
type TableFile = (StagedFile, PathBuf, Table);

/// Creates the requested tables, with their header lines.
fn tables(out: &Path, recording: &Recording, writer: &mut DatasetWriter) -> Result<Vec<TableFile>, Error> {
    let mut tables = Vec::new();
    for (wanted, name, header, kind) in [
        (
            recording.returns,
            dataset::RETURNS,
            RETURNS_HEADER,
            Table::Returns,
        ),
        (
            recording.readings,
            dataset::READINGS,
            READINGS_HEADER,
            Table::Readings,
        ),
        (
            recording.sub_rays,
            dataset::SUB_RAYS,
            sub_rays::HEADER,
            Table::SubRays,
        ),
    ] {
        if wanted {
            let mut file = writer.open_file(name)?;
            let path = out.join(name);
            file.write_all(header.as_bytes())
                .map_err(|e| IoError::write(&path, e))?;
            tables.push((file, path, kind));
        }
    }
    Ok(tables)
}

/// Writes excerpts in order; returns the number of their scans and the time it took.
fn write(
    writer: &mut DatasetWriter,
    tables: &mut [TableFile],
    laboratory: &Laboratory,
    made: Vec<Made<'_>>,
) -> Result<(usize, Duration), Error> {
    let begin = Instant::now();
    let scans = made.iter().map(|m| m.scans.len()).sum();
    for m in &made {
        let mut texts = m.texts.iter();
        for (file, path, kind) in &mut *tables {
            let mut append = |text: &str| {
                let written = file.write_all(text.as_bytes());
                written.map_err(|e| IoError::write(path.as_path(), e).into())
            };
            match kind {
                // Too large to keep: generated as it is written.
                Table::SubRays => {
                    sub_rays::rows(laboratory, m.number, m.scans.clone(), m.sight(), &mut append)?;
                }
                Table::Returns | Table::Readings => {
                    texts.next().map_or(Ok(()), |text| append(text))?;
                }
            }
        }
    }
    writer.append(made.into_iter().map(|m| m.encoded).collect())?;
    Ok((scans, begin.elapsed()))
}
