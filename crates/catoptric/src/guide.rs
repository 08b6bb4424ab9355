//! The guide, chapter by chapter: what to run, what the results mean, and the equations behind them.
//!
//! 1. [`getting_started`]: install, the demo, what the files are, how to read the report
//! 2. [`sensor_and_mirrors`]: frames, signs, symbols, one mirror in three numbers, Eqs. (6) and (9)
//! 3. [`simulating`]: the scene file, what is modeled and how the model is verified, truth, determinism
//! 4. [`calibrating_and_scoring`]: the paper's steps, statuses, covariances, scores, verdicts, your own calibrator
//! 5. [`files`]: every file and every key
//! 6. [`physics_of_table_3`]: how much of the paper's Table 3 is explained by pulse and threshold, and what is not
//! 7. [`characterizing`]: step 1, Tables 1 to 4 and Eqs. (3)–(5) of the bare sensor
//! 8. [`studies`]: statistics over many experiments, the reference setting, Figure 10
//! 9. [`test_your_own`]: a calibrator of your own, tiers, comparison
//! 10. [`ci`]: property tests and gates, jobs to copy
//! 11. [`planning`]: which board poses to record next
//! 12. [`layouts`]: coverage, losses and attainable accuracy of a mirror layout, and files for manufacturing
//! 13. [`optimizing`]: parameters, shapes and patterns of a layout, and the search for better ones
//! 14. [`gallery`]: four layouts to start from, what they show and how well they calibrate
//! 15. [`tolerances`]: the effect of manufacturing errors, before and after calibration
//! 16. [`performance`]: what a simulation costs, how the cost scales, where the time goes
//!
//! The chapters are Markdown files in `docs/guide/`; the test suite runs their Rust examples.

#[doc = include_str!("../../../docs/guide/1-getting-started.md")]
pub mod getting_started {}

#[doc = include_str!("../../../docs/guide/2-sensor-and-mirrors.md")]
pub mod sensor_and_mirrors {}

#[doc = include_str!("../../../docs/guide/3-simulating.md")]
pub mod simulating {}

#[doc = include_str!("../../../docs/guide/4-calibrating-and-scoring.md")]
pub mod calibrating_and_scoring {}

#[doc = include_str!("../../../docs/guide/5-files.md")]
pub mod files {}

#[doc = include_str!("../../../docs/guide/6-physics-of-table-3.md")]
pub mod physics_of_table_3 {}

#[doc = include_str!("../../../docs/guide/7-characterizing.md")]
pub mod characterizing {}

#[doc = include_str!("../../../docs/guide/8-studies.md")]
pub mod studies {}

#[doc = include_str!("../../../docs/guide/9-test-your-own.md")]
pub mod test_your_own {}

// The test suite runs the example; as a doctest it is only compiled.
#[allow(clippy::test_attr_in_doctest)]
#[cfg_attr(feature = "testing", doc = include_str!("../../../docs/guide/10-ci.md"))]
#[cfg_attr(
    not(feature = "testing"),
    doc = "Chapter 10 is in `docs/guide/10-ci.md`; its example needs the feature `testing`."
)]
pub mod ci {}

#[doc = include_str!("../../../docs/guide/11-planning.md")]
pub mod planning {}

#[doc = include_str!("../../../docs/guide/12-layouts.md")]
pub mod layouts {}

#[doc = include_str!("../../../docs/guide/13-optimizing.md")]
pub mod optimizing {}

#[doc = include_str!("../../../docs/guide/14-gallery.md")]
pub mod gallery {}

#[doc = include_str!("../../../docs/guide/15-tolerances.md")]
pub mod tolerances {}

#[doc = include_str!("../../../docs/guide/16-performance.md")]
pub mod performance {}
