//! `catoptric demo`: simulates, calibrates, scores and reports on the built-in scene.

use super::calibrate::summary;
use super::context::{Context, Reading};
use super::error::CliError;
use super::judging::conclude;
use super::output::{counted, grouped, print, quoted};
use super::outputs::Replacing;
use super::score::figure;
use catoptric::apply::{CloudSketch, Lift};
use catoptric::calib::Options;
use catoptric::files::{self, Content, Manifest};
use catoptric::report::MAX_POINTS;
use catoptric::{
    CloudFrame, Error, Method, Recording, Scene, Template, apply_into, calibrate_with, read_truth, report,
    score, simulate_into, write_json,
};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The methods shown: the best one, the best that treats each element separately, and the paper's.
const SHOWN: [Method; 3] = [Method::Joint, Method::BeamGls, Method::Beam];

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The folder to write into.
    #[arg(long, value_name = "DIR", default_value = "catoptric-demo")]
    out: PathBuf,
    /// Seed of all random effects, instead of the scene's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    replacing: Replacing,
}

/// Whether a dataset was written by a demo.
fn is_of_demo(dataset: &Path) -> bool {
    let manifest: Option<Manifest> = files::read_json(dataset.join(files::dataset::MANIFEST)).ok();
    manifest
        .and_then(|m| m.command_line)
        .is_some_and(|line| line.starts_with("catoptric demo"))
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let begin = Instant::now();
    let folder = &arguments.out;
    if folder.join(files::dataset::SESSION).exists() {
        let message = format!(
            "{} is a dataset; the demo creates its dataset inside the folder it is given",
            folder.display()
        );
        return Err(CliError::invalid(message, "choose another --out".to_owned()));
    }
    let mut scene = Scene::template(Template::Prototype);
    if let Some(seed) = arguments.seed {
        scene = scene.with_seed(seed);
    }
    let dataset_folder = folder.join("dataset");
    let outputs = arguments.replacing.outputs(&[] as &[PathBuf]);
    let place = |name: String, content| {
        let out = outputs.place(&folder.join(name))?;
        out.admit(content)?;
        Ok::<_, CliError>(out)
    };
    let mut places = Vec::new();
    for method in SHOWN {
        let name = method.name();
        let calibration = place(format!("calibration-{name}.json"), &Content::Calibration)?;
        places.push((
            method,
            calibration,
            place(format!("score-{name}.json"), &Content::Score)?,
        ));
    }
    let cloud_place = place("cloud.ply".to_owned(), &Content::PlyCloud)?;
    let report_place = place("report.html".to_owned(), &Content::Page)?;
    let recording = Recording {
        // A second demo creates the same dataset as the first.
        replace: arguments.replacing.replace || is_of_demo(&dataset_folder),
        command_line: Some(format!("catoptric demo --seed {}", scene.resolved().seed)),
        ..Recording::default()
    };
    let control = context.control();
    let figures = simulate_into(&scene, &dataset_folder, &recording, &control)?;

    context.say("reading the dataset back");
    let dataset = context.read_dataset(&dataset_folder, Reading::default())?;
    let truth = read_truth(&dataset_folder)?;
    let mut results = Vec::new();
    let mut lines = Vec::new();
    for (method, to_calibration, to_score) in places {
        context.check()?;
        let name = method.name();
        context.say(&format!("calibrating: {name}"));
        let calibration = calibrate_with(&dataset, method, &Options::default(), &control)?;
        write_json(to_calibration, &calibration)?;
        let result = score(&dataset, &calibration, truth.as_ref()).map_err(Error::from)?;
        write_json(to_score, &result)?;
        lines.push(format!(
            "{name:8}  {}; per-axis error {} rms",
            summary(&calibration),
            figure(result.per_axis_rms_deg, 4, "°")
        ));
        results.push((calibration, result));
    }
    context.check()?;
    context.say("writing cloud and report");
    let cloud_path = cloud_place.path().to_owned();
    let cloud = apply_into(&dataset, &results[0].0, None, CloudFrame::Room, cloud_place)?;
    let lift = Lift::new(&dataset, &results[0].0, None, CloudFrame::Room).map_err(Error::from)?;
    let sketch = CloudSketch::of(&lift, MAX_POINTS).map_err(Error::from)?;
    let report_path = report_place.path().to_owned();
    let html = report(&dataset, truth.as_ref(), &results, Some(&sketch));
    files::write_file(report_place, html.as_bytes())?;

    let (scene, score) = (scene.resolved(), &results[0].1);
    let verdict = score.verdict.word();
    let calibrated = lines.join("\n            ");
    print(&format!(
        "simulated   scene {:?}, seed {}: {}, {}, {}, {} readings\n\
         calibrated  {calibrated}\n\
         limit       no method can be expected to do better than {}, none that treats each element separately better than {}\n\
         verdict     {verdict}: of {} deflected elements {} solved, {} abstained, {} missed, {} false\n\
         points      {} at 1 m, {} at 4 m\n\
         took        {:.1} s\n\
         dataset     {}\n\
         report      {}\n\
         cloud       {}: {} in the room frame\n\
         next: catoptric new mine.toml && catoptric check mine.toml\n",
        scene.name,
        scene.seed,
        counted(scene.superstructure.facet.len(), "facet"),
        counted(dataset.poses.len().saturating_sub(2), "board pose"),
        counted(figures.scans, "scan"),
        grouped(figures.scans * figures.beams),
        figure(score.crlb_per_axis_deg, 4, "°"),
        figure(score.alone_crlb_per_axis_deg, 4, "°"),
        score.beams.deflected.unwrap_or_default(),
        score.beams.solved,
        score.beams.abstained,
        score.beams.missed.unwrap_or_default(),
        score.beams.wrong.unwrap_or_default(),
        figure(score.point_mm.at_1m, 1, " mm"),
        figure(score.point_mm.at_4m, 1, " mm"),
        begin.elapsed().as_secs_f64(),
        quoted(&dataset_folder),
        quoted(&report_path),
        quoted(&cloud_path),
        counted(cloud.points, "point"),
    ))?;
    conclude(score.verdict, &score.reasons())
}
