//! `catoptric simulate`: from a scene to a dataset.

use super::Context;
use super::error::CliError;
use super::interrupt;
use super::output::{counted, print, quoted};
use super::progress::Progress;
use super::sub_rays;
use super::truth_tables::{READINGS_HEADER, RETURNS_HEADER, Rows, reading_rows, return_rows, sub_ray_rows};
use catoptric::io::{self, DatasetWriter, IoError, Provenance, dataset, scene};
use catoptric::model::{Stretch, beam};
use catoptric::sim::laboratory::{Returns, Sight};
use catoptric::sim::{Laboratory, Scene, SimError, noise};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use std::borrow::Cow;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Stretches in flight for every thread: enough that none waits for the writer, few enough to stay in memory.
const WINDOW_PER_THREAD: usize = 2;

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
    pub(crate) write_s: f64,
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

/// Simulates an experiment and writes its dataset: stretches are computed in parallel and written in order.
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
    let mut timed = |work: &mut dyn FnMut() -> Result<(), CliError>| {
        let begin = Instant::now();
        let result = work();
        write_time += begin.elapsed();
        result
    };
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
    for (wanted, name, header, rows) in [
        (
            recording.returns,
            dataset::RETURNS,
            RETURNS_HEADER,
            return_rows as Rows,
        ),
        (
            recording.readings,
            dataset::READINGS,
            READINGS_HEADER,
            reading_rows,
        ),
        (
            recording.sub_rays,
            dataset::SUB_RAYS,
            sub_rays::HEADER,
            sub_ray_rows,
        ),
    ] {
        if wanted {
            let mut file = writer.open_file(name)?;
            let path = recording.out.join(name);
            file.write_all(header.as_bytes())
                .map_err(|e| IoError::write(&path, e))?;
            tables.push((file, path, rows));
        }
    }
    let mut progress = Progress::new(context, "simulating", laboratory.stretches());
    let all: Vec<usize> = (0..laboratory.stretches()).collect();
    for window in all.chunks(WINDOW_PER_THREAD * figures.threads) {
        interrupt::check()?;
        let recorded: Vec<Recorded<'_>> = window
            .par_iter()
            .map(|number| Recorded::of(&laboratory, *number))
            .collect::<Result<_, SimError>>()?;
        for (number, recorded) in window.iter().zip(&recorded) {
            figures.trace_s += recorded.trace.as_secs_f64();
            figures.sample_s += recorded.sample.as_secs_f64();
            figures.segments += figures.sub_rays * recorded.segments;
            timed(&mut || {
                writer.write_stretch(&recorded.stretch)?;
                for (file, path, rows) in &mut tables {
                    rows(&laboratory, *number, recorded, &mut |text| {
                        file.write_all(text.as_bytes())
                            .map_err(|e| IoError::write(path.as_path(), e).into())
                    })?;
                }
                Ok(())
            })?;
        }
        progress.advance(window.len());
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
        let file = std::fs::metadata(&path).map_err(|e| io::IoError::read(&path, e))?;
        figures.bytes += file.len();
    }
    context.detail(&format!(
        "built in {:.2} s, traced in {:.2} s, sampled in {:.2} s, written in {:.2} s",
        figures.build_s, figures.trace_s, figures.sample_s, figures.write_s
    ));
    Ok(figures)
}

/// A stretch, what it was made from, and how long that took.
pub(super) struct Recorded<'a> {
    pub(super) sight: Sight<'a>,
    /// What every beam met; of a flight, during its first scan: all of it would not fit into memory.
    pub(super) first: Returns,
    pub(super) stretch: Stretch,
    segments: usize,
    trace: Duration,
    sample: Duration,
}

impl<'a> Recorded<'a> {
    fn of(laboratory: &'a Laboratory, number: usize) -> Result<Self, SimError> {
        let begin = Instant::now();
        let sight = laboratory.sight(number)?;
        let first = sight.returns(0);
        let mut trace = begin.elapsed();
        let mut segments = segments_of(&first);
        let mut recorder = laboratory.recorder(number);
        recorder.add(&first);
        // What is seen once something has moved.
        let mut latest = None;
        for scan in 1..laboratory.scans_of(number) {
            if sight.changes_at(scan) {
                let begin = Instant::now();
                latest = Some(sight.returns(scan));
                trace += begin.elapsed();
                segments += latest.as_ref().map_or(0, segments_of);
            }
            recorder.add(latest.as_ref().unwrap_or(&first));
        }
        Ok(Self {
            sight,
            first,
            stretch: recorder.finish(),
            segments,
            trace,
            sample: begin.elapsed() - trace,
        })
    }

    /// What every beam met during a scan; those of a flight are traced again.
    pub(super) fn returns(&self, scan: usize) -> Cow<'_, Returns> {
        if self.sight.moves() && scan > 0 {
            Cow::Owned(self.sight.returns(scan))
        } else {
            Cow::Borrowed(&self.first)
        }
    }
}

fn segments_of(returns: &Returns) -> usize {
    let pieces = |r: &Option<_>| {
        r.as_ref()
            .map_or(1, |r: &catoptric::sim::reading::Return| r.facets.len() + 1)
    };
    returns.iter().map(pieces).sum()
}
