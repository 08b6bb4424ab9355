//! Scenes for the tests as text; random ones are those of `catoptric::testing`.

use catoptric::sim::Scene;
use catoptric::sim::scene::{Board, BoardPose};

pub(crate) use catoptric::testing::{layouts, without_errors};

/// The default experiment of the repository.
pub(crate) const PROTOTYPE: &str = include_str!("../../scenes/prototype.toml");
/// The published layout of the repository.
pub(crate) const TWO_MIRROR: &str = include_str!("../../scenes/two-mirror.toml");

/// Parses a scene that is known to be valid.
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

/// Adds one white board of 1 × 1 m, face-on at a distance in front of the scanner of [`BARE`].
pub(crate) fn set_board_ahead(scene: &mut Scene, distance: f64) {
    scene.board.push(Board {
        name: "board".to_owned(),
        width_mm: 1000.0,
        height_mm: 1000.0,
        thickness_mm: 0.0,
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
