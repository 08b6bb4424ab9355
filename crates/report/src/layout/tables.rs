//! The tables next to the pictures of a layout.

use super::drawn::Drawn;
use crate::page::number;
use catoptric_design::layout::{Analysis, Class, FacetView};

type Headings = &'static [&'static str];
type Rows = Vec<Vec<String>>;

/// A figure of a layout: its name, and the function that formats it.
type KeyFigure = (&'static str, fn(&Analysis) -> String);

const KEY_FIGURES: [KeyFigure; 22] = [
    ("Elements with a direction", |a| a.seeing.to_string()),
    ("… undeflected", |a| count(a, Class::Direct)),
    ("… deflected by one facet", |a| count(a, Class::Deflected)),
    ("… leaving after several facets", |a| {
        count(a, Class::MultiBounce)
    }),
    ("Elements without a direction", |a| a.lost.to_string()),
    ("… split at an edge", |a| count(a, Class::Split)),
    ("… ending on the structure", |a| count(a, Class::HitsStructure)),
    ("… ending on it after a mirror", |a| count(a, Class::Shaded)),
    ("… trapped between mirrors", |a| count(a, Class::Trapped)),
    ("… too faint", |a| count(a, Class::TooFaint)),
    ("Largest gap in the scan (°)", |a| number(a.largest_gap_deg, 2)),
    ("Field of regard (% of all directions)", |a| {
        number(100.0 * a.field_of_regard, 3)
    }),
    ("… of it undeflected (%)", |a| {
        number(100.0 * a.direct_field_of_regard, 3)
    }),
    ("Directions within 5° of a beam (%)", |a| {
        number(100.0 * a.share_within_5_deg, 1)
    }),
    ("Elevation (°)", |a| pair(a.elevation_deg, 1)),
    ("Azimuth covered (of 360°)", |a| number(a.azimuth_covered_deg, 0)),
    ("Smallest margin on a mirror (mm)", |a| {
        number(smallest(a, |f| f.margin_mm), 2)
    }),
    ("Dark target (10 %) seen by all mirrors to (m)", |a| {
        number(smallest(a, |f| f.range_max_dark_m), 1)
    }),
    ("Point at 4 m per 0.1° of facet, worst facet (mm)", |a| {
        let of = |f: &FacetView| f.point_at_4m_per_0_1_deg_rms_mm;
        number(a.facets.iter().filter_map(of).fold(f64::NAN, f64::max), 1)
    }),
    ("Calibration can reach (° per axis)", |a| {
        let bound = a.accuracy.as_ref().and_then(|accuracy| accuracy.per_axis_deg);
        number(bound.unwrap_or(f64::NAN), 4)
    }),
    ("Diameter × height (mm)", |a| {
        format!(
            "{} × {}",
            number(a.size.diameter_mm, 0),
            number(a.size.height_mm, 0)
        )
    }),
    ("Mirror area (cm²), mass of mirrors and posts (g)", |a| {
        format!(
            "{}, {}",
            number(0.01 * a.size.mirror_area_mm2, 1),
            number(a.size.structure_mass_g, 0)
        )
    }),
];

fn count(analysis: &Analysis, class: Class) -> String {
    analysis.counts.get(&class).copied().unwrap_or(0).to_string()
}

fn smallest(analysis: &Analysis, of: fn(&FacetView) -> Option<f64>) -> f64 {
    analysis.facets.iter().filter_map(of).fold(f64::NAN, f64::min)
}

fn pair(limits: Option<[f64; 2]>, decimals: usize) -> String {
    let [low, high] = limits.unwrap_or([f64::NAN; 2]);
    format!("{} … {}", number(low, decimals), number(high, decimals))
}

fn figure(value: Option<f64>, decimals: usize) -> String {
    number(value.unwrap_or(f64::NAN), decimals)
}

/// Summarizes a layout in a few sentences.
pub(super) fn summary(analysis: &Analysis) -> String {
    let of = |class| analysis.counts.get(&class).copied().unwrap_or(0);
    let accuracy = analysis.accuracy.as_ref();
    let reach = accuracy
        .and_then(|a| a.per_axis_deg)
        .map_or_else(String::new, |bound| {
            format!(" A calibration from its own boards can reach {bound:.4}° per axis.")
        });
    format!(
        "{}: of {} elements {} have a direction, {} past the mirrors and {} via mirrors; {} are lost, {} of these split \
         by an edge. {} of {} facets serve an element, and together all elements cover {} % of all directions.{reach}",
        analysis.name,
        analysis.elements.len(),
        analysis.seeing,
        of(Class::Direct),
        of(Class::Deflected) + of(Class::MultiBounce),
        analysis.lost,
        of(Class::Split),
        analysis.facets.iter().filter(|f| f.elements > 0).count(),
        analysis.facets.len(),
        number(100.0 * analysis.field_of_regard, 3),
    )
}

/// Returns every key figure, one column per layout.
pub(super) fn key_figures(layouts: &[Drawn]) -> (Vec<String>, Rows) {
    let mut headings = vec!["Figure".to_owned()];
    headings.extend(layouts.iter().map(|l| l.analysis.name.clone()));
    if layouts.len() == 2 {
        headings.push("Difference".to_owned());
    }
    let rows = KEY_FIGURES.iter().map(|(name, of)| {
        let mut row = vec![(*name).to_owned()];
        row.extend(layouts.iter().map(|l| of(&l.analysis)));
        if let [_, first, second] = row.as_slice() {
            row.push(difference(first, second));
        }
        row
    });
    (headings, rows.collect())
}

/// What separates the numbers of a cell that holds two.
const SEPARATORS: [&str; 3] = [" … ", " × ", ", "];

/// The second minus the first, of numbers as they are printed, so that the reader's own subtraction agrees.
fn difference(first: &str, second: &str) -> String {
    let separator = SEPARATORS
        .into_iter()
        .find(|s| first.contains(s) && second.contains(s));
    let parts = |text: &str| -> Vec<String> {
        separator.map_or_else(
            || vec![text.to_owned()],
            |s| text.split(s).map(str::to_owned).collect(),
        )
    };
    let one = |(a, b): (&String, &String)| {
        let read = |text: &String| text.replace('−', "-").parse::<f64>().ok();
        let decimals = |text: &String| text.split_once('.').map_or(0, |(_, digits)| digits.len());
        let (from, to) = (read(a)?, read(b)?);
        let change = number(to - from, decimals(a).max(decimals(b)));
        let moved = change.trim_matches(['0', '.']);
        Some(match moved {
            "" => "0".to_owned(),
            text if text.starts_with('−') => change,
            _ => format!("+{change}"),
        })
    };
    let changes: Option<Vec<String>> = parts(first).iter().zip(&parts(second)).map(one).collect();
    match changes {
        Some(changes) if changes.iter().all(|c| c == "0") => "0".to_owned(),
        Some(changes) => changes.join(separator.unwrap_or_default()),
        None => "–".to_owned(),
    }
}

/// Returns the ranges in the room of every facet's elements, and of the undeflected ones.
pub(super) fn ranges(drawn: &Drawn) -> (Headings, Rows) {
    let own = |facet: Option<usize>| {
        let rays = drawn.drawing.rays.iter();
        let of = rays.filter(move |r| r.class.sees() && r.facets.last().copied() == facet);
        let mut ranges: Vec<f64> = of.filter_map(|r| drawn.depth.read_m[r.beam]).collect();
        ranges.sort_by(f64::total_cmp);
        ranges
    };
    let row = |name: String, facet: Option<usize>| {
        let ranges = own(facet);
        let at = |place: Option<&f64>| number(place.copied().unwrap_or(f64::NAN), 2);
        vec![
            name,
            ranges.len().to_string(),
            at(ranges.first()),
            at(ranges.get(ranges.len() / 2)),
            at(ranges.last()),
        ]
    };
    let facets = drawn.analysis.facets.iter().enumerate();
    let mut rows: Rows = facets.map(|(i, f)| row(f.name.clone(), Some(i))).collect();
    rows.push(row("undeflected".to_owned(), None));
    let headings = &[
        "facet",
        "elements with a range",
        "nearest (m)",
        "median (m)",
        "farthest (m)",
    ];
    (headings, rows)
}

/// Returns the extents of each fan.
pub(super) fn directions(drawn: &Drawn) -> (Headings, Rows) {
    let row = |f: &FacetView| {
        vec![
            f.name.clone(),
            f.elements.to_string(),
            pair(f.exit_azimuth_deg, 1),
            pair(f.exit_elevation_deg, 1),
            number(100.0 * f.field_of_regard, 4),
            figure(f.range_max_dark_m, 1),
            figure(f.range_max_white_m, 1),
        ]
    };
    let headings = &[
        "Facet",
        "Elements",
        "Azimuth (°)",
        "Elevation (°)",
        "Of 4π (%)",
        "Seen to, 10 % (m)",
        "white (m)",
    ];
    (headings, drawn.analysis.facets.iter().map(row).collect())
}

/// Returns the runs of neighboring elements.
pub(super) fn runs(drawn: &Drawn) -> (Headings, Rows) {
    let rows = drawn.analysis.runs.iter().map(|run| {
        let [first, last] = run.beams;
        let [from, to] = run.azimuth_deg;
        vec![
            format!("{first} to {last}"),
            run.class.words().to_owned(),
            run.facets.join(", then "),
            run.stopped_by.clone().unwrap_or_default(),
            (last - first + 1).to_string(),
            pair(Some(run.azimuth_deg), 2),
            number(to - from, 2),
        ]
    });
    let headings = &[
        "Beams",
        "Class",
        "Facets hit",
        "Stopped by",
        "Elements",
        "Azimuth in the scan (°)",
        "Width (°)",
    ];
    (headings, rows.collect())
}

/// Returns the pose of each mirror.
pub(super) fn places(drawn: &Drawn) -> (Headings, Rows) {
    let row = |facet: &catoptric_sim::build::BuiltFacet| {
        let (middle, m) = (
            catoptric_design::layout::center(&facet.face.corners),
            facet.face.normal,
        );
        let mut row = vec![facet.name.clone()];
        row.extend(middle.iter().map(|c| number(1e3 * c, 1)));
        row.push(number(libm::atan2(m.y, m.x).to_degrees(), 2));
        row.push(number(libm::atan2(m.z, libm::hypot(m.x, m.y)).to_degrees(), 2));
        row
    };
    let headings = &[
        "Facet",
        "Center x (mm)",
        "y (mm)",
        "z (mm)",
        "Normal's azimuth (°)",
        "elevation (°)",
    ];
    (headings, drawn.drawing.facets.iter().map(row).collect())
}

/// Returns size, area, mass and spot.
pub(super) fn sizes(drawn: &Drawn) -> (Headings, Rows) {
    let size = &drawn.analysis.size;
    let mut rows: Rows = vec![
        vec![
            "Extent along x, y, z (mm)".to_owned(),
            size.extent_mm.map(|e| number(e, 1)).join(" × "),
        ],
        vec![
            "Diameter about the scanner (mm)".to_owned(),
            number(size.diameter_mm, 1),
        ],
        vec!["Mirrors (g)".to_owned(), number(size.mirror_mass_g, 1)],
        vec!["Posts (g)".to_owned(), number(size.post_mass_g, 1)],
        vec!["Scanner (g)".to_owned(), figure(size.scanner_mass_g, 0)],
    ];
    rows.extend(drawn.analysis.spots.iter().map(|s| {
        vec![
            format!(
                "Spot at {} m, and distance to the next beam (mm)",
                number(s.range_m, 0)
            ),
            format!(
                "{} × {}, {}",
                number(s.wide_mm, 1),
                number(s.narrow_mm, 1),
                number(s.spacing_mm, 1)
            ),
        ]
    }));
    (&["Quantity", "Value"], rows)
}

/// Returns the margins on each mirror.
pub(super) fn margins(drawn: &Drawn) -> (Headings, Rows) {
    let row = |f: &FacetView| {
        vec![
            f.name.clone(),
            f.elements.to_string(),
            f.split.to_string(),
            f.shaded.to_string(),
            figure(f.margin_mm, 2),
            figure(f.margin_beams, 1),
            figure(f.margin_across_mm, 2),
            number(0.01 * f.area_mm2, 2),
        ]
    };
    let headings = &[
        "Facet",
        "Unsplit",
        "Split",
        "Then blocked",
        "Margin (mm)",
        "in beams",
        "Margin above and below (mm)",
        "Area (cm²)",
    ];
    (headings, drawn.analysis.facets.iter().map(row).collect())
}

/// Returns the sensitivity to errors of each facet, and how well it can be calibrated.
pub(super) fn facets(drawn: &Drawn) -> (Headings, Rows) {
    let accuracy = drawn.analysis.accuracy.as_ref();
    let row = |f: &FacetView| {
        let of = accuracy.and_then(|a| a.facets.iter().find(|of| of.name == f.name));
        let [near, far] = f.mirror_at_m.unwrap_or([f64::NAN; 2]);
        vec![
            f.name.clone(),
            format!("{} … {}", number(1e3 * near, 1), number(1e3 * far, 1)),
            figure(f.point_at_4m_per_0_1_deg_rms_mm, 1),
            figure(f.point_at_4m_per_0_1_deg_max_mm, 1),
            figure(f.point_at_4m_per_0_1_mm_mm, 2),
            figure(of.and_then(|of| of.per_axis_deg), 4),
            of.map_or_else(|| "–".to_owned(), |of| of.open.to_string()),
        ]
    };
    let headings = &[
        "Facet",
        "Distance (mm)",
        "Per 0.1°, rms (mm)",
        "max (mm)",
        "Per 0.1 mm (mm)",
        "Calibration can reach (° per axis)",
        "Elements left open",
    ];
    (headings, drawn.analysis.facets.iter().map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::difference;

    #[test]
    fn differences_are_those_of_what_is_printed() {
        assert_eq!(difference("453", "362"), "−91");
        assert_eq!(difference("0.402", "0.415"), "+0.013");
        assert_eq!(difference("3.25", "3.25"), "0");
        assert_eq!(difference("−65.2 … 65.2", "−70.0 … 0.0"), "−4.8 … −65.2");
        assert_eq!(difference("180 × 62", "180 × 70"), "0 × +8");
        assert_eq!(difference("39.8, 120", "39.8, 120"), "0");
        assert_eq!(difference("–", "3.1"), "–");
    }
}
