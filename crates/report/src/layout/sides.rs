//! The structure with its beams from three sides.

use super::drawn::{Drawn, radius, rim};
use super::views::{DIRECT, is_drawn, ray_color};
use crate::figure::{self, Axes, Stroke, color};
use nalgebra::Point3;
use plotters::style::BLACK;

/// Size of a view, in pixels.
const SQUARE: (u32, u32) = (500, 500);

/// A side from which the structure is drawn.
pub(super) struct Side {
    /// Name of the picture's file.
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    /// The axes of the sensor frame that point right and up, each with its sign.
    axes: [(usize, f64); 2],
    labels: [&'static str; 2],
}

pub(super) const SIDES: [Side; 3] = [
    Side {
        name: "above",
        title: "From above",
        axes: [(1, -1.0), (0, 1.0)],
        labels: ["−y, right (mm)", "x, forward (mm)"],
    },
    Side {
        name: "right",
        title: "From the right",
        axes: [(0, 1.0), (2, 1.0)],
        labels: ["x, forward (mm)", "z, up (mm)"],
    },
    Side {
        name: "behind",
        title: "From behind",
        axes: [(1, -1.0), (2, 1.0)],
        labels: ["−y, right (mm)", "z, up (mm)"],
    },
];

/// Draws the structure with its beams from one side, clipped to a square around it.
pub(super) fn side(drawn: &Drawn, side: &Side) -> String {
    let drawing = &drawn.drawing;
    let [(i, right), (j, up)] = side.axes;
    let flat = |p: &Point3<f64>| (1e3 * right * p[i], 1e3 * up * p[j]);
    let line = |points: Vec<(f64, f64)>, color, width, opacity| Stroke {
        points,
        color,
        width,
        opacity,
    };
    let half = 1e3 * radius(drawing) * 1.5;
    let mut strokes = Vec::new();
    for part in &drawing.parts {
        let corners: Vec<(f64, f64)> = part.skin.iter().flatten().map(flat).collect();
        let fill = if part.housing { BLACK } else { DIRECT };
        strokes.push(line(hull(corners), fill, 1, 0.8));
    }
    for ray in drawing.rays.iter().filter(|r| is_drawn(r)) {
        let mut points: Vec<Point3<f64>> = ray.points.clone();
        if let (Some(last), Some(exit)) = (points.last().copied(), ray.exit) {
            points.push(last + exit.into_inner() * (3e-3 * half));
        }
        let points = clipped(&points.iter().map(flat).collect::<Vec<_>>(), half);
        let (color, opacity) = (ray_color(ray), if ray.facets.is_empty() { 1.0 } else { 0.75 });
        strokes.extend(points.into_iter().map(|p| line(p, color, 1, opacity)));
    }
    for (number, facet) in drawing.facets.iter().enumerate() {
        let mut outline: Vec<(f64, f64)> = rim(facet).iter().map(flat).collect();
        outline.extend(outline.first().copied());
        strokes.push(line(outline, color(number), 3, 1.0));
    }
    let axes = Axes {
        x: -half..half,
        y: -half..half,
        x_label: side.labels[0].to_owned(),
        y_label: side.labels[1].to_owned(),
    };
    figure::plan(SQUARE, &axes, side.title, &strokes, &[])
}

/// Returns the parts of a line inside a square around the origin.
fn clipped(points: &[(f64, f64)], half: f64) -> Vec<Vec<(f64, f64)>> {
    let mut parts: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        // Liang–Barsky: the interval of the line's parameter between each pair of borders.
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (at, along) in [(a.0, dx), (a.1, dy)] {
            if along == 0.0 {
                if at.abs() > half {
                    leave = -1.0;
                }
                continue;
            }
            let (s, t) = ((-half - at) / along, (half - at) / along);
            enter = enter.max(s.min(t));
            leave = leave.min(s.max(t));
        }
        if enter < leave {
            let on = |t: f64| (a.0 + t * dx, a.1 + t * dy);
            parts.push(vec![on(enter), on(leave)]);
        }
    }
    parts
}

/// Returns the convex hull of points as a closed line (Andrew's monotone chain).
fn hull(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points.dedup();
    let turns_left = |a: (f64, f64), b: (f64, f64), c: (f64, f64)| {
        (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0) > 0.0
    };
    let half = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        let mut chain: Vec<(f64, f64)> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && !turns_left(a, b, point)
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain
    };
    let mut outline = half(&mut points.iter().copied());
    outline.pop();
    outline.extend(half(&mut points.iter().rev().copied()));
    outline
}
