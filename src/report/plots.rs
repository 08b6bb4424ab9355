//! The plots of the report, each with its caption and its table.

use super::facet_of;
use super::figure::{self, Axes, Bar, Dot, GRID, Stroke, Word};
use super::page::{figure as block, number};
use crate::apply::{CloudFrame, PointCloud};
use crate::score::Score;
use catoptric_model::{BeamEstimate, Calibration, Dataset, Deflection, Pose, Status, beam};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use nalgebra::Point3;
use plotters::style::{BLACK, RGBColor};
use std::ops::Range;

/// Size of a square view and of a plot over azimuth, in pixels.
const SQUARE: (u32, u32) = (500, 500);
const WIDE: (u32, u32) = (980, 270);
const HALF: (u32, u32) = (490, 270);
const STRIP: (u32, u32) = (980, 150);

/// How far rays are drawn, in metres, in the whole view and in the close-up.
const REACH_M: f64 = 1.5;
const CLOSE_M: f64 = 0.16;

/// Every n-th beam is drawn as a ray; fewer of those that no mirror deflects.
const RAY_STEP: usize = 4;
const DIRECT_STEP: usize = 16;

/// Azimuths without an element beyond which a plot is parted in two, in degrees.
const WIDE_GAP_DEG: f64 = 40.0;

/// Points of a cloud that are drawn at most.
const MOST_POINTS: usize = 6000;

/// An element with a direction.
struct Solved<'a> {
    estimate: &'a BeamEstimate,
    deflection: Deflection,
    facet: Option<usize>,
}

fn solved<'a>(dataset: &Dataset, calibration: &'a Calibration) -> Vec<Solved<'a>> {
    let with = |estimate: &'a BeamEstimate| {
        let deflection = estimate.deflection()?;
        Some(Solved {
            estimate,
            deflection,
            facet: facet_of(dataset, estimate),
        })
    };
    calibration.beams.iter().filter_map(with).collect()
}

fn color_of(facet: Option<usize>) -> RGBColor {
    facet.map_or(BLACK, figure::color)
}

/// The facets and their colors.
fn legend(dataset: &Dataset) -> Vec<(String, String)> {
    let entry = |(i, f): (usize, &catoptric_model::session::NominalFacet)| {
        (figure::css(figure::color(i)), f.name.clone())
    };
    dataset.session.facets.iter().enumerate().map(entry).collect()
}

fn azimuth_deg(beam: usize) -> f64 {
    beam::azimuth(beam).to_degrees()
}

/// Azimuths of all beams, with a margin.
fn azimuth_axis(dataset: &Dataset) -> Range<f64> {
    let last = dataset.session.scanner.beams.saturating_sub(1);
    azimuth_deg(0) - 1.0..azimuth_deg(last) + 1.0
}

/// Name of a facet by its number; a dash for an element of none.
fn facet_name(dataset: &Dataset, facet: Option<usize>) -> String {
    facet.map_or_else(|| "–".to_owned(), |i| dataset.session.facets[i].name.clone())
}

/// Fans from above, from the side and from the front, and the mirrors close up.
pub(super) fn fans(dataset: &Dataset, calibration: &Calibration) -> String {
    let solved = solved(dataset, calibration);
    let mut svgs = "<div class=\"views\">\n".to_owned();
    for (title, reach, [i, j], [x, y]) in [
        (
            "From above",
            REACH_M,
            [0, 1],
            ["x, forward (m)", "y, to port (m)"],
        ),
        (
            "From above, the mirrors close up",
            CLOSE_M,
            [0, 1],
            ["x, forward (m)", "y, to port (m)"],
        ),
        ("From the side", REACH_M, [0, 2], ["x, forward (m)", "z, up (m)"]),
        ("From behind", REACH_M, [1, 2], ["y, to port (m)", "z, up (m)"]),
    ] {
        // Seen from behind, port is on the left.
        let mirrored = if i == 1 { -1.0 } else { 1.0 };
        let view = |p: &Point3<f64>| (mirrored * p[i], p[j]);
        let axes = Axes {
            x: -reach * 1.05..reach * 1.05,
            y: -reach * 1.05..reach * 1.05,
            x_label: if i == 1 {
                "−y, to starboard (m)".to_owned()
            } else {
                x.to_owned()
            },
            y_label: y.to_owned(),
        };
        let svg = figure::plan(
            SQUARE,
            &axes,
            title,
            &strokes(dataset, calibration, &solved, reach, view),
            &if reach > CLOSE_M {
                labels(dataset, &solved, reach, view)
            } else {
                Vec::new()
            },
        );
        svgs += &format!("<div><h4>{title}</h4>{svg}</div>\n");
    }
    svgs += "</div>";
    let caption = format!(
        "Every {RAY_STEP}th element as calibrated by “{}”, in the sensor frame: from the scanner at the origin to the mirror and on to {REACH_M} m. \
         A fan should leave its mirror in one sheet; a ray that crosses its neighbours is an element to look at. \
         Heavy lines are the mirrors as drawn, grey rays pass by them.",
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
            range(&|s| azimuth_deg(s.estimate.beam), 1),
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
    let mut strokes = Vec::new();
    let ray = |points: &[Point3<f64>], color, width, opacity| Stroke {
        points: points.iter().map(&view).collect(),
        color,
        width,
        opacity,
    };
    let direct = calibration.beams.iter().filter(|b| b.status == Status::Direct);
    for b in direct.filter(|b| b.beam % DIRECT_STEP == 0) {
        let end = Point3::from(beam::direction(beam::azimuth(b.beam)).into_inner() * reach.min(REACH_M));
        strokes.push(ray(&[Point3::origin(), end], GRID, 1, 0.9));
    }
    for s in solved.iter().filter(|s| s.estimate.beam % RAY_STEP == 0) {
        let azimuth = beam::azimuth(s.estimate.beam);
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

/// Names of the facets at the ends of their fans.
fn labels(
    dataset: &Dataset,
    solved: &[Solved],
    reach: f64,
    view: impl Fn(&Point3<f64>) -> (f64, f64),
) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::new();
    for (i, facet) in dataset.session.facets.iter().enumerate() {
        let of: Vec<&Solved> = solved.iter().filter(|s| s.facet == Some(i)).collect();
        let Some(middle) = of.get(of.len() / 2) else {
            continue;
        };
        let azimuth = beam::azimuth(middle.estimate.beam);
        let exit = middle.deflection.exit_direction(azimuth).into_inner();
        let mut at = view(&(middle.deflection.deflection_point(azimuth) + exit * reach * 0.98));
        // A word that falls on another one moves towards the middle by a line.
        let line = if at.1 < 0.0 { -0.08 } else { 0.08 } * reach;
        let near = |w: &Word, at: (f64, f64)| {
            (w.at.0 - at.0).abs() < 5.0 * line.abs() && (w.at.1 - at.1).abs() < 0.9 * line.abs()
        };
        while words.iter().any(|w| near(w, at)) {
            at.1 -= line;
        }
        words.push(Word {
            at,
            text: facet.name.clone(),
            color: BLACK,
        });
    }
    words
}

/// Errors of θ and φ with their ±2σ bands.
pub(super) fn errors(dataset: &Dataset, calibration: &Calibration, score: &Score) -> String {
    let facet = |beam| calibration.beam(beam).and_then(|b| facet_of(dataset, b));
    let mut svgs = String::new();
    for (title, axis) in [("Across: cos φ·δθ (°)", 0), ("Up: δφ (°)", 1)] {
        let dots: Vec<Dot> = score
            .scored()
            .map(|e| Dot {
                x: azimuth_deg(e.beam),
                y: [e.across, e.up][axis].to_degrees(),
                half_band: e.sigma.map_or(0.0, |s| 2.0 * s[axis].to_degrees()),
                color: color_of(facet(e.beam)),
            })
            .collect();
        svgs += &over_azimuth(dataset, title, &dots);
    }
    let rows: Vec<Vec<String>> = score
        .scored()
        .map(|e| {
            let sigma = |axis: usize| e.sigma.map_or(f64::NAN, |s| s[axis].to_degrees());
            vec![
                e.beam.to_string(),
                number(azimuth_deg(e.beam), 2),
                e.facet.clone(),
                number(e.across.to_degrees(), 4),
                number(sigma(0), 4),
                number(e.up.to_degrees(), 4),
                number(sigma(1), 4),
            ]
        })
        .collect();
    let headings = [
        "Beam",
        "Azimuth (°)",
        "Mirror",
        "cos φ·δθ (°)",
        "its σ (°)",
        "δφ (°)",
        "its σ (°)",
    ];
    let caption = "Error of every solved, unsplit element against the truth, with the ±2σ band its covariance states. \
                   19 of 20 dots should lie on their band. Dots that run together along a mirror share an error: a board, a \
                   bias, the mounting; dots that jump do not. What is beyond the axis is drawn at its end.";
    block(&svgs, caption, &legend(dataset), &headings, &rows)
}

/// Estimates of θ and φ, where there is no truth.
pub(super) fn estimates(dataset: &Dataset, calibration: &Calibration) -> String {
    let solved = solved(dataset, calibration);
    let mut svgs = String::new();
    let angle = |s: &Solved, axis: usize| [s.deflection.azimuth, s.deflection.elevation][axis].to_degrees();
    for (title, axis) in [("θ, azimuth added by the mirror (°)", 0), ("φ, elevation (°)", 1)] {
        let dots: Vec<Dot> = solved
            .iter()
            .map(|s| Dot {
                x: azimuth_deg(s.estimate.beam),
                y: angle(s, axis),
                half_band: 0.0,
                color: color_of(s.facet),
            })
            .collect();
        svgs += &over_azimuth(dataset, title, &dots);
    }
    let rows: Vec<Vec<String>> = solved
        .iter()
        .map(|s| {
            let sigma = |axis: usize| {
                s.estimate
                    .covariance_rad2
                    .map_or(f64::NAN, |c| c[axis][axis].sqrt().to_degrees())
            };
            vec![
                s.estimate.beam.to_string(),
                number(azimuth_deg(s.estimate.beam), 2),
                facet_name(dataset, s.facet),
                number(angle(s, 0), 3),
                number(sigma(0), 4),
                number(angle(s, 1), 3),
                number(sigma(1), 4),
            ]
        })
        .collect();
    let headings = [
        "Beam",
        "Azimuth (°)",
        "Mirror",
        "θ (°)",
        "its σ (°)",
        "φ (°)",
        "its σ (°)",
    ];
    let caption = "What was estimated for every solved element. A plane mirror makes a smooth curve; a dot off the curve of \
                   its mirror is an element to look at.";
    block(&svgs, caption, &legend(dataset), &headings, &rows)
}

/// Errors around zero over azimuth.
fn over_azimuth(dataset: &Dataset, title: &str, dots: &[Dot]) -> String {
    let y = figure::around_zero(dots.iter().flat_map(|d| [d.y, d.half_band]));
    parted(dataset, title, "(°)", &y, dots)
}

/// Dots over azimuth; in two plots side by side if a wide sector in the middle has none.
fn parted(dataset: &Dataset, title: &str, unit: &str, y: &Range<f64>, dots: &[Dot]) -> String {
    let whole = azimuth_axis(dataset);
    let gap = dots
        .iter()
        .zip(dots.iter().skip(1))
        .map(|(a, b)| a.x..b.x)
        .filter(|gap| gap.end - gap.start > WIDE_GAP_DEG)
        .max_by(|a, b| (a.end - a.start).total_cmp(&(b.end - b.start)));
    let parts = match gap {
        Some(gap) => vec![whole.start..gap.start + 2.0, gap.end - 2.0..whole.end],
        None => vec![whole],
    };
    let size = if parts.len() == 1 { WIDE } else { HALF };
    let mut svgs = String::new();
    for x in parts {
        let inside: Vec<Dot> = dots.iter().filter(|d| x.contains(&d.x)).cloned().collect();
        let axes = Axes {
            x,
            y: y.clone(),
            x_label: "Base azimuth of the element (°)".to_owned(),
            y_label: unit.to_owned(),
        };
        svgs += &format!("<div>{}</div>", figure::per_beam(size, &axes, title, &inside));
    }
    format!("<div class=\"plot\"><h4>{title}</h4><div class=\"views\">{svgs}</div></div>\n")
}

/// What the fit left over the boards.
pub(super) fn residuals(dataset: &Dataset, calibration: &Calibration) -> String {
    let solved = solved(dataset, calibration);
    let of: Vec<(&Solved, f64)> = solved
        .iter()
        .filter_map(|s| Some((s, s.estimate.rms_residual_m? * 1e3)))
        .collect();
    let dots: Vec<Dot> = of
        .iter()
        .map(|(s, mm)| Dot {
            x: azimuth_deg(s.estimate.beam),
            y: *mm,
            half_band: 0.0,
            color: color_of(s.facet),
        })
        .collect();
    let title = "Residual of the fit (mm, rms over the boards)";
    let y = 0.0..figure::around_zero(dots.iter().map(|d| d.y)).end;
    let plot = parted(dataset, title, "(mm)", &y, &dots);
    let count = |c: Option<usize>| c.map_or_else(|| "–".to_owned(), |c| c.to_string());
    let mut rows: Vec<Vec<String>> = of
        .iter()
        .map(|(s, mm)| {
            vec![
                s.estimate.beam.to_string(),
                number(azimuth_deg(s.estimate.beam), 2),
                facet_name(dataset, s.facet),
                number(*mm, 2),
                count(s.estimate.poses),
                count(s.estimate.readings),
                count(s.estimate.iterations),
            ]
        })
        .collect();
    if rows.is_empty() {
        rows.push(vec!["No solved element states a residual.".to_owned()]);
    }
    let headings = [
        "Beam",
        "Azimuth (°)",
        "Mirror",
        "Residual (mm)",
        "Boards",
        "Readings",
        "Steps",
    ];
    let caption = "How far the ranges of an element are from the boards once its direction is fitted. Residuals should be the \
                   size of drift and board errors; a mirror that stands out has a board that was tracked badly, an element \
                   that stands out falls on an edge.";
    block(&plot, caption, &legend(dataset), &headings, &rows)
}

/// Colors of what became of an element: the good in green and blue, the undecided in warm tones.
fn status_color(status: Status) -> RGBColor {
    match status {
        Status::Solved => RGBColor(0x00, 0x9E, 0x73),
        Status::Direct => RGBColor(0x56, 0xB4, 0xE9),
        Status::TooFewPoses => RGBColor(0xE6, 0x9F, 0x00),
        Status::Unobservable => RGBColor(0xCC, 0x79, 0xA7),
        Status::NotConverged => RGBColor(0x8A, 0x5A, 0x9E),
        Status::Rejected => RGBColor(0xD5, 0x5E, 0x00),
    }
}

fn class_color(class: BeamClass) -> (RGBColor, &'static str) {
    match class {
        BeamClass::Deflected => (RGBColor(0x00, 0x9E, 0x73), "deflected"),
        BeamClass::Direct => (RGBColor(0x56, 0xB4, 0xE9), "direct"),
        BeamClass::Split => (RGBColor(0xD5, 0x5E, 0x00), "split"),
        BeamClass::MultiBounce => (RGBColor(0xCC, 0x79, 0xA7), "several mirrors"),
        BeamClass::Blocked => (RGBColor(0x8C, 0x8C, 0x8C), "blocked"),
        BeamClass::Lost => (RGBColor(0x5E, 0x5E, 0x5E), "lost"),
    }
}

/// One bar for each run of neighbouring elements of the same color.
fn runs(row: usize, elements: impl Iterator<Item = (usize, RGBColor)>) -> Vec<Bar> {
    let half = 0.5 * beam::STEP.to_degrees();
    let mut bars: Vec<Bar> = Vec::new();
    for (beam, color) in elements {
        let x = azimuth_deg(beam) - half..azimuth_deg(beam) + half;
        match bars.last_mut() {
            // Neighbours share an edge up to rounding.
            Some(last) if last.color == color && (last.x.end - x.start).abs() < half => last.x.end = x.end,
            _ => bars.push(Bar { x, row, color }),
        }
    }
    bars
}

/// What became of every element, over azimuth.
pub(super) fn statuses(dataset: &Dataset, calibration: &Calibration, truth: Option<&Truth>) -> String {
    let found = calibration.beams.iter().map(|b| (b.beam, status_color(b.status)));
    let mut bars = runs(0, found);
    let mut legend: Vec<(String, String)> = Status::ALL
        .iter()
        .filter(|s| calibration.beams.iter().any(|b| b.status == **s))
        .map(|s| (figure::css(status_color(*s)), s.word().replace('_', " ")))
        .collect();
    if let Some(truth) = truth {
        bars.extend(runs(
            1,
            truth.beams.iter().map(|b| (b.beam, class_color(b.status).0)),
        ));
        let mut seen = Vec::new();
        for b in &truth.beams {
            if !seen.contains(&b.status) {
                seen.push(b.status);
                let (color, name) = class_color(b.status);
                legend.push((figure::css(color), format!("{name}, in truth")));
            }
        }
    }
    let rows_drawn = 1 + usize::from(truth.is_some());
    let axes = Axes {
        x: azimuth_axis(dataset),
        y: 0.0..rows_drawn as f64,
        x_label: "Base azimuth of the element (°)".to_owned(),
        y_label: if truth.is_some() {
            "truth · found".to_owned()
        } else {
            "found".to_owned()
        },
    };
    let title = "What became of every element";
    let svg = figure::strip(STRIP, &axes, title, &bars, rows_drawn);
    let mut rows: Vec<Vec<String>> = [Status::Solved, Status::Direct]
        .iter()
        .map(|s| {
            let count = calibration.beams.iter().filter(|b| b.status == *s).count();
            vec![s.word().to_owned(), String::new(), count.to_string()]
        })
        .collect();
    for ((status, reason), count) in crate::score::words::abstentions(calibration) {
        rows.push(vec![status.replace('_', " "), reason, count.to_string()]);
    }
    let absent = (0..dataset.session.scanner.beams).filter(|&i| calibration.beam(i).is_none());
    let absent = absent.count();
    if absent > 0 {
        rows.push(vec!["absent".to_owned(), String::new(), absent.to_string()]);
    }
    let caption = if truth.is_some() {
        "Upper row: what the calibration says of each element; lower row: what is true. Green over green is what is wanted; \
         anything else over green was not solved, and the table says why."
    } else {
        "What the calibration says of each element; the table says why those without a direction have none."
    };
    let plot = format!("<div class=\"plot\"><h4>{title}</h4>{svg}</div>\n");
    block(&plot, caption, &legend, &["Status", "Reason", "Elements"], &rows)
}

/// The cloud from above.
pub(super) fn cloud(dataset: &Dataset, calibration: Option<&Calibration>, cloud: &PointCloud) -> String {
    let facets: Vec<Option<usize>> = (0..dataset.session.scanner.beams)
        .map(|b| facet_of(dataset, calibration?.beam(b)?))
        .collect();
    // Whole scans are left out: every n-th point would favour some beams.
    let step = cloud.points.len().div_ceil(MOST_POINTS).max(1);
    let points: Vec<(f64, f64, RGBColor)> = cloud
        .points
        .iter()
        .filter(|p| p.scan % step == 0)
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
    let room = &dataset.session.room;
    let mut strokes = Vec::new();
    let mut corners = Vec::new();
    if cloud.frame == CloudFrame::Room {
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
        x_label: format!("x of the {} (m)", cloud.frame.word()),
        y_label: format!("y of the {} (m)", cloud.frame.word()),
    };
    let title = "The cloud from above";
    let svg = figure::scatter(level_size(&axes), &axes, title, &points, &strokes);
    let rows = cloud_rows(dataset, calibration, cloud, &facets);
    let outline = if cloud.frame == CloudFrame::Room {
        "The outline is the surveyed room: points belong on its walls, or inside on floor and ceiling; a wall of points that \
         leaves the outline is a mirror whose directions are off. The cross is the scanner. "
    } else {
        ""
    };
    let caption = format!(
        "Points of pose {} in the {} frame, colored by mirror; grey points were seen past the mirrors. {outline}{}",
        cloud.pose,
        cloud.frame.word(),
        if step > 1 {
            format!("One scan in {step} is drawn.")
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

/// A cross where the rig stood.
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

/// A size at which one metre is as long upward as across.
fn level_size(axes: &Axes) -> (u32, u32) {
    /// What margins and axis labels take, in pixels.
    const FRAME: f64 = 72.0;
    let (width, height) = (axes.x.end - axes.x.start, axes.y.end - axes.y.start);
    let across = 800.0 - FRAME;
    let up = (across * height / width).clamp(150.0, 1200.0);
    // Between 150 and 1272 by the clamp.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let up = (up + FRAME) as u32;
    (800, up)
}

fn cloud_rows(
    dataset: &Dataset,
    calibration: Option<&Calibration>,
    cloud: &PointCloud,
    facets: &[Option<usize>],
) -> Vec<Vec<String>> {
    let status = |b: usize| calibration.and_then(|c| c.beam(b)).map(|b| b.status);
    let row = |name: &str, keep: &dyn Fn(usize) -> bool| {
        let points: Vec<Point3<f64>> = cloud
            .points
            .iter()
            .filter(|p| keep(p.beam))
            .map(|p| p.position)
            .collect();
        let extent = |axis: usize| {
            let low = points.iter().map(|p| p[axis]).fold(f64::NAN, f64::min);
            let high = points.iter().map(|p| p[axis]).fold(f64::NAN, f64::max);
            format!("{} … {}", number(low, 2), number(high, 2))
        };
        vec![
            name.to_owned(),
            points.len().to_string(),
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
    rows.push(count("Left out: no direction", cloud.without_direction));
    rows.push(count("Left out: no range", cloud.without_range));
    rows
}
