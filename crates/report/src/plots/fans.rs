//! Plots of the fans from above, from the side and from behind.

use super::super::figure::{self, Axes, GRID, Label, Stroke};
use super::super::page::{escape, figure as block, legend as key, number};
use super::elements::{Solved, azimuth_deg, color_of, facet_name, legend, solved};
use catoptric_model::{Calibration, Dataset, Status, beam};
use nalgebra::Point3;
use plotters::style::BLACK;

/// Size of a view, in pixels.
const SQUARE: (u32, u32) = (500, 500);

/// Length of the rays, in meters, in the whole view and in the close-up.
const REACH_M: f64 = 1.5;

const CLOSE_M: f64 = 0.16;

/// Every n-th beam is drawn as a ray; fewer of the undeflected ones.
const RAY_STEP: usize = 4;

const DIRECT_STEP: usize = 16;

/// A view of the fans.
struct View {
    title: &'static str,
    reach: f64,
    /// The axes of the sensor frame that point right and up.
    axes: [usize; 2],
    labels: [&'static str; 2],
}

const VIEWS: [View; 4] = [
    View {
        title: "From above",
        reach: REACH_M,
        axes: [0, 1],
        labels: ["x, forward (m)", "y, left (m)"],
    },
    View {
        title: "From above, close-up of the mirrors",
        reach: CLOSE_M,
        axes: [0, 1],
        labels: ["x, forward (m)", "y, left (m)"],
    },
    View {
        title: "From the side",
        reach: REACH_M,
        axes: [0, 2],
        labels: ["x, forward (m)", "z, up (m)"],
    },
    View {
        title: "From behind",
        reach: REACH_M,
        axes: [1, 2],
        labels: ["−y, right (m)", "z, up (m)"],
    },
];

/// The view that says most about a layout at a glance: which mirrors look up and which look down, and where to.
const AT_A_GLANCE: &View = &VIEWS[3];

fn draw(dataset: &Dataset, calibration: &Calibration, solved: &[Solved], view: &View) -> String {
    let View {
        title,
        reach,
        axes: [i, j],
        labels: [x, y],
    } = *view;
    // Seen from behind, left is on the left.
    let mirrored = if i == 1 { -1.0 } else { 1.0 };
    let flat = |p: &Point3<f64>| (mirrored * p[i], p[j]);
    let axes = Axes {
        x: -reach * 1.05..reach * 1.05,
        y: -reach * 1.05..reach * 1.05,
        x_label: x.to_owned(),
        y_label: y.to_owned(),
    };
    let names = if reach > CLOSE_M {
        labels(dataset, solved, reach, flat)
    } else {
        Vec::new()
    };
    let strokes = strokes(dataset, calibration, solved, reach, flat);
    figure::plan(SQUARE, &axes, title, &strokes, &names)
}

/// Plots the fans once, for the beginning of a page.
pub(crate) fn fan(dataset: &Dataset, calibration: &Calibration) -> String {
    let svg = draw(dataset, calibration, &solved(dataset, calibration), AT_A_GLANCE);
    format!(
        "<div class=\"opening\">\n{svg}\n{}<p class=\"caption\">The fans as calibrated by “{}”, seen from behind: every \
         {RAY_STEP}th element from the scanner via its mirror to {REACH_M} m; gray rays are undeflected.</p>\n</div>\n",
        key(&legend(dataset)),
        escape(&calibration.method)
    )
}

/// Plots the fans from above, from the side and from behind, with a close-up of the mirrors.
pub(crate) fn fans(dataset: &Dataset, calibration: &Calibration) -> String {
    let solved = solved(dataset, calibration);
    let mut svgs = "<div class=\"views\">\n".to_owned();
    for view in &VIEWS {
        let svg = draw(dataset, calibration, &solved, view);
        svgs += &format!("<div><h4>{}</h4>{svg}</div>\n", view.title);
    }
    svgs += "</div>";
    let caption = format!(
        "Every {RAY_STEP}th element as calibrated by “{}”, in the sensor frame: from the scanner at the origin to the \
         mirror and on to {REACH_M} m. A fan should leave its mirror as one sheet; a ray that crosses its neighbors is \
         a suspect element. Thick lines are the mirrors as drawn, gray rays are undeflected.",
        calibration.method
    );
    let mut rows = Vec::new();
    let numbers = (0..dataset.session.facets.len()).map(Some).chain([None]);
    for facet in numbers {
        let of: Vec<&Solved> = solved.iter().filter(|s| s.facet == facet).collect();
        if of.is_empty() && facet.is_none() {
            continue;
        }
        let range = |value: &dyn Fn(&Solved) -> f64, decimals| {
            let low = of.iter().map(|s| value(s)).fold(f64::NAN, f64::min);
            let high = of.iter().map(|s| value(s)).fold(f64::NAN, f64::max);
            format!("{} … {}", number(low, decimals), number(high, decimals))
        };
        rows.push(vec![
            facet_name(dataset, facet),
            of.len().to_string(),
            range(&|s| azimuth_deg(dataset, s.estimate.beam), 1),
            range(&|s| s.deflection.azimuth.to_degrees(), 1),
            range(&|s| s.deflection.elevation.to_degrees(), 1),
            range(&|s| s.deflection.distance * 1e3, 1),
        ]);
    }
    let headings = ["Mirror", "Solved", "Base azimuth (°)", "θ (°)", "φ (°)", "d (mm)"];
    block(&svgs, &caption, &legend(dataset), &headings, &rows)
}

fn strokes(
    dataset: &Dataset,
    calibration: &Calibration,
    solved: &[Solved],
    reach: f64,
    view: impl Fn(&Point3<f64>) -> (f64, f64),
) -> Vec<Stroke> {
    let far = 1.5 * REACH_M;
    let scan = &dataset.session.scanner.scan;
    let mut strokes = Vec::new();
    let ray = |points: &[Point3<f64>], color, width, opacity| Stroke {
        points: points.iter().map(&view).collect(),
        color,
        width,
        opacity,
    };
    let direct = calibration.beams.iter().filter(|b| b.status == Status::Direct);
    for b in direct.filter(|b| b.beam % DIRECT_STEP == 0) {
        let end = Point3::from(beam::direction(scan.azimuth(b.beam)).into_inner() * reach.min(REACH_M));
        strokes.push(ray(&[Point3::origin(), end], GRID, 1, 0.9));
    }
    for s in solved.iter().filter(|s| s.estimate.beam % RAY_STEP == 0) {
        let azimuth = scan.azimuth(s.estimate.beam);
        let mirror = s.deflection.deflection_point(azimuth);
        let exit = s.deflection.exit_direction(azimuth).into_inner();
        let length = if reach < REACH_M { reach } else { REACH_M };
        let end = mirror + exit * length.min(far);
        strokes.push(ray(&[Point3::origin(), mirror, end], color_of(s.facet), 1, 0.75));
    }
    for (i, facet) in dataset.session.facets.iter().enumerate() {
        let mut corners = facet.corners();
        corners.extend(corners.first().copied());
        strokes.push(ray(&corners, figure::color(i), 3, 1.0));
    }
    strokes
}

/// Returns the names of the facets, at the ends of their fans.
fn labels(
    dataset: &Dataset,
    solved: &[Solved],
    reach: f64,
    view: impl Fn(&Point3<f64>) -> (f64, f64),
) -> Vec<Label> {
    let mut labels: Vec<Label> = Vec::new();
    for (i, facet) in dataset.session.facets.iter().enumerate() {
        let of: Vec<&Solved> = solved.iter().filter(|s| s.facet == Some(i)).collect();
        let Some(middle) = of.get(of.len() / 2) else {
            continue;
        };
        let azimuth = dataset.session.scanner.scan.azimuth(middle.estimate.beam);
        let exit = middle.deflection.exit_direction(azimuth).into_inner();
        let mut at = view(&(middle.deflection.deflection_point(azimuth) + exit * reach * 0.98));
        // A label that would overlap another moves toward the middle by one line.
        let line = if at.1 < 0.0 { -0.08 } else { 0.08 } * reach;
        let near = |w: &Label, at: (f64, f64)| {
            (w.at.0 - at.0).abs() < 5.0 * line.abs() && (w.at.1 - at.1).abs() < 0.9 * line.abs()
        };
        while labels.iter().any(|w| near(w, at)) {
            at.1 -= line;
        }
        labels.push(Label {
            at,
            text: facet.name.clone(),
            color: BLACK,
        });
    }
    labels
}
