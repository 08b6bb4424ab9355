//! How the report begins and ends: one table of the methods, and what to do next.

use super::page::{count, escape, number};
use super::verdict::badge;
use catoptric_assess::score::{Honesty, Score, Verdict};
use catoptric_model::{Calibration, Dataset, Status};

/// A column of the table of the methods.
type Column = (&'static str, fn(&Calibration, &Score) -> String);

const COLUMNS: [Column; 8] = [
    ("Solved", |_, s| s.beams.solved.to_string()),
    ("Missed", |_, s| count(s.beams.missed)),
    ("Error per axis (°)", |_, s| number(s.per_axis_rms_deg, 4)),
    ("Bound (°)", |_, s| number(s.crlb_per_axis_deg, 4)),
    ("Point at 4 m (mm)", |_, s| number(s.point_mm.at_4m, 1)),
    ("Boards, rms (mm)", |_, s| number(s.boards_mm.rms, 2)),
    ("Walls, rms (mm)", |_, s| number(s.walls_mm.rms, 2)),
    ("Covariance", |_, s| {
        let word = match s.honesty {
            Some(Honesty::Honest) => "honest",
            Some(Honesty::Doubtful) => "doubtful",
            Some(Honesty::OverConfident) => "over-confident",
            Some(Honesty::UnderConfident) => "under-confident",
            None => "–",
        };
        word.to_owned()
    }),
];

/// One row for each method; columns without any figure, such as an accuracy without a truth, are left out.
pub(super) fn methods(results: &[(Calibration, Score)]) -> String {
    let cells: Vec<(&str, Vec<String>)> = COLUMNS
        .iter()
        .map(|(heading, of)| (*heading, results.iter().map(|(c, s)| of(c, s)).collect()))
        .filter(|(_, cells): &(&str, Vec<String>)| cells.iter().any(|c| c != "–"))
        .collect();
    let class = |heading: &str| {
        if heading == "Covariance" {
            " class=\"words\""
        } else {
            ""
        }
    };
    let mut html = "<div class=\"scroll\"><table>\n<thead><tr><th scope=\"col\">Method</th>\
                    <th scope=\"col\" class=\"words\">Verdict</th>"
        .to_owned();
    for (heading, _) in &cells {
        html += &format!("<th scope=\"col\"{}>{heading}</th>", class(heading));
    }
    html += "</tr></thead>\n<tbody>\n";
    for (row, (calibration, score)) in results.iter().enumerate() {
        html += &format!(
            "<tr class=\"{}\"><th scope=\"row\">{}</th><td class=\"words\">{}</td>",
            score.verdict.word(),
            escape(&calibration.method),
            badge(score.verdict)
        );
        for (heading, column) in &cells {
            html += &format!("<td{}>{}</td>", class(heading), escape(&column[row]));
        }
        html += "</tr>\n";
    }
    html + "</tbody></table></div>\n"
}

/// What to do with these results, as a list.
pub(super) fn next(dataset: &Dataset, has_truth: bool, results: &[(Calibration, Score)]) -> String {
    let mut steps: Vec<String> = Vec::new();
    let Some((first, score)) = results.first() else {
        steps.push(
            "Calibrate it: <code>catoptric calibrate DATASET --out calibration.json</code>.".to_owned(),
        );
        return list(&steps);
    };
    let method = escape(&first.method);
    match score.verdict {
        Verdict::Pass => steps.push(format!(
            "Use “{method}”: <code>catoptric apply DATASET calibration.json --out cloud.ply</code> turns scans into points."
        )),
        Verdict::Blind => steps.push(format!(
            "Nothing speaks against “{method}”, and nothing shows how large its errors are. Points on the walls of a \
             surveyed room are the best evidence there is without a truth."
        )),
        Verdict::NotJudged => steps.push(format!(
            "“{method}” states too little to be judged: give every solved element its covariance."
        )),
        Verdict::Fail | Verdict::Invalid => steps.push(format!(
            "Do not use “{method}” yet. The gates that are not met, under “What decides the verdict”, say where to look; \
             <code>catoptric score DATASET calibration.json</code> names the usual mistakes."
        )),
    }
    let open = first
        .beams
        .iter()
        .filter(|b| matches!(b.status, Status::TooFewPoses | Status::Unobservable));
    let open = open.count();
    if open > 0 {
        steps.push(format!(
            "Set up more boards: {open} elements are left open by those there are, and <code>catoptric plan DATASET \
             --poses 5</code> proposes the poses that gain most."
        ));
    }
    if !first.warnings.is_empty() {
        steps.push(format!(
            "Look at what the recording itself shows first: {}",
            first
                .warnings
                .iter()
                .map(|w| escape(w))
                .collect::<Vec<_>>()
                .join("; ")
        ));
    }
    if has_truth {
        steps.push(
            "Judge methods by many runs, not by this one: <code>catoptric study SCENE --seeds 40 --methods joint,beam \
             --out study</code>."
                .to_owned(),
        );
    } else if dataset.session.facets.is_empty() {
        steps.push("There is no mirror in this session: nothing is deflected.".to_owned());
    }
    list(&steps)
}

fn list(steps: &[String]) -> String {
    let items: String = steps.iter().map(|step| format!("<li>{step}</li>\n")).collect();
    format!("<h2>What to do next</h2>\n<ul>\n{items}</ul>\n")
}
