//! The page on planned board poses: for each facet the room from above and from the side, and a table.

use super::figure::{self, Axes, GRID, Label, Stroke, color};
use super::page::{escape, figure as block, number, page};
use catoptric_calib::plan::{FacetPlan, Plan, PlannedPose, Situation, Standing};
use catoptric_model::frame::yaw_pitch_roll;
use catoptric_model::{Pose, Session};
use nalgebra::{Point3, Translation3, Vector3};
use std::ops::Range;

/// Size of a view, in pixels.
const SQUARE: (u32, u32) = (500, 500);

/// Approximate number of rays drawn of each fan.
const RAYS: usize = 12;

/// Margin around the room, as a fraction of its extent.
const MARGIN: f64 = 0.04;

/// A view: its title, the two axes of the room, and their labels.
type View = (&'static str, [usize; 2], [&'static str; 2]);

const VIEWS: [View; 2] = [
    ("From above", [0, 1], ["x (m)", "y (m)"]),
    ("From the side", [0, 2], ["x (m)", "z, up (m)"]),
];

/// Returns the page, as HTML.
pub fn plan(situation: &Situation, plan: &Plan) -> String {
    let session = situation.session();
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">Board poses to record next</p>\n</header>\n",
        escape(&session.name)
    );
    for facet in &plan.facets {
        html += &format!(
            "<h2>Facet {}</h2>\n<p>{}</p>\n",
            escape(&facet.facet),
            escape(&summary(facet))
        );
        html += &section(situation, facet);
        if !facet.open.is_empty() {
            html += "<h3>Still open</h3>\n<ul>\n";
            for open in &facet.open {
                let [first, last] = open.beams;
                html += &format!("<li>Beams {first} to {last}: {}</li>\n", escape(&open.reason));
            }
            html += "</ul>\n";
        }
    }
    html += "<footer>The bound is the root mean square, over the beams that are determined, of the smallest error that \
             any unbiased estimate of a beam by its own boards can have under the believed errors, in degrees per axis, \
             with the mounting known. ψ is the direction in which a board's normal is tilted, seen along the beam it is \
             aimed at: 0° toward growing azimuth, 90° up.</footer>\n";
    page(&format!("{} – catoptric plan", session.name), &html)
}

fn summary(facet: &FacetPlan) -> String {
    let text = |standing: &Standing| match standing.bound_deg {
        Some(bound) => format!(
            "{} beams determined to {bound:.4}° per axis, {} open",
            standing.determined, standing.open
        ),
        None => format!("{} beams open", standing.open),
    };
    format!("Before: {}. After: {}.", text(&facet.before), text(&facet.after))
}

fn section(situation: &Situation, facet: &FacetPlan) -> String {
    let mut svgs = "<div class=\"views\">\n".to_owned();
    for (title, axes, labels) in VIEWS {
        let svg = view(situation, facet, title, axes, labels);
        svgs += &format!("<div><h4>{title}</h4>{svg}</div>\n");
    }
    svgs += "</div>";
    let caption = format!(
        "The room with the fan of {}, as far as it is known, and the planned boards, numbered with the most informative \
         first. A board seen edge-on is a line. Rays end at the distance of the farthest board.",
        facet.facet
    );
    let rows: Vec<Vec<String>> = (facet.poses.iter().enumerate())
        .map(|(place, pose)| row(place + 1, pose))
        .collect();
    let headings = [
        "Pose",
        "Board",
        "Where",
        "x (m)",
        "y (m)",
        "z (m)",
        "Yaw (°)",
        "Pitch (°)",
        "Roll (°)",
        "Beams",
        "Bound before (°)",
        "after (°)",
    ];
    block(&svgs, &caption, &[], &headings, &rows)
}

fn row(place: usize, pose: &PlannedPose) -> Vec<String> {
    let bound = |standing: &Standing| number(standing.bound_deg.unwrap_or(f64::NAN), 4);
    let served: usize = pose.beams.iter().map(|[first, last]| last - first + 1).sum();
    let mut cells = vec![place.to_string(), pose.board.clone(), pose.words.clone()];
    cells.extend(pose.center_m.map(|m| number(m, 3)));
    cells.extend(pose.yaw_pitch_roll_deg.map(|deg| number(deg, 1)));
    cells.extend([served.to_string(), bound(&pose.before), bound(&pose.after)]);
    cells
}

fn view(
    situation: &Situation,
    facet: &FacetPlan,
    title: &str,
    [i, j]: [usize; 2],
    [x_label, y_label]: [&str; 2],
) -> String {
    let session = situation.session();
    let sensor = Point3::from(situation.room_from_sensor().translation.vector);
    let flat = |p: &Point3<f64>| (p[i], p[j]);
    let line = |points: Vec<(f64, f64)>, color, width, opacity| Stroke {
        points,
        color,
        width,
        opacity,
    };
    let mut strokes = Vec::new();
    if let Some(room) = &session.room {
        let (low, high) = (room.min_m, room.max_m);
        let corners = [
            (low[i], low[j]),
            (high[i], low[j]),
            (high[i], high[j]),
            (low[i], high[j]),
        ];
        strokes.push(line([&corners[..], &corners[..1]].concat(), GRID, 3, 1.0));
    }
    let farthest = facet
        .poses
        .iter()
        .fold(0.0, |far: f64, pose| far.max(pose.range_m));
    let rays = situation.rays(&facet.facet);
    for (_, origin, direction) in rays.iter().step_by((rays.len() / RAYS).max(1)) {
        let wall = session
            .room
            .as_ref()
            .and_then(|room| Some(room.cast(origin, direction)?.0));
        let end = origin + direction.into_inner() * wall.unwrap_or(farthest).min(farthest);
        strokes.push(line(vec![flat(&sensor), flat(origin), flat(&end)], GRID, 1, 1.0));
    }
    let mut labels: Vec<Label> = Vec::new();
    let (x, y) = extents(session, facet, &sensor, [i, j]);
    for (place, pose) in facet.poses.iter().enumerate() {
        let mut corners: Vec<(f64, f64)> = corners(session, pose).iter().map(flat).collect();
        corners.extend(corners.first().copied());
        // A corner is hidden by another board less often than the center.
        let at = corners.first().map_or((0.0, 0.0), |corner| {
            let center = flat(&Point3::from(Vector3::from(pose.center_m)));
            (
                center.0 + 1.1 * (corner.0 - center.0),
                center.1 + 1.1 * (corner.1 - center.1),
            )
        });
        strokes.push(line(corners, color(place), 2, 1.0));
        labels.push(Label {
            at,
            text: (place + 1).to_string(),
            color: color(place),
        });
    }
    let axes = Axes {
        x,
        y,
        x_label: x_label.to_owned(),
        y_label: y_label.to_owned(),
    };
    let title = format!("{title}: facet {}", facet.facet);
    figure::plan(SQUARE, &axes, &title, &strokes, &labels)
}

/// Returns limits of both axes, of equal length, around room, sensor and boards.
fn extents(
    session: &Session,
    facet: &FacetPlan,
    sensor: &Point3<f64>,
    axes: [usize; 2],
) -> (Range<f64>, Range<f64>) {
    let mut points = vec![*sensor];
    points.extend(facet.poses.iter().flat_map(|pose| corners(session, pose)));
    if let Some(room) = &session.room {
        points.extend([room.min_m, room.max_m].map(|m| Point3::from(Vector3::from(m))));
    }
    let limits = axes.map(|axis| {
        let low = points.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
        (0.5 * (low + high), high - low)
    });
    let half = (0.5 + MARGIN) * limits[0].1.max(limits[1].1);
    let around = |(middle, _): (f64, f64)| middle - half..middle + half;
    (around(limits[0]), around(limits[1]))
}

/// Returns the corners of a planned board in the room; none for a board that is not in the session.
fn corners(session: &Session, pose: &PlannedPose) -> Vec<Point3<f64>> {
    let [yaw, pitch, roll] = pose.yaw_pitch_roll_deg.map(f64::to_radians);
    let room_from_board = Pose::from_parts(
        Translation3::from(Vector3::from(pose.center_m)),
        yaw_pitch_roll(yaw, pitch, roll),
    );
    let sheet = session.board(&pose.board);
    sheet.map_or_else(Vec::new, |sheet| {
        sheet.outline().corners().map(|c| room_from_board * c).to_vec()
    })
}
