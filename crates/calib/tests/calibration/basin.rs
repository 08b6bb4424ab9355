//! Basin of convergence: an element's angles are found even from a start 60° off, farther than any drawing.

use crate::synthetic::Draw;
use catoptric_calib::observations::{BoardView, Observation};
use catoptric_calib::solve::{BareDistance, SoleElement};
use catoptric_calib::{Options, initial, solve};
use catoptric_model::{BoardPlane, Deflection, RangeBias, RawRange, beam, frame, range};
use nalgebra::{Unit, Vector3};

const AZIMUTH: f64 = 0.3;
const TRIALS: usize = 1000;

/// A random direction at a given angle from another.
fn away(from: &Unit<Vector3<f64>>, angle: f64, draw: &mut Draw) -> Unit<Vector3<f64>> {
    let (a, b) = frame::tangent_basis(from);
    let turn = beam::direction(std::f64::consts::TAU * draw.uniform());
    let across = a.into_inner() * turn.x + b.into_inner() * turn.y;
    let (cos, sin) = (libm::cos(angle), libm::sin(angle));
    Unit::new_normalize(from.into_inner() * cos + across * sin)
}

/// Five boards at 0.5 to 4 m, tilted by 20° to 60° in random directions: the random design of the reference setting.
fn boards(truth: &Deflection, draw: &mut Draw) -> Vec<BoardPlane> {
    let (origin, v) = (truth.deflection_point(AZIMUTH), truth.exit_direction(AZIMUTH));
    (0..5)
        .map(|_| {
            let s = 0.5 + 3.5 * draw.uniform();
            let tilt = (20.0 + 40.0 * draw.uniform()).to_radians();
            let facing = Unit::new_unchecked(-v.into_inner());
            BoardPlane::new(origin + v.into_inner() * s, away(&facing, tilt, draw))
        })
        .collect()
}

/// Number of elements that converge to the truth from a start `angle` away, with the given noise of each mean in
/// meters.
fn found(noise: f64, angle: f64, closed_form: bool) -> usize {
    let mut draw = Draw(7);
    let bias = RangeBias::default();
    let mut found = 0;
    for _ in 0..TRIALS {
        let truth = Deflection {
            azimuth: 0.5 * draw.normal(),
            elevation: 0.2 + 0.8 * draw.uniform(),
            distance: 0.07,
        };
        let planes = boards(&truth, &mut draw);
        let observations: Vec<Observation> = planes
            .iter()
            .map(|plane| {
                let exact = range::predict(&truth, AZIMUTH, plane).expect("the beam was aimed at the board");
                Observation {
                    board: BoardView {
                        plane: *plane,
                        markers: &[],
                        color: "white",
                        noise_sd: noise,
                        count: 1,
                    },
                    mean: RawRange(exact + noise * draw.normal()),
                }
            })
            .collect();
        let element = SoleElement {
            azimuth: AZIMUTH,
            observations: &observations,
            distance: BareDistance {
                distance: truth.distance,
                thickness: 0.0,
            },
            bias: &bias,
        };
        let v = truth.exit_direction(AZIMUTH);
        let start = Deflection::from_exit(AZIMUTH, &away(&v, angle, &mut draw), truth.distance);
        let start = if closed_form {
            let direct = initial::closed_form(&start, AZIMUTH, &observations, &bias);
            direct.map_or(start, |c| {
                Deflection::from_exit(AZIMUTH, &c.direction, truth.distance)
            })
        } else {
            start
        };
        let near = |end: &Deflection| {
            let off = beam::angle_between(&end.exit_direction(AZIMUTH), &v);
            // Random boards with a noise of one millimeter occasionally leave up to a degree.
            off < if noise > 0.0 { 0.05 } else { 1e-9 }
        };
        let solution = solve::batch(&element, &start, &Options::default());
        found += usize::from(solution.is_some_and(|s| s.converged && near(&s.deflection)));
    }
    found
}

#[test]
fn a_start_sixty_degrees_away_is_near_enough() {
    let angle = 60.0_f64.to_radians();
    for noise in [0.0, 1e-3] {
        let (with, without) = (found(noise, angle, true), found(noise, angle, false));
        assert!(
            with >= TRIALS * 95 / 100,
            "{with} of {TRIALS} with noise of {noise} m"
        );
        // The closed form is what makes the difference.
        assert!(without < with, "{without} of {TRIALS} without the closed form");
    }
}
