//! Scenes for the tests: small ones written out, and random layouts for the property tests.

use catoptric::sim::Scene;
use catoptric::sim::scene::{Board, BoardPose};
use proptest::prelude::*;

/// The default experiment of the repository.
pub(crate) const PROTOTYPE: &str = include_str!("../../scenes/prototype.toml");
/// The published layout of the repository.
pub(crate) const TWO_MIRROR: &str = include_str!("../../scenes/two-mirror.toml");

/// A scene from TOML that is known to be good.
pub(crate) fn scene(toml: &str) -> Scene {
    toml::from_str(toml).expect("the test's own scene parses")
}

/// A scanner in a room, without mirrors, boards or errors; tests add what they need.
pub(crate) const BARE: &str = r#"
schema_version = 1
name = "bare"
[scanner]
preset = "ust-20lx"
sub_rays = 19
housing = false
[scanner.mount]
position_mm = [0, 0, 0]
yaw_tolerance_deg = 0
tilt_tolerance_deg = 0
shift_tolerance_mm = 0
[superstructure]
marker = [
    { name = "a", position_mm = [100, 0, 0] },
    { name = "b", position_mm = [0, 120, 10] },
    { name = "c", position_mm = [-90, -30, 40] },
]
as_built = { tilt_sd_deg = 0, shift_sd_mm = 0, slope_rms_mrad = 0 }
[room]
size_m = [10, 10, 4]
rig_position_m = [0, 0, 2]
[mocap]
profile = "ideal"
dropout = 0
[errors]
model = "none"
"#;

/// Sets up one white board of 1 × 1 m, face-on at a distance before the scanner of [`BARE`].
pub(crate) fn set_board_ahead(scene: &mut Scene, distance: f64) {
    scene.board.push(Board {
        name: "board".to_owned(),
        width_mm: 1000.0,
        height_mm: 1000.0,
        color: "white".to_owned(),
        marker: Vec::new(),
    });
    scene.experiment.pose.push(BoardPose {
        board: "board".to_owned(),
        facet: None,
        center_m: [distance, 0.0, 2.0],
        normal: [-1.0, 0.0, 0.0],
        turn_deg: 0.0,
    });
}

/// Turns every error off that the sensor, the room and the recording can have; the mirrors stay as built.
pub(crate) fn without_errors(mut scene: Scene) -> Scene {
    scene.scanner.sub_rays = 1;
    scene.superstructure.as_built.slope_rms_mrad = 0.0;
    scene.errors.model = catoptric::sim::scene::ErrorModel::None;
    scene.mocap.profile = catoptric::sim::scene::MocapProfile::Ideal;
    scene.mocap.dropout = 0.0;
    scene.experiment.scans_per_pose = 1;
    scene.experiment.room_scans = 1;
    scene.experiment.bare_scans = 1;
    scene
}

/// One facet of a random layout: how its azimuths, distance and exit direction lie within their bounds, each in 0…1.
type FacetDraw = (f64, f64, f64, f64, bool);

/// A random layout: up to four facets on either side of a scanner whose forward sector is free.
pub(crate) fn layouts() -> impl Strategy<Value = Scene> {
    let unit = || 0.0..1.0_f64;
    let facet = (unit(), unit(), unit(), unit(), any::<bool>());
    let side = || proptest::collection::vec(facet.clone(), 0..=4);
    (side(), side(), -180.0..180.0_f64).prop_filter_map("no facet", |(left, right, rig_yaw)| {
        if left.is_empty() && right.is_empty() {
            return None;
        }
        let mut scene = without_errors(scene(PROTOTYPE));
        scene.superstructure.facet.clear();
        scene.superstructure.post.clear();
        for (draws, sign, name) in [(left, 1.0, "left"), (right, -1.0, "right")] {
            for (slot, draw) in draws.iter().enumerate() {
                scene
                    .superstructure
                    .facet
                    .push(random_facet(&format!("{name}-{slot}"), slot, sign, draw));
            }
        }
        scene.room.size_m = [7.0, 7.0, 4.4];
        scene.room.rig_position_m = [0.3, -0.2, 2.2];
        scene.room.rig_yaw_deg = rig_yaw;
        scene.board[0].width_mm = 1200.0;
        scene.board[0].height_mm = 1000.0;
        Some(scene)
    })
}

/// Slots of 17° from 62° on; a facet takes 8° to 14° of its slot.
fn random_facet(name: &str, slot: usize, sign: f64, draw: &FacetDraw) -> catoptric::sim::scene::Facet {
    use catoptric::sim::scene::{Facet, FacetShape, Wedge};
    let &(width, distance, turn, elevation, up) = draw;
    let first = 63.0 + 17.0 * slot as f64;
    let last = first + 8.0 + 6.0 * width;
    let middle = 0.5 * (first + last);
    let elevation = (30.0 + 35.0 * elevation) * if up { 1.0 } else { -1.0 };
    Facet {
        name: name.to_owned(),
        two_sided: false,
        shape: FacetShape::Wedge(Wedge {
            azimuth_deg: if sign > 0.0 {
                [first, last]
            } else {
                [-last, -first]
            },
            distance_mm: 62.0 + 20.0 * distance,
            exit_azimuth_deg: sign * (middle + 40.0 * (turn - 0.5)),
            exit_elevation_deg: elevation,
            height_mm: 14.0,
        }),
    }
}
