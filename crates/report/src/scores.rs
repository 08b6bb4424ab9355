//! The table of scores: one row per figure, one column per method.

use super::page::{self, count, number};
use catoptric_assess::score::{PointError, Score, Spread};
use catoptric_model::Calibration;

/// Returns the scores side by side, one column per method.
pub(super) fn scores(results: &[(Calibration, Score)]) -> String {
    let mut headings = vec!["Figure"];
    headings.extend(results.iter().map(|(c, _)| c.method.as_str()));
    let mut rows = Vec::new();
    let mut row = |name: &str, value: &dyn Fn(&Score) -> String| {
        let mut cells = vec![name.to_owned()];
        cells.extend(results.iter().map(|(_, s)| value(s)));
        rows.push(cells);
    };
    let spread = |s: &Spread| {
        format!(
            "{} / {} / {} / {}",
            number(s.rms, 4),
            number(s.median, 4),
            number(s.p95, 4),
            number(s.max, 4)
        )
    };
    let points = |p: &PointError| {
        format!(
            "{} / {} / {}",
            number(p.at_1m, 1),
            number(p.at_4m, 1),
            number(p.at_10m, 1)
        )
    };
    row("Elements deflected and unsplit, in truth", &|s| {
        count(s.beams.deflected)
    });
    row("– solved", &|s| s.beams.solved.to_string());
    row("– abstained, with a reason", &|s| s.beams.abstained.to_string());
    row("– missed", &|s| count(s.beams.missed));
    row("Determined by their boards: solved / all", &|s| {
        format!("{} / {}", count(s.knowable_solved), count(s.knowable))
    });
    row("False: solved but not deflected", &|s| count(s.beams.wrong));
    row("Per-axis error (°)", &|s| number(s.per_axis_rms_deg, 4));
    row("– bound, each element separately (°)", &|s| {
        number(s.alone_crlb_per_axis_deg, 4)
    });
    row("– bound, any method (°)", &|s| number(s.crlb_per_axis_deg, 4));
    row("– efficiency, 1 is best", &|s| number(s.efficiency, 2));
    row("– without the common rotation (°)", &|s| {
        number(s.differential_per_axis_rms_deg, 4)
    });
    row("Rotation common to all elements (°)", &|s| {
        number(s.common_mode_deg, 4)
    });
    row("Direction error: rms / median / 95 % / largest (°)", &|s| {
        spread(&s.direction_deg)
    });
    row("– the same in the room (°)", &|s| {
        spread(&s.direction_room_deg)
    });
    row("Per-axis error in the room (°)", &|s| {
        number(s.per_axis_rms_room_deg, 4)
    });
    row("Distance d to the mirror: rms / largest (mm)", &|s| {
        format!(
            "{} / {}",
            number(s.distance_mm.rms, 2),
            number(s.distance_mm.max, 2)
        )
    });
    row("– in units of its standard deviation, mean square", &|s| {
        number(s.distance_nees, 2)
    });
    row("Mounting: attitude (°) / position (mm)", &|s| {
        s.mounting.map_or_else(
            || "–".to_owned(),
            |m| format!("{} / {}", number(m.attitude_deg, 4), number(m.position_mm, 2)),
        )
    });
    row("– normalized squared error", &|s| {
        s.mounting.map_or_else(|| "–".to_owned(), |m| number(m.nees, 2))
    });
    row("Point 1 / 4 / 10 m behind the mirror (mm)", &|s| {
        points(&s.point_mm)
    });
    row("– the same in the room (mm)", &|s| points(&s.point_room_mm));
    row("Normalized squared error, 1 is honest", &|s| {
        number(s.nees_mean, 2)
    });
    row("Inside the stated 95 % ellipse (%)", &|s| {
        number(s.coverage_95 * 100.0, 1)
    });
    row("Distance of points from the boards: mean / rms (mm)", &|s| {
        format!("{} / {}", number(s.boards_mm.mean, 2), number(s.boards_mm.rms, 2))
    });
    row(
        "Distance of points from the walls of the empty room: mean / rms (mm)",
        &|s| format!("{} / {}", number(s.walls_mm.mean, 2), number(s.walls_mm.rms, 2)),
    );
    row("Split elements: solved / all", &|s| match s.split.elements {
        0 => "–".to_owned(),
        all => format!("{} of {all}", s.split.solved),
    });
    row("– per-axis error of split elements (°)", &|s| {
        number(s.split.per_axis_rms_deg, 4)
    });
    // A row without any figure, such as an accuracy without a truth, is omitted.
    let is_empty = |cell: &String| cell.chars().all(|c| matches!(c, '–' | '/' | ' '));
    rows.retain(|row| !row.iter().skip(1).all(is_empty));
    page::table(&headings, &rows)
}
