//! `catoptric apply`: turns a stretch of scans into a point cloud, given a calibration.

use super::context::{Context, Reading};
use super::error::CliError;
use super::one_of::one_of;
use super::output::{counted, print};
use super::outputs::Replacing;
use super::validate::invalid;
use catoptric::apply::ApplyError;
use catoptric::files::Content;
use catoptric::files::cloud::CloudFormat;
use catoptric::{CloudFrame, Error, apply_into, read_calibration_for};
use clap::Args;
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
    /// Frame of the points; Eqs. (9) and (10) are in the sensor's.
    #[arg(
        long,
        value_parser = one_of(&CloudFrame::ALL, CloudFrame::word, CloudFrame::about),
        default_value = CloudFrame::Sensor.word()
    )]
    frame: CloudFrame,
    /// The pose whose scans are taken; those of the empty room by default.
    #[arg(long, value_name = "N")]
    pose: Option<usize>,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let path = &arguments.out;
    // Said before anything is read.
    let content = match CloudFormat::of_path(path) {
        Ok(CloudFormat::Ply) => Content::PlyCloud,
        Ok(CloudFormat::Pcd) => Content::PcdCloud,
        Err(e) => return Err(CliError::invalid(e.to_string(), None)),
    };
    let outputs = arguments.replacing.outputs([&arguments.calibration]);
    let out = outputs.file(path, &content)?;
    let dataset = context.read_dataset(&arguments.dataset, arguments.reading)?;
    let calibration = read_calibration_for(&arguments.calibration, &dataset.session)?;
    let cloud = match apply_into(&dataset, &calibration, arguments.pose, arguments.frame, out) {
        Err(Error::Apply(ApplyError::Invalid(problems))) => {
            return Err(invalid(&arguments.calibration, &problems));
        }
        other => other?,
    };
    if cloud.mount_is_nominal {
        context.say("the calibration has no mounting: using the one of the drawing");
    }
    print(&format!(
        "wrote {}: {} in the {} frame, pose {}; left out: {} without a range, {} of {} without a direction{}\n\
         next: open {} in a viewer such as CloudCompare or Open3D\n",
        path.display(),
        counted(cloud.points, "point"),
        arguments.frame.word(),
        cloud.pose,
        counted(cloud.without_range, "reading"),
        counted(cloud.without_direction, "reading"),
        counted(cloud.unsolved_elements, "element"),
        match cloud.without_pose {
            0 => String::new(),
            n => format!(", {n} while the rig was not tracked"),
        },
        path.display(),
    ))
}
