//! Strategies for random valid scenes that shrink toward simple ones.
//!
//! Every number is a simple value plus an integer number of steps, so that it is round and shrinks to the simple value;
//! every choice shrinks to its first option.

use super::random_scene::RandomScene;
use catoptric_files::scene::Template;
use catoptric_sim::scene::{
    BeamShape, Board, ErrorModel, Experiment, Facet, FacetShape, Limits, Mocap, MocapProfile, Preset, Room,
    Scanner, Wedge,
};
use catoptric_sim::{Laboratory, Scene, check};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use std::ops::RangeInclusive;

/// A number some steps away from a simple value.
fn around(simple: f64, step: f64, steps: RangeInclusive<i32>) -> impl Strategy<Value = f64> + Clone {
    // Rounded, since 3 · 0.1 is not 0.3.
    steps.prop_map(move |k| ((simple + step * f64::from(k)) * 1e6).round() / 1e6)
}

/// The scene that all others are derived from.
fn base() -> Scene {
    let parsed = toml::from_str(Template::Prototype.text());
    parsed.expect("the built-in scene is valid")
}

/// Turns off all errors of the sensor, the room and the recording, as [`closure`](super::closure) requires; the mirrors
/// stay as built.
#[must_use]
pub fn without_errors(mut scene: Scene) -> Scene {
    scene.scanner.sub_rays = 1;
    scene.superstructure.as_built.slope_rms_mrad = 0.0;
    scene.errors.model = ErrorModel::None;
    scene.mocap = Mocap {
        profile: MocapProfile::Ideal,
        dropout: 0.0,
        marker: None,
        ..scene.mocap
    };
    // If d is measured by other means, it still is, but exactly.
    scene.experiment.bare_distance_sd_mm = scene.experiment.bare_distance_sd_mm.map(|_| 0.0);
    scene.experiment.scans_per_pose = 1;
    scene.experiment.room_scans = 1;
    scene.experiment.bare_scans = 1;
    scene
}

/// Presets in whose housings no mirror of [`superstructures`] stands.
const SMALL: [Preset; 6] = [
    Preset::Ust20lx,
    Preset::Ust20lxCooper,
    Preset::Ust10lx,
    Preset::Utm30lx,
    Preset::Utm30lxEw,
    Preset::Custom,
];

/// Scanners: presets and custom ones, with pencil beams and finite ones, with and without a housing. The simplest is the
/// UST-20LX with one ray per beam.
pub fn scanners() -> impl Strategy<Value = Scanner> {
    let own = (
        around(20.0, 1.0, -8..=20),
        around(40.0, 5.0, -6..=4),
        around(2.0, 0.5, -3..=20),
        around(1.0, 0.5, -1..=4),
    );
    (
        select(SMALL.to_vec()),
        select(vec![1_u32, 7, 19]),
        select(vec![true, false]),
        own,
    )
        .prop_map(
            |(preset, sub_rays, housing, (range_max_m, scan_rate_hz, wide, narrow))| {
                let is_own = preset == Preset::Custom;
                Scanner {
                    preset,
                    sub_rays,
                    housing,
                    custom: is_own.then_some(Limits {
                        range_max_m,
                        scan_rate_hz,
                        ..Limits::default()
                    }),
                    beam: is_own.then_some(BeamShape {
                        wide_full_mrad: wide,
                        narrow_full_mrad: narrow,
                        wide_aperture_mm: 0.0,
                        narrow_aperture_mm: 0.0,
                        turns: true,
                    }),
                    ..base().scanner
                }
            },
        )
}

/// Rooms in which boards fit in all directions from the rig. The simplest is 7 × 7 × 4.4 m with the rig in the middle.
pub fn rooms() -> impl Strategy<Value = Room> {
    (
        [around(7.0, 0.25, 0..=8), around(7.0, 0.25, 0..=8)],
        around(4.4, 0.1, 0..=10),
        [around(0.0, 0.05, -6..=6), around(0.0, 0.05, -6..=6)],
        around(0.0, 1.0, -180..=180),
    )
        .prop_map(|([x, y], z, [rig_x, rig_y], rig_yaw_deg)| Room {
            size_m: [x, y, z],
            rig_position_m: [rig_x, rig_y, 0.5 * z],
            rig_yaw_deg,
            ..base().room
        })
}

/// Boards and a procedure whose poses determine θ and φ: every group of beams gets at least four poses, tilted by 20° or
/// more in evenly distributed directions. The simplest is one white board of 1.2 × 1 m and the prototype's procedure.
pub fn board_designs() -> impl Strategy<Value = (Vec<Board>, Experiment)> {
    (
        vec(around(1200.0, 50.0, 0..=6), 1..=2),
        around(1000.0, 50.0, 0..=4),
        select(vec![6_u32, 5, 4, 8, 10]),
        [around(30.0, 1.0, -10..=5), around(50.0, 1.0, -5..=5)],
        [around(0.9, 0.05, 0..=4), around(1.5, 0.05, -2..=2)],
    )
        .prop_map(|(widths, height_mm, poses_per_group, tilt_deg, range_m)| {
            let base = base();
            let board = |(i, width_mm): (usize, &f64)| Board {
                name: if i == 0 {
                    "board".to_owned()
                } else {
                    format!("board-{}", i + 1)
                },
                width_mm: *width_mm,
                height_mm,
                ..base.board[0].clone()
            };
            let experiment = Experiment {
                poses_per_group,
                tilt_deg,
                range_m,
                scans_per_pose: 20,
                room_scans: 20,
                bare_scans: 20,
                ..base.experiment.clone()
            };
            (widths.iter().enumerate().map(board).collect(), experiment)
        })
}

/// A facet in its slot: width, distance, added azimuth and elevation of its middle beam, and whether it deflects upward.
type Slot = (f64, f64, f64, f64, bool);

fn slots(count: RangeInclusive<usize>) -> impl Strategy<Value = Vec<Slot>> {
    let slot = (
        around(10.0, 0.1, -20..=40),
        around(70.0, 0.1, -80..=120),
        around(0.0, 0.5, -40..=40),
        around(45.0, 0.5, -30..=40),
        select(vec![true, false]),
    );
    vec(slot, count)
}

/// Layouts that are valid in a room of [`rooms`] and for a scanner of [`scanners`]: one to eight facets on both sides
/// of a scanner whose forward sector is free, none of which occludes another. The simplest is one facet on the left;
/// everything else is without errors, so that [`closure`](super::closure) holds.
pub fn layouts() -> impl Strategy<Value = RandomScene> {
    (slots(1..=4), slots(0..=4), select(vec![1.0, -1.0])).prop_map(|(near, far, side)| {
        let mut scene = without_errors(base());
        scene.superstructure.post.clear();
        scene.superstructure.facet.clear();
        for (slots, sign) in [(near, side), (far, -side)] {
            let name = if sign > 0.0 { "left" } else { "right" };
            let facets = slots
                .iter()
                .enumerate()
                .map(|(i, slot)| facet(name, i, sign, slot));
            scene.superstructure.facet.extend(facets);
        }
        scene.room.size_m = [7.0, 7.0, 4.4];
        scene.room.rig_position_m = [0.0, 0.0, 2.2];
        scene.board[0].width_mm = 1200.0;
        scene.board[0].height_mm = 1000.0;
        RandomScene(scene)
    })
}

/// A facet in one of the slots of 17° from 62° on, of which it occupies 8° to 14°.
fn facet(side: &str, index: usize, sign: f64, &(width, distance_mm, turn, elevation, up): &Slot) -> Facet {
    let first = 63.0 + 17.0 * index as f64;
    let last = first + width;
    Facet {
        name: format!("{side}-{}", index + 1),
        curve: None,
        bow_um: 0.0,
        two_sided: false,
        reflectivity: None,
        coating: None,
        shape: FacetShape::Wedge(Wedge {
            azimuth_deg: if sign > 0.0 {
                [first, last]
            } else {
                [-last, -first]
            },
            distance_mm,
            exit_azimuth_deg: sign * (0.5 * (first + last) + turn),
            exit_elevation_deg: if up { elevation } else { -elevation },
            height_mm: 14.0,
        }),
    }
}

/// Complete experiments, with all errors of the prototype: a layout, a scanner, a room, a board design, motion capture
/// and a seed. Each passes `catoptric check`, and its boards can be placed.
pub fn scenes() -> impl Strategy<Value = RandomScene> {
    let mocap = select(vec![
        MocapProfile::Modern,
        MocapProfile::Ideal,
        MocapProfile::Cooper,
    ]);
    (
        layouts(),
        scanners(),
        rooms(),
        board_designs(),
        mocap,
        1..=9999_u64,
    )
        .prop_map(|(layout, scanner, room, (board, experiment), profile, seed)| {
            let base = base();
            let mut scene = Scene {
                scanner,
                room,
                board,
                experiment,
                seed,
                ..base.clone()
            };
            scene.superstructure = layout.0.superstructure;
            scene.superstructure.as_built = base.superstructure.as_built;
            scene.mocap.profile = profile;
            RandomScene(scene)
        })
        .prop_filter("a board that fits nowhere", |scene| {
            check::problems(scene).is_empty() && Laboratory::new(scene, scene.seed).is_ok()
        })
}
