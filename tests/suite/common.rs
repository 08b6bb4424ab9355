//! Shared helpers: running the program, and a small valid scene to corrupt.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program.
pub(crate) fn catoptric() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_catoptric"));
    // Colors must depend on the terminal check only, not on the environment of the machine.
    command.env_remove("CLICOLOR_FORCE").env_remove("NO_COLOR");
    command
}

/// The program with all signals as by default, though these tests may have been started by `nohup` or in the background
/// of a shell, which ignore some of them.
pub(crate) fn heeding_signals() -> Command {
    let program = catoptric();
    let reset = "--default-signal=HUP,INT,TERM";
    // GNU's; where there is none, the tests have to be started by a terminal.
    let known = Command::new("env").args([reset, "true"]).output();
    if !known.is_ok_and(|output| output.status.success()) {
        return program;
    }
    let mut command = Command::new("env");
    command.arg(reset).arg(program.get_program());
    for (name, value) in program.get_envs() {
        match value {
            Some(value) => command.env(name, value),
            None => command.env_remove(name),
        };
    }
    command
}

/// Runs the program in a folder.
pub(crate) fn run(folder: &Path, arguments: &[&str]) -> Output {
    catoptric().args(arguments).current_dir(folder).output().unwrap()
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// A temporary folder with the scene in it.
pub(crate) fn folder_with(scene: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    (folder, path)
}

/// A scene with every kind of facet, a post, explicit poses and a custom color.
///
/// The rig is in the middle of a 6 m × 6 m × 3 m room, 1.2 m up; the sensor is at the origin of the rig. The wedge lifts
/// its fan by 50°.
pub(crate) const VALID: &str = r#"schema_version = 1
name = "small"
seed = 7

[scanner]
preset = "ust-20lx"
mount = { position_mm = [0.0, 0.0, 0.0] }

[[superstructure.facet]]
name = "wedge"
shape.wedge = { azimuth_deg = [62.0, 77.0], distance_mm = 70.0, exit_azimuth_deg = 69.5, exit_elevation_deg = 50.0, height_mm = 12.0 }

[[superstructure.facet]]
name = "polygon"
[superstructure.facet.shape.polygon]
corners_mm = [
    [-40.0, 70.0, -10.0],
    [-20.0, 70.0, -10.0],
    [-20.0, 80.0, 10.0],
    [-40.0, 80.0, 10.0],
]

[[superstructure.facet]]
name = "rectangle"
shape.rectangle = { center_mm = [0.0, -80.0, 0.0], normal = [0.0, 1.0, 1.0], width_mm = 30.0, height_mm = 20.0 }

[[superstructure.post]]
name = "pillar"
center_mm = [-60.0, 0.0, 0.0]
size_mm = [10.0, 20.0, 30.0]

[[superstructure.marker]]
name = "a"
position_mm = [0.0, 0.0, 60.0]

[[superstructure.marker]]
name = "b"
position_mm = [100.0, 0.0, 60.0]

[[superstructure.marker]]
name = "c"
position_mm = [0.0, 100.0, 60.0]

[color.card]
reflectivity = 0.5
noise = { range_m = [1.0, 2.0], sd_mm = [4.0, 5.0] }

[[board]]
name = "big"
width_mm = 600.0
height_mm = 600.0
color = "card"

[room]
size_m = [6.0, 6.0, 3.0]
rig_position_m = [0.0, 0.0, 1.2]

[experiment]
tilt_deg = [30.0, 50.0]
scans_per_pose = 10

[[experiment.pose]]
board = "big"
center_m = [1.5, 0.0, 1.2]
normal = [-1.0, 0.0, 0.0]

[[experiment.pose]]
board = "big"
facet = "wedge"
center_m = [0.3, 0.7, 2.1]
normal = [0.0, -0.5, -1.0]

[errors]
model = "empirical"
"#;
