//! Flat pictures of a layout: the map of directions, the scan, the footprints on the facets.

use super::drawn::Drawn;
use crate::figure::{Area, Axes, GRID, Label, Shapes, Stroke, color, fine, round_numbers};
use catoptric_design::layout::{Class, DrawnRay, ElementRun, Footprint};
use catoptric_model::beam;
use nalgebra::{Matrix3, Point3, Vector3};
use plotters::style::{BLACK, RGBColor};

/// Size of the map, in pixels: twice as wide as high, apart from the labels.
const MAP: (u32, u32) = (1000, 540);

/// Size of the strip, in pixels.
const STRIP: (u32, u32) = (1000, 180);

/// Color of undeflected directions on the map, and of undeflected beams in the views.
pub(super) const DIRECT: RGBColor = RGBColor(0x7A, 0x80, 0x87);

/// Color of lost elements.
pub(super) const LOST: RGBColor = RGBColor(0x20, 0x20, 0x20);

/// Every n-th beam is drawn as a ray; fewer of the undeflected ones.
pub(super) const RAY_STEP: usize = 4;
pub(super) const DIRECT_STEP: usize = 16;

/// Returns the color of a ray: that of the last facet it hits, gray without any.
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

/// Draws the map of all directions and those of the elements; azimuth grows to the left, as seen looking forward.
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
    // A lost element is drawn where it would look without the structure.
    for ray in drawing.rays.iter().filter(|r| !r.class.sees()) {
        let (at, half) = (
            around(drawing.scan.azimuth(ray.beam).to_degrees()),
            0.5 * drawing.scan.step().to_degrees(),
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
        let fill = if ray.facets.is_empty() {
            DIRECT
        } else {
            ray_color(ray)
        };
        let cell = cell(drawn, ray).into_iter();
        shapes
            .areas
            .extend(cell.map(|points| Area { points, color: fill }));
    }
    for (number, facet) in drawn.analysis.facets.iter().enumerate() {
        let of = |r: &&DrawnRay| r.class == Class::Deflected && r.facets.first() == Some(&number);
        let mut own: Vec<&DrawnRay> = drawing.rays.iter().filter(of).collect();
        let beams: Vec<usize> = own.iter().map(|ray| ray.beam).collect();
        if let Some([begin, _]) = drawing.scan.shortest_run(&beams) {
            // In the order of the fan, which may go over the seam of the scan.
            own.rotate_left(beams.partition_point(|beam| *beam < begin));
        }
        let exit = |place: usize| own.get(place).and_then(|ray| ray.exit).map(|v| degrees(&v));
        let middle = own.len() / 2;
        let (Some(first), Some(at), Some(last)) = (exit(0), exit(middle), exit(own.len().max(1) - 1)) else {
            continue;
        };
        // Beside the fan, toward the middle of the map.
        let along = [first.0 - last.0, last.1 - first.1];
        let length = libm::hypot(along[0], along[1]).max(f64::MIN_POSITIVE);
        let (x, y) = (-at.0, at.1);
        let (across, up) = (-along[1] / length, along[0] / length);
        let sign = if across * x + up * y > 0.0 { -1.0 } else { 1.0 };
        shapes.labels.push(Label {
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

/// Returns the outline of an element's cell on the map, in two parts at the seam; empty if the ray does not leave.
pub(super) fn cell(drawn: &Drawn, ray: &DrawnRay) -> Vec<Vec<(f64, f64)>> {
    let Some(turn) = turn(drawn, ray) else {
        return Vec::new();
    };
    let cell = drawn.drawing.cells[ray.beam];
    let half = 0.5 * drawn.drawing.scan.step();
    if let Some(stretch) = &ray.stretch {
        let corners = [(-half, -1.0), (half, -1.0), (half, 1.0), (-half, 1.0)];
        return on_map(
            corners.map(|(along, across)| degrees(&stretch.exit(along, across * cell.half_height))),
        );
    }
    let corners = [(-half, -1.0), (half, -1.0), (half, 1.0), (-half, 1.0)].map(|(along, across)| {
        let v = turn * beam::spherical(cell.azimuth + along, across * cell.half_height).into_inner();
        degrees(&v)
    });
    on_map(corners)
}

/// Returns the product of the reflections along a ray path, which turns directions in the scan into exit directions.
fn turn(drawn: &Drawn, ray: &DrawnRay) -> Option<Matrix3<f64>> {
    ray.exit?;
    Some(ray.facets.iter().fold(Matrix3::identity(), |turn, &facet| {
        // The room's mirrors are not part of the layout, so every facet hit belongs to the structure.
        let m = drawn.drawing.facets[facet].face.normal.into_inner();
        (Matrix3::identity() - m * m.transpose() * 2.0) * turn
    }))
}

/// Returns azimuth and elevation, in degrees.
fn degrees(v: &Vector3<f64>) -> (f64, f64) {
    let elevation = libm::atan2(v.z, libm::hypot(v.x, v.y));
    (libm::atan2(v.y, v.x).to_degrees(), elevation.to_degrees())
}

/// Returns a cell's outline on the map, complete on either side of the seam behind the scanner.
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

/// Draws the scan with its left on the left: the class of every element.
pub(super) fn scan(drawn: &Drawn) -> String {
    /// Between ticks, in degrees.
    const TICK_DEG: f64 = 30.0;
    let [low, high] = drawn.drawing.scan.range_deg();
    let axes = Axes {
        x: -high - 1.0..-low + 1.0,
        y: 0.0..3.0,
        x_label: "azimuth in the scan, to the left (°)".to_owned(),
        y_label: String::new(),
    };
    let area = |run: &ElementRun| {
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
        ticks: [ticks(-high, -low, TICK_DEG), Vec::new()],
        mirrored: true,
        ..Shapes::default()
    };
    fine(STRIP, &axes, "Elements of the scan", &shapes)
}

/// Multiples of a step between two values.
fn ticks(from: f64, to: f64, step: f64) -> Vec<f64> {
    let first = (from / step).ceil();
    (0..)
        .map(|k| step * (first + f64::from(k)))
        .take_while(|tick| *tick <= to)
        .collect()
}

/// An azimuth in degrees within half a turn of the x axis, as the map has it.
fn around(azimuth_deg: f64) -> f64 {
    if azimuth_deg.abs() <= 180.0 {
        return azimuth_deg;
    }
    azimuth_deg - 360.0 * (azimuth_deg / 360.0).round()
}

/// The outline of a facet and the footprints of its beams, in the facet's own plane.
pub(super) fn footprints(drawn: &Drawn, facet: usize) -> Option<String> {
    let face = &drawn.drawing.facets[facet].face;
    let of = |f: &&Footprint| f.facet == facet;
    let own: Vec<&Footprint> = drawn.drawing.footprints.iter().filter(of).collect();
    let beams: Vec<usize> = own.iter().map(|f| f.beam).collect();
    let [begin, end] = drawn.drawing.scan.shortest_run(&beams)?;
    let (first, last) = (
        own.iter().find(|f| f.beam == begin)?,
        own.iter().rfind(|f| f.beam == end)?,
    );
    // To the right as the scan goes, seen from before the mirror.
    let right = (last.center - first.center).try_normalize(1e-9)?;
    let up = face.normal.cross(&right);
    let middle = catoptric_design::layout::center(&face.corners);
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
