//! One facet in a room of 6 m: the search against the budget of the estimator, and what a design must never do.

use super::*;
use crate::judge::covariance::{self, MountUncertainty};
use crate::readings::observations::BoardView;
use catoptric_model::frame::tangent_basis;
use catoptric_model::session::*;
use catoptric_model::{Pose, PoseData, RangeBias, ScanGeometry, Stop, beam};
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

const FACET: &str = "up";

fn marker(x: f64, y: f64) -> Marker {
    Marker {
        name: format!("{x} {y}"),
        position_mm: [x, y, 0.0],
    }
}

/// A facet 70 mm ahead that lifts the forward beams by about 50°.
fn session() -> Session {
    Session {
        schema_version: catoptric_model::session::SCHEMA_VERSION,
        name: String::new(),
        scanner: ScannerSheet {
            preset: String::new(),
            scan: ScanGeometry::default(),
            range_min_m: 0.06,
            range_max_m: 20.0,
            divergence_full_mrad: 10.0,
        },
        nominal_rig_from_sensor: PoseData {
            translation_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        },
        mount_tolerance: MountTolerance {
            rotation_sd_deg: [0.5; 3],
            translation_sd_mm: [1.0; 3],
        },
        room: Some(RoomSurvey {
            min_m: [-3.0, -3.0, 0.0],
            max_m: [3.0, 3.0, 5.0],
            color: "white".to_owned(),
        }),
        believed: Beliefs {
            range_noise_sd_mm: 4.0,
            noise: None,
            noise_of: Default::default(),
            drift_sd_mm: 0.9,
            element_sd_mm: 0.2,
            marker_sd_mm: 0.2,
            bias: RangeBias::default(),
            distance_bias_sd_mm: 0.5,
            angle_gain_sd_mm: 3.0,
            color_bias_sd_mm: 0.0,
        },
        glass: None,
        bare_structure: BareStructure {
            mirror_thickness_mm: 0.0,
            distance_sd_mm: 0.5,
            noise_sd_mm: 0.0,
            scanned: false,
            first_beam: 0,
            distance_m: Vec::new(),
        },
        rig_markers: vec![marker(90.0, 0.0), marker(0.0, 90.0), marker(-80.0, -20.0)],
        facets: vec![NominalFacet {
            name: FACET.to_owned(),
            corners_mm: vec![
                [64.4, -12.0, -12.0],
                [75.6, -12.0, 12.0],
                [75.6, 12.0, 12.0],
                [64.4, 12.0, -12.0],
            ],
            curve: None,
            beams: [516, 564],
        }],
        boards: vec![BoardSheet {
            name: "board".to_owned(),
            width_mm: 900.0,
            height_mm: 700.0,
            thickness_mm: 0.0,
            color: "white".to_owned(),
            markers: vec![
                marker(400.0, 300.0),
                marker(-400.0, 300.0),
                marker(-400.0, -300.0),
                marker(400.0, -250.0),
            ],
        }],
    }
}

fn room_from_rig() -> Pose {
    Pose::from_parts(Translation3::new(0.0, 0.0, 1.5), UnitQuaternion::identity())
}

fn drawn(placed: &[Placed]) -> Situation {
    Situation::drawn(&session(), &room_from_rig(), placed).expect("the facet has a plane")
}

fn request(poses: usize, criterion: Criterion) -> Request {
    Request {
        poses,
        criterion,
        tries: 3000,
        ..Request::default()
    }
}

/// A board on the ray of the middle beam, tilted toward a direction seen along it.
fn placed(range: f64, tilt_deg: f64, direction_deg: f64) -> Placed {
    let situation = drawn(&[]);
    let rays = situation.rays(FACET);
    let (_, origin, v) = rays[rays.len() / 2];
    let (across, up) = tangent_basis(&v);
    let (turn, tilt) = (
        beam::direction(direction_deg.to_radians()),
        beam::direction(tilt_deg.to_radians()),
    );
    let sideways = across.into_inner() * turn.x + up.into_inner() * turn.y;
    let normal = Unit::new_normalize(sideways * tilt.y - v.into_inner() * tilt.x);
    let x = tangent_basis(&normal).0;
    let axes = Matrix3::from_columns(&[x.into_inner(), normal.cross(&x), normal.into_inner()]);
    Placed {
        board: "board".to_owned(),
        facet: Some(FACET.to_owned()),
        room_from_board: Pose::from_parts(
            Translation3::from(origin.coords + v.into_inner() * range),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)),
        ),
        beams: None,
        readings: 100,
    }
}

#[test]
fn the_search_agrees_with_the_error_budget() {
    let situation = drawn(&[placed(1.0, 30.0, 40.0)]);
    let mut designer = Designer::new(&situation, FACET, &request(4, Criterion::A)).expect("there are poses");
    let chosen = designer.best(4);
    let session = session();
    let fan = situation.fan(FACET).expect("the facet exists");
    let mut compared = 0;
    for element in &fan.elements {
        let mut views: Vec<BoardView> = Vec::new();
        views.extend(
            element
                .read
                .iter()
                .map(|(n, noise, count)| situation.boards[*n].view(*noise, *count)),
        );
        for candidate in chosen.iter().map(|c| designer.candidate(*c)) {
            if candidate.beams.contains(&element.beam) {
                views.push(candidate.in_sensor.view(4e-3, 100));
            }
        }
        let Some(bound) = designer.bound_deg(element.beam, &chosen) else {
            continue;
        };
        let mount = MountUncertainty::none();
        let budget = covariance::budget(&session, &mount, element.azimuth, &element.deflection, &views)
            .expect("the beam hits the boards");
        let c = budget.bound().expect("both angles are determined");
        let cos = beam::direction(element.deflection.elevation).x;
        let expected = (0.5 * (cos * cos * c[(0, 0)] + c[(1, 1)])).sqrt().to_degrees();
        // The prior of 30° is the only difference.
        assert!((bound / expected - 1.0).abs() < 1e-5, "{bound} and {expected}");
        compared += 1;
    }
    assert!(compared > 20, "only {compared} elements are determined");
}

#[test]
fn the_mounting_only_adds() {
    let situation = drawn(&[]);
    let mut designer = Designer::new(&situation, FACET, &request(5, Criterion::A)).expect("there are poses");
    let standing = {
        let chosen = designer.best(5);
        designer.standing(&chosen)
    };
    let (alone, mounted) = (
        standing.bound_deg.expect("determined"),
        standing.bound_with_mounting_deg.expect("determined"),
    );
    // Nothing was recorded in front of undeflected beams: the drawing's half a degree is in every beam.
    assert!(alone < 0.1 && mounted > 0.3, "{alone} and {mounted}");
}

#[test]
fn another_pose_never_worsens_any_bound() {
    let situation = drawn(&[placed(1.0, 30.0, 40.0), placed(1.3, 20.0, 130.0)]);
    for criterion in [Criterion::A, Criterion::D] {
        let designer = Designer::new(&situation, FACET, &request(0, criterion)).expect("there are poses");
        let beams: Vec<usize> = situation.rays(FACET).iter().map(|r| r.0).collect();
        let mut chosen: Vec<usize> = Vec::new();
        for step in 0..8 {
            let more: Vec<usize> = chosen
                .iter()
                .copied()
                .chain([(step * 37) % designer.len()])
                .collect();
            assert!(designer.cost(&more) < designer.cost(&chosen));
            for beam in &beams {
                if let Some(before) = designer.bound_deg(*beam, &chosen) {
                    let after = designer
                        .bound_deg(*beam, &more)
                        .expect("the beam stays determined");
                    assert!(
                        after <= before * (1.0 + 1e-12),
                        "beam {beam}: {before} to {after}"
                    );
                }
            }
            chosen = more;
        }
    }
}

#[test]
fn no_exchange_improves_the_design() {
    let situation = drawn(&[]);
    for criterion in [Criterion::A, Criterion::D] {
        let new = || Designer::new(&situation, FACET, &request(3, criterion)).expect("there are poses");
        let mut designer = new();
        let drawn = designer.len();
        let chosen = designer.best(3);
        let cost = designer.cost(&chosen);
        for place in 0..3 {
            for other in 0..designer.len() {
                let mut exchanged = chosen.clone();
                exchanged[place] = other;
                assert!(designer.cost(&exchanged) >= cost - 1e-8 * cost.abs());
            }
        }
        assert_eq!(new().best(3), chosen);
        // Trying poses around the chosen ones has found something.
        assert!(chosen.iter().any(|c| *c >= drawn));
    }
}

#[test]
fn every_candidate_is_possible() {
    let situation = drawn(&[]);
    let asked = Request {
        max_incidence_deg: 50.0,
        range_m: [0.8, 2.0],
        ..request(0, Criterion::D)
    };
    let found = candidates::candidates(&situation, FACET, &asked, &Stop::default()).expect("there are poses");
    assert!(found.len() > 100);
    let rays = situation.rays(FACET);
    for candidate in &found {
        let pose = &candidate.room_from_board;
        for corner in session().boards[0].outline().corners() {
            let p = pose * corner;
            assert!(p.x.abs() < 3.0 && p.y.abs() < 3.0 && p.z > 0.0 && p.z < 5.0);
        }
        let normal = pose.rotation * Vector3::z();
        for (number, origin, v) in rays.iter().filter(|r| candidate.beams.contains(&r.0)) {
            let cos = -normal.dot(v);
            assert!(cos >= libm::cos(50.0_f64.to_radians()), "beam {number}");
            let s = normal.dot(&(pose.translation.vector - origin.coords)) / normal.dot(v);
            let at = pose.inverse_transform_point(&(origin + v.into_inner() * s));
            assert!(at.x.abs() < 0.45 && at.y.abs() < 0.35 && at.z.abs() < 1e-12);
            if *number == candidate.beam {
                assert!((s - candidate.range_m).abs() < 1e-9);
                let tilt = beam::angle_between(&Unit::new_normalize(-normal), v).to_degrees();
                assert!((tilt - candidate.tilt_deg).abs() < 1e-9);
            }
        }
        assert!(candidate.range_m >= 0.8 && candidate.range_m <= 2.0);
        // A point of the board nearest to the rig.
        let nearest = (-8..=8).flat_map(|i| {
            (-8..=8).map(move |j| Point3::new(0.05625 * f64::from(i), 0.04375 * f64::from(j), 0.0))
        });
        assert!(
            nearest
                .map(|p| (pose * p - room_from_rig() * Point3::origin()).norm())
                .all(|d| d > 0.19)
        );
    }
}

#[test]
fn a_hinge_gets_a_pose_tilted_across() {
    for hinge in [0.0, 35.0, 90.0] {
        let turned = |tilt: f64| placed(1.3, tilt.abs(), if tilt < 0.0 { hinge + 180.0 } else { hinge });
        let situation = drawn(&[turned(30.0), turned(-20.0), turned(10.0), turned(-35.0)]);
        for criterion in [Criterion::A, Criterion::D] {
            let plan = plan(&situation, &[], &request(1, criterion)).expect("there are poses");
            let facet = &plan.facets[0];
            assert!(
                facet
                    .lacking
                    .iter()
                    .any(|o| o.reason.contains("tilted along one direction only"))
            );
            assert!(facet.before.open > facet.after.open);
            let pose = &facet.poses[0];
            let across = (pose.direction_deg - hinge).to_radians();
            // More across the hinge than along it; beyond that, the room and the other beams decide.
            let share = beam::direction(across).y.abs();
            assert!(
                share > std::f64::consts::FRAC_1_SQRT_2 && pose.tilt_deg > 25.0,
                "hinge {hinge}: {}",
                pose.words
            );
        }
    }
}

#[test]
fn impossible_requests_are_refused() {
    let situation = drawn(&[]);
    let asked = request(1, Criterion::D);
    let refused = |name: &str, asked: &Request| {
        plan(&situation, &[name.to_owned()], asked)
            .expect_err("the request is impossible")
            .to_string()
    };
    assert!(refused("down", &asked).contains("\"down\"") && refused("down", &asked).contains("up"));
    let far = Request {
        range_m: [9.0, 9.5],
        ..asked
    };
    assert!(refused(FACET, &far).contains("nearer than the minimum range"));
    let steep = Request {
        max_incidence_deg: 90.0,
        ..asked
    };
    assert!(refused(FACET, &steep).contains("largest incidence"));
}

#[test]
fn the_reported_pose_is_the_planned_pose() {
    let situation = drawn(&[]);
    let plan = plan(&situation, &[], &request(4, Criterion::D)).expect("there are poses");
    for pose in &plan.facets[0].poses {
        let normal = Unit::new_normalize(Vector3::from(pose.normal));
        let level = tangent_basis(&normal).0;
        let turn = beam::direction(pose.turn_deg.to_radians());
        let x = level.into_inner() * turn.x + normal.cross(&level) * turn.y;
        let [yaw, pitch, roll] = pose.yaw_pitch_roll_deg.map(f64::to_radians);
        let attitude = catoptric_model::frame::yaw_pitch_roll(yaw, pitch, roll);
        assert!((attitude * Vector3::z() - normal.into_inner()).norm() < 1e-12);
        assert!((attitude * Vector3::x() - x).norm() < 1e-12);
    }
}
