//! `catoptric apply`: turns a stretch of scans into a point cloud, given a calibration.

use super::Context;
use super::error::CliError;
use super::output::{counted, print};
use catoptric::files;
use catoptric::files::IoError;
use catoptric::files::cloud::{CloudFormat, cloud_bytes};
use catoptric::{CloudFrame, Error, apply, read_calibration, read_dataset};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `apply`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The dataset.
    dataset: PathBuf,
    /// The calibration.
    calibration: PathBuf,
    /// The cloud to write; the extension selects the format.
    #[arg(long, value_name = "cloud.ply|cloud.pcd")]
    out: PathBuf,
    /// Frame of the points; Eqs. (9) and (10) use the sensor frame.
    #[arg(long, value_enum, default_value_t = FrameName::Sensor)]
    frame: FrameName,
    /// The pose whose scans are used; by default those of the empty room.
    #[arg(long, value_name = "N")]
    pose: Option<usize>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum FrameName {
    /// The laser base frame
    Sensor,
    /// The marker body on the superstructure
    Rig,
    /// The motion-capture frame of the room
    Room,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let path = &arguments.out;
    let format = CloudFormat::of_path(path).map_err(|e| CliError::invalid(e.to_string(), None))?;
    let dataset = read_dataset(&arguments.dataset)?;
    let calibration = read_calibration(&arguments.calibration)?;
    let frame = match arguments.frame {
        FrameName::Sensor => CloudFrame::Sensor,
        FrameName::Rig => CloudFrame::Rig,
        FrameName::Room => CloudFrame::Room,
    };
    let cloud = apply(&dataset, &calibration, arguments.pose, frame).map_err(Error::from)?;
    let bytes = cloud_bytes(format, &cloud).map_err(|e| IoError::write(path, e))?;
    files::write_file(path, &bytes)?;
    if cloud.mount_is_nominal {
        context.say("the calibration has no mounting: using the one of the drawing");
    }
    print(&format!(
        "wrote {}: {} in the {} frame, pose {}; left out: {} without a range, {} of {} without a direction\n\
         next: open {} in a viewer such as CloudCompare or Open3D\n",
        path.display(),
        counted(cloud.points.len(), "point"),
        frame.word(),
        cloud.pose,
        counted(cloud.without_range, "reading"),
        counted(cloud.without_direction, "reading"),
        counted(cloud.unsolved_elements, "element"),
        path.display(),
    ))
}
