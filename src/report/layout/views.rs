//! Flat pictures of a layout: the map of directions, the scan, three sides of the structure, footprints on the facets.

use super::Drawn;
use crate::layout::{Class, DrawnRay, Footprint, Run};
use crate::report::figure::{self, Area, Axes, GRID, Shapes, Stroke, Word, color, fine, round_numbers};
use catoptric_model::beam;
use nalgebra::{Matrix3, Point3, Vector3};
use plotters::style::{BLACK, RGBColor};

/// Size of the map, in pixels: twice as wide as high, but for the labels.
const MAP: (u32, u32) = (1000, 540);

/// Size of the strip, in pixels.
const STRIP: (u32, u32) = (1000, 180);

/// Size of a view, in pixels.
const SQUARE: (u32, u32) = (500, 500);

/// Undeflected directions on the map, and beams that pass by in the views.
pub(super) const DIRECT: RGBColor = RGBColor(0x7A, 0x80, 0x87);

/// Elements that are lost.
pub(super) const LOST: RGBColor = RGBColor(0x20, 0x20, 0x20);

/// Every n-th beam is drawn as a ray; fewer of those that no mirror deflects.
pub(super) const RAY_STEP: usize = 4;
pub(super) const DIRECT_STEP: usize = 16;

/// Color of a ray: of the last facet it meets, grey without any.
pub(super) fn ray_color(ray: &DrawnRay) -> RGBColor {
    match (ray.class, ray.facets.last()) {
        (Class::Direct, _) | (_, None) => GRID,
        (_, Some(facet)) => color(*facet),
    }
}

/// Whether a ray is among those drawn.
pub(super) fn is_drawn(ray: &DrawnRay) -> bool {
    let step = if ray.facets.is_empty() {
        DIRECT_STEP
    } else {
        RAY_STEP
    };
    ray.class.sees() && ray.beam.is_multiple_of(step)
}

/// All directions, and those that elements look into; azimuth grows to the left as it does for who looks forward.
pub(super) fn map(drawn: &Drawn) -> String {
    let axes = Axes {
        x: -180.0..180.0,
        y: -90.0..90.0,
        x_label: "azimuth, to the left (°)".to_owned(),
        y_label: "elevation, up (°)".to_owned(),
    };
    let drawing = &drawn.drawing;
    let mut shapes = Shapes {
        ticks: [
            (-5..=5).map(|k| 30.0 * f64::from(k)).collect(),
            (-3..=3).map(|k| 30.0 * f64::from(k)).collect(),
        ],
        mirrored: true,
        ..Shapes::default()
    };
    // Where a lost element would look without the structure.
    for ray in drawing.rays.iter().filter(|r| !r.class.sees()) {
        let (at, half) = (
            beam::azimuth(ray.beam).to_degrees(),
            0.5 * beam::STEP.to_degrees(),
        );
        let points = vec![
            (-at - half, -1.2),
            (-at + half, -1.2),
            (-at + half, 1.2),
            (-at - half, 1.2),
        ];
        shapes.areas.push(Area { points, color: LOST });
    }
    for ray in drawing.rays.iter().filter(|r| r.class.sees()) {
        let Some(turn) = turn(drawn, ray) else { continue };
        let cell = drawing.cells[ray.beam];
        let half = 0.5 * beam::STEP;
        let corners = [(-half, -1.0), (half, -1.0), (half, 1.0), (-half, 1.0)].map(|(along, across)| {
            let v = turn * beam::spherical(cell.azimuth + along, across * cell.half_height).into_inner();
            degrees(&v)
        });
        let fill = if ray.facets.is_empty() {
            DIRECT
        } else {
            ray_color(ray)
        };
        shapes.areas.extend(
            on_map(corners)
                .into_iter()
                .map(|points| Area { points, color: fill }),
        );
    }
    for (number, facet) in drawn.analysis.facets.iter().enumerate() {
        let of = |r: &&DrawnRay| r.class == Class::Deflected && r.facets.first() == Some(&number);
        let own: Vec<&DrawnRay> = drawing.rays.iter().filter(of).collect();
        let exit = |place: usize| own.get(place).and_then(|ray| ray.exit).map(|v| degrees(&v));
        let middle = own.len() / 2;
        let (Some(first), Some(at), Some(last)) = (exit(0), exit(middle), exit(own.len().max(1) - 1)) else {
            continue;
        };
        // Beside the fan, towards the middle of the map.
        let along = [first.0 - last.0, last.1 - first.1];
        let length = libm::hypot(along[0], along[1]).max(f64::MIN_POSITIVE);
        let (x, y) = (-at.0, at.1);
        let (across, up) = (-along[1] / length, along[0] / length);
        let sign = if across * x + up * y > 0.0 { -1.0 } else { 1.0 };
        shapes.words.push(Word {
            at: (
                (x + 10.0 * sign * across).clamp(-165.0, 165.0),
                y + 5.5 * sign * up,
            ),
            text: facet.name.clone(),
            color: BLACK,
        });
    }
    fine(MAP, &axes, "Field of regard", &shapes)
}

/// The product of the reflections on a ray's way: from directions of the scan to where it looks.
fn turn(drawn: &Drawn, ray: &DrawnRay) -> Option<Matrix3<f64>> {
    ray.exit?;
    Some(ray.facets.iter().fold(Matrix3::identity(), |turn, &facet| {
        // Mirrors of the room are not part of the layout, so every facet met is one of the structure.
        let m = drawn.drawing.facets[facet].face.normal.into_inner();
        (Matrix3::identity() - m * m.transpose() * 2.0) * turn
    }))
}

/// Azimuth and elevation, in degrees.
fn degrees(v: &Vector3<f64>) -> (f64, f64) {
    let elevation = libm::atan2(v.z, libm::hypot(v.x, v.y));
    (libm::atan2(v.y, v.x).to_degrees(), elevation.to_degrees())
}

/// A cell's outline on the map, whole on either side of the seam behind the scanner.
fn on_map(corners: [(f64, f64); 4]) -> Vec<Vec<(f64, f64)>> {
    let from = corners[0].0;
    let near = corners.map(|(azimuth, elevation)| {
        let turn = azimuth - from;
        (from + turn - 360.0 * (turn / 360.0).round(), elevation)
    });
    let shifted = |by: f64| -> Vec<(f64, f64)> {
        near.iter()
            .map(|(azimuth, elevation)| (-(azimuth + by), *elevation))
            .collect()
    };
    [-360.0, 0.0, 360.0]
        .map(shifted)
        .into_iter()
        .filter(|points| points.iter().any(|(x, _)| x.abs() < 180.0))
        .map(|points| {
            points
                .into_iter()
                .map(|(x, y)| (x.clamp(-180.0, 180.0), y))
                .collect()
        })
        .collect()
}

/// The scan, with its left on the left: what becomes of every element.
pub(super) fn scan(drawn: &Drawn) -> String {
    let axes = Axes {
        x: -136.0..136.0,
        y: 0.0..3.0,
        x_label: "azimuth in the scan, to the left (°)".to_owned(),
        y_label: String::new(),
    };
    let area = |run: &Run| {
        let ray = &drawn.drawing.rays[run.beams[0]];
        let (bottom, color) = match run.class {
            Class::Direct => (2.1, DIRECT),
            Class::Deflected | Class::MultiBounce => (2.1, ray_color(ray)),
            Class::Split => (1.1, LOST),
            _ => (0.1, LOST),
        };
        let [from, to] = run.azimuth_deg;
        let (left, right, top) = (-to, -from, bottom + 0.8);
        Area {
            points: vec![(left, bottom), (right, bottom), (right, top), (left, top)],
            color,
        }
    };
    let shapes = Shapes {
        areas: drawn.analysis.runs.iter().map(area).collect(),
        row_names: vec![(2.5, "sees"), (1.5, "split"), (0.5, "ends")],
        ticks: [(-4..=4).map(|k| 30.0 * f64::from(k)).collect(), Vec::new()],
        mirrored: true,
        ..Shapes::default()
    };
    fine(STRIP, &axes, "What becomes of the scan", &shapes)
}

/// A side to look from: file name, title, the axes of the sensor frame to the right and up with their signs.
pub(super) const SIDES: [(&str, &str, [(usize, f64); 2], [&str; 2]); 3] = [
    (
        "above",
        "From above",
        [(1, -1.0), (0, 1.0)],
        ["−y, right (mm)", "x, forward (mm)"],
    ),
    (
        "right",
        "From the right",
        [(0, 1.0), (2, 1.0)],
        ["x, forward (mm)", "z, up (mm)"],
    ),
    (
        "behind",
        "From behind",
        [(1, -1.0), (2, 1.0)],
        ["−y, right (mm)", "z, up (mm)"],
    ),
];

/// The structure with its beams from one side; everything within a square around it.
pub(super) fn side(drawn: &Drawn, title: &str, axes: [(usize, f64); 2], labels: [&str; 2]) -> String {
    let drawing = &drawn.drawing;
    let [(i, right), (j, up)] = axes;
    let flat = |p: &Point3<f64>| (1e3 * right * p[i], 1e3 * up * p[j]);
    let line = |points: Vec<(f64, f64)>, color, width, opacity| Stroke {
        points,
        color,
        width,
        opacity,
    };
    let half = 1e3 * super::radius(drawing) * 1.5;
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
        let mut outline: Vec<(f64, f64)> = facet.face.corners.iter().map(flat).collect();
        outline.extend(outline.first().copied());
        strokes.push(line(outline, color(number), 3, 1.0));
    }
    let axes = Axes {
        x: -half..half,
        y: -half..half,
        x_label: labels[0].to_owned(),
        y_label: labels[1].to_owned(),
    };
    figure::plan(SQUARE, &axes, title, &strokes, &[])
}

/// The parts of a line within a square around the origin.
fn clipped(points: &[(f64, f64)], half: f64) -> Vec<Vec<(f64, f64)>> {
    let mut parts: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        // Liang and Barsky: the stretch of the line's parameter that lies between each pair of borders.
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

/// The convex outline of points, closed (Andrew's monotone chain).
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

/// The outline of a facet and the footprints of its beams, in the facet's own plane.
pub(super) fn footprints(drawn: &Drawn, facet: usize) -> Option<String> {
    let face = &drawn.drawing.facets[facet].face;
    let of = |f: &&Footprint| f.facet == facet;
    let own: Vec<&Footprint> = drawn.drawing.footprints.iter().filter(of).collect();
    let (first, last) = (own.first()?, own.last()?);
    // To the right as the scan goes, seen from before the mirror.
    let right = (last.center - first.center).try_normalize(1e-9)?;
    let up = face.normal.cross(&right);
    let middle = crate::layout::center(&face.corners);
    let flat = |p: &Point3<f64>| (1e3 * right.dot(&(p - middle)), 1e3 * up.dot(&(p - middle)));
    let mut strokes = Vec::new();
    let mut outline: Vec<(f64, f64)> = face.corners.iter().map(flat).collect();
    outline.extend(outline.first().copied());
    let reach = outline
        .iter()
        .map(|(x, y)| x.abs().max(y.abs()))
        .fold(0.0, f64::max)
        * 1.15;
    let spot_reach = own.iter().flat_map(|f| &f.outline).map(|p| {
        let (x, y) = flat(p);
        x.abs().max(y.abs())
    });
    let reach = spot_reach.fold(reach, f64::max).min(1.6 * reach);
    for footprint in &own {
        let cut = !drawn.drawing.rays[footprint.beam].class.sees();
        if !cut && !footprint.beam.is_multiple_of(2) {
            continue;
        }
        let mut points: Vec<(f64, f64)> = footprint.outline.iter().map(flat).collect();
        points.extend(points.first().copied());
        let (color, width) = if cut { (LOST, 2) } else { (color(facet), 1) };
        let inside = points.iter().all(|(x, y)| x.abs() <= reach && y.abs() <= reach);
        if inside {
            strokes.push(Stroke {
                points,
                color,
                width,
                opacity: 0.9,
            });
        }
    }
    strokes.push(Stroke {
        points: outline,
        color: BLACK,
        width: 2,
        opacity: 1.0,
    });
    let axes = Axes {
        x: -reach..reach,
        y: -reach..reach,
        x_label: "along the scan (mm)".to_owned(),
        y_label: "across (mm)".to_owned(),
    };
    let title = format!("Footprints on {}", drawn.analysis.facets[facet].name);
    let shapes = Shapes {
        strokes,
        ticks: [
            round_numbers(axes.x.clone(), 6.0),
            round_numbers(axes.y.clone(), 6.0),
        ],
        ..Shapes::default()
    };
    Some(fine((400, 400), &axes, &title, &shapes))
}
