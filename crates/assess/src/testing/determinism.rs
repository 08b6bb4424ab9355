//! Determinism test: the same data yield the same bytes, every time and on any number of threads.

use super::Failure;
use super::trial::Experiment;
use catoptric_calib::Calibrator;
use catoptric_sim::Scene;

/// Runs a function twice on each number of threads and compares all results with the first one.
///
/// # Errors
/// As text: which run differs, or why it could not be run.
pub fn same_result<T: PartialEq + Send>(threads: &[usize], run: impl Fn() -> T + Sync) -> Result<(), String> {
    let mut first: Option<(T, usize)> = None;
    for &count in threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
        let pool = pool.map_err(|e| format!("cannot start {count} threads: {e}"))?;
        for time in ["first", "second"] {
            let result = pool.install(&run);
            match &first {
                None => first = Some((result, count)),
                Some((expected, on)) if *expected != result => {
                    return Err(format!(
                        "the {time} run on {count} threads differs from the first run on {on} threads"
                    ));
                }
                Some(_) => {}
            }
        }
    }
    Ok(())
}

/// Simulates a scene once and calibrates it twice on each number of threads: all files must be identical, byte for byte.
///
/// ```
/// use catoptric_calib::Method;
/// use catoptric_assess::testing::{deterministic, without_errors};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let scene = without_errors(toml::from_str(include_str!("../../../../scenes/two-mirror.toml"))?);
/// deterministic(&scene, 1, &Method::Beam, &[1, 2])?;
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Failure::Different`]; any failure of the experiment.
pub fn deterministic<C: Calibrator + Sync + ?Sized>(
    scene: &Scene,
    seed: u64,
    calibrator: &C,
    threads: &[usize],
) -> Result<(), Failure> {
    let experiment = Experiment::of(scene, seed)?;
    // A calibrator that always fails is reported with its own message.
    experiment.calibrate(calibrator)?;
    let bytes = || {
        let calibration = experiment.calibrate(calibrator).map_err(|e| e.to_string())?;
        serde_json::to_string(&calibration).map_err(|e| e.to_string())
    };
    same_result(threads, bytes).map_err(|what| Failure::Different {
        seed,
        what: format!("{}: {what}", calibrator.name()),
    })
}

/// Same as [`deterministic`], but panics.
///
/// # Panics
/// With the text of the failure.
#[track_caller]
pub fn assert_deterministic<C: Calibrator + Sync + ?Sized>(
    scene: &Scene,
    seed: u64,
    calibrator: &C,
    threads: &[usize],
) {
    if let Err(failure) = deterministic(scene, seed, calibrator, threads) {
        panic!("{failure}");
    }
}
