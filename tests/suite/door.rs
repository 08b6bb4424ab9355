//! The public API: a crate outside this workspace compiles against it, long verbs stop on request and leave no files
//! behind, and the program can be called as a function.
//!
//! The correctness of results is covered by `pipeline`, `closure` and `consistency`; how soon a verb stops is measured by
//! `.ci/long`, not here.

use catoptric::calib::plan::Request;
use catoptric::study::{Contestant, Part, Study};
use catoptric::{
    Control, Error, Method, PlanStart, Progress, Recording, Scene, Stop, Template, ToleranceOptions,
    calibrate_with, plan, read_dataset, simulate, simulate_into, simulate_with, study, study_into, tolerance,
    trace,
};
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The example at the top of the library's documentation, as an external crate.
const OUTSIDE: &str = r#"
fn main() -> Result<(), catoptric::Error> {
    let scene = catoptric::Scene::load("mine.toml")?;
    let (dataset, truth) = catoptric::simulate(&scene)?;
    let calibration = catoptric::calibrate(&dataset)?;
    let score = catoptric::score(&dataset, &calibration, &truth)?;
    println!("{}: {:.4}° per axis, at best {:.4}°",
        score.verdict.word(), score.per_axis_rms_deg, score.crlb_per_axis_deg);
    let blind = catoptric::score(&dataset, &calibration, None)?;
    println!("{}", blind.verdict.word());
    Ok(())
}
"#;

fn small() -> Scene {
    Scene::template(Template::TwoMirror)
        .with(&["experiment.scans_per_pose=3", "scanner.sub_rays=1"])
        .unwrap()
}

/// A control that requests a stop at the first progress report of finished work.
fn stops_immediately() -> Control {
    let stop = Stop::default();
    let requested = stop.clone();
    Control {
        stop,
        progress: Some(Arc::new(move |_: Progress| requested.request())),
        threads: None,
    }
}

fn stopped<T>(result: Result<T, Error>) -> bool {
    matches!(result, Err(Error::Stopped(_)))
}

#[test]
fn a_crate_outside_the_workspace_scores_a_calibration() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = format!(
        "[package]\nname = \"outside\"\nversion = \"0.0.0\"\nedition = \"2024\"\n[workspace]\n[dependencies]\n\
         catoptric = {{ path = {:?} }}\n[profile.dev]\nopt-level = 2\ndebug = false\n",
        root.join("crates/catoptric")
    );
    let at = tempfile::tempdir().unwrap();
    std::fs::create_dir(at.path().join("src")).unwrap();
    std::fs::write(at.path().join("Cargo.toml"), manifest).unwrap();
    std::fs::write(at.path().join("mine.toml"), Template::TwoMirror.text()).unwrap();
    std::fs::write(at.path().join("src/main.rs"), OUTSIDE).unwrap();
    // The same versions as here, so that nothing is downloaded.
    std::fs::copy(root.join("Cargo.lock"), at.path().join("Cargo.lock")).unwrap();
    let output = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--offline", "--target-dir"])
        .arg(root.join("target/outside"))
        .current_dir(at.path())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(
        text.starts_with("pass: 0.0") && text.ends_with("blind\n"),
        "{text}"
    );
}

#[test]
fn long_verbs_stop_on_request_and_leave_nothing_behind() {
    let (scene, control) = (small(), stops_immediately());
    let at = tempfile::tempdir().unwrap();
    assert!(stopped(simulate_with(&scene, &control)));
    let out = at.path().join("data");
    assert!(stopped(simulate_into(
        &scene,
        &out,
        &Recording::default(),
        &stops_immediately()
    )));
    let left: Vec<_> = at.path().read_dir().unwrap().collect();
    assert!(left.is_empty(), "{left:?}");

    let (dataset, _) = simulate(&scene).unwrap();
    let before = Control::default();
    before.stop.request();
    assert!(stopped(calibrate_with(
        &dataset,
        Method::Joint,
        &Default::default(),
        &before
    )));

    let contestants = vec![Contestant::named("beam").unwrap()];
    let four = Study::of_scene(scene.resolved().clone(), 4, contestants);
    assert!(stopped(study(&four, &stops_immediately())));
    let folder = at.path().join("study");
    assert!(stopped(study_into(
        &four,
        Part::WHOLE,
        false,
        &folder,
        &stops_immediately()
    )));
    let whole = study_into(&four, Part::WHOLE, false, &folder, &Control::default()).unwrap();
    assert_eq!(whole.methods[0].runs, 4);

    let draws = ToleranceOptions {
        draws: 40,
        bounds: 0,
        ..ToleranceOptions::default()
    };
    assert!(stopped(tolerance(&scene, &draws, &stops_immediately())));

    let start = PlanStart::of_scene(&scene).unwrap();
    let request = Request {
        tries: 100,
        ..Request::default()
    };
    let facets = start.facets(&[]).unwrap();
    assert!(stopped(plan(&start, &facets, &request, &stops_immediately())));

    let rays = at.path().join("rays.csv");
    std::fs::write(&rays, "x_m,y_m,z_m,dx,dy,dz\n0,0,0,1,0,0\n").unwrap();
    let paths = at.path().join("paths.csv");
    assert!(stopped(trace(&scene, &rays, &paths, 4, &before)));
    assert!(!paths.exists());
}

#[test]
fn threads_and_progress_change_no_result() {
    let scene = small();
    let done = Arc::new(AtomicUsize::new(0));
    let counted = done.clone();
    let control = Control {
        threads: std::num::NonZeroUsize::new(3),
        progress: Some(Arc::new(move |p: Progress| {
            assert_eq!(p.doing, "simulating");
            counted.fetch_add(p.more, Ordering::SeqCst);
        })),
        ..Control::default()
    };
    let (on_three, _) = simulate_with(&scene, &control).unwrap();
    let (alone, _) = simulate(&scene).unwrap();
    assert_eq!(on_three, alone);
    assert_eq!(done.load(Ordering::SeqCst), alone.poses.len());
}

#[test]
fn the_program_runs_as_a_function_repeatedly() {
    let at = tempfile::tempdir().unwrap();
    let scene = at.path().join("mine.toml");
    let dataset = at.path().join("data");
    let run = |arguments: &[&str]| {
        let arguments = std::iter::once("catoptric").chain(arguments.iter().copied());
        catoptric_cli::run(arguments)
    };
    let (scene, data) = (scene.to_str().unwrap(), dataset.to_str().unwrap());
    assert_eq!(run(&["check", scene]), 3);
    assert_eq!(run(&["new", scene, "--layout", "two-mirror"]), 0);
    let few = [
        "--set",
        "experiment.scans_per_pose=2",
        "--set",
        "scanner.sub_rays=1",
    ];
    // The number of threads applies to one run, not to later ones.
    for threads in ["1", "2"] {
        let simulate = [
            "simulate",
            scene,
            "--out",
            data,
            "--replace",
            "--threads",
            threads,
        ];
        assert_eq!(run(&[simulate.as_slice(), few.as_slice()].concat()), 0);
    }
    assert_eq!(run(&["simulate", scene, "--bogus"]), 2);
    assert!(read_dataset(&dataset).is_ok());
}
