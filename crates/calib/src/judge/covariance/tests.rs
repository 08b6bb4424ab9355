//! The error budget against closed forms: even spreads of boards, common errors, four markers.

use super::*;
use catoptric_model::session::*;
use catoptric_model::{BoardPlane, PoseData, RangeBias, ScanGeometry};
use nalgebra::{Point3, Unit};

fn session() -> Session {
    Session {
        schema_version: SCHEMA_VERSION,
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
            rotation_sd_deg: [1.0; 3],
            translation_sd_mm: [5.0; 3],
        },
        room: Some(RoomSurvey {
            min_m: [-3.0; 3],
            max_m: [3.0; 3],
            color: "white".to_owned(),
        }),
        believed: Beliefs {
            range_noise_sd_mm: 4.0,
            noise: None,
            noise_of: Default::default(),
            drift_sd_mm: 0.0,
            element_sd_mm: 0.0,
            marker_sd_mm: 0.0,
            bias: RangeBias::default(),
            distance_bias_sd_mm: 0.0,
            angle_gain_sd_mm: 0.0,
            color_bias_sd_mm: 0.0,
        },
        glass: None,
        bare_structure: BareStructure {
            mirror_thickness_mm: 0.0,
            distance_sd_mm: 0.0,
            noise_sd_mm: 0.0,
            scanned: false,
            first_beam: 0,
            distance_m: Vec::new(),
        },
        rig_markers: Vec::new(),
        facets: Vec::new(),
        boards: Vec::new(),
    }
}

const UP: Deflection = Deflection {
    azimuth: 0.2,
    elevation: 0.9,
    distance: 0.0,
};

/// Boards at s = 2 m with tilt α = 45°, spread evenly in ψ.
fn even(count: usize, session: &Session) -> Budget {
    let v = UP.exit_direction(0.0);
    let (across, up) = catoptric_model::frame::tangent_basis(&v);
    let point = Point3::from(v.into_inner() * 2.0);
    let markers: Vec<Point3<f64>> = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
        .iter()
        .map(|(x, y)| point + across.into_inner() * (0.3 * x) + up.into_inner() * (0.3 * y))
        .collect();
    let views: Vec<BoardView> = (0..count)
        .map(|k| {
            let psi = std::f64::consts::TAU * k as f64 / count as f64;
            let psi = catoptric_model::beam::direction(psi);
            let side = across.into_inner() * psi.x + up.into_inner() * psi.y;
            BoardView {
                plane: BoardPlane::new(point, Unit::new_normalize(side - v.into_inner())),
                markers: &markers,
                color: "white",
                noise_sd: 4e-3,
                count: 100,
            }
        })
        .collect();
    budget(session, &MountUncertainty::none(), 0.0, &UP, &views).expect("the beam hits the boards")
}

/// Standard deviation per axis of the tangent plane, in degrees.
fn per_axis_deg(c: &Matrix2<f64>) -> f64 {
    let cos = catoptric_model::beam::direction(UP.elevation).x;
    (0.5 * (cos * cos * c[(0, 0)] + c[(1, 1)])).sqrt().to_degrees()
}

#[test]
fn noise_alone_is_the_closed_form() {
    // σ_angle = σ/(s·tan α)·√(2/K) for an even spread of ψ; sandwich, bound and the paper's formula are then equal.
    let budget = even(5, &session());
    let expected = (4e-4 / 2.0 * (2.0_f64 / 5.0).sqrt()).to_degrees();
    for c in [budget.bound(), budget.sandwich(), budget.noise_covariance(4e-3)] {
        assert!((per_axis_deg(&c.expect("both angles are determined")) / expected - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_sandwich_is_never_below_the_bound() {
    let mut session = session();
    session.believed.drift_sd_mm = 0.9;
    session.believed.marker_sd_mm = 0.3;
    session.believed.angle_gain_sd_mm = 5.0;
    session.bare_structure.distance_sd_mm = 0.5;
    let mut last = f64::INFINITY;
    for count in [3, 4, 6, 8] {
        let budget = even(count, &session);
        let bound = budget.bound().expect("both angles are determined");
        let excess = budget.sandwich().expect("both angles are determined") - bound;
        assert!(excess.symmetric_eigenvalues().min() > -1e-9 * bound.norm());
        assert!(bound.trace() < last, "another board must not lose information");
        last = bound.trace();
    }
}

#[test]
fn an_even_spread_cancels_a_common_error() {
    let mut biased = session();
    biased.believed.angle_gain_sd_mm = 20.0;
    let (without, with) = (even(4, &session()), even(4, &biased));
    assert!((with.covariance.clone() - without.covariance.clone()).norm() > 1e-5);
    let difference = with.sandwich().expect("both angles are determined")
        - without.sandwich().expect("both angles are determined");
    assert!(difference.norm() < 1e-12);
}

#[test]
fn four_markers_hold_a_plane_by_half_their_error() {
    let mut session = session();
    session.believed.marker_sd_mm = 0.4;
    let sigma = even(3, &session).covariance[(0, 0)] - 16e-8;
    // Offset σ/2, over cos 45° along the beam.
    assert!((sigma - (0.2e-3_f64).powi(2) * 2.0).abs() < 1e-14);
}

#[test]
fn a_scanned_bare_distance_holds_the_common_errors_and_its_uncertainty_is_the_stated_one() {
    let mut session = session();
    session.believed.distance_bias_sd_mm = 0.5;
    session.believed.angle_gain_sd_mm = 3.0;
    session.believed.drift_sd_mm = 0.9;
    session.bare_structure.distance_sd_mm = 1.6;
    let with_another_instrument = CommonErrors::of(&session);
    assert_eq!(with_another_instrument.bare_row(0.07, 0.8).norm(), 0.0);
    assert!((with_another_instrument.bare_sd(0.07, 0.8) - 1.6e-3).abs() < 1e-15);
    let count = with_another_instrument.len();
    session.bare_structure.scanned = true;
    let common = CommonErrors::of(&session);
    assert_eq!(common.len(), count + 1);
    let row = common.bare_row(0.07, 0.8);
    // E_r and A_a as in a reading, and a drift that no reading of a board has.
    assert_eq!(
        row.columns(0, count),
        common.row(0.07, 0.8, "structure").columns(0, count)
    );
    assert!((row[count] - 0.9e-3).abs() < 1e-15 && common.row(1.0, 0.8, "")[count] == 0.0);
    let whole = row.norm_squared() + common.bare_sd(0.07, 0.8).powi(2);
    assert!((whole.sqrt() - 1.6e-3).abs() < 1e-12);
}
