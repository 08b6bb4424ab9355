//! What must not change a result, and what must change only its covariance.

use crate::synthetic::{Draw, World};
use catoptric_calib::{Method, Options, calibrate};
use catoptric_model::{Calibration, Dataset};

fn solve(dataset: &Dataset) -> Calibration {
    calibrate(dataset, Method::Beam, &Options::default()).expect("a sound dataset")
}

/// A random order of a list.
fn shuffle<T>(list: &mut [T], draw: &mut Draw) {
    for last in (1..list.len()).rev() {
        // Truncation picks an index uniformly.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        list.swap(last, (draw.uniform() * (last as f64 + 1.0)) as usize);
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let made = World::noisy(8).make();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let solve = || calibrate(&made.dataset, Method::Joint, &Options::default());
        pool.expect("threads can be started")
            .install(solve)
            .expect("a sound dataset")
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn the_order_of_poses_and_facets_does_not_matter() {
    let mut made = World::noisy(7).make();
    let straight = solve(&made.dataset);
    let mut draw = Draw(3);
    for round in 0..4 {
        if round == 0 {
            made.dataset.poses.reverse();
        } else {
            shuffle(&mut made.dataset.poses, &mut draw);
            shuffle(&mut made.dataset.session.facets, &mut draw);
        }
        let shuffled = solve(&made.dataset);
        let mut compared = 0;
        for (a, b) in straight.beams.iter().zip(&shuffled.beams) {
            assert_eq!((a.beam, a.status, &a.facet), (b.beam, b.status, &b.facet));
            if let (Some(x), Some(y)) = (a.deflection(), b.deflection()) {
                // Sums in a different order.
                assert!((x.azimuth - y.azimuth).abs() < 1e-12 && (x.elevation - y.elevation).abs() < 1e-12);
                compared += 1;
            }
        }
        assert!(compared > 40, "{compared} elements are solved");
    }
}

#[test]
fn twice_the_readings_halve_the_noise_covariance_and_not_the_whole() {
    let mut made = World::noisy(8).make();
    // Believed larger than any sample shows: otherwise a repeated sample may be taken as evidence of larger noise.
    made.dataset.session.believed.range_noise_sd_mm = 8.0;
    let once = solve(&made.dataset);
    for pose in &mut made.dataset.poses {
        let ranges = pose.readings.held_mut().expect("in memory");
        ranges.extend_from_within(..);
        pose.label.scans *= 2;
    }
    let twice = solve(&made.dataset);
    for (a, b) in once.beams.iter().zip(&twice.beams) {
        let (Some(x), Some(y)) = (a.noise_covariance_rad2, b.noise_covariance_rad2) else {
            continue;
        };
        for (row, other) in x.iter().zip(&y) {
            for (p, q) in row.iter().zip(other) {
                // The direction itself moves a little: the mounting is weighted by noise.
                assert!(
                    (0.5 * p - q).abs() < 1e-3 * (x[0][0] + x[1][1]),
                    "beam {}",
                    a.beam
                );
            }
        }
        let trace = |c: Option<[[f64; 2]; 2]>| c.map_or(0.0, |c| c[0][0] + c[1][1]);
        let ratio = trace(b.covariance_rad2) / trace(a.covariance_rad2);
        assert!(ratio > 0.55 && ratio < 1.0, "beam {}: {ratio}", a.beam);
    }
}

/// Only noise here: no drift, no error of markers, tables or distances, no prior knowledge of the mounting. Any other
/// believed error does not shrink with the number of readings, and the covariance would not halve.
#[test]
fn with_noise_alone_twice_the_readings_halve_the_whole_covariance() {
    let mut made = World {
        drift_mm: 0.0,
        marker_mm: 0.0,
        distance_bias_sd_mm: 0.0,
        angle_gain_sd_mm: 0.0,
        color_bias_sd_mm: 0.0,
        distance_sd_mm: 0.0,
        ..World::noisy(11)
    }
    .make();
    let session = &mut made.dataset.session;
    session.believed.range_noise_sd_mm = 8.0;
    session.mount_tolerance.rotation_sd_deg = [1e4; 3];
    session.mount_tolerance.translation_sd_mm = [1e6; 3];
    let once = solve(&made.dataset);
    for pose in &mut made.dataset.poses {
        let ranges = pose.readings.held_mut().expect("in memory");
        ranges.extend_from_within(..);
        pose.label.scans *= 2;
    }
    let twice = solve(&made.dataset);
    let mut worst: f64 = 0.0;
    let mut compared = 0;
    for (a, b) in once.beams.iter().zip(&twice.beams) {
        assert_eq!(a.status, b.status);
        let (Some(x), Some(y)) = (a.covariance_rad2, b.covariance_rad2) else {
            continue;
        };
        let entries = x.iter().flatten().zip(y.iter().flatten());
        worst = entries
            .map(|(p, q)| (0.5 * p - q).abs() / (x[0][0] + x[1][1]))
            .fold(worst, f64::max);
        compared += 1;
    }
    assert!(
        compared > 40 && worst < 1e-9,
        "{compared} elements, {worst} off at worst"
    );
}

#[test]
fn two_runs_give_equal_bits() {
    let made = World::noisy(9).make();
    assert_eq!(solve(&made.dataset), solve(&made.dataset));
}
