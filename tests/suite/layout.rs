//! The results of `layout` agree with the simulator.
//!
//! Classes are compared with the truth of a simulation, element by element; ranges, spots, sensitivities and fields of
//! regard with closed forms and with the simulator itself. These do not prove that the simulator's optics are correct;
//! `physics` does.

use crate::common::{VALID, folder_with, run, stderr, stdout};
use catoptric::cast::{Polygon, Shape};
use catoptric::files::scene as scenes;
use catoptric::layout::{self, Analysis, Class, Detail};
use catoptric::model::beam;
use catoptric::sim::build::Structure;
use catoptric::sim::build::color;
use catoptric::sim::light::footprint::{self, SubRay};
use catoptric::sim::light::{Mirrors, Role, Setting, Target};
use catoptric::sim::receive::Sensor;
use catoptric::sim::scene::{Facet, FacetShape, PolygonShape};
use catoptric::sim::truth::BeamClass;
use catoptric::sim::{Laboratory, Scene};
use catoptric_fixtures::ust20lx;
use nalgebra::{Point3, Rotation3, Unit, Vector3};
use std::path::{Path, PathBuf};

/// The built-in layouts.
const GALLERY: [&str; 4] = [
    "prototype.toml",
    "two-mirror.toml",
    "gallery/pyramid.toml",
    "gallery/altimeter.toml",
];

fn load(path: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(path);
    scenes::load(&path, &[]).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// All scenes of the repository that can be recorded.
fn recordable() -> Vec<(PathBuf, Scene)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut folders = vec![root];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "toml") {
                let scene = scenes::load(&path, &[]).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                found.push((path, scene));
            }
        }
    }
    found.retain(|(_, scene)| !scene.has_no_laboratory() && !scene.only_shows_mirrors());
    found
}

fn assert_equals_the_truth(scene: &Scene, analysis: &Analysis, name: &str) {
    let truth = Laboratory::new(scene, scene.seed).unwrap().truth().unwrap();
    assert_eq!(truth.beams.len(), analysis.elements.len());
    for (true_beam, element) in truth.beams.iter().zip(&analysis.elements) {
        let at = format!("{name}, beam {}", true_beam.beam);
        assert_eq!(true_beam.beam, element.beam, "{at}");
        assert_eq!(true_beam.status, element.status, "{at}");
        assert_eq!(true_beam.facets, element.facets, "{at}");
        // Of a beam that an edge divides, shares of the same energies are added up, in another number of parts.
        let apart = (true_beam.chief_energy - element.chief_energy).abs();
        assert!(apart < 1e-12, "{at}: {apart}");
        let of_class = match element.class {
            Class::Direct => BeamClass::Direct,
            Class::Deflected => BeamClass::Deflected,
            Class::MultiBounce => BeamClass::MultiBounce,
            Class::Split => BeamClass::Split,
            Class::HitsStructure | Class::Shaded => BeamClass::Blocked,
            Class::Trapped => BeamClass::Lost,
            Class::TooFaint => element.status,
        };
        assert_eq!(of_class, true_beam.status, "{at}");
        let exit = true_beam
            .exit_direction(ust20lx::azimuth(true_beam.beam))
            .map(|v| libm::atan2(v.z, libm::hypot(v.x, v.y)).to_degrees());
        if let (Some(exit), Some(elevation)) = (exit, element.exit_elevation_deg) {
            assert!((exit - elevation).abs() < 1e-9, "{at}: {exit} {elevation}");
        }
    }
}

#[test]
fn classes_equal_those_of_the_truth_in_every_scene() {
    let scenes = recordable();
    assert!(scenes.len() > 30, "{}", scenes.len());
    for layout in scenes::Template::ALL {
        if layout == scenes::Template::Blank {
            continue;
        }
        let drawn = scenes::parse(layout.text(), "template.toml", &[]).unwrap();
        assert!(
            scenes.iter().any(|(_, scene)| *scene == drawn),
            "{layout:?} is missing"
        );
    }
    for (path, scene) in scenes {
        let analysis = layout::analyze(&scene, Some(scene.seed), Detail::Full).unwrap();
        assert_equals_the_truth(&scene, &analysis, &path.display().to_string());
    }
}

#[test]
fn layouts_of_the_gallery_can_be_calibrated() {
    use catoptric::calib::{Calibrator, Method};
    // The other two have many tests elsewhere.
    for name in ["gallery/pyramid.toml", "gallery/altimeter.toml"] {
        let mut scene = load(name);
        scene.experiment.scans_per_pose = 30;
        for seed in [1, 2] {
            let laboratory = Laboratory::new(&scene, seed).unwrap();
            let (dataset, truth) = (laboratory.dataset().unwrap(), laboratory.truth().unwrap());
            let calibration = Method::Joint.calibrate(&dataset).unwrap();
            let score = catoptric::score(&dataset, &calibration, Some(&truth)).expect("in memory");
            assert!(score.beams.solved >= 10, "{name} {seed}: {:?}", score.beams);
            assert_eq!(
                (score.beams.missed, score.beams.wrong),
                (Some(0), Some(0)),
                "{name} {seed}"
            );
            // Elements share the error of the mounting, so one draw may be well above the bound.
            let (error, bound) = (score.per_axis_rms_deg, score.crlb_per_axis_deg);
            assert!(
                error > 0.0 && error < 3.0 * bound && bound < 0.1,
                "{name} {seed}: {error} {bound}"
            );
        }
    }
}

#[test]
fn classes_of_a_drawing_equal_those_of_a_structure_built_exactly() {
    for name in GALLERY {
        let mut scene = load(name);
        scene.superstructure.as_built = catoptric::sim::scene::AsBuilt {
            tilt_sd_deg: 0.0,
            shift_sd_mm: 0.0,
            slope_rms_mrad: 0.0,
            thickness_sd_mm: 0.0,
        };
        scene.scanner.mount.yaw_tolerance_deg = 0.0;
        scene.scanner.mount.tilt_tolerance_deg = 0.0;
        scene.scanner.mount.shift_tolerance_mm = 0.0;
        let analysis = layout::analyze(&scene, None, Detail::Full).unwrap();
        assert_equals_the_truth(&scene, &analysis, name);
        assert!(analysis.counts[&Class::Split] > 0 && analysis.counts[&Class::Deflected] > 10);
    }
}

/// A scanner without housing and one square mirror that part of the scan hits.
fn one_facet() -> Scene {
    let mut scene = load("prototype.toml");
    scene.scanner.housing = false;
    scene.superstructure.post.clear();
    scene.superstructure.facet.clear();
    let turn = Rotation3::from_euler_angles(0.4, 0.3, 0.7);
    let corners = [(-0.02, -0.02), (0.02, -0.02), (0.02, 0.02), (-0.02, 0.02)];
    let center = Point3::new(0.02, 0.07, 0.002);
    let corners_mm = corners
        .map(|(a, b)| (center + turn * Vector3::new(a, 0.0, b)).coords * 1e3)
        .map(Into::into);
    let mut corners_mm = corners_mm.to_vec();
    let face = Polygon::new(corners_mm.iter().map(|c: &[f64; 3]| Point3::from(*c)).collect()).unwrap();
    if face.normal.dot(&face.origin.coords) > 0.0 {
        corners_mm.reverse();
    }
    scene.superstructure.facet.push(Facet {
        name: "mirror".to_owned(),
        shape: FacetShape::Polygon(PolygonShape { corners_mm }),
        curve: None,
        bow_um: 0.0,
        two_sided: false,
        reflectivity: None,
        coating: None,
    });
    scene
}

#[test]
fn the_field_of_one_flat_facet_equals_its_closed_form() {
    for turns in [true, false] {
        let mut scene = one_facet();
        scene.scanner.beam = Some(catoptric::sim::scene::BeamShape {
            wide_full_mrad: 16.0,
            narrow_full_mrad: 2.5,
            wide_aperture_mm: 0.0,
            narrow_aperture_mm: 0.0,
            turns,
        });
        let analysis = layout::analyze(&scene, None, Detail::Full).unwrap();
        let facet = &analysis.facets[0];
        let own = || analysis.elements.iter().filter(|e| e.class == Class::Deflected);
        assert!(own().count() > 60 && facet.elements == own().count());
        // step·2·sin(δ/2) for each element; if the spot does not rotate, N times the same.
        let step = 0.25_f64.to_radians();
        let closed = if turns {
            own()
                .map(|e| {
                    let azimuth = e.scan_azimuth_deg.to_radians();
                    let [wide, narrow] = [0.008_f64, 0.00125].map(f64::tan);
                    2.0 * step * (wide * azimuth.sin()).hypot(narrow * azimuth.cos()).atan().sin()
                })
                .sum::<f64>()
        } else {
            facet.elements as f64 * step * 2.0 * 0.00125_f64.sin()
        };
        assert!(
            (facet.solid_angle_sr / closed - 1.0).abs() < 1e-12,
            "{} {closed}",
            facet.solid_angle_sr
        );
        // The whole field also includes the direct beams, which this fan does not cross.
        let direct = analysis.direct_field_of_regard * 4.0 * std::f64::consts::PI;
        assert!((analysis.solid_angle_sr / (closed + direct) - 1.0).abs() < 1e-12);
        assert_eq!(
            analysis.field_of_regard,
            analysis.solid_angle_sr / (4.0 * std::f64::consts::PI)
        );
    }
}

#[test]
fn directions_near_one_fan_fill_a_strip_with_round_ends() {
    // The fan of a flat facet is an arc of a great circle. A low wall all around stops every beam that the mirror does
    // not deflect below it, so nothing else is seen; without mirror and walls the scan itself is the arc.
    let mut walled = one_facet();
    let mut bare = walled.clone();
    bare.superstructure.facet.clear();
    for (name, center_mm, size_mm) in [
        ("front", [200.0, 0.0, 0.0], [1.0, 402.0, 4.0]),
        ("left", [0.0, 200.0, 0.0], [402.0, 1.0, 4.0]),
        ("back", [-200.0, 0.0, 0.0], [1.0, 402.0, 4.0]),
        ("right", [0.0, -200.0, 0.0], [402.0, 1.0, 4.0]),
    ] {
        walled.superstructure.post.push(catoptric::sim::scene::Post {
            name: name.to_owned(),
            center_mm,
            size_mm: Some(size_mm),
            shape: None,
            yaw_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            color: "structure".to_owned(),
        });
    }
    for (scene, least) in [(walled, 60), (bare, 1081)] {
        let analysis = layout::analyze(&scene, None, Detail::Full).unwrap();
        let arcs: Vec<_> = analysis.runs.iter().filter(|run| run.class.sees()).collect();
        assert_eq!(arcs.len(), 1, "{arcs:?}");
        let [first, last] = arcs[0].beams;
        assert!(last - first + 1 >= least);
        let arc = ust20lx::azimuth(last) - ust20lx::azimuth(first);
        let near = layout::NEAR_DEG.to_radians();
        let strip = 2.0 * arc * near.sin() + 2.0 * std::f64::consts::PI * (1.0 - near.cos());
        let closed = strip / (4.0 * std::f64::consts::PI);
        // Three of the 8000 sampled directions.
        let found = analysis.share_within_5_deg;
        assert!((found - closed).abs() < 3.75e-4, "{found} {closed}");
    }
}

#[test]
fn directions_seen_by_two_facets_count_once() {
    // An upright mirror sends its fan back into the scan plane, mostly to where undeflected beams are already.
    let mut scene = one_facet();
    scene.superstructure.facet[0].shape = FacetShape::Rectangle(catoptric::sim::scene::RectangleShape {
        center_mm: [60.0, 0.0, 0.0],
        normal: [-1.0, 0.5, 0.0],
        width_mm: 30.0,
        height_mm: 30.0,
    });
    let analysis = layout::analyze(&scene, None, Detail::Full).unwrap();
    let direct = analysis.direct_field_of_regard * 4.0 * std::f64::consts::PI;
    let own: Vec<_> = analysis
        .elements
        .iter()
        .filter(|e| e.class == Class::Deflected)
        .collect();
    let [wide, narrow] = [0.008_f64, 0.00125].map(f64::tan);
    let cell = |scan_azimuth_deg: f64| {
        let (sin, cos) = scan_azimuth_deg.to_radians().sin_cos();
        2.0 * ust20lx::STEP * (wide * sin).hypot(narrow * cos).atan().sin()
    };
    // Beyond the last beam of the scan nothing else sees. The fan is lower than the undeflected cells that it crosses.
    let beyond: Vec<f64> = own
        .iter()
        .filter(|e| e.exit_azimuth_deg.unwrap().abs() > 135.125)
        .map(|e| cell(e.scan_azimuth_deg))
        .collect();
    assert!(
        beyond.len() > 5 && own.len() > beyond.len() + 20,
        "{} of {}",
        beyond.len(),
        own.len()
    );
    let once = direct + beyond.iter().sum::<f64>();
    // One cell may extend across the end of the scan.
    assert!(
        (analysis.solid_angle_sr - once).abs() < cell(9.0),
        "{} {once}",
        analysis.solid_angle_sr
    );
    // Fans that cross at a point have almost nothing in common.
    let crossing = load("two-mirror.toml");
    let analysis = layout::analyze(&crossing, None, Detail::Full).unwrap();
    let sum: f64 = analysis.facets.iter().map(|f| f.solid_angle_sr).sum::<f64>()
        + analysis.direct_field_of_regard * 4.0 * std::f64::consts::PI;
    assert!(analysis.solid_angle_sr <= sum * (1.0 + 1e-12));
    let counted = counted_on_a_grid(&crossing, &analysis);
    assert!(
        (counted / analysis.solid_angle_sr - 1.0).abs() < 0.02,
        "{counted} {}",
        analysis.solid_angle_sr
    );
}

/// The field of regard by checking for each direction of a fine grid whether a cell contains it, cell by cell.
fn counted_on_a_grid(scene: &Scene, analysis: &Analysis) -> f64 {
    let structure = Structure::nominal(scene).unwrap();
    let shape = scene.scanner.beam_shape();
    let [wide, narrow] = [shape.wide_full_mrad, shape.narrow_full_mrad].map(|full| (0.5e-3 * full).tan());
    let mut total = 0.0;
    let rows = 3600;
    for row in 0..rows {
        let z = 2.0 * (f64::from(row) + 0.5) / f64::from(rows) - 1.0;
        let columns = 3600;
        for column in 0..columns {
            let azimuth = std::f64::consts::TAU * f64::from(column) / f64::from(columns);
            let radius = (1.0 - z * z).sqrt();
            let direction = Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), z);
            let turned_back = std::iter::once((None, direction)).chain(structure.facets.iter().map(|f| {
                let m = f.face.normal.into_inner();
                (Some(f.name.as_str()), direction - m * (2.0 * m.dot(&direction)))
            }));
            let seen = turned_back.into_iter().any(|(facet, u)| {
                let Some(beam) = ust20lx::nearest(u.y.atan2(u.x)) else {
                    return false;
                };
                let element = &analysis.elements[beam];
                let own = match facet {
                    None => element.class == Class::Direct,
                    Some(name) => element.class == Class::Deflected && element.facets[0] == name,
                };
                let (sin, cos) = ust20lx::azimuth(beam).sin_cos();
                own && u.z.asin().abs() <= (wide * sin).hypot(narrow * cos).atan()
            });
            if seen {
                total += 4.0 * std::f64::consts::PI / f64::from(rows) / f64::from(columns);
            }
        }
    }
    total
}

/// Moves the corners of a facet: rotated about their mean, then shifted.
fn moved(scene: &Scene, facet: usize, turn: Vector3<f64>, shift: Vector3<f64>) -> Scene {
    let structure = Structure::nominal(scene).unwrap();
    let corners = &structure.facets[facet].face.corners;
    let center = corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / corners.len() as f64;
    let rotation = Rotation3::new(turn);
    let place = |c: &Point3<f64>| (center + shift + rotation * (c.coords - center)) * 1e3;
    let mut scene = scene.clone();
    scene.superstructure.facet[facet].shape = FacetShape::Polygon(PolygonShape {
        corners_mm: corners.iter().map(|c| place(c).into()).collect(),
    });
    scene
}

/// The point on a beam's chief ray at a given path length, from the simulator.
fn point_at(scene: &Scene, beam: usize, range: f64) -> Point3<f64> {
    let structure = Structure::nominal(scene).unwrap();
    let sensor = Sensor::new(scene).unwrap();
    let setting = Setting::new(scene, &structure, Mirrors::Attached, Vec::new()).unwrap();
    let path = sensor.chief_path(&setting, beam);
    assert!(!path.facets().is_empty());
    path.last.origin + path.last.direction.into_inner() * (range - path.length)
}

#[test]
fn sensitivities_are_the_simulators_finite_differences() {
    for name in GALLERY {
        let mut scene = load(name);
        scene.scanner.sub_rays = 1;
        let structure = Structure::nominal(&scene).unwrap();
        let analysis = layout::analyze(&scene, None, Detail::Full).unwrap();
        for (number, facet) in analysis.facets.iter().enumerate() {
            let Some([first, last]) = facet.beams else {
                continue;
            };
            let normal = structure.facets[number].face.normal;
            let across = Unit::new_normalize(normal.cross(&Vector3::new(0.3, 0.5, 0.7)));
            let along = normal.cross(&across);
            let differences = |beam: usize, turn: Vector3<f64>, shift: Vector3<f64>| {
                let [ahead, behind] = [1.0, -1.0]
                    .map(|sign| point_at(&moved(&scene, number, turn * sign, shift * sign), beam, 4.0));
                (ahead - behind) * 0.5
            };
            let (mut square, mut count, mut worst) = (0.0, 0.0_f64, 0.0_f64);
            let turn = 1e-4;
            for beam in first + 2..last - 1 {
                if !analysis.elements[beam].class.sees() {
                    continue;
                }
                let [a, b] = [across.into_inner(), along]
                    .map(|axis| differences(beam, axis * turn, Vector3::zeros()) / turn);
                let jacobian = nalgebra::Matrix3x2::from_columns(&[a, b]);
                let by_turn = jacobian.singular_values().max() * 0.1_f64.to_radians() * 1e3;
                square += by_turn * by_turn;
                count += 1.0;
                worst = worst.max(by_turn);
            }
            let rms = facet.point_at_4m_per_0_1_deg_rms_mm.unwrap();
            // Central differences of 0.1 mrad deviate from the derivative quadratically; the elements at both ends,
            // which a rotation may move off the mirror, are excluded.
            let found: f64 = (square / count).sqrt();
            assert!(
                (rms / found - 1.0).abs() < 1e-3,
                "{name} {}: {rms} {found}",
                facet.name
            );
            let max = facet.point_at_4m_per_0_1_deg_max_mm.unwrap();
            assert!(
                (max / worst - 1.0).abs() < 2e-3,
                "{name} {}: {max} {worst}",
                facet.name
            );
            let middle = (first + last) / 2;
            let by_shift =
                differences(middle, Vector3::zeros(), normal.into_inner() * 1e-4).norm() / 1e-4 * 0.1;
            let shift = facet.point_at_4m_per_0_1_mm_mm.unwrap();
            assert!(
                (shift / by_shift - 1.0).abs() < 1e-9 && (shift - 0.2).abs() < 1e-12,
                "{shift} {by_shift}"
            );
        }
    }
}

/// Whether a face-on target of a color on a beam's last leg, at a given total path length, returns an echo.
fn is_seen(scene: &Scene, beam: usize, range: f64, color_name: &str) -> bool {
    let structure = Structure::nominal(scene).unwrap();
    let sensor = Sensor::new(scene).unwrap();
    let bare = Setting::new(scene, &structure, Mirrors::Attached, Vec::new()).unwrap();
    let path = sensor.chief_path(&bare, beam);
    let v = path.last.direction;
    let center = path.last.origin + v.into_inner() * (range - path.length);
    let across = v.cross(&Vector3::new(0.31, -0.47, 0.2)).normalize();
    let up = v.cross(&across);
    let half = 0.2 * range;
    let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    let corners = corners
        .map(|(a, b)| center + across * (a * half) + up * (b * half))
        .to_vec();
    let target = Target {
        name: "target".to_owned(),
        shape: Shape::Polygon(Polygon::new(corners).unwrap()),
        role: Role::Board,
        paint: color::paint(scene, color_name).unwrap(),
    };
    let setting = Setting::new(scene, &structure, Mirrors::Attached, vec![target]).unwrap();
    sensor
        .observe(&setting, beam)
        .is_some_and(|found| found.role == Role::Board)
}

#[test]
fn the_longest_range_is_where_the_simulator_loses_a_target() {
    let mut scene = load("prototype.toml");
    scene.color.insert(
        "dark".to_owned(),
        catoptric::sim::scene::Color {
            reflectivity: 0.1,
            noise: None,
        },
    );
    scene.errors.model = catoptric::sim::scene::ErrorModel::None;
    let analysis = layout::analyze(&scene, None, Detail::Full).unwrap();
    for facet in &analysis.facets {
        let [first, last] = facet.beams.unwrap();
        let element = &analysis.elements[(first + last) / 2];
        let dark = element.range_max_dark_m.unwrap();
        // Two passes by a mirror of 0.9 reduce the range by a tenth.
        assert!((dark - 7.2).abs() < 1e-9, "{dark}");
        // The light of a face-on target is spread over ranges that differ by at most 1 mm.
        assert!(
            is_seen(&scene, element.beam, dark * 0.999, "dark"),
            "{}",
            facet.name
        );
        assert!(
            !is_seen(&scene, element.beam, dark * 1.001, "dark"),
            "{}",
            facet.name
        );
        assert_eq!(element.range_max_white_m, Some(20.0));
    }
    assert!((analysis.elements[540].range_max_dark_m.unwrap() - 8.0).abs() < 1e-12);
}

#[test]
fn light_absorbed_by_mirrors_is_too_faint() {
    let mut scene = load("prototype.toml");
    let bright = layout::analyze(&scene, None, Detail::Coarse).unwrap();
    scene.superstructure.mirror.reflectivity = 1e-3;
    let analysis = layout::analyze(&scene, None, Detail::Coarse).unwrap();
    // 24 m · 10⁻³ is closer than any of the mirrors.
    assert_eq!(analysis.counts[&Class::Deflected], 0);
    assert!(bright.counts[&Class::Deflected] > 400 && bright.counts[&Class::TooFaint] == 0);
    assert_eq!(
        analysis.counts[&Class::TooFaint],
        bright.counts[&Class::Deflected]
    );
    assert!(
        analysis
            .facets
            .iter()
            .all(|f| f.elements == 0 && f.point_at_4m_per_0_1_deg_rms_mm.is_none())
    );
    let [whole, direct] = [analysis.field_of_regard, analysis.direct_field_of_regard];
    assert!((whole / direct - 1.0).abs() < 1e-12 && direct > 0.0);
}

#[test]
fn a_spot_is_as_wide_as_the_simulated_sub_rays() {
    for preset in ["prototype.toml", "ust-20lx-cooper.toml"] {
        let scene = load(preset);
        let analysis = layout::analyze(&scene, None, Detail::Coarse).unwrap();
        let shape = scene.scanner.beam_shape();
        for spot in &analysis.spots {
            let at = |wide: f64, narrow: f64| {
                let sub_ray = SubRay {
                    wide,
                    narrow,
                    weight: 1.0,
                };
                let ray = footprint::ray(&shape, 0.4, &sub_ray);
                let chief = beam::direction(0.4);
                let length = (spot.range_m - ray.origin.coords.dot(&chief)) / ray.direction.dot(&chief);
                ray.origin + ray.direction.into_inner() * length
            };
            let wide = (at(1.0, 0.0) - at(-1.0, 0.0)).norm() * 1e3;
            let narrow = (at(0.0, 1.0) - at(0.0, -1.0)).norm() * 1e3;
            assert!(
                (wide / spot.wide_mm - 1.0).abs() < 1e-12,
                "{wide} {}",
                spot.wide_mm
            );
            assert!(
                (narrow / spot.narrow_mm - 1.0).abs() < 1e-12,
                "{narrow} {}",
                spot.narrow_mm
            );
        }
    }
}

#[test]
fn an_edge_cuts_a_beam_where_its_margin_is_zero() {
    // The contour represents 14 % of the light outside and is drawn with 16 corners: between 0.1 mm beyond an edge and
    // 1 mm inside it, either class is possible.
    let mut cut = 0;
    for scene in [load("prototype.toml"), one_facet()] {
        let analysis = layout::analyze(&scene, None, Detail::Full).unwrap();
        for element in &analysis.elements {
            let Some(margin) = element.margin_mm else { continue };
            if margin < -0.1 {
                cut += 1;
                assert!(!element.class.sees(), "beam {} with {margin} mm", element.beam);
            }
            if margin > 1.0 {
                assert_eq!(
                    element.class,
                    Class::Deflected,
                    "beam {} with {margin} mm",
                    element.beam
                );
            }
        }
    }
    assert!(cut >= 8, "{cut}");
}

#[test]
fn size_and_mass_of_a_plain_structure_agree_with_hand_calculation() {
    let mut scene = one_facet();
    scene.superstructure.post.push(catoptric::sim::scene::Post {
        name: "block".to_owned(),
        center_mm: [-50.0, 0.0, 0.0],
        size_mm: Some([10.0, 20.0, 30.0]),
        shape: None,
        yaw_deg: 0.0,
        pitch_deg: 0.0,
        roll_deg: 0.0,
        color: "structure".to_owned(),
    });
    let size = layout::analyze(&scene, None, Detail::Coarse).unwrap().size;
    assert!((size.mirror_area_mm2 - 1600.0).abs() < 1e-9);
    // 1 mm of glass, 2.5 g/cm³; 6 cm³ of plastic, 1.24 g/cm³.
    assert!((size.mirror_mass_g - 4.0).abs() < 1e-9, "{}", size.mirror_mass_g);
    assert!((size.post_mass_g - 7.44).abs() < 1e-9, "{}", size.post_mass_g);
    assert!((size.structure_mass_g - 11.44).abs() < 1e-9);
    assert_eq!(size.scanner_mass_g, Some(130.0));
    // Zero is never printed as −0.
    scene.superstructure.facet.clear();
    let none = layout::analyze(&scene, None, Detail::Coarse).unwrap().size;
    assert!(none.mirror_area_mm2 == 0.0 && none.mirror_area_mm2.is_sign_positive());
}

#[test]
fn the_predicted_accuracy_is_the_bound_used_in_scores() {
    for name in ["two-mirror.toml", "reference-facet.toml", "prototype.toml"] {
        let mut scene = load(name);
        scene.experiment.scans_per_pose = 20;
        let laboratory = Laboratory::new(&scene, scene.seed).unwrap();
        let (dataset, truth) = (laboratory.dataset().unwrap(), laboratory.truth().unwrap());
        let method = catoptric::calib::Method::Joint;
        let calibration =
            catoptric::calib::calibrate(&dataset, method, &catoptric::calib::Options::default()).unwrap();
        let score = catoptric::score(&dataset, &calibration, Some(&truth)).expect("in memory");
        let predicted = layout::predict(&scene, scene.seed);
        let bound = predicted.per_axis_deg.unwrap();
        assert!(
            (bound / score.crlb_per_axis_deg - 1.0).abs() < 0.005,
            "{name}: {bound} {}",
            score.crlb_per_axis_deg
        );
        let elements: usize = predicted.facets.iter().map(|f| f.determined + f.open).sum();
        assert_eq!(elements, predicted.determined + predicted.open);
        assert_eq!(predicted.board_poses, laboratory.board_poses());
    }
}

fn root(path: &str) -> String {
    format!("{}/{path}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_verb_prints_judges_and_writes() {
    let folder = tempfile::tempdir().unwrap();
    let prototype = root("scenes/prototype.toml");
    let output = run(folder.path(), &["layout", &prototype, "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let analysis = layout::analyze(&load("prototype.toml"), None, Detail::Full).unwrap();
    assert_eq!(json["schema_version"], 1);
    assert_eq!(json["field_of_regard"].as_f64(), Some(analysis.field_of_regard));
    assert_eq!(json["elements"].as_array().unwrap().len(), 1081);
    assert!(json["accuracy"]["per_axis_deg"].as_f64().unwrap() > 0.01);
    // The structure as built differs.
    let built = run(
        folder.path(),
        &[
            "layout",
            &prototype,
            "--coarse",
            "--as-built",
            "--seed",
            "3",
            "--json",
        ],
    );
    let built: serde_json::Value = serde_json::from_str(&stdout(&built)).unwrap();
    assert_eq!(
        (&built["seed"], &built["accuracy"]),
        (&3.into(), &serde_json::Value::Null)
    );
    assert_ne!(built["field_of_regard"], json["field_of_regard"]);

    let met = run(
        folder.path(),
        &[
            "layout",
            &prototype,
            "--coarse",
            "--require",
            "field_of_regard>=0.004",
            "--require",
            "facets.*.elements > 50",
        ],
    );
    assert!(met.status.success(), "{}", stderr(&met));
    let unmet = run(
        folder.path(),
        &[
            "layout",
            &prototype,
            "--coarse",
            "--require",
            "field_of_regard>=0.3",
            "--require",
            "facets.left-1.elements<60",
        ],
    );
    assert_eq!(unmet.status.code(), Some(1));
    let said = stderr(&unmet);
    assert!(
        said.contains("not met: prototype: field_of_regard is 0.00")
            && said.contains("facets.left-1.elements is 60")
    );
    // A figure that does not exist meets no limit.
    let none = run(
        folder.path(),
        &["layout", &prototype, "--coarse", "--require", "accuracy<1"],
    );
    assert_eq!(none.status.code(), Some(1), "{}", stderr(&none));
}

#[test]
fn bad_requirements_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let prototype = root("scenes/prototype.toml");
    for (requirement, said) in [
        ("field_of_regrad>=0.3", "did you mean field_of_regard?"),
        ("facets.*.margin_m>=0.3", "did you mean facets.*.margin_mm?"),
        ("field_of_regard", "is not a requirement"),
        ("field_of_regard>=much", "is not a requirement"),
        (">=1", "is not a requirement"),
        ("field_of_regard>=inf", "is not a requirement"),
        ("wings>=2", "every number of --json has a name"),
    ] {
        let output = run(
            folder.path(),
            &["layout", &prototype, "--coarse", "--require", requirement],
        );
        assert_eq!(
            output.status.code(),
            Some(2),
            "{requirement}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains(said),
            "{requirement}: {}",
            stderr(&output)
        );
    }
}

#[test]
fn pages_and_pictures_are_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = [root("scenes/prototype.toml"), root("scenes/two-mirror.toml")];
    for threads in ["1", "3"] {
        let output = run(
            folder.path(),
            &[
                "layout",
                &scenes[0],
                &scenes[1],
                "--out",
                threads,
                "--threads",
                threads,
            ],
        );
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let files = |name: &str| -> Vec<(String, Vec<u8>)> {
        let entries = std::fs::read_dir(folder.path().join(name)).unwrap();
        let mut files: Vec<_> = entries
            .map(|e| e.unwrap())
            .map(|e| {
                (
                    e.file_name().into_string().unwrap(),
                    std::fs::read(e.path()).unwrap(),
                )
            })
            .collect();
        files.sort();
        files
    };
    let (one, three) = (files("1"), files("3"));
    assert_eq!(one, three);
    let names: Vec<&str> = one.iter().map(|(name, _)| name.as_str()).collect();
    for name in [
        "layout.json",
        "report.html",
        "1-field.svg",
        "2-perspective.png",
        "1-footprints-1-left-1.svg",
        "2-scan.svg",
    ] {
        assert!(names.contains(&name), "{names:?}");
    }
    let page = String::from_utf8(one.iter().find(|(n, _)| n == "report.html").unwrap().1.clone()).unwrap();
    // Self-contained: nothing is loaded from elsewhere.
    assert!(!page.contains("http") && !page.contains("<script") && page.contains("data:image/png;base64,"));
    assert!(
        !page.contains("could not be drawn")
            && page.contains("two-mirror")
            && page.contains("Field of regard")
    );
    let json: serde_json::Value =
        serde_json::from_slice(&one.iter().find(|(n, _)| n == "layout.json").unwrap().1).unwrap();
    assert_eq!(json["layouts"].as_array().unwrap().len(), 2);
    // Every SVG is a standalone file.
    for (name, bytes) in one.iter().filter(|(n, _)| n.ends_with(".svg")) {
        let text = String::from_utf8_lossy(bytes);
        assert!(
            text.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\""),
            "{name}"
        );
        assert!(text.trim_end().ends_with("</svg>"), "{name}");
    }
}

#[test]
fn a_missing_bound_on_a_calibration_is_explained() {
    let (folder, _) = folder_with(VALID);
    for (set, reason) in [
        ("errors.model=\"none\"", "no bound: the scene has no errors"),
        ("superstructure.facet.0.two_sided=true", "per axis"),
    ] {
        let output = run(folder.path(), &["layout", "scene.toml", "--set", set]);
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(stdout(&output).contains(reason), "{}", stdout(&output));
    }
    let predicted = layout::predict(&load("traps/ridge.toml"), 1);
    assert!(
        predicted.per_axis_deg.is_none() && predicted.reason.is_some(),
        "{predicted:?}"
    );
}
