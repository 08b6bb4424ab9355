//! The point cloud from above, and how many of its points each mirror contributes.

use super::super::figure::{self, Axes, GRID, Stroke};
use super::super::page::{figure as block, number};
use super::elements::{color_of, facet_of, legend};
use catoptric_assess::apply::{CloudSketch, Extent};
use catoptric_model::CloudFrame;
use catoptric_model::{Calibration, Dataset, Pose, Status};
use plotters::style::{BLACK, RGBColor};

/// Maximum number of points of a cloud that are drawn.
pub const MAX_POINTS: usize = 6000;

/// The cloud from above.
pub(crate) fn cloud(dataset: &Dataset, calibration: Option<&Calibration>, cloud: &CloudSketch) -> String {
    let sheet = &cloud.sheet;
    let facets: Vec<Option<usize>> = (0..dataset.session.scanner.scan.beams())
        .map(|b| facet_of(dataset, calibration?.beam(b)?))
        .collect();
    let points: Vec<(f64, f64, RGBColor)> = cloud
        .drawn
        .iter()
        .map(|p| {
            let facet = facets.get(p.beam).copied().flatten();
            let is_direct = calibration
                .and_then(|c| c.beam(p.beam))
                .is_some_and(|b| b.status == Status::Direct);
            let color = if is_direct {
                RGBColor(0x8C, 0x8C, 0x8C)
            } else {
                color_of(facet)
            };
            (p.position.x, p.position.y, color)
        })
        .collect();
    let mut strokes = Vec::new();
    let mut corners = Vec::new();
    let surveyed = dataset.session.room.as_ref();
    if let Some(room) = surveyed.filter(|_| sheet.frame == CloudFrame::Room) {
        let [[x0, y0, _], [x1, y1, _]] = [room.min_m, room.max_m];
        corners = vec![(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)];
        strokes.push(Stroke {
            points: corners.clone(),
            color: GRID,
            width: 3,
            opacity: 1.0,
        });
        strokes.extend(
            dataset
                .poses
                .first()
                .map(|p| cross(&p.room_from_rig))
                .into_iter()
                .flatten(),
        );
    }
    let all = || points.iter().map(|p| (p.0, p.1)).chain(corners.iter().copied());
    let limits = |value: fn((f64, f64)) -> f64| {
        let low = all().map(value).fold(f64::INFINITY, f64::min);
        let high = all().map(value).fold(f64::NEG_INFINITY, f64::max);
        if low < high {
            low - 0.3..high + 0.3
        } else {
            -1.0..1.0
        }
    };
    let axes = Axes {
        x: limits(|p| p.0),
        y: limits(|p| p.1),
        x_label: format!("x of the {} (m)", sheet.frame.word()),
        y_label: format!("y of the {} (m)", sheet.frame.word()),
    };
    let title = "The cloud from above";
    let svg = figure::scatter(level_size(&axes), &axes, title, &points, &strokes);
    let rows = cloud_rows(dataset, calibration, cloud, &facets);
    let outline = if sheet.frame == CloudFrame::Room && surveyed.is_some() {
        "The outline is the surveyed room: points should be on its walls, or inside on floor and ceiling; a wall of \
         points off the outline indicates a mirror whose directions are wrong. The cross is the scanner. "
    } else {
        ""
    };
    let caption = format!(
        "Points of pose {} in the {} frame, colored by mirror; gray points were seen past the mirrors. {outline}{}",
        sheet.pose,
        sheet.frame.word(),
        if cloud.step > 1 {
            format!("One scan in {} is drawn.", cloud.step)
        } else {
            String::new()
        },
    );
    let plot = format!("<div class=\"plot\"><h4>{title}</h4>{svg}</div>\n");
    block(
        &plot,
        caption.trim_end(),
        &legend(dataset),
        &["Part", "Points", "x (m)", "y (m)", "z (m)"],
        &rows,
    )
}

/// A cross at the position of the rig.
fn cross(room_from_rig: &Pose) -> [Stroke; 2] {
    const ARM_M: f64 = 0.12;
    let (x, y) = (room_from_rig.translation.x, room_from_rig.translation.y);
    [(ARM_M, 0.0), (0.0, ARM_M)].map(|(dx, dy)| Stroke {
        points: vec![(x - dx, y - dy), (x + dx, y + dy)],
        color: BLACK,
        width: 2,
        opacity: 1.0,
    })
}

/// Returns the size at which both axes have the same scale.
fn level_size(axes: &Axes) -> (u32, u32) {
    /// Space for margins and axis labels, in pixels.
    const FRAME: f64 = 72.0;
    let (width, height) = (axes.x.end - axes.x.start, axes.y.end - axes.y.start);
    let across = 800.0 - FRAME;
    let up = (across * height / width).clamp(150.0, 1200.0);
    // The clamp limits it to 150…1272.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let up = (up + FRAME) as u32;
    (800, up)
}

/// Returns number of points and extent for the cloud and for the part from each mirror.
fn cloud_rows(
    dataset: &Dataset,
    calibration: Option<&Calibration>,
    cloud: &CloudSketch,
    facets: &[Option<usize>],
) -> Vec<Vec<String>> {
    let status = |b: usize| calibration.and_then(|c| c.beam(b)).map(|b| b.status);
    let row = |name: &str, keep: &dyn Fn(usize) -> bool| {
        let beams = cloud.beams.iter().enumerate().filter(|(b, _)| keep(*b));
        let of = beams.fold(Extent::NONE, |all, (_, beam)| all.with(beam));
        let extent = |axis: usize| format!("{} … {}", number(of.low[axis], 2), number(of.high[axis], 2));
        vec![
            name.to_owned(),
            of.points.to_string(),
            extent(0),
            extent(1),
            extent(2),
        ]
    };
    let mut rows = vec![row("All points", &|_| true)];
    for (i, facet) in dataset.session.facets.iter().enumerate() {
        rows.push(row(&facet.name, &|b| {
            facets.get(b).copied().flatten() == Some(i) && status(b) == Some(Status::Solved)
        }));
    }
    rows.push(row("Past the mirrors", &|b| status(b) == Some(Status::Direct)));
    let count = |name: &str, count: usize| {
        let mut row = vec![String::new(); 5];
        row[0] = name.to_owned();
        row[1] = count.to_string();
        row
    };
    rows.push(count("Omitted: no direction", cloud.sheet.without_direction));
    rows.push(count("Omitted: no range", cloud.sheet.without_range));
    rows
}
