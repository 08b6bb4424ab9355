//! The same data give the same bytes, again and on any number of threads.

use super::Failure;
use super::trial::Experiment;
use catoptric_calib::Calibrator;
use catoptric_sim::Scene;

/// Runs something twice on each number of threads and compares all results with the first.
///
/// # Errors
/// In words, where they differ or why it could not be run.
pub fn same_result<T: PartialEq + Send>(threads: &[usize], run: impl Fn() -> T + Sync) -> Result<(), String> {
    let mut first: Option<(T, usize)> = None;
    for &count in threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
        let pool = pool.map_err(|e| format!("{count} threads cannot be had: {e}"))?;
        for time in ["first", "second"] {
            let result = pool.install(&run);
            match &first {
                None => first = Some((result, count)),
                Some((expected, on)) if *expected != result => {
                    return Err(format!(
                        "the {time} run on {count} threads is not what the first run on {on} threads gave"
                    ));
                }
                Some(_) => {}
            }
        }
    }
    Ok(())
}

/// Simulates a scene once, and calibrates it twice on each number of threads: all files would be the same, byte by byte.
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
/// [`Failure::Different`]; what keeps it from being told.
pub fn deterministic<C: Calibrator + Sync + ?Sized>(
    scene: &Scene,
    seed: u64,
    calibrator: &C,
    threads: &[usize],
) -> Result<(), Failure> {
    let experiment = Experiment::of(scene, seed)?;
    // A calibrator that fails should at least fail alike, and with its own words.
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

/// As [`deterministic`].
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
