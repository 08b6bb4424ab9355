//! What must not change an answer, and what must change only its covariance.

use crate::synthetic::World;
use catoptric_calib::{Method, Options, calibrate};
use catoptric_model::{Calibration, Dataset};

fn solve(dataset: &Dataset) -> Calibration {
    calibrate(dataset, Method::Beam, &Options::default()).expect("a sound dataset")
}

#[test]
fn the_order_of_poses_does_not_matter() {
    let mut made = World::noisy(7).make();
    let forward = solve(&made.dataset);
    made.dataset.poses.reverse();
    let backward = solve(&made.dataset);
    for (a, b) in forward.beams.iter().zip(&backward.beams) {
        assert_eq!(a.status, b.status);
        if let (Some(x), Some(y)) = (a.deflection(), b.deflection()) {
            assert!((x.azimuth - y.azimuth).abs() < 1e-12 && (x.elevation - y.elevation).abs() < 1e-12);
        }
    }
}

#[test]
fn twice_the_readings_halve_the_noise_covariance_and_not_the_whole() {
    let mut made = World::noisy(8).make();
    // Believed larger than any sample shows: otherwise a repeated sample may pass for proof of larger noise.
    made.dataset.session.believed.range_noise_sd_mm = 8.0;
    let once = solve(&made.dataset);
    for pose in &mut made.dataset.poses {
        pose.ranges.extend_from_within(..);
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

#[test]
fn two_runs_give_equal_bits() {
    let made = World::noisy(9).make();
    assert_eq!(solve(&made.dataset), solve(&made.dataset));
}
