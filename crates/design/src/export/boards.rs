//! Export of a dataset's boards as a table: the part of a recording that a calibrator needs, one row for every beam of
//! every board.
//!
//! A row holds what was read of a board and the pose of the board, in the rig and in the sensor as drawn. Nothing is
//! corrected, selected or omitted: the statistics are over all readings that are ranges.

use catoptric_calib::observations::{BoardInSensor, azimuth};
use catoptric_files::names::defused;
use catoptric_model::beam::direction;
use catoptric_model::{Dataset, Pose, PoseKind, PoseRecord};
use nalgebra::{Point3, Unit, Vector3};

/// Number of beams on either side of those that a board in a fan serves that have rows too: mirrors are a degree or two
/// off the drawing.
pub const BESIDE: usize = 12;

/// Columns of the readings, in front of those of [`FRAMES`].
const READ: [&str; 14] = [
    "kind",
    "pose",
    "board",
    "color",
    "facet",
    "beam",
    "set_up_for",
    "azimuth_rad",
    "bare_distance_m",
    "inside_edge_m",
    "readings",
    "missing",
    "mean_m",
    "sd_m",
];

/// Prefixes of the columns of the board's pose: in the rig, and in the sensor as the drawing mounts it.
const FRAMES: [&str; 2] = ["rig", "drawn"];

/// Returns the boards of a dataset as CSV, in the order of the recording; numbers are written such that they are read
/// back bit for bit.
///
/// A board has rows for the beams that it was set up for, all beams if its label names none, and in the fan of a facet
/// [`BESIDE`] more on either side. Stretches without a board have no rows.
///
/// ```
/// use catoptric_design::export;
/// use catoptric_sim as sim;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut scene: sim::Scene = toml::from_str(include_str!("../../../../scenes/two-mirror.toml"))?;
/// scene.scanner.sub_rays = 1;
/// let dataset = sim::Laboratory::new(&scene, 1)?.dataset()?;
/// let table = String::from_utf8(export::board_table(&dataset)?)?;
/// assert!(table.starts_with("kind,pose,board,color,facet,beam,set_up_for,"));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// An error of the CSV writer; writing to memory causes none.
pub fn board_table(dataset: &Dataset) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let place = FRAMES.iter().flat_map(|frame| {
        let of = move |what: &str| format!("{frame}_{what}");
        ["center_x_m", "center_y_m", "center_z_m"]
            .into_iter()
            .chain(["normal_x", "normal_y", "normal_z"])
            .chain(["along_x", "along_y", "along_z"])
            .map(of)
    });
    writer.write_record(READ.map(str::to_owned).into_iter().chain(place))?;
    for record in dataset.poses.iter().filter(|p| has_rows(p)) {
        write_board(&mut writer, dataset, record)?;
    }
    writer.into_inner().map_err(|e| e.into_error().into())
}

/// Whether a stretch records a board and so has rows in [`board_table`].
pub fn has_rows(record: &PoseRecord) -> bool {
    matches!(record.label.kind, PoseKind::Direct | PoseKind::Facet) && record.room_from_board.is_some()
}

fn write_board(
    writer: &mut csv::Writer<Vec<u8>>,
    dataset: &Dataset,
    record: &PoseRecord,
) -> Result<(), csv::Error> {
    let (session, label) = (&dataset.session, &record.label);
    let drawn = Pose::from(&session.nominal_rig_from_sensor);
    let (Some(room_from_board), Some(board)) =
        (record.room_from_board, BoardInSensor::of(record, session, &drawn))
    else {
        return Ok(());
    };
    let rig_from_board = record.room_from_rig.inverse() * room_from_board;
    let drawn_from_board = drawn.inverse() * rig_from_board;
    let place = [rig_from_board, drawn_from_board]
        .map(|p| in_numbers(&p))
        .concat();
    let (kind, beside) = match label.kind {
        PoseKind::Facet => ("facet", BESIDE),
        _ => ("direct", 0),
    };
    let scan = &session.scanner.scan;
    let own = label.beams.unwrap_or([0, scan.beams() - 1]);
    let rows = scan.widened(own, beside);
    let summaries = record.summarize();
    for (beam, read) in summaries
        .iter()
        .enumerate()
        .filter(|(beam, _)| scan.holds(rows, *beam))
    {
        let inside = match label.kind {
            PoseKind::Direct => inside_edge(&board, &direction(azimuth(session, beam))),
            _ => None,
        };
        let mean = (read.count > 0).then_some(read.mean);
        let sd = (read.count > 1).then_some(read.sd);
        let row = [
            kind.to_owned(),
            label.pose.to_string(),
            defused(label.board.as_deref().unwrap_or_default()).into_owned(),
            defused(&board.color).into_owned(),
            defused(label.facet.as_deref().unwrap_or_default()).into_owned(),
            beam.to_string(),
            u8::from(scan.holds(own, beam)).to_string(),
            azimuth(session, beam).to_string(),
            or_empty(session.bare_structure.distance(beam)),
            or_empty(inside),
            read.count.to_string(),
            read.missing.to_string(),
            or_empty(mean),
            or_empty(sd),
        ];
        writer.write_record(row.iter().chain(&place))?;
    }
    Ok(())
}

/// Returns the distance from a beam's intersection with a board to the nearest edge of the board, in meters, negative
/// outside the board; `None` if the beam misses the board's plane.
fn inside_edge(board: &BoardInSensor, direction: &Unit<Vector3<f64>>) -> Option<f64> {
    let at = board.hit(&Point3::origin(), direction)?.in_board;
    let half = [0.5 * board.outline.width, 0.5 * board.outline.height];
    Some((half[0] - at.x.abs()).min(half[1] - at.y.abs()))
}

/// Returns the center of a board's face, its normal, and its x axis.
fn in_numbers(pose: &Pose) -> Vec<String> {
    let center = pose.translation.vector;
    let [along, normal] = [Vector3::x(), Vector3::z()].map(|axis| pose.rotation * axis);
    let numbers = [center, normal, along];
    numbers.iter().flatten().map(f64::to_string).collect()
}

fn or_empty(number: Option<f64>) -> String {
    number.map(|n| n.to_string()).unwrap_or_default()
}
