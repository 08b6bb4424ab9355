//! `catoptric simulate`: from a scene to a dataset.

use super::Context;
use super::error::CliError;
use super::interrupt;
use super::output::{counted, print, quoted};
use super::progress::Progress;
use super::stream::{Made, Stream, Table};
use super::sub_rays;
use super::truth_tables::{READINGS_HEADER, RETURNS_HEADER};
use catoptric::files::folder::StagedFile;
use catoptric::files::{self, DatasetWriter, IoError, Provenance, dataset, scene};
use catoptric::model::beam;
use catoptric::sim::{Laboratory, Scene, noise};
use clap::Args;
use serde::Serialize;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The scene, TOML or JSON.
    scene: PathBuf,
    /// The folder to write.
    #[arg(long, value_name = "DATASET")]
    out: PathBuf,
    /// Seed of every random draw, instead of the scene's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Change a value first: experiment.scans_per_pose=20, superstructure.facet.0.name=left.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print figures of the run as JSON.
    #[arg(long)]
    json: bool,
    /// Replace a dataset that is there already.
    #[arg(long)]
    replace: bool,
    /// Write no truth/, so that the dataset is blind; a second run without this, of the same scene and seed, has it.
    #[arg(long, conflicts_with_all = ["returns", "readings", "sub_rays"])]
    blind: bool,
    /// Write also what every beam met, truth/returns.csv.
    #[arg(long)]
    returns: bool,
    /// Write also every error of every reading, truth/readings.csv; large.
    #[arg(long)]
    readings: bool,
    /// Write also the way of every sub-ray, truth/sub_rays.csv; large.
    #[arg(long)]
    sub_rays: bool,
}

/// Figures of a run: what `simulate --json` prints.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Figures {
    pub(crate) scans: usize,
    pub(crate) beams: usize,
    pub(crate) sub_rays: usize,
    /// Straight pieces of sub-rays, counted by the way of each beam's first echo.
    pub(crate) segments: usize,
    pub(crate) build_s: f64,
    /// Summed over threads, as is `sample_s`.
    pub(crate) trace_s: f64,
    pub(crate) sample_s: f64,
    /// Encoding, summed over threads, and writing.
    pub(crate) write_s: f64,
    /// Most readings in memory at a time, on their way from the sensor to the file.
    #[serde(rename = "readings_held")]
    pub(crate) held: usize,
    pub(crate) bytes: u64,
    pub(crate) threads: usize,
}

/// What is to be written, and where.
pub(crate) struct Recording<'a> {
    /// The scene with its final seed.
    pub(crate) scene: &'a Scene,
    /// The command in canonical form, for the manifest.
    pub(crate) command_line: String,
    /// The dataset's folder.
    pub(crate) out: &'a Path,
    /// Whether a dataset there may be replaced.
    pub(crate) replace: bool,
    /// Whether the truth is kept back.
    pub(crate) blind: bool,
    /// Whether the truth about every return is written as well.
    pub(crate) returns: bool,
    /// Whether the truth about every reading is written as well.
    pub(crate) readings: bool,
    /// Whether the truth about every sub-ray is written as well.
    pub(crate) sub_rays: bool,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let mut scene = scene::load(&arguments.scene, &arguments.set)?;
    scene.seed = arguments.seed.unwrap_or(scene.seed);
    let figures = record(
        &Recording {
            scene: &scene,
            command_line: command_line(arguments, scene.seed),
            out: &arguments.out,
            replace: arguments.replace,
            blind: arguments.blind,
            returns: arguments.returns,
            readings: arguments.readings,
            sub_rays: arguments.sub_rays,
        },
        context,
    )?;
    if arguments.json {
        let json = serde_json::to_string(&figures).map_err(|e| CliError::Output(e.into()))?;
        return print(&format!("{json}\n"));
    }
    let out = quoted(&arguments.out);
    let next = if scene.superstructure.facet.is_empty() && !scene.experiment.test.is_empty() {
        format!("catoptric characterize {out} --out characterization.json")
    } else {
        format!("catoptric calibrate {out} --out calibration.json")
    };
    print(&format!(
        "wrote {}: {} of {}, seed {}\nnext: {next}\n",
        arguments.out.display(),
        counted(figures.scans, "scan"),
        counted(figures.beams, "beam"),
        scene.seed,
    ))
}

/// The command without what differs between machines and changes nothing: folders, threads, what is printed.
fn command_line(arguments: &Arguments, seed: u64) -> String {
    let scene = arguments.scene.file_name().unwrap_or(arguments.scene.as_os_str());
    let mut line = format!("catoptric simulate {} --seed {seed}", quoted(scene.as_ref()));
    for set in &arguments.set {
        line.push_str(&format!(" --set {}", quoted(set.as_ref())));
    }
    if arguments.blind {
        line.push_str(" --blind");
    }
    if arguments.returns {
        line.push_str(" --returns");
    }
    if arguments.readings {
        line.push_str(" --readings");
    }
    if arguments.sub_rays {
        line.push_str(" --sub-rays");
    }
    line
}

/// Simulates an experiment and writes its dataset: excerpts are made in parallel and written in order.
pub(crate) fn record(recording: &Recording<'_>, context: &Context) -> Result<Figures, CliError> {
    let begin = Instant::now();
    let laboratory = Laboratory::new(recording.scene, recording.scene.seed)?;
    let (session, truth) = (laboratory.session()?, laboratory.truth()?);
    let mut figures = Figures {
        scans: laboratory.scans(),
        beams: beam::COUNT,
        sub_rays: laboratory.sub_rays(),
        build_s: begin.elapsed().as_secs_f64(),
        threads: rayon::current_num_threads(),
        ..Figures::default()
    };
    let mut write_time = Duration::ZERO;
    let mut writer = DatasetWriter::create(recording.out, recording.replace, &session)?;
    if !recording.blind {
        let (kept, meshes) = scene::kept(recording.scene);
        for (name, bytes) in &meshes {
            writer.write_beside_scene(name, bytes)?;
        }
        let resolved = scene::to_toml(&kept)
            .map_err(|e| IoError::content(recording.out.join(dataset::SCENE), e.to_string()))?;
        writer.write_scene(&resolved)?;
        writer.write_truth(&truth)?;
    }
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
            let path = recording.out.join(name);
            file.write_all(header.as_bytes())
                .map_err(|e| IoError::write(&path, e))?;
            tables.push((file, path, kind));
        }
    }
    let wanted: Vec<Table> = tables.iter().map(|(_, _, kind)| *kind).collect();
    let encoder = writer.encoder();
    let mut stream = Stream::new(&laboratory, &encoder, wanted);
    let mut progress = Progress::new(context, "simulating", figures.scans);
    let mut made: Vec<Made<'_>> = Vec::new();
    loop {
        interrupt::check()?;
        // What was made is written while the next is made.
        let (written, next) = rayon::join(
            || write(&mut writer, &mut tables, &laboratory, made),
            || stream.next(figures.threads),
        );
        let (scans, time) = written?;
        write_time += time;
        progress.advance(scans);
        made = next?;
        // Those just written were there while these were made.
        let made_now: usize = made.iter().map(|m| m.scans.len()).sum();
        figures.held = figures.held.max((scans + made_now) * beam::COUNT);
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
    drop(progress);
    interrupt::check()?;
    let finish = Instant::now();
    for (file, _, _) in tables {
        file.finish()?;
    }
    let manifest = writer.finish(Provenance {
        seed: recording.scene.seed,
        command_line: recording.command_line.clone(),
        rng_rule: noise::RULE.to_owned(),
    })?;
    figures.write_s = (write_time + finish.elapsed()).as_secs_f64();
    let names = manifest.files.keys().map(String::as_str);
    for name in names.chain([dataset::MANIFEST]) {
        let path = recording.out.join(name);
        let file = std::fs::metadata(&path).map_err(|e| files::IoError::read(&path, e))?;
        figures.bytes += file.len();
    }
    context.detail(&format!(
        "built in {:.2} s, traced in {:.2} s, sampled in {:.2} s, written in {:.2} s",
        figures.build_s, figures.trace_s, figures.sample_s, figures.write_s
    ));
    Ok(figures)
}

/// A table of the truth that is written row by row: the file, its name in errors, and what it lists.
type TableFile = (StagedFile, PathBuf, Table);

/// Writes what was made, in order; how many scans these were, and how long it took.
fn write(
    writer: &mut DatasetWriter,
    tables: &mut [TableFile],
    laboratory: &Laboratory,
    made: Vec<Made<'_>>,
) -> Result<(usize, Duration), CliError> {
    let begin = Instant::now();
    let scans = made.iter().map(|m| m.scans.len()).sum();
    for m in &made {
        let mut texts = m.texts.iter();
        for (file, path, kind) in &mut *tables {
            let mut tell = |text: &str| {
                let written = file.write_all(text.as_bytes());
                written.map_err(|e| IoError::write(path.as_path(), e).into())
            };
            match kind {
                // Too large to be kept: made where it is written.
                Table::SubRays => {
                    sub_rays::rows(laboratory, m.number, m.scans.clone(), m.sight(), &mut tell)?
                }
                _ => texts.next().map_or(Ok(()), |text| tell(text))?,
            }
        }
    }
    writer.append(made.into_iter().map(|m| m.encoded).collect())?;
    Ok((scans, begin.elapsed()))
}
