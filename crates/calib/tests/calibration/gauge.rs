//! Ranks and open directions of board sets and layouts, against tables computed by hand and by SVD.
//!
//! Only the geometry: whether a direction that is not open is known well enough is covered by covariances.

use catoptric_calib::gauge::{Determined, Layout, Ray, Unknowns, determine};
use catoptric_model::{BoardPlane, Deflection, MirrorPlane, Pose, beam, frame};
use nalgebra::{Point3, Unit, Vector3};

const UP: Deflection = Deflection {
    azimuth: 0.17,
    elevation: 0.87,
    distance: 0.07,
};

/// A board at a range along the beam, tilted by α toward ψ as seen along it.
fn tilted(range: f64, alpha_deg: f64, psi_deg: f64) -> BoardPlane {
    let v = UP.exit_direction(0.0);
    let (across, up) = frame::tangent_basis(&v);
    let (alpha, psi) = (
        beam::direction(alpha_deg.to_radians()),
        beam::direction(psi_deg.to_radians()),
    );
    let side = across.into_inner() * psi.x + up.into_inner() * psi.y;
    BoardPlane::new(
        UP.deflection_point(0.0) + v.into_inner() * range,
        Unit::new_normalize(side * alpha.y - v.into_inner() * alpha.x),
    )
}

/// A vertical board at a range along the beam, turned by a yaw.
fn vertical(range: f64, yaw_deg: f64) -> BoardPlane {
    let v = UP.exit_direction(0.0);
    BoardPlane::new(
        UP.deflection_point(0.0) + v.into_inner() * range,
        Unit::new_unchecked(-beam::direction(UP.azimuth + yaw_deg.to_radians()).into_inner()),
    )
}

fn of_element(boards: &[BoardPlane], unknowns: Unknowns) -> Determined {
    let layout = Layout {
        rays: vec![Ray::Alone {
            azimuth: 0.0,
            deflection: UP,
        }],
        sights: (0..boards.len()).map(|b| (0, b)).collect(),
        boards: boards.to_vec(),
        ..Layout::default()
    };
    determine(&layout, &unknowns).expect("the ray meets every board")
}

/// Angles alone, with B, with d, with B and A_c, with B and A_a.
fn columns() -> [Unknowns; 5] {
    let none = Unknowns::default();
    let constant = Unknowns {
        constant: true,
        ..none
    };
    [
        none,
        constant,
        Unknowns {
            distance: true,
            ..none
        },
        Unknowns {
            per_meter: true,
            ..constant
        },
        Unknowns {
            incidence: true,
            ..constant
        },
    ]
}

#[test]
fn sets_of_boards_determine_what_the_table_says() {
    // One row per set: whether each of the five sets of unknowns is determined.
    let table: [(&str, Vec<BoardPlane>, [bool; 5]); 9] = [
        (
            "face-on",
            [1.0, 1.3, 1.6, 1.9, 2.2].map(|r| tilted(r, 0.0, 0.0)).to_vec(),
            [false; 5],
        ),
        (
            "one orientation",
            [1.0, 1.3, 1.6, 1.9, 2.2].map(|r| tilted(r, 40.0, 30.0)).to_vec(),
            [false; 5],
        ),
        (
            "hinge",
            [(1.0, 40.0), (1.3, -40.0), (1.6, 20.0), (1.9, -20.0), (2.2, 30.0)]
                .map(|(r, a)| tilted(r, a, 70.0))
                .to_vec(),
            [false; 5],
        ),
        (
            "vertical, equally far",
            [-40.0, -20.0, 0.0, 20.0, 40.0].map(|y| vertical(1.5, y)).to_vec(),
            [true, false, false, false, false],
        ),
        (
            "vertical",
            [(1.0, -40.0), (1.5, -20.0), (2.0, 0.0), (2.5, 20.0), (3.0, 40.0)]
                .map(|(r, y)| vertical(r, y))
                .to_vec(),
            [true, true, true, false, true],
        ),
        (
            "four vertical and one pitched",
            vec![
                vertical(1.0, -40.0),
                vertical(1.6, -20.0),
                vertical(2.0, 20.0),
                vertical(2.6, 40.0),
                tilted(1.5, 45.0, -90.0),
            ],
            [true; 5],
        ),
        (
            "two",
            vec![tilted(1.5, 45.0, 0.0), tilted(1.5, 45.0, 90.0)],
            [true, false, false, false, false],
        ),
        (
            "three around",
            [0.0, 120.0, 240.0].map(|p| tilted(1.5, 45.0, p)).to_vec(),
            [true, true, true, false, false],
        ),
        (
            "three on one side",
            [0.0, 45.0, 90.0].map(|p| tilted(1.5, 45.0, p)).to_vec(),
            [true, true, true, false, false],
        ),
    ];
    for (name, boards, expected) in &table {
        for (unknowns, determined) in columns().into_iter().zip(expected) {
            let found = of_element(boards, unknowns);
            let width = found.unknowns.len();
            assert_eq!(
                found.rank == width,
                *determined,
                "{name}, {unknowns:?}: rank {} of {width}",
                found.rank
            );
            assert_eq!(found.open.len(), width - found.rank);
            for open in &found.open {
                // No finite number along it: every unknown that takes part is open.
                for (unknown, _) in open.terms.iter().filter(|t| t.1.abs() > 0.1) {
                    assert_eq!(found.per_meter(unknown), None, "{name}: {unknown}");
                }
            }
        }
    }
}

#[test]
fn open_directions_have_the_right_names() {
    let names = |found: &Determined| -> Vec<String> {
        let mut all: Vec<String> = found.open[0].terms.iter().map(|t| t.0.clone()).collect();
        all.sort();
        all
    };
    // Vertical boards: elevation is a scale of the range.
    let vertical =
        [(1.0, -40.0), (1.5, -20.0), (2.0, 0.0), (2.5, 20.0), (3.0, 40.0)].map(|(r, y)| vertical(r, y));
    let [_, _, _, scale, _] = columns();
    let found = of_element(&vertical, scale);
    assert!(names(&found).contains(&"φ".to_owned()) && names(&found).contains(&"A_c".to_owned()));
    assert!(found.open[0].words.contains("pitched"), "{}", found.open[0].words);
    // A hinge toward ψ = 70°: the open direction is the one across, (−sin ψ, cos ψ) in (θ, φ).
    let hinge = [(1.0, 40.0), (1.3, -40.0), (1.6, 20.0)].map(|(r, a)| tilted(r, a, 70.0));
    let found = of_element(&hinge, Unknowns::default());
    assert_eq!(found.rank, 1);
    let share = |name: &str| {
        found.open[0]
            .terms
            .iter()
            .find(|t| t.0 == name)
            .expect("the unknown takes part")
            .1
    };
    let psi = beam::direction(70.0_f64.to_radians());
    assert!((share("θ") / share("φ") + psi.y / psi.x).abs() < 1e-9);
    // Equal tilts: A_a acts as a constant.
    let around = [0.0, 90.0, 180.0, 270.0, 45.0].map(|p| tilted(1.2, 45.0, p));
    let [.., incidence] = columns();
    let found = of_element(&around, incidence);
    assert_eq!(names(&found), ["A_a", "B"]);
    // Equal ranges: so does A_c. B_a and B_c need no test: they are one unknown here.
    let found = of_element(&around, scale);
    assert_eq!(names(&found), ["A_c", "B"]);
}

/// Facets that face different directions, each with five boards of its own, and direct beams of two fans on boards.
fn structure(facets: usize, direct: &[f64]) -> Layout {
    let mut layout = Layout::default();
    for facet in 0..facets {
        let middle = [-1.6, -0.3, 1.1, 1.9][facet];
        let tilt = [0.45, 0.6, 0.5, 0.55][facet];
        let u = beam::direction(middle);
        let aside = beam::direction(middle + 1.57).into_inner() * [0.1, -0.2, 0.25, -0.1][facet];
        let normal = Unit::new_normalize(-u.into_inner() + Vector3::z() * tilt + aside);
        let plane = MirrorPlane::through(Point3::from(u.into_inner() * 0.07), normal);
        layout.facets.push(plane);
        let exit = plane
            .deflect(u)
            .expect("the facet faces its beams")
            .exit_direction(middle);
        let rays: Vec<usize> = (-5..=5)
            .map(|i| {
                layout.rays.push(Ray::OfFacet {
                    azimuth: middle + 0.02 * f64::from(i),
                    facet,
                });
                layout.rays.len() - 1
            })
            .collect();
        boards(&mut layout, &rays, &exit);
    }
    for middle in direct {
        let rays: Vec<usize> = (-5..=5)
            .map(|i| {
                layout.rays.push(Ray::Direct {
                    azimuth: middle + 0.0175 * f64::from(i),
                });
                layout.rays.len() - 1
            })
            .collect();
        boards(&mut layout, &rays, &beam::direction(*middle));
    }
    layout
}

fn boards(layout: &mut Layout, rays: &[usize], along: &Unit<Vector3<f64>>) {
    for (s, tilt, psi) in [
        (1.2, 0.7, 0.1),
        (1.5, 0.6, 1.4),
        (1.8, 0.75, 2.7),
        (1.4, 0.5, 3.9),
        (1.1, 0.65, 5.2),
    ] {
        let (across, up) = frame::tangent_basis(along);
        let psi = beam::direction(psi);
        let axis = Unit::new_normalize(across.into_inner() * psi.x + up.into_inner() * psi.y);
        let turn = Pose::rotation(axis.into_inner() * tilt);
        layout.boards.push(BoardPlane::new(
            Point3::from(along.into_inner() * s),
            Unit::new_unchecked(turn * -along.into_inner()),
        ));
        let board = layout.boards.len() - 1;
        layout.sights.extend(rays.iter().map(|r| (*r, board)));
    }
}

#[test]
fn the_sensor_s_place_is_determined_as_the_table_says() {
    let sensor = Unknowns {
        mounting: true,
        ..Unknowns::default()
    };
    for (facets, direct, parameters, rank) in [
        (1, &[][..], 9, 6),
        (2, &[][..], 12, 11),
        (3, &[][..], 15, 15),
        (4, &[][..], 18, 18),
        (0, &[0.4][..], 6, 6),
        (1, &[0.4][..], 9, 9),
        (1, &[0.4, -2.2][..], 9, 9),
        (3, &[0.4, -2.2][..], 15, 15),
    ] {
        let found = determine(&structure(facets, direct), &sensor).expect("every ray hits its boards");
        assert_eq!(
            (found.unknowns.len(), found.rank),
            (parameters, rank),
            "{facets} facets, {} direct fans",
            direct.len()
        );
        for open in &found.open {
            assert!(
                open.words.contains("sensor") && open.words.contains("undeflected"),
                "{}",
                open.words
            );
        }
    }
    let all = Unknowns {
        mounting: true,
        constant: true,
        per_meter: true,
        incidence: true,
        distance: false,
    };
    let found = determine(&structure(3, &[0.4, -2.2]), &all).expect("every ray hits its boards");
    assert_eq!((found.unknowns.len(), found.rank), (18, 18));
}

#[test]
fn two_mirrors_turn_about_the_line_in_which_they_meet() {
    let layout = structure(2, &[]);
    let sensor = Unknowns {
        mounting: true,
        ..Unknowns::default()
    };
    let found = determine(&layout, &sensor).expect("every ray hits its boards");
    let share = |name: &str| {
        found.open[0]
            .terms
            .iter()
            .find(|t| t.0.starts_with(name))
            .map_or(0.0, |t| t.1)
    };
    let turn = Vector3::new(share("roll"), share("pitch"), share("yaw")).normalize();
    let line = layout.facets[0]
        .normal
        .cross(&layout.facets[1].normal)
        .normalize();
    assert!(
        turn.dot(&line).abs() > 1.0 - 1e-6,
        "turns about {turn}, the planes meet along {line}"
    );
}
